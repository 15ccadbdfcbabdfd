"""Text tables: a pose a line."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats
from .columns import FOUR_ROWS, QUATERNION, name_columns
from .poses import (
    Trajectory,
    poses_from_matrices,
    poses_from_positions,
    poses_from_quaternions,
    warn,
)
from .rows import open_table
from .stamps import TIME_UNITS, in_seconds, time_unit
from .text import FilePath, Source

__all__ = ["read_stamps", "read_table"]


def read_table(path: FilePath, columns: str | None = None, *, euroc: bool = False) -> Trajectory:
    """Read a text table of poses, whose columns are named by `columns`, a header or their number.

    Tables of EuRoC with commas have w first, if nothing names their columns; that they are in
    nanoseconds and have more columns goes without saying.
    """
    table = open_table(path)
    names = name_columns(table, columns, w_first=euroc)
    used = [name for name in names if name != "-"]
    values = table.numbers([names.index(name) for name in used])
    column = dict(zip(used, values.T, strict=True))
    if len(used) < len(names) and not euroc:
        unread = len(names) - len(used)
        warn(path, f"read {' '.join(used)}, not the other {unread} of {len(names)} columns")
    keys = _keys(column, table.source, usual="ns" if euroc else "s")
    return Trajectory(keys, _poses(column, table.source))


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
        Time stamps in seconds, whatever their unit is in the file.

    Raises
    ------
    FileError
        Where the file cannot be read, or a line does not begin with a finite number.

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
    table = open_table(path)
    stamps = table.numbers([0])[:, 0]
    table.source.refuse(~np.isfinite(stamps), "the time stamp is not finite")
    return stamps / TIME_UNITS[time_unit(stamps)]


def _keys(column: dict[str, Floats], source: Source, usual: str) -> NDArray[Any]:
    """Return time stamps in seconds, otherwise the numbers of frames or rows."""
    stamps = {name: values for name, values in column.items() if name[0] == "t"}
    for values in stamps.values():
        source.refuse(~np.isfinite(values), "the time stamp is not finite")
    if stamps and "t" not in stamps:
        parts = [values / TIME_UNITS[name[2:]] for name, values in stamps.items()]
        return np.asarray(np.sum(parts, axis=0))
    keys = stamps.get("t", column.get("n", np.arange(0.0, len(column["x"]))))
    source.refuse(~np.isfinite(keys), "the number is not finite")
    if not stamps and time_unit(keys) == "s" and (keys == np.round(keys)).all():
        return keys.astype(np.int64)
    return in_seconds(keys, source.path, usual)


def _poses(column: dict[str, Floats], source: Source) -> Floats:
    positions = np.column_stack([column[name] for name in "xyz"])
    if "qw" in column:
        quaternions = np.column_stack([column[name] for name in QUATERNION])
        return poses_from_quaternions(positions, quaternions, source)
    if "r11" not in column:
        return poses_from_positions(positions)
    matrices = np.column_stack([column[name] for name in FOUR_ROWS.split() if name in column])
    return poses_from_matrices(matrices.reshape(len(matrices), -1, 4), source)
