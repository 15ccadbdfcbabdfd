"""A small experiment that runs in a moment."""

from collections.abc import Callable

import pytest

from experiments.config import Config, load

SMALL = [
    "experiment=outliers",
    "trials=3",
    "n_cameras=[25]",
    "n_outliers=[0,3]",
    "sigma_t=[0.02,0.05]",
    "n_jobs=1",
]


@pytest.fixture
def small_overrides() -> list[str]:
    return list(SMALL)


@pytest.fixture
def small() -> Callable[..., Config]:
    return lambda *overrides: load([*SMALL, *overrides])
