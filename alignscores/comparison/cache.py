"""The folder where results are kept: whose it is, how much of it, and how it is emptied."""

import hashlib
import os
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..writing import write_whole

__all__ = ["clear", "load", "make", "prune", "store"]

LIMIT = 10**9  # bytes; beyond it the oldest results go
DIGEST = 32  # bytes, before a result
# As `runs` names them; and what is left where a process was killed as it wrote one.
RESULT = re.compile(r"[0-9a-f]{64}\.(npz|json)|\.[0-9a-f]{16}\.tmp")


def make(folder: Path, *, private: bool = False) -> str:
    """Make the folder, for its owner alone; return why it is not to be used, nothing if it is.

    With `private` one that others may read or write to becomes its owner's alone.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if hasattr(os, "geteuid"):  # not on Windows
            if folder.stat().st_uid != os.geteuid():
                return "belongs to somebody else"
            if private:
                folder.chmod(0o700)
            if folder.stat().st_mode & 0o022:
                return "may be written to by others"
    except OSError:
        return "is not writable"
    return "" if os.access(folder, os.W_OK | os.X_OK) else "is not writable"


def store(file: Path, content: bytes) -> None:
    """Keep a result with its digest; where it cannot be written, go on without."""
    with suppress(ValueError):
        write_whole(file, _digest(file, content) + content)


def load(file: Path) -> bytes | None:
    """Return a result, None where there is none that is as it was stored."""
    try:
        if not file.is_file() or file.stat().st_size > LIMIT:
            return None
        data = file.read_bytes()
    except OSError:
        return None
    digest, content = data[:DIGEST], data[DIGEST:]
    return content if digest == _digest(file, content) else None


def _digest(file: Path, content: bytes) -> bytes:
    return hashlib.sha256(file.name.encode() + content).digest()


def clear(folder: Path) -> int:
    """Remove all results in a folder, and nothing else; return how many there were."""
    count = 0
    for file in _results(folder):
        with suppress(OSError):  # as of a folder of such a name
            file.unlink()
            count += 1
    return count


def prune(folder: Path, limit: int = LIMIT) -> None:
    """Remove the oldest results in a folder until they take at most `limit` bytes."""
    known = []
    for file in _results(folder):
        with suppress(OSError):  # as of another process that prunes, too
            status = file.stat()
            known.append((status.st_mtime, status.st_size, file))
    total = sum(size for _, size, _ in known)
    for _, size, file in sorted(known):
        if total > limit:
            with suppress(OSError):
                file.unlink(missing_ok=True)
                total -= size


def _results(folder: Path) -> Iterator[Path]:
    return (file for file in list(folder.glob("*")) if RESULT.fullmatch(file.name))
