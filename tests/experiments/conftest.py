"""A small experiment that runs in a moment."""

from collections.abc import Callable

import pandas as pd
import pytest

from experiments.config import Sweep, load_sweep
from experiments.sweep import run_sweeps

SMALL = [
    "experiment=outliers",
    "trials=3",
    "n_cameras=[25]",
    "n_outliers=[0,3]",
    "sigma_t=[0.02,0.05]",
]


@pytest.fixture(scope="session")
def small() -> Callable[..., Sweep]:
    return lambda *overrides: load_sweep([*SMALL, *overrides])


@pytest.fixture(scope="session")
def run() -> Callable[..., pd.DataFrame]:
    """Run one sweep, in this process by default."""
    return lambda sweep, n_jobs=1: run_sweeps([sweep], n_jobs)


@pytest.fixture(scope="session")
def trials(small: Callable[..., Sweep], run: Callable[..., pd.DataFrame]) -> pd.DataFrame:
    """The trials of the small experiment; not to be changed."""
    return run(small())
