"""Repeated runs of one's own, scored by many metrics: as they are, and changed in ways known."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd
from tqdm import tqdm

from alignscores.arrays import Booleans, Floats
from alignscores.comparison.benchmark import Benchmark, Run, read_yaml
from alignscores.comparison.comparison import settings_of_run
from alignscores.evaluation.evaluation import Evaluation
from alignscores.evaluation.matching import files_below, read_parts, read_reference
from alignscores.evaluation.notes import collected_warnings
from alignscores.evaluation.scoring import score
from alignscores.evaluation.settings import Settings
from alignscores.protocols import split_names
from alignscores.trajectories.files import Trajectory
from alignscores.validation import finite_rows
from baselines import dre, dte, maa
from experiments.command import ConfigError

from ..study import naming

LIBRARY = (  # of files of one's own, those that need no order of time first
    *("TAS", "RAS", "PAS", "half_distance", "half_angle", "distance@0.25", "angle@0.25"),
    *("ATE", "are:rmse", "auc@30:vggt", "median:hloc"),
)
ORDERED = ("rpe@1f", "rpe@1m:all", "rpe@1m:all:rotation", "rpg@10m", "kitti", "kitti:rotation")
BASELINES: Mapping[str, Callable[[Floats, Floats], float]] = {  # of the poses that there are
    "DTE": dte,
    "DRE": lambda gt, est: dre(gt[:, :3, :3], est[:, :3, :3]),
    "mAA": maa,
}
KEYS = ["sequence", "system", "run", "change"]
AS_IT_IS = "as it is"
SHARE = 0.1  # of the poses, or of the time, that is lost or wild
FACTOR = 1.1  # by which the scale is off

Change = Callable[[Trajectory, np.random.Generator], Trajectory]
Changes = Mapping[str, Change | None]


def _kept(estimate: Trajectory, kept: Booleans) -> Trajectory:
    return Trajectory(estimate.keys[kept], estimate.poses[kept])


def _stretch(estimate: Trajectory, rng: np.random.Generator) -> Booleans:
    """Return which poses are in a stretch of the trajectory, at a random place inside."""
    n = len(estimate.keys)
    start = rng.uniform(SHARE, 1 - 2 * SHARE) * n
    place = np.arange(n)
    return (place >= start) & (place < start + SHARE * n)


def _wild(estimate: Trajectory, rng: np.random.Generator) -> Trajectory:
    """Throw the positions of a stretch about, as far as the trajectory is large."""
    wild, poses = _stretch(estimate, rng), estimate.poses.copy()
    size = np.nanstd(poses[:, :3, 3])
    poses[wild, :3, 3] += rng.normal(scale=size, size=(int(wild.sum()), 3))
    return estimate._replace(poses=poses)


def _scaled(estimate: Trajectory, _: np.random.Generator) -> Trajectory:
    poses = estimate.poses.copy()
    poses[:, :3, 3] *= FACTOR
    return estimate._replace(poses=poses)


CHANGES: Mapping[str, Change] = {
    "every 2nd": lambda estimate, _: _kept(estimate, np.arange(len(estimate.keys)) % 2 == 0),
    "every 5th": lambda estimate, _: _kept(estimate, np.arange(len(estimate.keys)) % 5 == 0),
    "frames lost": lambda estimate, rng: _kept(estimate, rng.random(len(estimate.keys)) >= SHARE),
    "time lost": lambda estimate, rng: _kept(estimate, ~_stretch(estimate, rng)),
    "wild stretch": _wild,
    "scale": _scaled,
    "seed": lambda estimate, _: estimate,
}
"""What an estimate may suffer without being another one; the last gets another seed."""


def read_benchmark(path: Path) -> Benchmark:
    """Read the file of a benchmark, as of ``alignscores compare``; errors are for the user."""
    with naming():
        benchmark = read_yaml(str(path))
    if len({run.system for run in benchmark.runs}) < 2:
        raise ConfigError(f"{path}: has one system; it takes two or more")
    return benchmark


def sources(benchmark: Benchmark, sequence: str) -> list[str]:
    """Return the files that the table of a sequence rests on."""
    runs = [run.file for run in benchmark.runs if run.sequence == sequence and run.file]
    files = [benchmark.references[sequence], *runs]
    return [str(path) for file in files for path in files_below(file)]


def score_sequence(
    benchmark: Benchmark, sequence: str, *, changed: bool = True, more: str = ""
) -> pd.DataFrame:
    """Score all runs on a sequence, as they are and with each of `CHANGES`.

    `more` names further metrics of files, with commas between them.

    Returns
    -------
    DataFrame
        One row for each run and change: `sequence, system, run, change`, then one column a metric,
        empty where it has no value. Runs that cannot be scored have no rows.
    """
    runs = [run for run in benchmark.runs if run.sequence == sequence and run.file]
    settings = {run: _settings(benchmark, run, more) for run in runs}
    changes: Changes = {AS_IT_IS: None, **(CHANGES if changed else {})}
    rows = []
    for run in tqdm(runs, desc=sequence, disable=None):
        try:
            rows += _rows(run, benchmark.references[sequence], settings[run], changes)
        except ValueError as error:
            print(f"{sequence}, {run.system}, run {run.run}: left out: {error}", flush=True)
    columns = [*KEYS, *settings[runs[0]].metrics, *BASELINES]
    return pd.DataFrame(rows, columns=columns).dropna(axis="columns", how="all")


def _settings(benchmark: Benchmark, run: Run, more: str) -> Settings:
    with naming():
        asked = Settings(format=benchmark.format, metrics=tuple(split_names(more) if more else ()))
    known = (*LIBRARY, *(ORDERED if asked.form.ordered else ()))
    metrics = tuple(dict.fromkeys((*known, *asked.metrics)))
    return settings_of_run(benchmark, run, Settings(format=benchmark.format, metrics=metrics))


def _rows(
    run: Run, file: str, settings: Settings, changes: Changes
) -> list[dict[str, str | float | None]]:
    """Return the rows of a run, one a change."""
    keys = run.sequence, run.system, run.run
    rows = []
    with collected_warnings():
        reference = read_reference(file, settings)
        (estimate,) = read_parts(str(run.file), settings).values()
        for name, change in changes.items():
            rng = np.random.default_rng(crc32("/".join([*keys, name]).encode()))
            changed = change(estimate, rng) if change else estimate
            chosen = replace(settings, invert=False, seed=settings.seed + (name == "seed"))
            found = score(reference, changed, chosen, name="", check=False)
            rows.append({**dict(zip(KEYS, (*keys, name), strict=True)), **_values(found)})
    return rows


def _values(found: Evaluation) -> dict[str, float | None]:
    """Return the value of each metric; none where it has none, infinite where it is."""
    given = {"half_distance": found.half_distance, **found.metrics}
    values = {name: given.get(name, found.value(name)) for name in found.settings.metrics}
    gt, est = _poses(found)
    return {**values, **{name: function(gt, est) for name, function in BASELINES.items()}}


def _poses(found: Evaluation) -> tuple[Floats, Floats]:
    """Return the poses that were estimated, each once, with those of the reference."""
    gt, est = found.matches.pose_references, found.estimate.poses[found.matches.pose_rows]
    finite = finite_rows(est)
    return gt[finite], est[finite]
