"""Score many runs, in this process or in parallel ones.

A `ProcessPoolExecutor` hangs where an interruption or a limit of processes meets it between the
start of its workers and of its threads. Here the parent needs no thread: each worker has a pipe.
"""

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from itertools import islice
from multiprocessing.connection import wait
from typing import Any, TypeVar

from .benchmark import Run
from .runs import Task

__all__ = ["Progress", "work"]

Progress = Callable[[str], None]
Result = TypeVar("Result")

# A fork is ready at once; elsewhere a worker imports NumPy first, where Ctrl-C shows a traceback.
CONTEXT: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else None)


def work(
    function: Callable[[Task], Result],
    tasks: Mapping[Run, Task],
    jobs: int,
    progress: Progress,
    doing: str,
) -> dict[Run, Result]:
    """Return the result of each task, and show how many are done."""
    results: dict[Run, Result] = {}
    with closing(_computed(function, tasks, min(jobs, len(tasks)))) as computed:
        for run, result in computed:
            if isinstance(result, Exception):
                raise result
            results[run] = result
            progress(f"{doing} {len(results)}/{len(tasks)}")
    progress("")
    return results


def _computed(
    function: Callable[[Task], Any], tasks: Mapping[Run, Task], n_workers: int
) -> Generator[tuple[Run, Any], None, None]:
    """Yield each result as soon as it is there; whatever ends this, no worker is left."""
    waiting = iter(tasks.items())
    if n_workers < 2:
        yield from ((run, function(task)) for run, task in waiting)
        return
    workers: list[Any] = []
    busy: dict[Any, Run] = {}  # by the pipe to its worker
    try:
        with _interruptions_deferred():
            for run, task in islice(waiting, n_workers):
                worker, pipe = _start(function)
                workers.append(worker)
                pipe.send(task)
                busy[pipe] = run
        while busy:
            ready: list[Any] = wait(list(busy))
            for pipe in ready:
                run, result = busy.pop(pipe), pipe.recv()
                if following := next(waiting, None):
                    busy[pipe], task = following
                    pipe.send(task)
                yield run, result
    except (ConnectionError, EOFError):
        raise ChildProcessError(
            "a process ended before its work was done, as when memory or processes are limited; "
            "use fewer --jobs"
        ) from None
    finally:
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.join()


def _start(function: Callable[[Task], Any]) -> tuple[Any, Any]:
    """Start a worker; return it with our end of its pipe."""
    try:
        ours, theirs = multiprocessing.Pipe()
        # daemon: at exit Python ends it instead of waiting for it
        worker = CONTEXT.Process(target=_serve, args=(function, theirs), daemon=True)
        worker.start()
    except OSError as error:
        message = f"no further process can be started ({error.strerror}); use fewer --jobs"
        raise ChildProcessError(message) from None
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


def _serve(function: Callable[[Task], Any], pipe: Any) -> None:
    """Compute one task after the other, until the parent ends this process."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        threading.Thread(target=_end_with_parent, daemon=True).start()
    except RuntimeError:  # no thread can be started; the parent finds the pipe closed
        return
    while True:
        task = pipe.recv()
        try:
            result = function(task)
        except Exception as error:  # raised by the parent
            error.add_note(traceback.format_exc())
            result = error
        pipe.send(result)


def _end_with_parent() -> None:
    """End this process where the parent was ended by a signal; it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
