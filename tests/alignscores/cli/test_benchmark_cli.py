"""Time of the whole command on a long trajectory: ``pytest -m benchmark``."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.cli import main

pytestmark = pytest.mark.benchmark


@pytest.mark.parametrize("n", [1000, 10_000, 100_000])
@pytest.mark.timeout(1200)
def test_command(benchmark, tmp_path, n):
    rng = np.random.default_rng(n)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.02, (n, 3)), axis=0))
    positions = np.cumsum(rng.normal(0.05, 0.1, (n, 3)), axis=0)
    files = []
    for name, delay, sigma in (("reference", 0.0, 0.0), ("estimate", 0.001, 0.05)):
        noise = Rotation.from_rotvec(rng.normal(0, sigma, (n, 3)), degrees=False)
        stamps = np.arange(n) / 20 + delay
        poses = positions + rng.normal(0, sigma, (n, 3)), (noise * turns).as_quat()
        files.append(tmp_path / f"{name}.txt")
        np.savetxt(files[-1], np.column_stack([stamps, *poses]), fmt="%.6f")
    arguments = ["tum", *map(str, files)]
    assert benchmark.pedantic(main, args=(arguments,), rounds=1) == 0
