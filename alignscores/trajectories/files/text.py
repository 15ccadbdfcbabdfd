"""Text files, also compressed or from stdin, and the numbers in their lines."""

import gzip
import sys
import zlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import StringIO
from math import isfinite
from os import PathLike
from pathlib import Path

import numpy as np

from ...arrays import Booleans, Floats

__all__ = ["STDIN", "FileError"]

FilePath = str | PathLike[str]
Lines = list[tuple[int, str]]  # lines with their numbers, from 1

STDIN = "-"
GZIP = b"\x1f\x8b"  # the first bytes
FORMAT_OF_COLUMNS = {8: "tum", 12: "kitti", 16: "kitti"}


class FileError(ValueError):
    """A trajectory file that cannot be read, with its name, the line and the reason.

    Parameters
    ----------
    path : path
        The file.
    reason : str
        What is wrong with it.
    place : str
        Where in the file, if anywhere.

    Examples
    --------
    >>> from alignscores.trajectories.files import FileError
    >>> print(FileError("estimate.txt", "has 2 columns", place="line 1"))
    estimate.txt, line 1: has 2 columns
    """

    def __init__(self, path: FilePath, reason: str, *, place: str = "") -> None:
        super().__init__(f"{path}{place and ', '}{place}: {reason}")


@dataclass(frozen=True)
class Source:
    """The file that an array was read from, and the place of each row in it."""

    path: FilePath
    place: Callable[[int], str]

    def error(self, row: int, reason: str) -> FileError:
        """Return the error that something is wrong with a row."""
        return FileError(self.path, reason, place=self.place(row))

    def refuse(self, wrong: Booleans, reason: str) -> None:
        """Raise the error that something is wrong with the first of some rows, if there are any."""
        if wrong.any():
            raise self.error(int(np.argmax(wrong)), reason)


def read_bytes(path: FilePath) -> bytes:
    """Return the content of a file, which may be compressed or stdin."""
    try:
        data = sys.stdin.buffer.read() if str(path) == STDIN else Path(path).read_bytes()
        compressed = data.startswith(GZIP) or str(path).endswith(".gz")
        return gzip.decompress(data) if compressed else data
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise FileError(path, f"is not a complete gzip file ({error})") from None
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None


def read_text(path: FilePath) -> str:
    """Return the text of a file, which may be compressed or stdin."""
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise FileError(path, "is not text (UTF-8)", place=f"line {line}") from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise FileError(path, "is not text (a zero byte)", place=f"line {line}")
    return text


def numbered_lines(path: FilePath) -> Lines:
    """Return the lines of a text file, whatever ends them, with their numbers."""
    return list(enumerate(StringIO(read_text(path), newline=None), 1))


def data_lines(path: FilePath) -> Lines:
    """Return the stripped lines of a text file that are neither blank nor comments."""
    stripped = [(number, line.strip()) for number, line in numbered_lines(path)]
    return [(number, line) for number, line in stripped if line and line[0] != "#"]


def read_numbers(
    path: FilePath, lines: Lines, columns: str, counts: Sequence[int], delimiter: str | None = None
) -> tuple[Floats, Source]:
    """Return the numbers of a file, a row a line, and where the rows are in the file.

    `columns` names the columns for errors, `counts` has the numbers of columns that a file may
    have.
    """
    if not lines:
        raise FileError(path, "has no poses")
    source = Source(path, lambda row: f"line {lines[row][0]}")
    with suppress(ValueError):
        text = [line for _, line in lines]
        values = np.loadtxt(text, comments=None, delimiter=delimiter, ndmin=2)
        if values.shape[1] in counts:
            return values, source
    # Line by line takes twice as long, but tells which line is malformed.
    rows: list[list[float]] = []
    for row, (_, line) in enumerate(lines):
        fields = line.split(delimiter)
        if len(fields) not in counts:
            raise source.error(row, _wrong_columns(fields, columns))
        if rows and len(fields) != len(rows[0]):
            raise source.error(row, f"has {len(fields)} columns, the first line {len(rows[0])}")
        header = "; a header line begins with #" if row == 0 else ""
        for field in fields:
            if not is_number(field):
                raise source.error(row, f"{field[:40]!r} is not a number{header}")
        rows.append(list(map(float, fields)))
    return np.array(rows), source


def is_number(field: str, *, finite: bool = False) -> bool:
    """Tell whether a field holds a number, which may have to be finite."""
    try:
        return isfinite(float(field)) or not finite
    except ValueError:
        return False


def _wrong_columns(fields: Sequence[str], columns: str) -> str:
    reason = f"has {len(fields)} column{'s'[: len(fields) != 1]}, not {columns!r}"
    if len(fields) in FORMAT_OF_COLUMNS:
        reason += f"; {len(fields)} columns are the {FORMAT_OF_COLUMNS[len(fields)]} format"
    elif "," in fields[0]:
        reason += "; files with commas are the euroc format"
    return reason
