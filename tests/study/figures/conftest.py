"""Trials of the paper's experiments, few of them and made up, and figures drawn from them."""

from functools import cache

import numpy as np
import pytest

from experiments.config import load_sweep
from experiments.metrics import metric as find
from figures import style
from figures.paper import FIGURES


@pytest.fixture(autouse=True)
def _style():
    """Draw as ``python -m figures`` does."""
    with style.applied():
        yield


def worsens(metric, cell, trial, rng):
    """Scores that fall, and errors that grow, with noise and outliers."""
    level = 5 * cell.sigma_t + cell.sigma_r_deg / 20 + cell.n_outliers / 50
    return rng.uniform(0.8, 1) * (np.exp(-level) if find(metric).sign > 0 else 10 * level)


@pytest.fixture(scope="session")
def run(make_up):
    """Make up trials of an experiment, once for all tests: ``run("outliers", "trials=2")``."""

    @cache
    def three_trials(experiment, *overrides):
        sweep = load_sweep([f"experiment={experiment}", "trials=3", *overrides])
        trials = make_up(sweep, value=worsens)
        if experiment == "collinear":  # whose errors have a logarithmic axis
            trials.table[["ATE", "DTE"]] **= 4
        return trials

    return three_trials


@pytest.fixture(scope="session")
def draw(run):
    """Draw a figure of the paper from such trials."""

    @cache
    def draw_three_trials(name, *overrides):
        function, experiments = FIGURES[name]
        trials = [run(experiment, *overrides) for experiment in experiments]
        return function(*(entry.sweep if name == "histogram" else entry.table for entry in trials))

    return draw_three_trials
