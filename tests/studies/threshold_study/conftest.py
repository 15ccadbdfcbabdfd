"""A small threshold study of made-up trials."""

from dataclasses import replace

import pytest

from experiments.config import load_sweep, to_overrides
from studies.threshold_study.axes import axes_of, plan
from studies.threshold_study.effects import effects

GRID = {"n_outliers": [0, 3], "sigma_t": [0.02, 0.06], "sigma_r_deg": [2.0, 6.0], "trials": 30}
VALUES = {"tas_max_threshold": [0.5], "tas_n_thresholds": [5]}


def falls(metric, cell, trial, rng):
    """Fall with noise and outliers, and scatter."""
    return 1 - 5 * cell.sigma_t - 0.05 * cell.n_outliers + 0.05 * rng.normal()


@pytest.fixture(scope="session")
def parts(make_up):
    """The trials of its parts."""
    cameras = {"length": [20, 30]}
    sweeps = {
        name: replace(load_sweep(to_overrides(settings)), n_cameras=cameras.get(name, [20]), **GRID)
        for name, settings in plan(VALUES).items()
    }
    return {name: make_up(sweep, value=falls) for name, sweep in sweeps.items()}


@pytest.fixture
def tables(parts):
    """Copies of the tables, to be changed."""
    return {name: part.table.copy() for name, part in parts.items()}


@pytest.fixture(scope="session")
def axes(parts):
    return axes_of(parts["outliers"].record.metrics)


@pytest.fixture(scope="session")
def table(axes, parts):
    """The effects; not to be changed."""
    return effects(axes, {name: part.table for name, part in parts.items()})
