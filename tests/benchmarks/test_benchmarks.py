"""The benchmarks measure what they say, and the page holds what was measured."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from alignscores.registration import kernel
from benchmarks import __main__ as benchmarks
from benchmarks import protocols
from benchmarks.contenders import METRICS, PROFILE, REFINED, UNCOMPILED, contenders, scene
from benchmarks.floor import compiled_loop, counter
from benchmarks.memory import STATUS


def test_floor_counts_inliers() -> None:
    library = compiled_loop()
    if library is None:
        pytest.skip("no C compiler")
    rng = np.random.default_rng(0)
    gt, est = rng.random((2, 150, 3))
    hypotheses = rng.normal(size=(20, 3, 4))
    residuals = np.einsum("hij,nj->hni", hypotheses[:, :, :3], gt) + hypotheses[:, None, :, 3] - est
    expected = np.count_nonzero(np.sum(residuals**2, axis=2) < 2.0, axis=1)
    assert 0 < expected.sum() < expected.size * len(gt)
    np.testing.assert_array_equal(counter(library, hypotheses, gt, est, 2.0)(), expected)


def test_contenders_do_their_work() -> None:
    """Every metric gives the value of its scene; the floor's hypotheses are the true alignment."""
    calls = contenders(60, 0.3, compiled_loop())
    assert set(calls) - {"pycolmap", "floor", UNCOMPILED} == {*METRICS, REFINED, PROFILE}
    assert float(calls[REFINED]()) >= float(calls["TAS"]())  # type: ignore[arg-type]
    assert len(calls[PROFILE]().units) == 64  # type: ignore[attr-defined]
    for name, metric in METRICS.items():
        assert float(calls[name]()) == float(metric(scene(60, 0.3)))  # type: ignore[arg-type]
    if kernel.LIBRARY is not None:
        library = kernel.LIBRARY
        assert float(calls[UNCOMPILED]()) == float(calls["TAS"]())  # type: ignore[arg-type]
        assert kernel.LIBRARY is library
    if "floor" in calls:
        assert np.all(np.asarray(calls["floor"]()) > 30)
    if "pycolmap" in calls:
        assert calls["pycolmap"]() is not None


def test_the_shortest_time_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Turn by turn, several calls where they are quick, one call where it is slow."""
    durations = {"quick": iter([0.01, *[0.004, 0.003, 0.005] * 100]), "slow": iter([3.0, 2.0])}
    order: list[str] = []

    def clock(call: Callable[[], object], repeats: int) -> float:
        name = str(call())
        order.append(name)
        return next(durations[name])

    monkeypatch.setattr(benchmarks, "clock", clock)
    times = benchmarks.measure({name: lambda name=name: name for name in durations})  # type: ignore[misc]
    assert times == {"quick": 0.003, "slow": 3.0}
    assert order.count("slow") == 1
    assert order.count("quick") == 1 + benchmarks.MAX_TURNS


def test_page_and_plot(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One command, all numbers on the page, a dash where a contender is missing."""
    metric_times = dict(zip(METRICS, np.arange(1, 7) / 1000, strict=True))
    monkeypatch.setattr(benchmarks, "compiled_loop", lambda: None)
    monkeypatch.setattr(benchmarks, "contenders", lambda *_: {})
    others = {"pycolmap": 0.004, UNCOMPILED: 0.02, REFINED: 0.0018, PROFILE: 0.07}
    monkeypatch.setattr(benchmarks, "measure", lambda _: metric_times | others)
    monkeypatch.setattr(benchmarks, "peak_memory", lambda _name, n: n / 100)
    monkeypatch.setattr(sys, "argv", ["benchmarks", "--output", str(tmp_path)])
    assert benchmarks.main() == 0
    page = (tmp_path / "reference" / "benchmarks.md").read_text()
    assert "| 100 | 1 | 2 | 3 | 4 | 5 | 6 |" in page
    assert "| 100 | 90% | 1 | 4 | 0.25 | – | – | 20 |" in page
    assert "| 100 | 90% | 1 | 1.8 | 1.80 | 70 |" in page
    assert "| 10,000 | 100 | 100 |" in page
    assert (tmp_path / "images" / "benchmarks.png").stat().st_size > 10_000


def test_milliseconds() -> None:
    times = [benchmarks.milliseconds(s) for s in (0.00012345, 0.0456, 1.23456, 123.4)]
    assert times == ["0.123", "45.6", "1,235", "123,400"]


@pytest.mark.skipif(not STATUS.exists(), reason="not Linux")
def test_peak_memory_is_that_of_one_metric() -> None:
    """It is the process's own, however large this one is, and grows with the cameras."""
    ballast = np.ones(1 << 26)  # 512 MiB
    few, many = (benchmarks.peak_memory("DTE", n) for n in (50, 50_000))
    assert ballast.all()
    assert 30 < few < 400
    assert few + 20 < many < few + 400
    assert 30 < benchmarks.peak_memory("ate:rmse", 50) < 400


def test_protocols_page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Each protocol has a value or none on its scene, a row on the page, and its own memory."""
    calls, long_enough = protocols.calls(30), protocols.calls(100)
    for name, call in calls.items():
        value = float(call())  # type: ignore[arg-type]
        if name in ("kitti", "rpg@100m"):
            assert np.isnan(value)
            value = float(long_enough[name]())  # type: ignore[arg-type]
        assert value >= 0
    monkeypatch.setattr(protocols, "peak_memory", lambda _name, n: n / 10)
    monkeypatch.setattr(protocols, "measure", lambda calls: dict.fromkeys(calls, 0.002))
    monkeypatch.setattr(sys, "argv", ["benchmarks.protocols", "--output", str(tmp_path)])
    assert protocols.main() == 0
    page = (tmp_path / "reference" / "protocol-benchmarks.md").read_text()
    assert "| `auc@30:vggt` | 2 | 2 | 2 | 2 | 2 | 1000 | 10,000 |" in page
