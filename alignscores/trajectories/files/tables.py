"""Text tables: a pose a line."""

import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats
from .columns import (
    NAME_THEM,
    QUATERNION,
    columns_by_width,
    columns_of_header,
    matrix_columns,
    parse_columns,
)
from .poses import (
    Trajectory,
    poses_from_matrices,
    poses_from_positions,
    poses_from_quaternions,
    warn,
)
from .stamps import TIME_UNITS, in_seconds, numbers_or_stamps, time_unit
from .text import FileError, FilePath, Lines, Source, is_number, numbered_lines

__all__ = ["Table", "open_table", "read_stamps", "read_table"]

COMMENTS = ("#", "%", "//")
Rows = Iterator[tuple[int, list[str]]]  # fields, with the numbers of their lines
MISSING = {"", "na", "none", "null"}  # what stands in a table instead of a number


def read_table(path: FilePath, columns: str | None = None, *, euroc: bool = False) -> Trajectory:
    """Read a text table of poses, whose columns are named by `columns`, a header or their number.

    Tables of EuRoC with commas have w first, if nothing names their columns; that they are in
    nanoseconds and have more columns goes without saying.
    """
    table = open_table(path)
    names = table.columns(columns, w_first=euroc)
    used = [name for name in names if name != "-"]
    values, source = table.numbers([names.index(name) for name in used])
    column = dict(zip(used, values.T, strict=True))
    with warnings.catch_warnings():
        if euroc:
            warnings.filterwarnings("ignore", ".*: time stamps in nanoseconds")
        elif unread := len(names) - len(used):
            warn(path, f"read {' '.join(used)}, not the other {unread} of {len(names)} columns")
        return Trajectory(_keys(column, source), _poses(column, source))


def _keys(column: dict[str, Floats], source: Source) -> NDArray[Any]:
    """Return time stamps in seconds, otherwise the numbers of frames or rows."""
    stamps = {name: values for name, values in column.items() if name[0] == "t"}
    for values in stamps.values():
        source.refuse(~np.isfinite(values), "the time stamp is not finite")
    if stamps:
        return in_seconds(source.path, stamps)
    if "n" in column:
        return numbers_or_stamps(column["n"], source)
    return np.arange(len(column["x"]))


def _poses(column: dict[str, Floats], source: Source) -> Floats:
    positions = np.column_stack([column["x"], column["y"], column["z"]])
    if "qw" in column:
        quaternions = np.column_stack([column[name] for name in QUATERNION])
        return poses_from_quaternions(positions, quaternions, source)
    if "r11" not in column:
        return poses_from_positions(positions)
    matrices = np.column_stack([column[name] for name in matrix_columns(column)])
    return poses_from_matrices(matrices.reshape(len(matrices), -1, 4), source)


@dataclass(frozen=True)
class Table:
    """A text file with a row of fields a line."""

    path: FilePath
    header: str  # the line above the first row, or the comment, that names columns
    separator: str | None  # None: blanks
    first: list[str]  # fields of the first row
    line: int  # its number
    rows: Rows  # all of them

    def columns(self, named: str | None = None, *, w_first: bool = False) -> list[str]:
        """Return what each column holds."""
        width = len(self.first)
        names = parse_columns(named) if named else columns_of_header(self.header)
        if named and len(names) > width:
            reason = f"has {width} columns, not the {len(names)} of {named!r}"
            raise FileError(self.path, reason, place=f"line {self.line}")
        if "x" not in names or len(names) > width:
            self._check_header(len(names))
            names = columns_by_width(self.first, w_first=w_first and self.separator is not None)
        if not names:
            columns = "column" if width == 1 else "columns"
            reason = f"has {width} {columns}, whose meaning is unknown; {NAME_THEM}"
            raise FileError(self.path, reason, place=f"line {self.line}")
        return names + ["-"] * (width - len(names))

    def _check_header(self, n_names: int) -> None:
        """Check that the columns have no other names."""
        if re.search("latitude|(?<![a-z])lat(?![a-z])", self.header.lower()):
            raise FileError(self.path, "has latitudes; it takes positions x, y, z in one unit")
        if self.header and not self.header.startswith(COMMENTS) and n_names == len(self.first):
            reason = f"its header names no x, y, z ({self.header[:60]!r}); {NAME_THEM}"
            raise FileError(self.path, reason)

    def numbers(self, columns: Sequence[int]) -> tuple[Floats, Source]:
        """Return the numbers in some columns, and where the rows are in the file."""
        lines, values = [], []
        for line, fields in self.rows:
            lines.append(line)
            values.append(self._numbers_of_row(line, fields, columns))
        return np.array(values), Source(self.path, lambda row: f"line {lines[row]}")

    def _numbers_of_row(self, line: int, fields: list[str], columns: Sequence[int]) -> list[float]:
        width = len(self.first)
        fields = fields if "".join(fields[width:]).strip() else fields[:width]
        if len(fields) <= max(columns) or (len(columns) == width != len(fields)):
            reason = f"has {len(fields)} column{'s'[: len(fields) != 1]}, the first row {width}"
            raise FileError(self.path, reason, place=f"line {line}")
        with suppress(ValueError):
            return [float(fields[column]) for column in columns]
        used = [fields[column].strip() for column in columns]
        used = ["nan" if field.lower() in MISSING else field for field in used]
        if wrong := [field for field in used if not is_number(field)]:
            reason = f"{wrong[0][:40]!r} is not a number; --columns names the columns"
            raise FileError(self.path, reason, place=f"line {line}")
        return list(map(float, used))


def open_table(path: FilePath) -> Table:
    """Return the table of a text file, with its header and its first row."""
    lines, header = numbered_lines(path), ""
    for number, line in lines:
        text = line.strip()
        is_comment = text.startswith(COMMENTS)
        if not is_comment and any(map(is_number, re.split(r"[\s,;]+", text))):
            separator = _separator(text.partition("#")[0])
            rows = _rows(chain([(number, line)], lines), separator)
            first, fields = next(rows)
            ends_lines = separator and not fields[-1].strip()
            named = fields[:-1] if ends_lines else fields
            return Table(path, header, separator, named, first, chain([(first, fields)], rows))
        if text and (not (is_comment and header) or "x" in columns_of_header(text)):
            header = text
    raise FileError(path, "has no line of numbers")


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
    values, source = open_table(path).numbers([0])
    source.refuse(~np.isfinite(values[:, 0]), "the time stamp is not finite")
    return values[:, 0] / TIME_UNITS[time_unit(values[:, 0])]


def _separator(text: str) -> str | None:
    """Return the mark that separates the fields of a line; None: blanks and others."""
    separator = next((mark for mark in ";," if mark in text), None)
    if separator and any(len(field.split()) > 1 for field in text.split(separator)):
        return None
    return separator


def _rows(lines: Lines, separator: str | None) -> Rows:
    """Yield the fields of the lines that are neither blank nor comments."""
    for number, line in lines:
        text = line.partition("#")[0].strip().replace('"', "")
        if not text or text.startswith(COMMENTS):
            continue
        if separator == ";":
            text = text.replace(",", ".")  # a decimal comma
        elif separator is None:
            text = text.replace(",", " ").replace(";", " ")
        yield number, text.split(separator)
