"""Dask's workers give the bytes of a serial run, also when one dies; what is wrong is one line."""

import os
import signal
import socket
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from distributed import LocalCluster

from alignscores import __version__
from experiments import parallel, sweep, tables
from experiments.config import Sweep, load
from experiments.run import main

MANY_CELLS = f"sigma_t={[level / 200 for level in range(1, 21)]}"
Refused = Callable[[str], str]
LOOPBACK = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}


@pytest.mark.parametrize(("tasks", "processes"), [(0, 1), (1, 1), (2, 2), (9, 3)])
def test_no_more_processes_are_started_than_there_are_cells(tasks: int, processes: int) -> None:
    with parallel.executor(load(["n_jobs=3"])[1], tasks) as joblib:
        assert joblib.n_jobs == processes


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    """Two workers of their own processes, one thread each."""
    with LocalCluster(n_workers=2, threads_per_worker=1, **LOOPBACK) as cluster:
        yield cluster


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_changes_no_bit(
    small: Callable[..., Sweep],
    run: Callable[..., pd.DataFrame],
    cluster: LocalCluster,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left: list[int] = []

    def kill_one_after_the_first(results: Iterable[Any], total: int, **_: object) -> Iterator[Any]:
        for number, result in enumerate(results, start=1):
            if number == 1:
                busy = [w for w in cluster.scheduler.workers.values() if w.processing]
                os.kill(cluster.workers[busy[0].name].pid, signal.SIGKILL)
                left.append(total - number)
            yield result

    serial = run(small(MANY_CELLS))
    monkeypatch.setattr(sweep, "tqdm", kill_one_after_the_first)
    table = run(small(MANY_CELLS), backend="dask", dask_address=cluster.scheduler_address)
    assert left == [39]
    pd.testing.assert_frame_equal(table, serial, check_exact=True)
    assert table.to_csv() == serial.to_csv()


@pytest.fixture
def refused(
    small_overrides: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> Refused:
    """Return the one line in which a run on an address ends."""

    def run(address: str) -> str:
        dask = [MANY_CELLS, "backend=dask", f"dask_address={address}"]
        settings = [*small_overrides[:4], *dask, f"results_dir={tmp_path}"]
        assert main(settings) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert not list(tmp_path.rglob("*.csv"))
        return line

    return run


def test_dask_that_is_not_installed_is_one_line(
    refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    line = refused("tcp://127.0.0.1:8786")
    assert "'backend': dask is not installed; pip install -e '.[cluster]'" in line


@pytest.mark.parametrize("listens", [False, True])
def test_an_address_without_a_scheduler_is_one_line_in_bounded_time(
    refused: Refused, monkeypatch: pytest.MonkeyPatch, listens: bool
) -> None:
    """Nobody is there, or somebody who takes the call and says nothing."""
    monkeypatch.setattr(parallel, "PATIENCE", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        if not listens:
            mute.close()
        assert f"no dask scheduler at {address} (" in refused(address)


def test_an_address_that_is_none_is_one_line(refused: Refused) -> None:
    assert "nowhere (missing port number" in refused("nowhere")


def test_a_worker_with_other_packages_is_refused(
    refused: Refused, cluster: LocalCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "version", lambda name: "0.0.1")
    assert f"has alignscores {__version__}, this process 0.0.1" in refused(
        cluster.scheduler_address
    )


def test_a_scheduler_without_workers_is_one_line(
    refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parallel, "PATIENCE", 2)
    with LocalCluster(n_workers=0, **LOOPBACK) as empty:
        assert "has no workers after 2 s" in refused(empty.scheduler_address)


@pytest.mark.slow
def test_a_cluster_lost_in_the_middle_is_one_line(
    refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    with LocalCluster(n_workers=1, threads_per_worker=2, **LOOPBACK) as short_lived:

        def close_after_the_first(results: Iterable[Any], **_: object) -> Iterator[Any]:
            for result in results:
                short_lived.close()
                yield result

        monkeypatch.setattr(sweep, "tqdm", close_after_the_first)
        address = short_lived.scheduler_address
        assert f"lost the cluster at {address} (" in refused(address)
