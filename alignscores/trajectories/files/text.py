"""Files of text and bytes, also compressed or from stdin, and what is wrong with them."""

import gzip
import os
import sys
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...arrays import Booleans

__all__ = ["FAILURES", "STDIN", "FileError"]

FilePath = str | PathLike[str]
Lines = Iterator[tuple[int, str]]  # lines with their numbers, from 1

STDIN = "-"
GZIP = b"\x1f\x8b"  # the first bytes
LIMIT = "ALIGNSCORES_MAX_MB"  # the variable of the environment that raises the bound
MOST_MB = 256
BYTES_OF_LINE = 64  # of the bound: a file may have as many lines as this makes of it
BYTES = 1 << 20  # that are read at a time


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
    megabytes = os.environ.get(LIMIT) or str(MOST_MB)
    if not (is_number(megabytes, finite=True) and float(megabytes) > 0):
        raise ValueError(f"{LIMIT} must be a number of MB above 0, not {megabytes[:40]!r}")
    return int(min(float(megabytes) * 10**6, sys.maxsize / 2))


def refuse_more(path: FilePath, number: int, most: int, unit: str = "bytes") -> None:
    """Raise an error for a file that is too large."""
    if number > most:
        raise FileError(path, f"has more than {most} {unit}; set {LIMIT} higher to read it")


def read_bytes(path: FilePath, most: int | None = None) -> bytes:
    """Return the content of a file, which may be compressed or stdin, if it is not too large."""
    most = most or most_bytes()
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
    refuse_more(path, len(data), most)
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
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise FileError(path, "is not text (UTF-8)", place=f"line {line}") from None


def numbered_lines(path: FilePath) -> Lines:
    """Yield the lines of a text file, whatever ends them, with their numbers."""
    data, most = read_bytes(path), most_bytes() // BYTES_OF_LINE
    _decoded(path, data)  # at once: a decoder of blocks does not tell the line
    for number, line in enumerate(TextIOWrapper(BytesIO(data), "utf-8-sig"), 1):
        refuse_more(path, number, most, "lines")
        yield number, line


def is_number(field: str, *, finite: bool = False) -> bool:
    """Return whether a field holds a number; with `finite` a finite one."""
    try:
        return isfinite(float(field)) or not finite
    except ValueError:
        return False
