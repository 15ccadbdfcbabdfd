"""Sweeps: every cell of a grid, trial by trial, in parallel processes."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from operator import itemgetter
from typing import Any
from zlib import crc32

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from .config import Sweep
from .grid import KEY_COLUMNS, Cell, evaluations
from .metrics import evaluate_scenes
from .scenes import Scene, make_scene

__all__ = ["draw_scene", "run_sweeps", "trial_seeds"]

BATCH = 50  # trials that are held in memory


def trial_seeds(sweep: Sweep, cell: Cell, trial: int) -> list[np.random.SeedSequence]:
    """Return the seeds of the cameras and of the registration of one trial.

    They depend on the experiment's name, the values of the cell, the replicate and the trial:
    not on the rest of the grid, nor on the order or the process in which trials run.
    """
    key = (crc32(sweep.name.encode()), crc32(repr(cell).encode()), sweep.replicate, trial)
    return np.random.SeedSequence(sweep.seed, spawn_key=key).spawn(2)


def draw_scene(sweep: Sweep, cell: Cell, seed: np.random.SeedSequence) -> Scene:
    """Draw the cameras of one trial; of `every=n` every n-th is kept.

    With `frame=study` the ground truths of all trials of a study are turned by one random rotation.
    """
    volume = 1.0 if sweep.volume_per_camera is None else sweep.volume_per_camera * cell.n_cameras
    scene = make_scene(
        np.random.default_rng(seed),
        geometry=sweep.geometry,
        error=sweep.error,
        outliers=sweep.outliers,
        outlier_side=sweep.outlier_side,
        volume=volume,
        **vars(cell),
    )
    if sweep.frame == "study":
        key = (crc32(sweep.name.encode()), sweep.replicate)
        rng = np.random.default_rng(np.random.SeedSequence(sweep.seed, spawn_key=key))
        turn = Rotation.random(rng=rng).as_matrix()
        gt_positions = scene.gt_positions @ turn.T
        scene = replace(scene, gt_positions=gt_positions, gt_rotations=turn @ scene.gt_rotations)
    return scene if sweep.every == 1 else scene[:: sweep.every]


def run_trials(
    sweep: Sweep, cell: Cell, trials: Sequence[int], metrics: Sequence[str]
) -> list[dict[str, Any]]:
    """Run some trials of a cell in one batch, and return a row for each."""
    seeds = [trial_seeds(sweep, cell, trial) for trial in trials]
    scenes = [draw_scene(sweep, cell, camera_seed) for camera_seed, _ in seeds]
    values = evaluate_scenes(scenes, [seed for _, seed in seeds], metrics, sweep)
    keys = {"experiment": sweep.name, "geometry": sweep.geometry, **vars(cell)}
    keys["replicate"] = sweep.replicate
    return [
        {**keys, "trial": trial, **dict(zip(values, row, strict=True))}
        for trial, *row in zip(trials, *values.values(), strict=True)
    ]


@cache
def _use_one_blas_thread() -> None:
    """Let this process compute on one BLAS thread: more could change the last bits."""
    threadpool_limits(1, user_api="blas")


def run_cell(
    index: int, sweep: Sweep, cell: Cell, metrics: Sequence[str]
) -> tuple[int, list[dict[str, Any]]]:
    """Run all trials of a cell; return its index in the grid, and a row for each trial."""
    _use_one_blas_thread()
    batches = (range(sweep.trials)[i : i + BATCH] for i in range(0, sweep.trials, BATCH))
    return index, [row for trials in batches for row in run_trials(sweep, cell, trials, metrics)]


def run_sweeps(sweeps: Sequence[Sweep], n_jobs: int = 1) -> pd.DataFrame:
    """Run sweeps and join their trials in one table, with progress on standard error.

    Returns
    -------
    DataFrame
        One row a trial: `experiment, geometry, n_cameras, n_outliers, sigma_t, sigma_r_deg,
        replicate, trial`, then one column a metric, empty where it was not asked for. Where there
        are several sweeps, a column `settings` has what differs from the experiment's own. The
        same for any number of processes, bit for bit.
    """
    tables = [_run_sweep(sweep, n_jobs) for sweep in sweeps]
    if len(tables) == 1:
        return tables[0]
    for sweep, table in zip(sweeps, tables, strict=True):
        table.insert(1, "settings", sweep.changes)
    return pd.concat(tables, ignore_index=True)


def _run_sweep(sweep: Sweep, n_jobs: int) -> pd.DataFrame:
    wanted = evaluations(sweep)
    tasks = [
        delayed(run_cell)(index, sweep, cell, metrics)
        for index, (cell, metrics) in enumerate(wanted.items())
    ]
    done = _parallel(n_jobs)(tasks)
    progress = tqdm(done, total=len(tasks), desc=sweep.name, unit="cell", disable=None)
    rows = [row for _, cell_rows in sorted(progress, key=itemgetter(0)) for row in cell_rows]
    columns = dict.fromkeys(metric for metrics in wanted.values() for metric in metrics)
    return pd.DataFrame(rows, columns=[*KEY_COLUMNS, *columns])


def _parallel(n_jobs: int) -> Any:
    try:
        return Parallel(n_jobs, return_as="generator_unordered")
    except ValueError:  # a backend without generators, such as multiprocessing
        return Parallel(n_jobs, return_as="list")
