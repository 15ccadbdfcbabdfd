"""Trajectories of one's own at several frame rates: each camera, each second, each fifth ..."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field, RootModel

from alignscores import AlignmentWarning
from alignscores.trajectories.association import match
from alignscores.trajectories.files import TrajectoryWarning
from alignscores.trajectories.formats import FORMATS
from experiments.command import ConfigError
from experiments.config import one_of, read_yaml
from experiments.metrics import evaluate
from experiments.scenes import Scene

from ..study import Section

RATES = (1, 2, 5, 10, 20, 50, 100)
METRICS = ("TAS", "TAS(registration=refined)", "HalfDistance", "ATE", "RAS", "HalfAngle")
FEWEST = 10  # cameras that are worth scoring


class Recording(Section):
    """A reference trajectory, and the files of estimates of it by the names of the systems."""

    format: Annotated[str, one_of(FORMATS)]
    reference: Path
    estimates: Annotated[dict[str, Path], Field(min_length=1)]


class _File(RootModel[dict[str, Recording]]):
    root: Annotated[dict[str, Recording], Field(min_length=1)]


def read_recordings(path: Path) -> dict[str, Recording]:
    """Read a file of recordings; its paths are relative to it."""
    return {
        name: recording.model_copy(
            update={
                "reference": path.parent / recording.reference,
                "estimates": {s: path.parent / file for s, file in recording.estimates.items()},
            }
        )
        for name, recording in read_yaml(path, _File).root.items()
    }


def score_rates(recordings: Mapping[str, Recording]) -> pd.DataFrame:
    """Score all estimates with each camera kept, each second, each fifth, and so on.

    Returns
    -------
    DataFrame
        One row for each recording, system and rate: `recording, system, every, cameras`, then one
        column a metric.
    """
    rows = []
    for name, recording in recordings.items():
        for system, path in recording.estimates.items():
            scene = _scene(recording, path)
            for k in RATES:
                kept = scene[::k]
                n = len(kept.gt_positions)
                if n >= FEWEST:
                    keys = {"recording": name, "system": system, "every": k, "cameras": n}
                    rows.append(keys | evaluate(kept, METRICS, np.random.SeedSequence(0)))
    return pd.DataFrame(rows)


def _scene(recording: Recording, estimate: Path) -> Scene:
    read = FORMATS[recording.format].read
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TrajectoryWarning)
            warnings.simplefilter("ignore", AlignmentWarning)
            matches = match(read(recording.reference, complete=True), read(estimate))
    except (OSError, ValueError) as error:
        raise ConfigError(str(error)) from None
    gt, est = matches.gt_poses, matches.est_poses
    unknown = np.zeros(len(gt), dtype=np.bool_)
    return Scene(gt[:, :3, :3], gt[:, :3, 3], est[:, :3, :3], est[:, :3, 3], unknown)
