"""The units of time stamps."""

import numpy as np

from ...arrays import Floats
from .poses import warn
from .text import FilePath

__all__ = ["TIME_UNITS", "in_seconds", "time_unit"]

TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}  # in a second
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
        return "ns"
    units = (unit for unit, factor in TIME_UNITS.items() if size < MAX_SECONDS * factor)
    return next(units, "ns")


def in_seconds(stamps: Floats, path: FilePath, usual: str = "s") -> Floats:
    """Return time stamps in seconds; warn where their size shows a unit that is not usual."""
    unit = time_unit(stamps)
    if unit not in ("s", usual):
        warn(path, f"time stamps in {unit}, as their size shows")
    return stamps / TIME_UNITS[unit]
