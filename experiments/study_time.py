"""Measure what the values of a study's axes cost in time: ``python -m experiments.study_time``.

The only table that is not the same in every run: it tells of the machine that made it.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from time import process_time

import pandas as pd

from .command import run_command
from .metrics import Evaluation
from .study import STUDIES, Part, Study, load_study
from .sweep import cells, draw_scene, one_blas_thread, trial_seeds
from .tables import to_csv, write_files

__all__ = ["main", "measure"]

REPEATS = 5


def measure(study: Study) -> pd.DataFrame:
    """Time every value of every axis on the scenes that are registered with several seeds.

    Returns
    -------
    DataFrame
        One row for each value and number of cameras: `n_cameras, axis, metric, option, value` and
        `milliseconds`, the median over scenes and repetitions of the processor time of one
        evaluation, registration included.
    """
    parts = [part for part in study.parts.values() if part.seeds]
    with one_blas_thread():
        times = pd.concat([_measure(part, study.columns) for part in parts])
    medians = times.groupby("n_cameras").median()
    return pd.DataFrame(
        [
            {
                "n_cameras": n,
                "axis": axis.name,
                "metric": axis.metric,
                "option": axis.option,
                "value": value,
                "milliseconds": round(1e3 * medians.loc[n, axis.column(value)], 3),
            }
            for n in medians.index
            for axis in study.axes.values()
            for value in axis.values
        ]
    )


def _measure(part: Part, columns: Sequence[str]) -> pd.DataFrame:
    """Seconds of each metric, one row for each repetition on the first scene of each cell."""
    rows = []
    for cell in cells(part.config):
        camera_seed, registration_seed = trial_seeds(part.config, cell, 0)
        scene = draw_scene(part.config, cell, camera_seed)
        for _ in range(REPEATS):  # one after another, so that all share the machine's moods
            row: dict[str, float] = {"n_cameras": cell.n_cameras}
            for column in columns:
                Evaluation(scene, registration_seed).value(column)  # warms up
                start = process_time()
                Evaluation(scene, registration_seed).value(column)
                row[column] = process_time() - start
            rows.append(row)
    return pd.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/tables/<study>_study_time.csv``; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.study_time",
        description="Measure the run time of the values of a study's axes.",
    )
    parser.add_argument("study", metavar="STUDY", help=" | ".join(STUDIES))
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    study = load_study(options.study, options.overrides)
    path = study.table_path("_time")
    path.parent.mkdir(parents=True, exist_ok=True)  # rather fail before the trials than after
    write_files({path: to_csv(measure(study))})
    return [path]


if __name__ == "__main__":
    sys.exit(main())
