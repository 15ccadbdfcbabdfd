"""Work in several processes: what is done where, and how they end."""

import multiprocessing
import os
import signal
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from alignscores.comparison import processes
from alignscores.comparison.processes import Pool


def told_nobody(text):
    pass


def test_a_worker_leaves_interruptions_to_the_command_and_watches_it(monkeypatch):
    """In a thread that does not keep it from ending."""
    handlers, watched, ended = {}, [], threading.Event()

    def watch():
        watched.append("command")
        ended.wait()

    monkeypatch.setattr(signal, "signal", handlers.__setitem__)
    monkeypatch.setattr(processes, "_end_with_parent", watch)
    before = set(threading.enumerate())
    processes._in_worker()
    (thread,) = set(threading.enumerate()) - before
    assert thread.daemon
    ended.set()
    thread.join()
    assert handlers == {signal.SIGINT: signal.SIG_IGN}
    assert watched == ["command"]


@pytest.mark.parametrize("there", [True, False])
def test_a_worker_ends_with_the_command(monkeypatch, there):
    said = []
    command = SimpleNamespace(join=lambda: said.append("command ended"))
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: command if there else None)
    monkeypatch.setattr(os, "_exit", said.append)
    processes._end_with_parent()
    assert said == (["command ended", 1] if there else [])


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_several_jobs_are_done_in_processes_that_no_interruption_ends(jobs):
    here = signal.getsignal(signal.SIGINT)
    with Pool(jobs, told_nobody) as pool:
        found = dict(pool.work(signal.getsignal, {"a": signal.SIGINT}, "asking"))
    assert found["a"] == (here if jobs == 1 else signal.SIG_IGN)


def test_a_worker_that_ends_is_an_error_that_says_what_to_do():
    with Pool(2, told_nobody) as pool, pytest.raises(ValueError, match="a process was") as caught:
        dict(pool.work(os._exit, {"a": 3}, "ending"))
    assert str(caught.value) == (
        "a process was ended before its work was done, as when memory is short; what is done is in "
        "the cache: start again, with fewer --jobs"
    )


def test_work_that_nobody_waits_for_is_not_done(tmp_path):
    tasks = {number: tmp_path / str(number) for number in range(1000)}
    with Pool(2, told_nobody) as pool:
        next(pool.work(Path.touch, tasks, "making"))
    assert 0 < len(list(tmp_path.iterdir())) < 1000
