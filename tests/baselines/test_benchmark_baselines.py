"""Times of the baselines at the size of the study, 100 cameras: ``pytest -m benchmark``."""

from collections.abc import Callable
from typing import Any

import pytest

from alignscores.arrays import Floats
from baselines import ate, dre, dte, maa, rotation_statistics

Scene = Callable[..., tuple[Floats, Floats]]
pytestmark = pytest.mark.benchmark


@pytest.mark.parametrize("metric", [dte, maa])
def test_poses(benchmark: Any, scene: Scene, metric: Callable[..., float]) -> None:
    benchmark(metric, *scene(100, 10, 0.03, 3, 0))


def test_positions(benchmark: Any, scene: Scene) -> None:
    benchmark(ate, *(poses[:, :, 3] for poses in scene(100, 10, 0.03, 3, 0)))


@pytest.mark.parametrize("metric", [dre, rotation_statistics])
def test_rotations(benchmark: Any, scene: Scene, metric: Callable[..., Any]) -> None:
    benchmark(metric, *(poses[:, :, :3] for poses in scene(100, 10, 0.03, 3, 0)))


@pytest.mark.parametrize("n", [1000, 3000])
def test_many_pairs(benchmark: Any, scene: Scene, n: int) -> None:
    benchmark.pedantic(maa, scene(n, n // 10, 0.03, 3, 0), rounds=3)
