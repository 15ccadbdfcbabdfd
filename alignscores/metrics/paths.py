"""Basis of errors along a path: lengths, motions between poses, statistics."""

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np

from ..arrays import Floats, Indices
from ..averaging import rotation_angles
from .cameras import Cameras, check_choice

__all__ = ["STATISTICS", "Statistic", "motion_errors", "path_lengths", "statistic_of"]

Statistic = Literal["rmse", "mean", "median", "std", "min", "max", "sse"]

STATISTICS: Mapping[str, Callable[[Floats], np.floating]] = {
    "rmse": lambda errors: np.sqrt(np.mean(errors * errors)),
    "mean": np.mean,
    "median": np.median,
    "std": np.std,
    "min": np.min,
    "max": np.max,
    "sse": lambda errors: np.sum(errors * errors),
}


def motion_errors(cameras: Cameras, first: Indices, second: Indices) -> tuple[Floats, Floats]:
    """Return lengths and angles of Q^-1 P, of the true motion Q and the estimated one P."""

    def motions(rotations: Floats, positions: Floats) -> tuple[Floats, Floats]:
        inverse = rotations[first].transpose(0, 2, 1)
        steps = (positions[second] - positions[first])[:, :, None]
        return inverse @ rotations[second], (inverse @ steps)[:, :, 0]

    gt_rotations, gt_steps = motions(cameras.gt_rotations, cameras.gt)
    est_rotations, est_steps = motions(cameras.est_rotations, cameras.est)
    distances = np.linalg.norm(est_steps - gt_steps, axis=1)
    return distances, rotation_angles(gt_rotations.transpose(0, 2, 1) @ est_rotations)


def path_lengths(positions: Floats) -> Floats:
    """Return the length of the path up to each camera."""
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def statistic_of(errors: Floats, statistic: str) -> float:
    """Return a statistic of errors by its name."""
    check_choice(statistic, STATISTICS, "statistic")
    return float(STATISTICS[statistic](errors))
