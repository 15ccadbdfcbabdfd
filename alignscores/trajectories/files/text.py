"""Files of text and bytes, also compressed or from stdin, and what is wrong with them."""

import gzip
import os
import sys
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO, StringIO
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


def read_bytes(path: FilePath) -> bytes:
    """Return the content of a file, which may be compressed or stdin, if it is not too large."""
    try:
        if str(path) == STDIN:
            if sys.stdin is None:
                raise FileError(path, "standard input is closed")
            data = _read(path, sys.stdin.buffer)
        else:
            with Path(path).open("rb") as file:
                data = _read(path, file)
        if data.startswith(GZIP) or str(path).endswith(".gz"):
            data = _read(path, gzip.GzipFile(fileobj=BytesIO(data)))
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise FileError(path, f"is not a complete gzip file ({error})") from None
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None
    return data


def _read(path: FilePath, stream: BinaryIO | gzip.GzipFile) -> bytes:
    """Return what a stream holds; refuse one that is too large, or has no end."""
    megabytes = os.environ.get(LIMIT) or str(MOST_MB)
    if not (is_number(megabytes) and float(megabytes) > 0):
        raise ValueError(f"{LIMIT} must be a number of MB above 0, not {megabytes[:40]!r}")
    content = BytesIO()
    while block := stream.read(BYTES):
        content.write(block)
        if content.tell() > float(megabytes) * 10**6:
            reason = f"has more than {megabytes} MB; set {LIMIT} higher to read it"
            raise FileError(path, reason)
    return content.getvalue()


def read_text(path: FilePath) -> str:
    """Return the text of a file, which may be compressed or stdin."""
    try:
        return read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise FileError(path, "is not text (UTF-8)", place=f"line {line}") from None


def numbered_lines(path: FilePath) -> Lines:
    """Yield the lines of a text file, whatever ends them, with their numbers."""
    yield from enumerate(StringIO(read_text(path), newline=None), 1)


def is_number(field: str, *, finite: bool = False) -> bool:
    """Return whether a field holds a number; with `finite` a finite one."""
    try:
        return isfinite(float(field)) or not finite
    except ValueError:
        return False
