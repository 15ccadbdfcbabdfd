"""Trials of the paper's experiments, few of them, and figures drawn from them."""

from functools import cache
from pathlib import Path

import pytest

from experiments.config import load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import Record, Trials
from figures import style
from figures.paper import FIGURES


@pytest.fixture(autouse=True)
def _style():
    """Draw as ``python -m figures`` does."""
    with style.applied():
        yield


@pytest.fixture(scope="session")
def run():
    """Run an experiment, once for all tests: ``run("outliers", "sigma_t=[0.05]")``."""

    @cache
    def run_three_trials(experiment, *overrides):
        settings = [f"experiment={experiment}", "trials=3", *overrides]
        sweep = load_sweep(settings)
        path = Path("results", "trials", f"{experiment}.csv")
        return Trials(path, run_sweeps([sweep]), Record((sweep,), {}))

    return run_three_trials


@pytest.fixture(scope="session")
def draw(run):
    """Draw a figure of the paper from such trials."""

    @cache
    def draw_three_trials(name, *overrides):
        function, experiments = FIGURES[name]
        trials = [run(experiment, *overrides) for experiment in experiments]
        return function(*(entry.sweep if name == "histogram" else entry.table for entry in trials))

    return draw_three_trials
