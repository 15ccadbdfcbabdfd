"""Times, reported and not asserted: ``pytest -m benchmark``."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import alignscores
from alignscores import closest_pair_quartile, ras, tas
from alignscores.registration import pcr99

pytestmark = pytest.mark.benchmark


@pytest.mark.parametrize(
    ("n", "outliers"), [(15, 4), (100, 30), (100, 80), (1000, 300), (10_000, 3000)]
)
@pytest.mark.parametrize("registration", ["pcr99", "refined"])
def test_tas(benchmark, noisy_scene, registration, n, outliers):
    """The whole score."""
    gt, est = noisy_scene(n, outliers, 0.03, 0)
    assert benchmark(tas, gt, est, registration=registration).n_hypotheses > 0


@pytest.mark.parametrize(("n", "outliers"), [(100, 30), (10_000, 3000)])
def test_pcr99(benchmark, noisy_scene, n, outliers):
    """Its registration alone."""
    gt, est = noisy_scene(n, outliers, 0.03, 0)

    def register():
        rng = np.random.default_rng(0)
        return pcr99(gt, est, rank=n // 10, n_hypotheses=1000, rng=rng)[1]

    assert benchmark(register) == 1000


def test_tas_where_nothing_passes(benchmark, noisy_scene):
    """The whole budget of draws."""
    gt, est = noisy_scene(100, 0, 0, 0)
    est[2:] = 0
    with pytest.warns(alignscores.AlignmentWarning):
        assert benchmark(tas, gt, est).n_hypotheses == 0


@pytest.mark.parametrize("n", [100, 10_000])
def test_d(benchmark, noisy_scene, n):
    """The unit d."""
    gt, _ = noisy_scene(n, 0, 0, 0)
    assert benchmark(closest_pair_quartile, gt) > 0


@pytest.mark.parametrize("n", [100, 2000])
def test_ras(benchmark, noisy_rotations, n):
    """The whole score, quadratic in the number of cameras."""
    gt, est = noisy_rotations(n, 3 * n // 10, 3, 0)
    assert benchmark(ras, gt, est).score > 0


@pytest.mark.parametrize("module", ["numpy, scipy.spatial.transform", "alignscores"])
def test_import(benchmark, module):
    """A fresh interpreter that imports the package, and one that imports what it needs."""
    environment = {**os.environ, "PYTHONPATH": str(Path(alignscores.__file__).parents[1])}
    command = [sys.executable, "-c", f"import {module}"]
    benchmark.pedantic(
        subprocess.run, (command,), {"check": True, "env": environment}, rounds=5, warmup_rounds=1
    )
