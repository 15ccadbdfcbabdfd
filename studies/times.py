"""What the values of a study's axes cost in time: the only table that differs from run to run."""

from collections.abc import Sequence
from time import process_time

import pandas as pd

from experiments.config import Sweep
from experiments.grid import cells
from experiments.metrics import Column, Evaluation
from experiments.sweep import draw_scene, one_blas_thread, trial_seeds

from .axes import Axis

REPETITIONS = 5


def measure(axes: Sequence[Axis], sweeps: Sequence[Sweep]) -> pd.DataFrame:
    """Time every value of every axis on the first scene of each cell of some sweeps.

    Returns
    -------
    DataFrame
        One row for each value and number of cameras: `n_cameras, axis, metric, option, value` and
        `milliseconds`, the median over scenes and repetitions of the processor time of one
        evaluation, registration included.
    """
    columns = {name: Column.parse(name) for axis in axes for name in axis.columns.values()}
    with one_blas_thread():
        times = pd.DataFrame([row for sweep in sweeps for row in _measure(sweep, columns)])
    medians = times.groupby("n_cameras").median()
    rows = [
        {"n_cameras": n, **axis.keys(value), "milliseconds": 1e3 * medians.loc[n, column]}
        for n in medians.index
        for axis in axes
        for value, column in axis.columns.items()
    ]
    return pd.DataFrame(rows).round(3)


def _measure(sweep: Sweep, columns: dict[str, Column]) -> list[dict[str, float]]:
    """Seconds of each metric, one row for each repetition on the first scene of each cell."""
    rows = []
    for cell in cells(sweep):
        camera_seed, registration_seed = trial_seeds(sweep, cell, 0)
        scene = draw_scene(sweep, cell, camera_seed)
        for _ in range(REPETITIONS):  # in turn, so that a slow spell of the machine hits all values
            row: dict[str, float] = {"n_cameras": cell.n_cameras}
            for name, column in columns.items():
                Evaluation(scene, registration_seed).value(column)  # warms up
                start = process_time()
                Evaluation(scene, registration_seed).value(column)
                row[name] = process_time() - start
            rows.append(row)
    return rows
