"""Trajectories of one's own at several frame rates: each camera, each second, each fifth ..."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field, RootModel

from alignscores import AlignmentWarning
from alignscores.trajectories.association import match
from alignscores.trajectories.files import Trajectory, TrajectoryWarning
from alignscores.trajectories.formats import FORMATS
from experiments.config import one_of, read_yaml
from experiments.metrics import evaluate
from experiments.scenes import Scene

from ..study import Section, naming

RATES = (1, 2, 5, 10, 20, 50, 100)
METRICS = ("TAS", "TAS(registration=refined)", "HalfDistance", "ATE", "RAS", "HalfAngle")
FEWEST = 10  # cameras that are worth scoring


class _Recording(Section):
    format: Annotated[str, one_of(FORMATS)]
    reference: Path
    estimates: Annotated[dict[str, Path], Field(min_length=1)]  # by the names of the systems


class _File(RootModel[dict[str, _Recording]]):
    root: Annotated[dict[str, _Recording], Field(min_length=1)]


def score_rates(file: Path) -> pd.DataFrame:
    """Score all estimates of a file with each camera kept, each second, each fifth, and so on.

    Returns
    -------
    DataFrame
        One row for each recording, system and rate: `recording, system, every, cameras`, then one
        column a metric.
    """
    rows = []
    for name, recording in read_yaml(file, _File).root.items():
        for system, estimate in recording.estimates.items():
            read = FORMATS[recording.format].read
            scene = _scene(read, file.parent / recording.reference, file.parent / estimate)
            for k in RATES:
                kept = scene[::k]
                n = len(kept.gt_positions)
                if n >= FEWEST:
                    keys = {"recording": name, "system": system, "every": k, "cameras": n}
                    rows.append(keys | evaluate(kept, METRICS, np.random.SeedSequence(0)))
    return pd.DataFrame(rows)


def _scene(read: Callable[..., Trajectory], reference: Path, estimate: Path) -> Scene:
    with naming(), warnings.catch_warnings():
        warnings.simplefilter("ignore", TrajectoryWarning)
        warnings.simplefilter("ignore", AlignmentWarning)
        matches = match(read(reference, complete=True), read(estimate))
    gt, est = matches.gt_poses, matches.est_poses
    unknown = np.zeros(len(gt), dtype=np.bool_)
    return Scene(gt[:, :3, :3], gt[:, :3, 3], est[:, :3, :3], est[:, :3, 3], unknown)
