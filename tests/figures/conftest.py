"""Tables of trials that look like real ones, made up in a moment."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd
import pytest

from experiments.config import load
from experiments.sweep import cells
from experiments.tables import write_trials


def make_table(experiment: str, *overrides: str) -> pd.DataFrame:
    """All cells of an experiment, with metrics that fall with noise and outliers."""
    config = load([f"experiment={experiment}", "trials=3", *overrides])
    grid = pd.DataFrame([asdict(cell) for cell in cells(config) for _ in range(config.trials)])
    table = pd.DataFrame(
        {
            "experiment": config.name,
            "geometry": config.geometry,
            **grid,
            "replicate": config.replicate,
            "trial": np.tile(np.arange(config.trials), len(grid) // config.trials),
        }
    )
    rng = np.random.default_rng(crc32(config.name.encode()))
    share = 1 - grid["n_outliers"] / grid["n_cameras"]
    for metric in config.metrics:
        scatter = rng.uniform(0.9, 1.0, len(grid))
        score = share * np.exp(-5 * grid["sigma_t"] - 0.1 * grid["sigma_r_deg"]) * scatter
        table[metric] = score if metric in {"mAA", "TAS", "RAS", "PAS"} else 60 * (1 - score)
    return table


@pytest.fixture(scope="session")
def table() -> Callable[..., pd.DataFrame]:
    """Make the table of an experiment: ``table("outliers", "sigma_t=[0.05]")``."""
    return make_table


@pytest.fixture(scope="session")
def write_tables() -> Callable[..., str]:
    """Write such tables into a directory; returns the override that says where they are."""

    def write(directory: Path, *experiments: str) -> str:
        for experiment in experiments:
            config = load([f"experiment={experiment}", f"results_dir={directory}"])
            write_trials(config, make_table(experiment))
        return f"results_dir={directory}"

    return write
