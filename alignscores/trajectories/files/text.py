"""Text files, also compressed or from stdin, and the numbers in their lines."""

import gzip
import os
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from itertools import islice
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...arrays import Booleans, Floats, Indices

__all__ = ["FAILURES", "STDIN", "FileError"]

FilePath = str | PathLike[str]
Lines = Iterator[tuple[int, str]]  # lines with their numbers, from 1

STDIN = "-"
GZIP = b"\x1f\x8b"  # the first bytes
LIMIT = "ALIGNSCORES_MAX_MB"  # the variable of the environment that raises the bound
MOST_MB = 256
BYTES_OF_LINE = 64  # of the bound: a file may have as many lines as this makes of it
BYTES, BLOCK = 1 << 20, 10_000  # bytes and lines that are read at a time
LONGEST_LINE = 10_000  # characters of a line of numbers
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


# What a file that cannot be read or scored may end in; others go on.
FAILURES = ArithmeticError, MemoryError, OSError, RecursionError, ValueError


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


def most_bytes() -> int:
    """Return how many bytes are read of a file, unpacked, before it is refused."""
    given = os.environ.get(LIMIT) or str(MOST_MB)
    if not (is_number(given, finite=True) and float(given) > 0):
        raise ValueError(f"{LIMIT} must be a number of MB above 0, not {given[:40]!r}")
    return int(min(float(given) * 10**6, sys.maxsize / 2))


def refuse_more(path: FilePath, number: int, most: int, unit: str = "bytes") -> None:
    """Refuse a file that holds more than it may."""
    if number > most:
        raise FileError(path, f"has more than {most} {unit}; set {LIMIT} higher to read it")


def read_bytes(path: FilePath, most: int | None = None) -> bytes:
    """Return the content of a file, which may be compressed or stdin, if it is not too large."""
    most = most or most_bytes()
    data = _unpacked(path, most)
    refuse_more(path, len(data), most)
    return data


def _unpacked(path: FilePath, most: int) -> bytes:
    """Return the content of a file; no more than `most` bytes and one."""
    try:
        if str(path) == STDIN:
            if sys.stdin is None:
                raise FileError(path, "standard input is closed")
            data = _read_at_most(sys.stdin.buffer, most)
        else:
            with Path(path).open("rb") as file:
                data = _read_at_most(file, most)
        refuse_more(path, len(data), most)
        if data.startswith(GZIP) or str(path).endswith(".gz"):
            data = _read_at_most(gzip.GzipFile(fileobj=BytesIO(data)), most)
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise FileError(path, f"is not a complete gzip file ({error})") from None
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None
    return data


def _read_at_most(stream: BinaryIO | gzip.GzipFile, most: int) -> bytes:
    """Return what a stream holds, at most one byte more than `most`.

    To ask for so much at once would take the memory for it, however little there is.
    """
    content = BytesIO()
    while content.tell() <= most and (block := stream.read(min(BYTES, most + 1 - content.tell()))):
        content.write(block)
    return content.getvalue()


def read_text(path: FilePath) -> str:
    """Return the text of a file of JSON, which may be compressed or stdin.

    Its bound is lower, since what it holds takes many times as much memory.
    """
    return _decoded(path, read_bytes(path, most_bytes() // 4))


def _decoded(path: FilePath, data: bytes) -> str:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise FileError(path, "is not text (UTF-8)", place=f"line {line}") from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise FileError(path, "is not text (a zero byte)", place=f"line {line}")
    return text


def numbered_lines(path: FilePath) -> Lines:
    """Yield the lines of a text file, whatever ends them, with their numbers."""
    data = read_bytes(path)
    _decoded(path, data)  # at once: a decoder of blocks does not tell the line
    yield from enumerate(TextIOWrapper(BytesIO(data), "utf-8-sig"), 1)


def data_lines(path: FilePath) -> Lines:
    """Yield the stripped lines of a text file that are neither blank nor comments."""
    most = most_bytes() // BYTES_OF_LINE
    for number, line in numbered_lines(path):
        if (stripped := line.strip()) and stripped[0] != "#":
            refuse_more(path, number, most, "lines")
            yield number, stripped


def read_numbers(
    path: FilePath, lines: Lines, columns: str, counts: Sequence[int], delimiter: str | None = None
) -> tuple[Floats, Source]:
    """Return the numbers of a file, a row a line, and where the rows are in the file.

    `columns` names the columns for errors, `counts` has the numbers of columns that a file may
    have.
    """
    blocks: list[Floats] = []
    numbers: list[Indices] = []
    while block := list(islice(lines, BLOCK)):
        width = blocks[0].shape[1] if blocks else 0
        blocks.append(_numbers(path, block, columns, counts, delimiter, width))
        numbers.append(np.array([number for number, _ in block]))
    if not blocks:
        raise FileError(path, "has no poses")
    places = np.concatenate(numbers)
    return np.concatenate(blocks), Source(path, lambda row: f"line {places[row]}")


def _numbers(
    path: FilePath,
    block: Sequence[tuple[int, str]],
    columns: str,
    counts: Sequence[int],
    delimiter: str | None,
    width: int,
) -> Floats:
    """Return the numbers of some lines; `width` is that of those before, 0 of the first ones."""
    for number, line in block:
        if len(line) > LONGEST_LINE:
            reason = f"has more than {LONGEST_LINE} characters"
            raise FileError(path, reason, place=f"line {number}")
    with suppress(ValueError):
        text = [line for _, line in block]
        values = np.loadtxt(text, comments=None, delimiter=delimiter, ndmin=2)
        if values.shape[1] in ([width] if width else counts):
            return values
    # Line by line takes twice as long, but tells which line is malformed.
    rows: list[list[float]] = []
    for number, line in block:
        place = f"line {number}"
        fields = line.split(delimiter)
        if len(fields) not in counts:
            raise FileError(path, _wrong_columns(fields, columns), place=place)
        header = "" if width else "; a header line begins with #"
        width = width or len(fields)
        if len(fields) != width:
            reason = f"has {len(fields)} columns, the first line {width}"
            raise FileError(path, reason, place=place)
        for field in fields:
            if not is_number(field):
                raise FileError(path, f"{field[:40]!r} is not a number{header}", place=place)
        rows.append(list(map(float, fields)))
    return np.array(rows)


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
