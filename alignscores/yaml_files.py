"""Files of YAML from anybody: read without a way to exhaust memory, the stack or patience.

It needs PyYAML: import it where a file is read.
"""

import re
from os import PathLike
from pathlib import Path
from typing import Any

import yaml
from yaml.constructor import ConstructorError

__all__ = ["load_yaml", "parse_yaml"]

MOST_BYTES = 10**6
MOST_NODES = 10**5  # texts, lists and mappings, counted anew wherever an alias repeats them
MOST_DEPTH = 20
MOST_DIGITS = 40  # characters of a number
LARGEST = 2**63

# The parser in C is twenty times as fast.
_Parser: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Parser):  # type: ignore[misc]
    """Texts, numbers, lists and mappings: 1e-3 is a number, a date a text, no key given twice."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._checked: set[Any] = set()

    def flatten_mapping(self, node: Any) -> None:
        """Merge what the mapping takes from others, once its own keys are checked."""
        seen = set()
        for key, _ in () if node in self._checked else node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _problem("a key must be a text or a number", key)
            value = self.construct_object(key)
            if value in seen:
                raise _problem(f"{key.value[:40]!r} is given twice", key)
            seen.add(value)
        self._checked.add(node)
        super().flatten_mapping(node)

    def construct_number(self, node: Any) -> float:
        """Return a number that a double or 64 bits hold."""
        kind = node.tag.rpartition(":")[2]
        if len(node.value) > MOST_DIGITS:
            raise _problem(f"a number has {len(node.value)} characters", node)
        try:
            number: float = getattr(self, f"construct_yaml_{kind}")(node)
        except ValueError:
            raise _problem(f"{node.value!r} is not a number", node) from None
        if (
            abs(number) >= LARGEST
            if kind == "int"
            else abs(number) == float("inf") and ("inf" not in node.value.lower())
        ):
            raise _problem(f"{node.value} is too large a number", node)
        return number


def _problem(problem: str, node: Any) -> ConstructorError:
    return ConstructorError(problem=problem, problem_mark=node.start_mark)


_Loader.yaml_implicit_resolvers = {
    letter: [pair for pair in pairs if not pair[0].endswith((":timestamp", ":value"))]
    for letter, pairs in _Parser.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+$"), list("-+0123456789")
)
_Loader.add_constructor("tag:yaml.org,2002:merge", _Loader.construct_yaml_str)
for _kind in ("int", "float"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_number)


def load_yaml(path: str | PathLike[str]) -> Any:
    """Return what a file of YAML holds, in UTF-8 whatever the locale.

    Raises
    ------
    ValueError
        Why it cannot be read, in one line with the place, but without the name of the file.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ValueError(error.strerror) from None
    if len(data) > MOST_BYTES:
        raise ValueError(f"it has more than {MOST_BYTES // 10**6} MB")
    try:
        return parse_yaml(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"line {line} is not text (UTF-8)") from None


def parse_yaml(text: str) -> Any:
    """Return what a text holds; ValueError as of `load_yaml`."""
    try:
        _check_size(text)
        return yaml.load(text, _Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}: " if mark else ""
        raise ValueError(f"{place}{error.problem or error.context}") from None
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except OverflowError:  # of the parser in Python
        raise ValueError("a character has too large a number") from None


def _check_size(text: str) -> None:
    """Refuse what is nested too deeply, what aliases make too large, and tags of types."""
    sizes: dict[str, int] = {}  # of what has an anchor
    total = 0
    open_nodes: list[tuple[str | None, int]] = []  # anchors, and the total before

    for event in yaml.parse(text, _Parser):
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise _problem(f"*{event.anchor[:40]} names nothing before it", event)
            total += sizes[event.anchor]
        elif isinstance(event, yaml.NodeEvent):
            total += 1
            if event.anchor in sizes:
                raise _problem(f"&{event.anchor[:40]} is given twice", event)
            if event.tag is not None:
                raise _problem(f"a tag, {event.tag[:40]}, is not taken; write the value", event)
            if isinstance(event, yaml.ScalarEvent):
                sizes |= {event.anchor: 1} if event.anchor else {}
            else:
                open_nodes.append((event.anchor, total - 1))
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_nodes.pop()
            sizes |= {anchor: total - before} if anchor else {}
        if len(open_nodes) > MOST_DEPTH:
            raise _problem(f"it is nested more than {MOST_DEPTH} deep", event)
        if total > MOST_NODES:
            raise _problem(f"it has more than {MOST_NODES} entries, aliases counted", event)
