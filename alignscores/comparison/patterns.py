"""Patterns of paths with named fields in braces: ``data/{sequence}/{system}/{run}.txt``."""

import glob
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import filterfalse
from pathlib import Path

__all__ = ["BenchmarkError", "Pattern"]

TOKEN = re.compile(r"(\{[^{}]*\}|\*+)")
MAX_STARS = 4  # between two slashes; the time of a search grows with their power


class BenchmarkError(ValueError):
    """A benchmark that is described wrongly, by its patterns or in its YAML file."""


@dataclass(frozen=True)
class Pattern:
    """A pattern of paths, and the names that its fields may have.

    A field matches one or more characters other than a slash, the same ones wherever it is
    repeated; a ``*`` matches any characters other than a slash.
    """

    text: str
    allowed: Collection[str]

    def __post_init__(self) -> None:
        names = ", ".join(f"{{{name}}}" for name in self.allowed)
        for field in self.fields:
            if field not in self.allowed:
                raise BenchmarkError(
                    f"the pattern {self.text} has a field {{{field}}}; it may have {names}"
                )
        if re.search("[{}]", TOKEN.sub("", self.text)):
            raise BenchmarkError(f"the pattern {self.text} has a brace without its partner")
        if any(len(re.findall(r"\*+", part)) > MAX_STARS for part in self.text.split("/")):
            raise BenchmarkError(
                f"the pattern {self.text} has more than {MAX_STARS} * between two slashes"
            )

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the fields, each once."""
        tokens = TOKEN.findall(self.text)
        return tuple(dict.fromkeys(token[1:-1] for token in tokens if token[0] == "{"))

    def find(self) -> dict[str, dict[str, str]]:
        """Return the paths that match, with the values of the fields; a device never does.

        Where the text can be divided among the fields in several ways, the first field is as long
        as possible.
        """
        parts = TOKEN.split(self.text)
        parts[::2], parts[1::2] = map(glob.escape, parts[::2]), ["*"] * (len(parts) // 2)
        paths = sorted(filterfalse(_is_device, glob.glob("".join(parts))))  # noqa: PTH207 - keeps a ./
        matches = map(self._expression().fullmatch, paths)  # a repeated field may differ
        return {match[0]: match.groupdict() for match in matches if match}

    def fill(self, values: Mapping[str, str]) -> str:
        """Return the path for some values of the fields."""
        return TOKEN.sub(lambda token: values.get(token[0][1:-1], token[0]), self.text)

    def _expression(self) -> re.Pattern[str]:
        """Return an expression with a group for each field."""
        parts = TOKEN.split(self.text)
        tokens = parts[1::2]
        parts[::2] = map(re.escape, parts[::2])
        for index, token in enumerate(tokens):
            name = token[1:-1]
            if token[0] == "*":
                parts[2 * index + 1] = "[^/]*"
            elif token in tokens[:index]:
                parts[2 * index + 1] = f"(?P={name})"
            else:
                parts[2 * index + 1] = f"(?P<{name}>[^/]+)"
        return re.compile("".join(parts), re.DOTALL)


def _is_device(path: str) -> bool:
    return Path(path).is_char_device() or Path(path).is_block_device()
