"""Work on many runs, in this process or in several side by side."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from .benchmark import Run
from .runs import Task

__all__ = ["Pool", "Progress"]

Progress = Callable[[str], None]
Result = TypeVar("Result")


class Pool:
    """Processes side by side; with one job, this process alone."""

    def __init__(self, jobs: int, progress: Progress) -> None:
        self._executor = None if jobs == 1 else ProcessPoolExecutor(jobs, initializer=_in_worker)
        self._progress = progress

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *_: object) -> None:
        if self._executor:
            self._executor.shutdown(cancel_futures=True)

    def work(
        self, function: Callable[[Task], Result], tasks: Mapping[Run, Task], doing: str
    ) -> Iterator[tuple[Run, Result]]:
        """Yield the result of each task, and show how far it is."""
        for number, (run, result) in enumerate(self._results(function, tasks), 1):
            self._progress(f"{doing} {number}/{len(tasks)}")
            yield run, result
        self._progress("")

    def _results(
        self, function: Callable[[Task], Result], tasks: Mapping[Run, Task]
    ) -> Iterator[tuple[Run, Result]]:
        if self._executor is None:
            yield from ((run, function(task)) for run, task in tasks.items())
            return
        futures = {self._executor.submit(function, task): run for run, task in tasks.items()}
        for future in as_completed(futures):
            try:
                yield futures[future], future.result()
            except BrokenProcessPool:
                raise ValueError(
                    "a process was ended before its work was done, as when memory is short; what "
                    "is done is in the cache: start again, with fewer --jobs"
                ) from None


def _in_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the work
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process where the parent was ended by a signal; it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
