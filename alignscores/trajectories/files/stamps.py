"""The units of time stamps."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats
from .poses import warn
from .text import FilePath, Source

__all__ = ["in_seconds", "numbers_or_stamps", "time_unit", "unit_of_word"]

TIME_UNITS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
PREFIXES = "", "m|milli", "u|micro", "n|nano"  # of words for these units
MAX_SECONDS = 1e11  # larger time stamps, as a rule, are in a smaller unit
MAX_ELAPSED = 1e14  # nanoseconds, a day or so; larger time stamps are not counted from a start
NANOSECOND_STEP = 5e5  # stamps since a start that differ by more are in nanoseconds


def time_unit(stamps: Floats) -> str:
    """Return the unit of time stamps, a key of `TIME_UNITS`, as their size or their steps show it.

    Of stamps since the start of a recording, milliseconds and microseconds cannot be told from
    seconds.
    """
    size = float(np.median(np.abs(stamps)))
    steps = np.diff(np.unique(stamps))
    if size < MAX_ELAPSED and len(steps) > 0 and np.median(steps) >= NANOSECOND_STEP:
        return "nanoseconds"
    units = (unit for unit, factor in TIME_UNITS.items() if size < MAX_SECONDS * factor)
    return next(units, "nanoseconds")


def unit_of_word(word: str) -> str | None:
    """Return the unit of time that a word in the name of a column means, if any."""
    units = zip(TIME_UNITS, PREFIXES, strict=True)
    return next((u for u, prefix in units if re.fullmatch(f"({prefix})s(ec(ond)?s?)?", word)), None)


def in_seconds(path: FilePath, columns: Mapping[str, Floats]) -> Floats:
    """Return time stamps in seconds: the sum of columns of known units, or t of any unit.

    There is a warning if its size shows another unit than seconds.
    """
    if "t" not in columns:
        parts = [values / TIME_UNITS[name[2:]] for name, values in columns.items()]
        return np.asarray(np.sum(parts, axis=0))
    unit = time_unit(columns["t"])
    if unit != "seconds":
        warn(path, f"time stamps in {unit}, as their size shows")
    return columns["t"] / TIME_UNITS[unit]


def numbers_or_stamps(values: Floats, source: Source) -> NDArray[Any]:
    """Return numbers of frames; those that are not whole, or are too large, are time stamps."""
    source.refuse(~np.isfinite(values), "the number is not finite")
    if (values != np.round(values)).any() or time_unit(values) != "seconds":
        return in_seconds(source.path, {"t": values})
    return values.astype(np.int64)
