"""Repeated runs from user-supplied files, scored by many metrics: as they are, and once a second.

The offset between the clocks of a system and a reference is removed first: it is an error of the
recording and not of the poses. It is the median over the runs of the system on the sequence.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from alignscores import ras_angle, tas_distance
from alignscores.arrays import Floats
from alignscores.comparison.benchmark import Benchmark, Run, read_yaml
from alignscores.comparison.comparison import settings_of_run
from alignscores.evaluation.clock import find_clock
from alignscores.evaluation.evaluation import Evaluation
from alignscores.evaluation.notes import collected_warnings
from alignscores.evaluation.reading import files_below, read_estimate, read_reference
from alignscores.evaluation.scoring import score
from alignscores.evaluation.settings import Settings
from alignscores.io import Trajectory
from alignscores.metrics import split_names
from alignscores.validation import finite_rows
from baselines import dre, dte, maa
from experiments.command import ConfigError

from ..study import naming

LIBRARY = (  # of user-supplied files, those that need no order of time first
    *("TAS", "RAS", "PAS", "half_distance", "half_angle"),
    *("ATE", "are:rmse", "auc@30:vggt", "median:hloc"),
)
ORDERED = ("rpe@1f", "rpe@1m:all", "rpe@1m:all:rotation", "rpg@10m", "kitti", "kitti:rotation")
BASELINES: Mapping[str, Callable[[Floats, Floats], Any]] = {  # of the poses that there are
    "DTE": dte,
    "DRE": lambda gt, est: dre(gt[:, :3, :3], est[:, :3, :3]),
    "mAA": maa,
}
QUARTERS: Mapping[str, Callable[[Floats, Floats], float]] = {  # of the frames that are expected
    "distance@0.25": lambda gt, est: tas_distance(gt[:, :3, 3], est[:, :3, 3], 0.25),
    "angle@0.25": lambda gt, est: ras_angle(gt[:, :3, :3], est[:, :3, :3], 0.25),
}
KEYS = ["sequence", "system", "run", "t_offset", "poses"]
ALL_POSES = "all"
EQUAL_TIMES = "equal times"  # one pose in each second: no metric can tell the rate of the poses


def _at_equal_times(estimate: Trajectory) -> Trajectory:
    """Return the pose nearest to each whole second, within half of one."""
    distance = np.abs(estimate.keys - np.round(estimate.keys))
    order = np.lexsort((distance, np.round(estimate.keys)))
    rows = order[np.unique(np.round(estimate.keys)[order], return_index=True)[1]]
    return Trajectory(estimate.keys[rows], estimate.poses[rows])


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


def score_sequence(benchmark: Benchmark, sequence: str, *, more: str = "") -> pd.DataFrame:
    """Score all runs on a sequence, as they are and with one pose a second.

    `more` names further metrics of files, with commas between them.

    Returns
    -------
    DataFrame
        Two rows for each run: `sequence, system, run, t_offset` (seconds added to its
        stamps), `poses`, then one column a metric, empty where it has no value. Runs that cannot
        be scored have no rows.
    """
    runs = [run for run in benchmark.runs if run.sequence == sequence and run.file]
    settings = {run: _settings(benchmark, run, more) for run in runs}
    with collected_warnings():
        reference = read_reference(benchmark.references[sequence], settings[runs[0]])
        estimates = {}
        for run in runs:
            try:
                estimates[run] = read_estimate(str(run.file), settings[run])
            except ValueError as error:
                print(f"{sequence}, {run.system}, run {run.run}: left out: {error}", flush=True)
        offsets = clock_offsets(reference, estimates)
        rows = [
            row
            for run, estimate in tqdm(estimates.items(), desc=sequence, disable=None)
            for row in _rows(run, reference, estimate, settings[run], offsets[run.system])
        ]
    columns = [*KEYS, *settings[runs[0]].metrics, *QUARTERS, *BASELINES]
    return pd.DataFrame(rows, columns=columns).dropna(axis="columns", how="all")


def clock_offsets(reference: Trajectory, estimates: Mapping[Run, Trajectory]) -> dict[str, float]:
    """Return the seconds to be added to the stamps of each system; 0 where none is certain."""
    offsets: dict[str, list[float]] = {run.system: [] for run in estimates}
    for run, estimate in estimates.items():
        if estimate.keys.dtype.kind == "f":
            offset = find_clock(reference, estimate)
            offsets[run.system].append(offset.seconds if offset and offset.certain else 0.0)
    return {system: float(np.median(own)) if own else 0.0 for system, own in offsets.items()}


def _settings(benchmark: Benchmark, run: Run, more: str) -> Settings:
    with naming():
        asked = Settings(format=benchmark.format, metrics=tuple(split_names(more) if more else ()))
    names = (*LIBRARY, *(ORDERED if asked.form.ordered else ()))
    metrics = tuple(dict.fromkeys((*names, *asked.metrics)))
    return settings_of_run(benchmark, run, Settings(format=benchmark.format, metrics=metrics))


def _rows(
    run: Run,
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    offset: float,
) -> list[dict[str, object]]:
    """Return the rows of a run; with too few poses there is none."""
    keys = run.sequence, run.system, run.run
    chosen = replace(settings, invert=False, t_offset=0.0)
    estimate = estimate._replace(keys=estimate.keys + offset) if offset else estimate
    rows = []
    for name, poses in ((ALL_POSES, estimate), (EQUAL_TIMES, _at_equal_times(estimate))):
        try:
            evaluation = score(reference, poses, chosen, name="", check=False)
        except ValueError as error:
            print(f"{'/'.join(keys)}, {name}: left out: {error}", flush=True)
            continue
        rows.append({**dict(zip(KEYS, (*keys, offset, name), strict=True)), **_values(evaluation)})
    return rows


def _values(scored: Evaluation) -> dict[str, float | None]:
    """Return the value of each metric; none where it has none, infinite where it is."""
    metrics = {"half_distance": scored.half_distance, **scored.metrics}
    values = {name: metrics.get(name, scored.value(name)) for name in scored.settings.metrics}
    frames = scored.matches.gt_poses, scored.matches.est_poses
    values |= {name: function(*frames) for name, function in QUARTERS.items()}
    poses = _poses(scored)
    return values | {name: function(*poses) for name, function in BASELINES.items()}


def _poses(scored: Evaluation) -> tuple[Floats, Floats]:
    """Return the reference's and the estimated poses, each estimated one once."""
    gt, est = scored.matches.pose_references, scored.estimate.poses[scored.matches.pose_rows]
    finite = finite_rows(est)
    return gt[finite], est[finite]
