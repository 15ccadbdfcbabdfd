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
from threadpoolctl import ThreadpoolController, threadpool_limits

from experiments import parallel, sweep, tables
from experiments.config import Config
from experiments.run import main

Small = Callable[..., Config]

MANY_CELLS = f"sigma_t={[level / 200 for level in range(1, 21)]}"
LOOPBACK = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    """Two workers of their own processes, one thread each."""
    with LocalCluster(n_workers=2, threads_per_worker=1, **LOOPBACK) as cluster:
        yield cluster


@pytest.fixture
def on_dask(cluster: LocalCluster) -> list[str]:
    return ["backend=dask", f"dask_address={cluster.scheduler_address}"]


def test_a_worker_killed_in_the_middle_changes_no_bit(
    small: Small, cluster: LocalCluster, on_dask: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    left: list[int] = []

    def kill_one_after_the_first(results: Iterable[Any], total: int, **_: object) -> Iterator[Any]:
        for number, result in enumerate(results, start=1):
            if number == 1:
                busy = [w for w in cluster.scheduler.workers.values() if w.processing]
                os.kill(cluster.workers[busy[0].name].pid, signal.SIGKILL)
                left.append(total - number)
            yield result

    serial = sweep.sweep(small(MANY_CELLS))
    with monkeypatch.context() as patch:
        patch.setattr(sweep, "tqdm", kill_one_after_the_first)
        table = sweep.sweep(small(MANY_CELLS, *on_dask))
    assert left == [39]
    pd.testing.assert_frame_equal(table, serial, check_exact=True)
    assert table.to_csv() == serial.to_csv()


def test_the_thread_limit_of_blas_stays_with_a_worker_and_ends_with_a_sweep(small: Small) -> None:
    """Otherwise a cell would lift the limit of another that runs beside it."""

    def threads() -> set[int]:
        blas = ThreadpoolController().select(user_api="blas")
        return {library["num_threads"] for library in blas.info()}

    with threadpool_limits(2, user_api="blas"):
        sweep.sweep(small("backend=sequential"))
        assert threads() == {2}
        config = small()
        sweep.run_cell(config, sweep.cells(config)[0], ["ATE"])
        assert threads() == {1}


def refused(overrides: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one line in which a run ends."""
    assert main([*overrides, f"results_dir={tmp_path}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert not list(tmp_path.rglob("*.csv"))
    return line


def test_dask_that_is_not_installed_is_one_line(
    small_overrides: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    overrides = [*small_overrides, "backend=dask", "dask_address=tcp://127.0.0.1:8786"]
    assert "alignscores[cluster]" in refused(overrides, tmp_path, capsys)


@pytest.mark.parametrize("listens", [False, True])
def test_an_address_without_a_scheduler_is_one_line_in_bounded_time(
    small_overrides: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    listens: bool,
) -> None:
    """Nobody is there, or somebody who takes the call and says nothing."""
    monkeypatch.setattr(parallel, "PATIENCE", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        if not listens:
            mute.close()
        overrides = [*small_overrides, "backend=dask", f"dask_address={address}"]
        line = refused(overrides, tmp_path, capsys)
    assert f"no dask scheduler at {address}" in line


def test_an_address_that_is_none_is_one_line(
    small_overrides: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    overrides = [*small_overrides, "backend=dask", "dask_address=nowhere"]
    assert "nowhere (missing port number" in refused(overrides, tmp_path, capsys)


def test_a_worker_with_other_packages_is_refused(
    small_overrides: list[str],
    on_dask: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tables, "version", lambda name: "0.0.1")
    line = refused([*small_overrides, *on_dask], tmp_path, capsys)
    assert "alignscores 0.1.0, this process 0.0.1" in line


def test_a_scheduler_without_workers_is_one_line(
    small_overrides: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(parallel, "PATIENCE", 2)
    with LocalCluster(n_workers=0, **LOOPBACK) as empty:
        overrides = ["backend=dask", f"dask_address={empty.scheduler_address}"]
        line = refused([*small_overrides, *overrides], tmp_path, capsys)
    assert "has no workers" in line


def test_a_cluster_lost_in_the_middle_is_one_line(
    small_overrides: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with LocalCluster(n_workers=1, threads_per_worker=2, **LOOPBACK) as short_lived:

        def close_after_the_first(results: Iterable[Any], **_: object) -> Iterator[Any]:
            for result in results:
                short_lived.close()
                yield result

        monkeypatch.setattr(sweep, "tqdm", close_after_the_first)
        overrides = [MANY_CELLS, "backend=dask", f"dask_address={short_lived.scheduler_address}"]
        line = refused([*small_overrides, *overrides], tmp_path, capsys)
    assert "lost the cluster" in line
