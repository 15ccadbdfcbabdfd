"""Averages that the baselines align with: geometric median, geodesic L1 and L2 rotation mean."""

import numpy as np

from alignscores.arrays import Floats
from alignscores.averaging import (
    WEISZFELD_STEPS,
    angles_and_axes,
    dots,
    geodesic_l1_means,
    project_to_rotation,
    rotation_from_vector,
)

__all__ = ["geometric_medians", "rotation_l1_means", "rotation_l2_means"]


L2_STEPS = 100  # bound; 4 steps do without outliers, some 20 with half of them
L2_TOLERANCE = 1e-12  # radians; a smaller step is rounding


def geometric_medians(points: Floats) -> Floats:
    """Return the points (G, 3) with the smallest sums of distances to stacks of points (G, n, 3).

    Weiszfeld steps from the coordinate-wise median. A point that the iterate coincides with has no
    direction: it cancels the pull of one other point (Vardi and Zhang, "The multivariate L1-median
    and associated data depth", PNAS 2000).
    """
    medians: Floats = np.median(points, axis=1)
    points = np.ascontiguousarray(points.swapaxes(1, 2))
    moving = np.arange(len(points))
    for _ in range(WEISZFELD_STEPS):
        offsets = points[moving] - medians[moving][..., None]
        distances = np.sqrt(np.einsum("gin,gin->gn", offsets, offsets))
        resting = distances.shape[1] - np.count_nonzero(distances, axis=1)
        distances[distances == 0] = np.inf
        weights = 1 / distances
        pull = (offsets @ weights[..., None])[..., 0]
        strength = np.sqrt(dots(pull, pull))
        going = strength > resting
        moving, pull, weights = moving[going], pull[going], weights[going]
        if not moving.size:
            break
        shares = (1 - resting[going] / strength[going]) / weights.sum(axis=1)
        medians[moving] += shares[:, None] * pull
    return medians


def rotation_l1_means(rotations: Floats) -> Floats:
    """Return the geodesic L1 means of stacks of rotations (G, n, 3, 3) after 10 Weiszfeld steps.

    The start is their element-wise median, projected on SO(3) (Lee and Civera, "Robust Single
    Rotation Averaging", arXiv 2004.00732).
    """
    return geodesic_l1_means(rotations, project_to_rotation(np.median(rotations, axis=1)))


def rotation_l2_means(rotations: Floats) -> Floats:
    """Return the rotations with the smallest sums of squared angles to stacks (G, n, 3, 3).

    The chordal mean moves by the average of the log maps until the step vanishes (Hartley et al.,
    "Rotation Averaging", IJCV 2013, section 5).
    """
    means, moving = project_to_rotation(rotations.sum(axis=1)), np.arange(len(rotations))
    for _ in range(L2_STEPS):
        angles, axes = angles_and_axes(rotations[moving], means[moving])
        steps = (axes @ angles[..., None])[..., 0] / rotations.shape[1]
        turns = np.array([rotation_from_vector(step) for step in steps])
        means[moving] = turns @ means[moving]
        moving = moving[np.sqrt(dots(steps, steps)) >= L2_TOLERANCE]
        if not moving.size:
            break
    return means
