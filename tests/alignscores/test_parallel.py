"""Calls in parallel processes."""

import multiprocessing
import os
import signal
import threading

import pytest

from alignscores.parallel import run_parallel


def share(number: int) -> tuple[int, int]:
    return number, os.getpid()


@pytest.mark.parametrize(
    ("n_tasks", "n_jobs", "n_processes"), [(0, 3, 0), (1, 3, 0), (2, 3, 2), (9, 3, 3), (9, 1, 0)]
)
def test_results_come_from_no_more_processes_than_tasks(
    n_tasks: int, n_jobs: int, n_processes: int
) -> None:
    results = dict(run_parallel(share, [(number,) for number in range(n_tasks)], n_jobs))
    assert sorted((index, number) for index, (number, _) in results.items()) == [
        (index, index) for index in range(n_tasks)
    ]
    assert len({process for _, process in results.values()} - {os.getpid()}) <= n_processes
    assert not multiprocessing.active_children()


def reciprocal(number: int) -> float:
    return 1 / number


def test_an_error_in_a_worker_is_raised_with_its_traceback() -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        list(run_parallel(reciprocal, [(1,), (0,)], 2))
    assert "in reciprocal" in caught.value.__notes__[0]
    assert not multiprocessing.active_children()


def test_a_killed_worker_is_one_sentence() -> None:
    kill = [(signal.SIGKILL,)] * 2
    with pytest.raises(ChildProcessError, match=r"^a process ended before its work was done, "):
        list(run_parallel(signal.raise_signal, kill, 2))
    assert not multiprocessing.active_children()


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_outside_the_main_thread() -> None:
    results: dict[int, int] = {}
    thread = threading.Thread(
        target=lambda: results.update(run_parallel(reciprocal, [(1,), (-1,)], 2))
    )
    thread.start()
    thread.join()
    assert results == {0: 1, 1: -1}
