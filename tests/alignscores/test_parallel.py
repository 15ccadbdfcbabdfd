"""Calls in parallel processes."""

import multiprocessing
import signal
import threading

import pytest

from alignscores.parallel import run_parallel


def reciprocal(number):
    return 1 / number


def test_a_killed_worker_is_one_sentence():
    kill = [(signal.SIGKILL,)] * 2
    with pytest.raises(ChildProcessError, match=r"^a process ended before its work was done, "):
        list(run_parallel(signal.raise_signal, kill, 2))
    assert not multiprocessing.active_children()


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_outside_the_main_thread():
    results = {}
    thread = threading.Thread(
        target=lambda: results.update(run_parallel(reciprocal, [(1,), (-1,)], 2))
    )
    thread.start()
    thread.join()
    assert results == {0: 1, 1: -1}
