"""Time stamps: their unit, and files that hold nothing else of interest."""

import numpy as np

from ...arrays import Floats
from .text import FileError, FilePath, data_lines, is_number

__all__ = ["read_stamps"]

TIME_UNITS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
MAX_SECONDS = 1e11  # larger time stamps, as a rule, are in a smaller unit
MAX_ELAPSED = 1e14  # nanoseconds, a day or so; larger time stamps are not counted from a start
NANOSECOND_STEP = 5e5  # stamps since a start that differ by more are in nanoseconds


def read_stamps(path: FilePath) -> Floats:
    r"""Read the time stamps in the first column of a text file.

    Parameters
    ----------
    path : path
        The file: TUM's ``rgb.txt``, EuRoC's ``cam0/data.csv``, a trajectory. Columns are separated
        by blanks or commas; a header line, blank lines and those that begin with # are left out.

    Returns
    -------
    (n,) ndarray
        Time stamps in seconds; those of a file in nanoseconds are divided by 1e9.

    Raises
    ------
    FileError
        Where the file cannot be read, a line does not begin with a finite number, or the stamps
        are in milliseconds or microseconds.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_stamps
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "data.csv")
    ...     _ = path.write_text("time,file\n1500000000500000000,a.png\n")
    ...     stamps = read_stamps(path)
    >>> stamps
    array([1.5e+09])
    """
    stamps: list[float] = []
    may_be_header = True
    for line_number, line in data_lines(path):
        fields = line.replace(",", " ").split()
        if not fields:
            continue
        if is_number(fields[0], finite=True):
            stamps.append(float(fields[0]))
        elif not may_be_header:
            reason = f"must begin with a time stamp, not {fields[0][:40]!r}"
            raise FileError(path, reason, place=f"line {line_number}")
        may_be_header = False
    if not stamps:
        raise FileError(path, "has no time stamps")
    return in_seconds(path, np.array(stamps), "seconds", "nanoseconds")


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


def in_seconds(path: FilePath, stamps: Floats, *units: str) -> Floats:
    """Return time stamps in seconds, of a file that may have them in any of the given units."""
    unit = time_unit(stamps)
    if unit not in units:
        raise FileError(
            path,
            f"its time stamps seem to be in {unit} (the first is {stamps[0]:.0f}); write them in "
            f"{' or '.join(units)}",
        )
    return stamps / TIME_UNITS[unit]
