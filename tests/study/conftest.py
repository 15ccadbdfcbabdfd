"""Trials that are made up: what they show is known."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.grid import evaluations
from experiments.tables import Record, Trials


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
