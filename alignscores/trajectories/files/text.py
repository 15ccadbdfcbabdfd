"""Files of text and bytes, and what is wrong with them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import StringIO
from math import isfinite
from os import PathLike
from pathlib import Path

import numpy as np

from ...arrays import Booleans

__all__ = ["FAILURES", "FileError"]

FilePath = str | PathLike[str]
Lines = Iterator[tuple[int, str]]  # lines with their numbers, from 1


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
    """Return the content of a file."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None


def read_text(path: FilePath) -> str:
    """Return the text of a file."""
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
