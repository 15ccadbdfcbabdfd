"""Calls in parallel processes, which end with this one, whatever ends it.

The executors of the standard library and joblib hang, or leave processes, where an interruption or
a limit of processes meets them between the start of their workers and of their threads. Here the
parent has no thread, and each worker a pipe.
"""

import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

__all__ = ["available_processors", "run_parallel"]

Result = TypeVar("Result")

# A fork is ready at once; elsewhere a worker imports NumPy first, where Ctrl-C shows a traceback.
CONTEXT: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else None)


def available_processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS and Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_parallel(
    function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], n_jobs: int
) -> Generator[tuple[int, Result], None, None]:
    """Yield index and result of each call when it is done; with one job, in this process.

    With -1 there are as many processes as processors, and never more than tasks. Raise what a call
    raises, and a `ChildProcessError` if a process cannot be started or is ended.
    """
    n_workers = min(available_processors() if n_jobs == -1 else n_jobs, len(tasks))
    if n_workers < 2:
        yield from ((index, function(*task)) for index, task in enumerate(tasks))
        return
    waiting = iter(enumerate(tasks))
    workers: list[Any] = []
    busy: dict[Any, int] = {}  # index of the task by the pipe to its worker
    try:
        with _interruptions_deferred():
            for _ in range(n_workers):
                worker, pipe = _start(function)
                workers.append(worker)
                busy[pipe], task = next(waiting)
                pipe.send(task)
        while busy:
            ready: list[Any] = multiprocessing.connection.wait(list(busy))
            for pipe in ready:
                index, result = busy.pop(pipe), pipe.recv()
                if following := next(waiting, None):
                    busy[pipe], task = following
                    pipe.send(task)
                if isinstance(result, Exception):
                    raise result
                yield index, result
    except (ConnectionError, EOFError):
        raise ChildProcessError(
            "a process ended before its work was done, as when memory or processes are limited; "
            "set fewer jobs"
        ) from None
    finally:
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.join()


def _start(function: Callable[..., object]) -> tuple[Any, Any]:
    """Start a worker; return it with our end of its pipe."""
    try:
        ours, theirs = multiprocessing.Pipe()
        # daemon: at exit Python ends it instead of waiting for it
        worker = CONTEXT.Process(target=_serve, args=(function, theirs), daemon=True)
        worker.start()
    except OSError as error:
        raise ChildProcessError(
            f"no further process can be started ({error.strerror}); set fewer jobs"
        ) from None
    theirs.close()
    return worker, ours


@contextmanager
def _interruptions_deferred() -> Iterator[None]:
    """Interrupt only after the workers are started: in the middle of it Python would lose it."""
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        yield  # the system ends the command, and other threads are not interrupted
        return
    interruptions: list[Any] = []
    signal.signal(signal.SIGINT, lambda *frame: interruptions.append(frame))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if interruptions:
            handler(*interruptions[0])


def _serve(function: Callable[..., object], pipe: Any) -> None:
    """Compute one task after the other, until the parent ends this process."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as a shell has it in the background
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        threading.Thread(target=_end_with_parent, daemon=True).start()
    except RuntimeError:  # no thread can be started; the parent finds the pipe closed
        return
    while True:
        task = pipe.recv()
        result: object
        try:
            result = function(*task)
        except Exception as error:  # raised by the parent
            error.add_note(traceback.format_exc())
            result = error
        pipe.send(result)


def _end_with_parent() -> None:
    """End this process if the parent was ended by a signal; it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
