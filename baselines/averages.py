"""Averages that the baselines align with: geometric median, geodesic L1 and L2 rotation mean."""

from math import sqrt
from typing import Any

import numpy as np

from alignscores.arrays import Floats
from alignscores.averaging import (
    WEISZFELD_STEPS,
    angles_and_axes,
    chordal_mean,
    geodesic_l1_mean,
    project_to_rotation,
    rotation_from_vector,
)

__all__ = ["geometric_median", "median", "rotation_l1_mean", "rotation_l2_mean"]


L2_STEPS = 100  # bound; 4 steps do without outliers, some 20 with half of them
L2_TOLERANCE = 1e-12  # radians; a smaller step is rounding


def median(values: Floats) -> Any:
    """Return the median along the first axis; NumPy's takes several times as long for few."""
    lower, upper = (len(values) - 1) // 2, len(values) // 2
    parted = np.partition(values, (lower, upper), axis=0)
    return (parted[lower] + parted[upper]) / 2


def geometric_median(points: Floats, *, max_steps: int = WEISZFELD_STEPS) -> Floats:
    """Return the point with the smallest sum of distances to (n, 3) points, by Weiszfeld steps.

    The start is the coordinate-wise median. A point that the iterate coincides with has no
    direction: it holds the iterate against the pull of one other point. Source: Vardi and Zhang,
    "The multivariate L1-median and associated data depth", PNAS 2000.
    """
    iterate: Floats = median(points)
    points = np.ascontiguousarray(points.T)
    for _ in range(max_steps):
        offsets = points - iterate[:, None]
        distances = np.sqrt(np.einsum("in,in->n", offsets, offsets))
        resting = len(distances) - np.count_nonzero(distances)
        if resting:
            distances[distances == 0] = np.inf
        weights = 1 / distances
        pull = offsets @ weights
        strength = sqrt(pull @ pull)
        if strength <= resting:
            break
        iterate += (1 - resting / strength) / weights.sum() * pull
    return iterate


def rotation_l1_mean(rotations: Floats) -> Floats:
    """Return the geodesic L1 mean of rotations after 10 Weiszfeld steps.

    The start is their element-wise median, projected on SO(3): Lee and Civera, "Robust Single
    Rotation Averaging", arXiv 2004.00732.
    """
    return geodesic_l1_mean(rotations, project_to_rotation(median(rotations)))


def rotation_l2_mean(rotations: Floats) -> Floats:
    """Return the rotation that minimises the sum of squared angles to the given ones.

    The chordal mean moves by the average of the log maps until the step vanishes (Hartley et al.,
    "Rotation Averaging", IJCV 2013, section 5). The minimum is unique where all rotations lie
    within 90 degrees of a common one; otherwise it is the one that the chordal mean leads to.
    """
    mean = chordal_mean(rotations)
    for _ in range(L2_STEPS):
        angles, axes = angles_and_axes(rotations, mean)
        step = axes @ angles / len(angles)
        mean = rotation_from_vector(step) @ mean
        if sqrt(step @ step) < L2_TOLERANCE:
            break
    return mean
