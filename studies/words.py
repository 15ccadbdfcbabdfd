"""Numbers and tables as they are read."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

NONE = "–"


def write_number(value: float, digits: int = 0, *, signed: bool = False) -> str:
    """Write a number with a true minus sign, and with a plus where it is one of two directions."""
    text = f"{abs(value):.{digits}f}"
    if not float(text):
        return text
    return f"−{text}" if value < 0 else f"+{text}" if signed else text


def write_levels(values: Sequence[float]) -> str:
    """Write the values of a setting, shortened where they rise in even steps."""
    steps = {round(after - before, 9) for before, after in pairwise(values)}
    if len(values) > 4 and len(steps) == 1:
        return f"{values[0]:g}, {values[1]:g}, …, {values[-1]:g}"
    return ", ".join(f"{value:g}" for value in values)


def markdown_table(
    head: Sequence[str], rows: Iterable[Sequence[str]], columns: str = ""
) -> list[str]:
    """Return the lines of a table; columns stand left or right (l, r), all but the first right."""
    rules = {"l": "---|", "r": "--:|"}
    rule = "".join(rules[side] for side in columns or "l" + "r" * (len(head) - 1))
    first, *others = (
        " ".join(f"| {cell}".rstrip() for cell in row) + " |" for row in (head, *rows)
    )
    return [first, f"|{rule}", *others]


def document(*blocks: str | Iterable[str]) -> str:
    """Join paragraphs, and lists and tables of lines, with an empty line between them."""
    texts = [block if isinstance(block, str) else "\n".join(block) for block in blocks]
    return "\n\n".join(texts) + "\n"


def listed(words: Sequence[object]) -> str:
    """List words with commas, and *and* before the last."""
    *others, last = map(str, words)
    return f"{', '.join(others)} and {last}" if others else last
