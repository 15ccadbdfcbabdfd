"""Numbers as they are written for readers."""

from collections.abc import Sequence
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
