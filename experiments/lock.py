"""Who writes in a folder of results: a run of the workflow alone, or single experiments."""

from fcntl import LOCK_EX, LOCK_NB, LOCK_SH, flock
from pathlib import Path
from typing import TextIO

from .command import CommandError

__all__ = ["hold"]


def hold(results: Path, *, is_shared: bool = False) -> TextIO:
    """Return the lock of a folder, which is held as long as it is open and ends with its process.

    Single experiments share it, as each has a table of its own.
    """
    try:
        results.mkdir(parents=True, exist_ok=True)
        lock = (results / ".lock").open("w")
    except OSError as error:
        problem = f"cannot write in results_dir={results}: {error.strerror}"
        raise CommandError(problem) from None
    try:
        flock(lock, (LOCK_SH if is_shared else LOCK_EX) | LOCK_NB)
    except BlockingIOError:
        lock.close()
        problem = "wait for it, or set another results_dir"
        raise CommandError(f"another run is at work in {results}; {problem}") from None
    return lock
