"""The table of the estimates, at most 100 columns wide, and no wider than the terminal."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..evaluation.notes import MUCH_LOST
from ..evaluation.settings import Settings
from ..texts import WIDTH, padded, text_width

__all__ = ["shortened", "table"]

LONG = 8  # characters of a number
COLUMNS = (  # header, key of the JSON output, format
    ("rank", "rank", "rank"),
    ("TAS", "TAS", ".4f"),
    ("sd", "TAS_sd", ".2g"),
    ("half{unit}", "half_distance", ".4g"),
    ("RAS", "RAS", ".4f"),
    ("half deg", "half_angle", ".4g"),
    ("PAS", "PAS", ".4f"),
    ("sd", "PAS_sd", ".2g"),
    ("ATE{unit}", "ATE", ".4g"),
    ("d{unit}", "unit", ".4g"),
    ("< d", "within_unit", ".0%"),
    ("< 10 deg", "within_10_deg", ".0%"),
    ("n", "n", "d"),
    ("lost", "lost", ".1%"),
    ("nan", "no_pose", "no_pose"),
    ("dupl.", "duplicate", "d"),
    ("parts", "n_parts", "d"),
)
SELDOM = ("lost", "no_pose", "duplicate", "n_parts")  # shown where not all are 0
SPREADS = ("TAS_sd", "PAS_sd")  # shown where a score has one, close to it
# For long names. (The sd of the PAS is that of the TAS times its weight.)
FIRST_DROPPED = ("within_10_deg", "within_unit", "duplicate", "PAS_sd", "no_pose")
NEXT_DROPPED = ("TAS_sd", "ATE", "lost")  # for names shortened to so many characters
LAST_DROPPED = ("n_parts", "unit", "n", "half_angle", "half_distance", "rank")  # of narrow ones
SHORTEST = 12


def table(
    results: Sequence[Mapping[str, Any]], settings: Settings, columns: int = WIDTH
) -> tuple[str, list[str]]:
    """Return the table of all estimates, with the keys of the JSON output, and what had no room.

    Columns that say nothing are left out; then, as far as there is no room, the less important
    ones and the middle of long names.
    """
    unit = " m" if settings.form.unit == "m" else ""
    results = [
        {
            **values,
            "no_pose": (values["no_position"], values["no_rotation"]),
            "n_parts": len(values["parts"]),
        }
        for values in results
    ]
    shown = {
        key: [header.format(unit=unit), *(_cell(values[key], form) for values in results)]
        for header, key, form in COLUMNS
        if (key != "rank" or len(results) > 1)
        and (key not in SELDOM or any(np.any(values[key]) for values in results))
        and (key not in SPREADS or any(values[key] is not None for values in results))
    }
    if settings.missing_cameras == "ignore" and any(row["lost"] > MUCH_LOST for row in results):
        marks = " ", *("*" if values["lost"] > MUCH_LOST else " " for values in results)
        for key in ("half_distance", "PAS"):  # by which estimates are ranked
            shown[key] = [cell + mark for cell, mark in zip(shown[key], marks, strict=True)]
    names = ["estimate", *(values["name"] for values in results)]
    longest = max(map(text_width, names))
    dropped = []
    for key in FIRST_DROPPED + NEXT_DROPPED + LAST_DROPPED:
        least = longest if key in FIRST_DROPPED else min(longest, SHORTEST)
        if key in shown and _room(shown, columns) < least:
            dropped.append(shown.pop(key)[0])
    names = shortened(names, max(_room(shown, columns), SHORTEST))
    width = max(map(text_width, names))
    gaps = list(map(_gap, shown))
    widths = [max(map(len, cells)) for cells in shown.values()]
    lines = []
    for name, *row in zip(names, *shown.values(), strict=True):
        cells = (gap + cell.rjust(wide) for gap, cell, wide in zip(gaps, row, widths, strict=True))
        lines.append("".join([padded(name, width), *cells]))
    return "\n".join(lines), dropped


def _room(shown: Mapping[str, Sequence[str]], columns: int) -> int:
    """Return the width that the columns leave for the names."""
    return columns - sum(len(_gap(key)) + max(map(len, cells)) for key, cells in shown.items())


def _gap(key: str) -> str:
    """Return what stands before a column: a standard deviation belongs to the score before it."""
    return " " if key in SPREADS else "  "


def shortened(names: list[str], width: int) -> list[str]:
    """Cut the middle out of long names, or else what they share; at last they are numbered."""
    short = [_cut(name, width, "") for name in names]
    if len(set(short)) < len(set(names)):
        long = [name for name in names if text_width(name) > width]
        start = len(os.path.commonprefix(long))  # noqa: RUF071 - of characters
        end = len(os.path.commonprefix([name[start:][::-1] for name in long]))  # noqa: RUF071
        apart = [f"..{name[start : len(name) - end]}.." if name in long else name for name in names]
        short = [_cut(name, width, "") for name in apart]
    if len(set(short)) < len(set(names)):
        short = [_cut(name, width, f"~{row}") for row, name in enumerate(names)]
    return short


def _cut(name: str, width: int, number: str) -> str:
    if text_width(name) <= width:
        return name
    room = width - 2 - len(number)
    end = _fitting(name[::-1], room // 2)[::-1]
    return f"{_fitting(name, room - text_width(end))}..{end}{number}"


def _fitting(text: str, width: int) -> str:
    """Return as much of the beginning of a text as fits in."""
    return next(text[:n] for n in range(len(text), -1, -1) if text_width(text[:n]) <= max(width, 0))


def _cell(value: Any, form: str) -> str:
    if value is None:
        return "-"
    if form == "no_pose":
        return "{}/{}".format(*value)
    if form == "rank":  # one number, or the two of a tie
        return "-".join(map(str, dict.fromkeys(value)))
    text = format(value, form)
    return text if len(text) <= LONG else format(value, ".2e")
