"""Errors of each camera in the first trials: ``python -m experiments.camera_errors --sweeps JSON``.

A table of trials has scores at one threshold; these errors give them at any other.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from joblib import delayed
from numpy.typing import NDArray

from alignscores import ras, tas
from alignscores.arrays import Floats
from alignscores.translation import closest_pair_distances

from .command import ConfigError, run_command
from .config import Execution, Sweep
from .grid import Cell, cells
from .metrics import Column
from .parallel import executor
from .run import resolved
from .sweep import draw_scene, one_blas_thread, trial_seeds
from .tables import read_record, write_recorded

__all__ = ["FIRST", "CameraErrors", "errors_of_scores", "main", "measure", "read_camera_errors"]

Arrays = list[NDArray[Any]]

FIRST = 10  # trials of each cell, so that a page can hold all of them
ARRAYS = "positions", "rotations", "closest", "outliers"
POSITIONS, ROTATIONS = {"TAS", "PAS"}, {"RAS", "PAS"}  # the scores of these errors


@dataclass(frozen=True, eq=False)
class CameraErrors:
    """What the scores of a sweep's first trials are computed from; outliers come first in each."""

    sweep: Sweep
    positions: Floats  # errors in ground-truth units, infinite for a failure; empty if not needed
    rotations: Floats  # errors in degrees, likewise
    closest: Floats  # distances to the closest other camera, ascending in each trial
    outliers: NDArray[np.int64]  # their number in each trial of each cell

    @property
    def scores(self) -> list[str]:
        """The scores that there are errors for."""
        found = {"TAS": self.positions.size > 0, "RAS": self.rotations.size > 0}
        return [*(name for name in found if found[name]), *(["PAS"] if all(found.values()) else [])]

    @cached_property
    def counts(self) -> list[int]:
        """The number of cameras of a trial in each cell."""
        return [len(range(0, cell.n_cameras, self.sweep.every)) for cell in cells(self.sweep)]


def measure(sweeps: Sequence[Sweep], execution: Execution) -> list[CameraErrors]:
    """Run the first trials of each cell, with the seeds that they have in a table of trials."""
    firsts = [replace(sweep, trials=min(sweep.trials, FIRST)) for sweep in sweeps]
    tasks = [(sweep, cell, *errors_of_scores(sweep)) for sweep in firsts for cell in cells(sweep)]
    with one_blas_thread(), executor(execution, len(tasks)) as parallel:
        found: Iterator[Arrays] = parallel(delayed(_measure_cell)(*task) for task in tasks)
        errors = []
        for sweep in firsts:
            of_cells = islice(found, len(cells(sweep)))
            errors.append(CameraErrors(sweep, *map(np.concatenate, zip(*of_cells, strict=True))))
        return errors


def errors_of_scores(sweep: Sweep) -> tuple[bool, bool]:
    """Tell whether a sweep has scores of positions, and of rotations; refuse one without either."""
    names = {Column.parse(metric).metric.name for metric in sweep.metrics}
    wanted = bool(names & POSITIONS), bool(names & ROTATIONS)
    if not any(wanted):
        raise ConfigError("setting 'metrics' has none of TAS, RAS and PAS, whose errors are wanted")
    return wanted


def _measure_cell(sweep: Sweep, cell: Cell, positions: bool, rotations: bool) -> Arrays:
    """Return the arrays of one cell."""
    one_blas_thread()  # stays: see `run_cell`
    found: dict[str, list[Floats]] = {name: [np.empty(0)] for name in ARRAYS[:-1]}
    outliers = []
    for trial in range(sweep.trials):
        camera_seed, registration_seed = trial_seeds(sweep, cell, trial)
        scene = draw_scene(sweep, cell, camera_seed)
        outliers.append(np.count_nonzero(scene.is_outlier))
        outliers_first = np.argsort(~scene.is_outlier, kind="stable")
        if positions:
            result = tas(scene.gt_positions, scene.est_positions, rng=registration_seed)
            found["positions"].append(result.errors[outliers_first])
            found["closest"].append(np.sort(closest_pair_distances(scene.gt_positions)))
        if rotations:
            errors = ras(scene.gt_rotations, scene.est_rotations).errors
            found["rotations"].append(errors[outliers_first])
    return [*map(np.concatenate, found.values()), np.array(outliers)]


def write_camera_errors(path: Path, errors: Sequence[CameraErrors]) -> None:
    """Write the errors of sweeps as ``.npz``, and their record beside them as JSON."""
    arrays: dict[str, Any] = {
        f"{part.sweep.name}.{name}": getattr(part, name) for part in errors for name in ARRAYS
    }
    buffer = BytesIO()
    np.savez(buffer, **arrays)
    write_recorded(path, buffer.getvalue(), [part.sweep for part in errors])


def read_camera_errors(path: Path) -> list[CameraErrors]:
    """Read errors, bit for bit as they were computed; refuse what is not of its record."""
    sweeps = read_record(path).sweeps
    with np.load(path) as arrays:
        parts = [[arrays[f"{sweep.name}.{name}"] for name in ARRAYS] for sweep in sweeps]
    return [CameraErrors(sweep, *found) for sweep, found in zip(sweeps, parts, strict=True)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the errors of sweeps; return the exit code."""
    parser = ArgumentParser(
        prog="python -m experiments.camera_errors",
        description=f"Run the first {FIRST} trials of each cell; write the errors of each camera.",
        epilog="snakemake explorer writes those of all experiments, and the page that shows them",
    )
    parser.add_argument("overrides", nargs="*", default=[], metavar="key=value")
    parser.add_argument("--sweeps", metavar="JSON", help="resolved settings, as of experiments.run")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.npz")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    sweeps, execution = resolved(options)
    # Rather fail now than after the trials.
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_camera_errors(options.output, measure(sweeps, execution))
    return [options.output]


if __name__ == "__main__":
    sys.exit(main())
