"""Calls in parallel processes, which end with this one, whatever ends it.

Executors hang if Ctrl-C or a limit of processes comes between the starts of their processes and
threads. Here the parent has no thread, and each worker a pipe.
"""

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from .command import CommandError

__all__ = ["run_parallel"]

Result = TypeVar("Result")


def run_parallel(
    function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], n_jobs: int
) -> Iterator[Result]:
    """Yield the result of each call in order; with one job, from this process."""
    n_processes = min(len(tasks), _cpu_count() if n_jobs == -1 else n_jobs)
    if n_processes <= 1:
        yield from (function(*task) for task in tasks)
        return
    workers = []
    results: dict[int, Any] = {}
    try:
        for first in range(n_processes):
            share = dict(list(enumerate(tasks))[first::n_processes])
            workers.append(_start(function, share))
        receivers = [receiver for _, receiver in workers]
        for index in range(len(tasks)):
            while index not in results:
                results.update(_receive(receivers))
            result = results.pop(index)
            if isinstance(result, Exception):
                raise result
            yield result
    finally:
        for process, _ in workers:
            process.kill()
        for process, _ in workers:
            process.join()


def _cpu_count() -> int:
    """Return how many cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS
        return os.cpu_count() or 1


def _start(
    function: Callable[..., object], share: dict[int, tuple[Any, ...]]
) -> tuple[BaseProcess, Connection]:
    """Start a worker for a share of the tasks; return it with the pipe of its results."""
    context: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else None)
    try:
        receiver, sender = context.Pipe(duplex=False)
        # At exit Python ends a daemon, and would wait for any other process.
        process = context.Process(target=_work, args=(function, share, sender), daemon=True)
        process.start()
    except OSError as error:
        problem = f"cannot start another process ({error.strerror})"
        raise CommandError(f"{problem}; set n_jobs=1") from None
    sender.close()
    return process, receiver


def _receive(receivers: Sequence[Connection]) -> list[tuple[int, Any]]:
    """Wait for results, and return those that are there."""
    ready: list[Any] = wait(receivers)
    try:
        return [receiver.recv() for receiver in ready]
    except (EOFError, OSError):
        problem = "a worker process was killed, likely for lack of memory"
        raise CommandError(f"{problem}; set n_jobs=1, or fewer cameras") from None


def _work(
    function: Callable[..., object], share: dict[int, tuple[Any, ...]], sender: Connection
) -> None:
    """Send the results of a share of the tasks, and wait for the end, which is the parent's."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as a shell has it in the background
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        threading.Thread(target=_end_with_parent, daemon=True).start()
    except RuntimeError:  # a thread too many
        os._exit(1)
    for index, task in share.items():
        try:
            result = function(*task)
        except Exception as error:
            error.add_note(traceback.format_exc())
            result = error
        sender.send((index, result))
    _end_with_parent()


def _end_with_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
    os._exit(1)
