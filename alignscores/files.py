"""The door through which every file comes in: regular files and pipes, of a limited size."""

import errno
import os
import select
import stat
from codecs import getincrementaldecoder
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from io import BufferedReader, BytesIO, FileIO, TextIOWrapper
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import IO

import numpy as np

from .arrays import Booleans

__all__ = ["FAILURES", "FileError", "FilePath"]

FilePath = str | PathLike[str]

MAX_BYTES = 500_000_000  # of a file, and of an array; a million poses in TUM's format are 110 MB
MAX_LINE = 20_000_000  # letters
MAX_PIPE = 100_000_000  # of a pipe, whose content is held in memory
# A named pipe without a writer would block the program where it is opened.
FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
COMPRESSED = b"\x1f\x8b", b"PK\x03\x04", b"BZh", b"\xfd7zXZ"  # gzip, zip, bzip2, xz
MAX_SILENCE = 10.0  # seconds without a byte after which a pipe is given up


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
    >>> from alignscores.io import FileError
    >>> print(FileError("estimate.txt", "has 2 columns", place="line 1"))
    estimate.txt, line 1: has 2 columns
    """

    def __init__(self, path: FilePath, reason: str, *, place: str = "") -> None:
        super().__init__(f"{path}{place and ', '}{place}: {reason}")
        self.path, self.reason, self.place = path, reason, place


_pipes: dict[str, bytes] = {}  # content of pipes whose format was looked at, by their paths

# What a file that cannot be read or scored may end in; others go on.
FAILURES = ArithmeticError, MemoryError, OSError, RecursionError, ValueError


@dataclass(frozen=True)
class Source:
    """The file that an array was read from, and the place of each row in it."""

    path: FilePath
    place_of_row: Callable[[int], str]

    def error(self, row: int, reason: str) -> FileError:
        """Return the error that something is wrong with a row."""
        return FileError(self.path, reason, place=self.place_of_row(row))

    def refuse(self, wrong: Booleans, reason: str) -> None:
        """Raise the error that something is wrong with the first of some rows, if there are any."""
        if wrong.any():
            raise self.error(int(np.argmax(wrong)), reason)


def open_file(path: FilePath, max_bytes: int = MAX_BYTES) -> "BufferedReader[FileIO] | BytesIO":
    """Open a regular file, or a pipe, which is read to its end.

    Raise a FileError for folders, devices and sockets, for files that are too large, and for a
    pipe that stays silent.
    """
    if (content := _pipes.pop(os.fspath(path), None)) is not None:
        return BytesIO(content)
    try:
        status = Path(path).stat()
        mode = status.st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
            raise FileError(path, "is a device, not a file")
        if status.st_size > max_bytes:
            raise _too_large(path, max_bytes)
        file = BufferedReader(FileIO(os.open(path, FLAGS)))
        if not stat.S_ISFIFO(mode):
            return file
        with file:
            return BytesIO(_content_of_pipe(path, file.fileno()))
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None


def _content_of_pipe(path: FilePath, descriptor: int) -> bytes:
    content = bytearray()
    while select.select([descriptor], [], [], MAX_SILENCE)[0]:
        chunk = os.read(descriptor, 1 << 20)
        if not chunk:
            return bytes(content)
        content += chunk
        if len(content) > MAX_PIPE:
            raise _too_large(path, MAX_PIPE)
    raise FileError(path, f"is a pipe that sent nothing for {MAX_SILENCE:g} s")


def _too_large(path: FilePath, max_bytes: int) -> FileError:
    return FileError(path, f"has more than {max_bytes / 1e6:g} MB, the largest size that is read")


def read_bytes(path: FilePath, max_bytes: int = MAX_BYTES) -> bytes:
    """Return the content of a file."""
    with open_file(path, max_bytes) as file:
        return _read(path, file)


def read_text(path: FilePath, max_bytes: int = MAX_BYTES) -> str:
    """Return the text of a file."""
    content = read_bytes(path, max_bytes)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _no_text(path, content, error.start) from None


def _read(path: FilePath, file: IO[bytes], n_bytes: int = -1) -> bytes:
    try:
        return file.read(n_bytes)
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None


def _no_text(path: FilePath, content: bytes, position: int) -> FileError:
    if content.startswith(COMPRESSED):
        return FileError(
            path, "is compressed; unpack it first, or write an array of PyTorch as .npy"
        )
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return FileError(path, "is UTF-16, as PowerShell's > writes it; save it as UTF-8")
    line = content.count(b"\n", 0, position) + 1
    return FileError(path, "is not text (UTF-8)", place=f"line {line}")


def read_head(path: FilePath) -> str:
    """Return the first megabyte of a text file; who opens a pipe next gets all of it again."""
    with open_file(path) as file:
        if isinstance(file, BytesIO):
            _pipes[os.fspath(path)] = file.getvalue()
        content = _read(path, file, 1 << 20)
    try:
        return getincrementaldecoder("utf-8-sig")().decode(content)
    except UnicodeDecodeError as error:
        raise _no_text(path, content, error.start) from None


def numbered_lines(path: FilePath, max_bytes: int = MAX_BYTES) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text file with their numbers, from 1, whatever ends the lines."""
    with (
        open_file(path, max_bytes) as file,
        TextIOWrapper(file, "utf-8-sig", errors="surrogateescape") as text,
    ):
        try:
            for number, line in enumerate(iter(partial(text.readline, MAX_LINE), ""), 1):
                if len(line) == MAX_LINE:
                    reason = f"has more than {MAX_LINE / 1e6:g} million letters"
                    raise FileError(path, reason, place=f"line {number}")
                if not line.isascii():
                    line.encode()
                yield number, line
        except UnicodeEncodeError:
            raise FileError(path, "is not text (UTF-8)", place=f"line {number}") from None
        except OSError as error:
            raise FileError(path, f"cannot be read ({error.strerror})") from None


def is_number(field: str, *, finite: bool = False) -> bool:
    """Return whether a field holds a number; with `finite` a finite one."""
    try:
        return isfinite(to_number(field)) or not finite
    except ValueError:
        return False


def to_number(field: str) -> float:
    """Return the number in a field; Python's own spellings, as 1_000, are none."""
    if "_" in field or not field.isascii():
        raise ValueError(field)
    return float(field)
