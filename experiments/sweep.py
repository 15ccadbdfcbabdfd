"""The sweep: every cell of an experiment's grid, trial by trial, over joblib."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product
from typing import Any
from zlib import crc32

import numpy as np
import pandas as pd
from joblib import delayed
from threadpoolctl import ThreadpoolController
from tqdm import tqdm

from .cameras import Scene, make_scene
from .config import Config
from .metrics import Evaluation
from .parallel import executor
from .tables import KEY_COLUMNS

__all__ = ["Cell", "cells", "draw_scene", "one_blas_thread", "run_trials", "sweep", "trial_seeds"]

BATCH = 50  # trials side by side


@dataclass(frozen=True)
class Cell:
    """One combination of settings; an experiment runs its trials in every cell."""

    n_cameras: int
    n_outliers: int
    sigma_t: float
    sigma_r_deg: float


def cells(config: Config) -> list[Cell]:
    """Return the cells of an experiment's grid in the order of its result table.

    Examples
    --------
    >>> from experiments.config import load
    >>> from experiments.sweep import cells
    >>> grid = cells(load(["experiment=outliers"]))
    >>> len(grid), grid[0]
    (70, Cell(n_cameras=100, n_outliers=0, sigma_t=0.01, sigma_r_deg=3.0))
    """
    noise = (
        list(zip(config.sigma_t, config.sigma_r_deg, strict=True))
        if config.noise == "paired"
        else list(product(config.sigma_t, config.sigma_r_deg))
    )
    return [
        Cell(n, k, sigma_t, sigma_r)
        for n, k, (sigma_t, sigma_r) in product(config.n_cameras, config.n_outliers, noise)
    ]


def trial_seeds(config: Config, cell: Cell, trial: int) -> list[np.random.SeedSequence]:
    """Seeds of the cameras and of the registration of one trial.

    They depend on the experiment's name, the cell's own values, the replicate and the trial alone:
    not on the rest of the grid, nor on the order or the process in which trials run.
    """
    key = (crc32(config.name.encode()), crc32(repr(cell).encode()), config.replicate, trial)
    return np.random.SeedSequence(config.seed, spawn_key=key).spawn(2)


def draw_scene(config: Config, cell: Cell, seed: np.random.SeedSequence) -> Scene:
    """Draw the cameras of one trial."""
    volume = 1.0 if config.volume_per_camera is None else config.volume_per_camera * cell.n_cameras
    return make_scene(
        np.random.default_rng(seed),
        geometry=config.geometry,
        error=config.error,
        outliers=config.outliers,
        outlier_side=config.outlier_side,
        volume=volume,
        **asdict(cell),
    )


def run_trials(
    config: Config, cell: Cell, trials: Sequence[int], metrics: Sequence[str]
) -> list[dict[str, Any]]:
    """Run trials: draw the scenes, evaluate the metrics, return rows of the result table.

    They run side by side, one metric on scene after scene: its code stays in the caches.
    """
    evaluations = [
        Evaluation(draw_scene(config, cell, camera_seed), registration_seed)
        for camera_seed, registration_seed in (trial_seeds(config, cell, t) for t in trials)
    ]
    values = {metric: [scene.value(metric) for scene in evaluations] for metric in metrics}
    keys = {"experiment": config.name, "geometry": config.geometry, **asdict(cell)}
    keys["replicate"] = config.replicate
    return [
        {**keys, "trial": trial, **dict(zip(values, row, strict=True))}
        for trial, *row in zip(trials, *values.values(), strict=True)
    ]


@cache
def _blas() -> ThreadpoolController:
    """Find the BLAS libraries of this process; looking for them takes as long as a trial."""
    return ThreadpoolController().select(user_api="blas")


def one_blas_thread() -> AbstractContextManager[object]:
    """Compute on one BLAS thread: more could change the last bits."""
    limit: AbstractContextManager[object] = _blas().limit(limits=1)
    return limit


def run_cell(config: Config, cell: Cell, metrics: Sequence[str]) -> list[dict[str, Any]]:
    """Run all trials of a cell, on one BLAS thread: more could change the last bits.

    The limit stays: a worker may run other cells beside this one, which must not get theirs back.
    """
    one_blas_thread()
    batches = (range(config.trials)[i : i + BATCH] for i in range(0, config.trials, BATCH))
    return [row for trials in batches for row in run_trials(config, cell, trials, metrics)]


def sweep(config: Config, metrics: Mapping[Cell, Sequence[str]] | None = None) -> pd.DataFrame:
    """Run an experiment.

    Parameters
    ----------
    config : Config
        Its settings.
    metrics : mapping of Cell to sequence of str, optional
        The cells to run and what to evaluate in each; by default all cells and metrics of the
        experiment. The values are the same.

    Returns
    -------
    DataFrame
        One row a trial: `KEY_COLUMNS`, then one column a metric, empty where it was not asked for.
        The same for any number of processes and any backend, bit for bit. Progress goes to standard
        error.

    Raises
    ------
    ConfigError
        Where the backend cannot be reached.
    """
    plan = dict.fromkeys(cells(config), config.metrics) if metrics is None else metrics
    # The limit of the cells stays in their process; here it ends with the sweep.
    with one_blas_thread(), executor(config) as parallel:
        results: Iterator[list[dict[str, Any]]] = parallel(
            delayed(run_cell)(config, cell, wanted) for cell, wanted in plan.items()
        )
        progress = tqdm(results, total=len(plan), desc=config.name, unit="cell", disable=None)
        rows = [row for batch in progress for row in batch]
    columns = dict.fromkeys(metric for wanted in plan.values() for metric in wanted)
    return pd.DataFrame(rows, columns=[*KEY_COLUMNS, *columns])
