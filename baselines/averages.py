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
    """Return the median along the first axis; NumPy's takes several times as long for few values.

    Examples
    --------
    >>> import numpy as np
    >>> from baselines.averages import median
    >>> median(np.array([[4.0, 1.0], [1.0, 2.0], [9.0, 5.0], [2.0, 6.0]]))
    array([3. , 3.5])
    """
    lower, upper = (len(values) - 1) // 2, len(values) // 2
    parted = np.partition(values, (lower, upper), axis=0)
    return (parted[lower] + parted[upper]) / 2


def geometric_median(points: Floats, *, max_steps: int = WEISZFELD_STEPS) -> Floats:
    """Return the point with the smallest sum of distances to the given ones.

    Parameters
    ----------
    points : (n, 3) array
        Finite points.
    max_steps : int
        Largest number of Weiszfeld steps, from the coordinate-wise median.

    Returns
    -------
    (3,) ndarray
        The last iterate, in the unit of the points.

    Notes
    -----
    Points that the iterate coincides with have no direction: each holds it against the pull of one
    other, as in the reference.

    References
    ----------
    Vardi and Zhang, "The multivariate L1-median and associated data depth", PNAS 2000.

    Examples
    --------
    >>> import numpy as np
    >>> from baselines.averages import geometric_median
    >>> geometric_median(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 5, 0], [1, -9, 0]]))
    array([1., 0., 0.])
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
    """Return the geodesic L1 mean of rotations, started from their element-wise median.

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations.

    Returns
    -------
    (3, 3) ndarray
        The iterate after 10 Weiszfeld steps from the projection of the median on SO(3).

    References
    ----------
    Lee and Civera, "Robust Single Rotation Averaging", arXiv 2004.00732, for the start.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from baselines.averages import rotation_l1_mean
    >>> turns = Rotation.from_euler("z", [[0], [20], [20], [20], [170]], degrees=True).as_matrix()
    >>> Rotation.from_matrix(rotation_l1_mean(turns)).as_euler("xyz", degrees=True).round(6)
    array([ 0.,  0., 20.])
    """
    return geodesic_l1_mean(rotations, project_to_rotation(median(rotations)))


def rotation_l2_mean(rotations: Floats) -> Floats:
    """Return the rotation that minimises the sum of squared angles to the given ones.

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations.

    Returns
    -------
    (3, 3) ndarray
        The chordal mean, moved by the average of the log maps until the step vanishes.

    Notes
    -----
    The minimum is unique where all rotations lie within 90 degrees of one; otherwise it is the one
    that the chordal mean leads to.

    References
    ----------
    Hartley et al., "Rotation Averaging", IJCV 2013, section 5.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from baselines.averages import rotation_l2_mean
    >>> turns = Rotation.from_euler("z", [[0], [20], [20], [60]], degrees=True).as_matrix()
    >>> Rotation.from_matrix(rotation_l2_mean(turns)).as_euler("xyz", degrees=True).round(6)
    array([ 0.,  0., 25.])
    """
    mean = chordal_mean(rotations)
    for _ in range(L2_STEPS):
        angles, axes = angles_and_axes(rotations, mean)
        step = axes @ angles / len(angles)
        mean = rotation_from_vector(step) @ mean
        if sqrt(step @ step) < L2_TOLERANCE:
            break
    return mean
