"""Trials that are made up: what they show is known."""

import inspect
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.grid import evaluations
from experiments.tables import Record, Trials
from studies.statements import load_claims

CLAIMS = load_claims(3)  # of the paper, decided by three studies; read once, which takes long


def undescribed(function, table):
    """Return the columns that a docstring does not name: the documentation shows it."""
    described = set(re.findall(r"\w+", inspect.getdoc(function) or ""))
    names = [re.sub("_(error|p)$", "", str(column)) for column in table.columns]
    return [name for name in names if name not in described]


@pytest.fixture(scope="session")
def make_up():
    """Make up the trials of sweeps: the value of each metric is that of a function."""

    def made_up(*sweeps, value, path="made_up.csv", seed=0):
        rng = np.random.default_rng(seed)
        rows = [
            {"experiment": sweep.name}
            | ({"settings": sweep.changes} if sweeps[1:] else {})
            | {"geometry": sweep.geometry, **vars(cell)}
            | {"replicate": sweep.replicate, "trial": trial}
            | {metric: value(metric, cell, trial, rng) for metric in metrics}
            for sweep in sweeps
            for cell, metrics in evaluations(sweep).items()
            for trial in range(sweep.trials)
        ]
        return Trials(Path(path), pd.DataFrame(rows), Record(sweeps, {}))

    return made_up


@pytest.fixture
def written(tmp_path):
    """Write trials under names, and return the paths."""
    from experiments.tables import write_trials

    def write(trials):
        for name, made in trials.items():
            path = tmp_path / f"{name}.csv"
            for written in (path, path.with_suffix(".json")):
                written.unlink(missing_ok=True)
            write_trials(path, made.table, made.record.sweeps)
        return [str(tmp_path / f"{name}.csv") for name in trials]

    return write
