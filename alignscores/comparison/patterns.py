"""Patterns of paths with named fields in braces: ``data/{sequence}/{system}/{run}.txt``."""

import glob
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

__all__ = ["Pattern"]

TOKEN = re.compile(r"\{([^{}]*)\}|\*+")


@dataclass(frozen=True)
class Pattern:
    """A pattern of paths, and the names that its fields may have.

    A field stands for one or more characters other than a slash, the same ones wherever it is
    repeated; a ``*`` stands for any characters other than a slash.
    """

    text: str
    allowed: Collection[str]

    def __post_init__(self) -> None:
        names = ", ".join(f"{{{name}}}" for name in self.allowed)
        for field in self.fields:
            if field not in self.allowed:
                raise ValueError(
                    f"the pattern {self.text} has a field {{{field}}}; it may have {names}"
                )
        if re.search("[{}]", TOKEN.sub("", self.text)):
            raise ValueError(f"the pattern {self.text} has a brace without its partner")

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the fields, each once."""
        found = (match[1] for match in TOKEN.finditer(self.text) if match[1] is not None)
        return tuple(dict.fromkeys(found))

    def find(self) -> tuple[dict[str, dict[str, str]], list[str]]:
        """Find the paths that match, with the values of the fields, and a line for each other.

        The others are those in which a field may end at more than one place.
        """
        found, problems = {}, []
        for path in sorted(glob.glob(self._joined(glob.escape, "*"))):  # noqa: PTH207 - keeps a ./
            longest, shortest = self._values(path, ""), self._values(path, "?")
            if longest is None or shortest is None:
                continue  # a repeated field that differs
            if longest == shortest:
                found[path] = longest
            else:
                either, other = (
                    ", ".join(f"{name} {value!r}" for name, value in values.items())
                    for values in (longest, shortest)
                )
                problems.append(
                    f"{path}: matches {self.text} in more than one way ({either}; or {other}); "
                    "left out"
                )
        return found, problems

    def fill(self, values: Mapping[str, str]) -> str:
        """Return the path for some values of the fields."""
        return TOKEN.sub(lambda token: values.get(token[1] or "", token[0]), self.text)

    def _values(self, path: str, lazy: str) -> dict[str, str] | None:
        """Return the values of the fields, each as long, or as short, as possible."""
        seen: set[str] = set()

        def field(name: str) -> str:
            if name in seen:
                return f"(?P={name})"
            seen.add(name)
            return f"(?P<{name}>[^/]+{lazy})"

        match = re.fullmatch(self._joined(re.escape, f"[^/]*{lazy}", field), path, re.DOTALL)
        return match and match.groupdict()

    def _joined(
        self,
        literal: Callable[[str], str],
        star: str,
        field: Callable[[str], str] | None = None,
    ) -> str:
        """Translate the pattern, by default with fields like stars."""
        parts, end = [], 0
        for token in TOKEN.finditer(self.text):
            parts.append(literal(self.text[end : token.start()]))
            parts.append(star if token[1] is None or field is None else field(token[1]))
            end = token.end()
        return "".join([*parts, literal(self.text[end:])])
