"""The folder where results are kept: how much of it, and how it is emptied."""

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

__all__ = ["clear", "prune"]

LIMIT = 10**9  # bytes; beyond it the oldest results go
RESULT = re.compile(r"[0-9a-f]{64}\.(npz|json)")  # as `runs` names them


def clear(folder: Path) -> int:
    """Remove all results in a folder, and nothing else; return how many there were."""
    files = list(_results(folder))
    for file in files:
        file.unlink(missing_ok=True)
    return len(files)


def prune(folder: Path, limit: int = LIMIT) -> None:
    """Remove the oldest results in a folder until they take at most `limit` bytes."""
    known = []
    for file in _results(folder):
        with suppress(FileNotFoundError):  # as of another process that prunes, too
            status = file.stat()
            known.append((status.st_mtime, status.st_size, file))
    total = sum(size for _, size, _ in known)
    for _, size, file in sorted(known):
        if total <= limit:
            break
        file.unlink(missing_ok=True)
        total -= size


def _results(folder: Path) -> Iterator[Path]:
    return (file for file in folder.glob("*") if RESULT.fullmatch(file.name))
