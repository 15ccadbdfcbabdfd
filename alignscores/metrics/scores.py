"""The scores of this package as metrics by name, and the ATE next to them in the table."""

import numpy as np

from ..arrays import Floats
from ..pose import pas
from ..rotation import ras
from ..similarity import least_squares_rmse
from ..thresholds import ras_angle, tas_distance
from ..translation import tas
from .base import Metric
from .cameras import estimated_positions

__all__ = ["METRICS", "SCORES"]


def _ate(gt: Floats, est: Floats) -> float:
    return least_squares_rmse(*estimated_positions(gt, est))


# Only what `Evaluation` computes itself; any other metric has its own module.
METRICS = [
    Metric(
        "TAS",
        tas,
        larger_is_better=True,
        needs=(),
        description="Translation Alignment Score",
    ),
    Metric(
        "RAS",
        lambda gt, est: ras(np.asarray(gt)[:, :3, :3], np.asarray(est)[:, :3, :3]),
        larger_is_better=True,
        description="Rotation Alignment Score",
    ),
    Metric("PAS", pas, larger_is_better=True, description="Pose Alignment Score"),
    Metric(
        "half_distance",
        tas_distance,
        unit="units",
        needs=(),
        description="half-score distance: the threshold d at which the TAS would be 0.5",
    ),
    Metric(
        "half_angle",
        lambda gt, est: ras_angle(np.asarray(gt)[:, :3, :3], np.asarray(est)[:, :3, :3]),
        unit="deg",
        description="half-score angle: the largest angle threshold at which the RAS would be 0.5",
    ),
    Metric(
        "ATE",
        _ate,
        unit="units",
        needs=(),
        description="absolute trajectory error: RMSE of the positions, aligned by least squares",
    ),
]
"""Scores of every estimate, in the order of tables."""

SCORES = tuple(metric.name for metric in METRICS)
