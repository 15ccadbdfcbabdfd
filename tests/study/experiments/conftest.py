"""A small experiment that runs in a moment."""

import pytest

from experiments.config import load_sweep
from experiments.sweep import run_sweeps

SMALL = [
    "experiment=outliers",
    "trials=3",
    "n_cameras=[25]",
    "n_outliers=[0,3]",
    "sigma_t=[0.02,0.05]",
]


@pytest.fixture(scope="session")
def small():
    return lambda *overrides: load_sweep([*SMALL, *overrides])


@pytest.fixture(scope="session")
def run():
    """Run one sweep, in this process by default."""
    return lambda sweep, n_jobs=1: run_sweeps([sweep], n_jobs)


@pytest.fixture(scope="session")
def trials(small, run):
    """The trials of the small experiment; not to be changed."""
    return run(small())
