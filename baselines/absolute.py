"""Absolute trajectory error, ATE."""

import numpy as np
from numpy.typing import ArrayLike

from alignscores.arrays import Floats
from alignscores.similarity import FARTHEST_SUMMABLE, least_squares_rmse
from alignscores.validation import check_positions, check_same_length

__all__ = ["ate"]


def ate(gt_positions: ArrayLike, est_positions: ArrayLike) -> float:
    """Absolute trajectory error: RMSE of the positions after the least-squares alignment.

    The estimate is rotated, shifted and scaled so that the RMSE is the smallest possible.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Finite camera centres, row i of both the same camera.

    Returns
    -------
    float
        The RMSE in ground-truth units.

    Raises
    ------
    ValueError
        If the input is malformed or not finite, or the ground truth has no extent: every
        estimate could then be scaled down to an error of 0.

    Notes
    -----
    The value is that of ``evo_ape --align --correct_scale``, which refuses collinear cameras and an
    estimate that is one point: there the alignment is not unique, but the RMSE is. An estimate that
    is one point has the RMS distance of the ground truth from its centroid.

    References
    ----------
    Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
    Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
    PAMI 1991.

    Examples
    --------
    >>> from baselines import ate
    >>> gt = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]
    >>> ate(gt, [[0, 3, 0], [0, 3, 0], [0, 3, 0], [0, 3, 0]])
    1.118033988749895
    """
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=True)
    check_same_length(gt, est, "gt_positions", "est_positions")
    gt, unit = _normalise(gt)
    est, _ = _normalise(est)
    if unit == 0:
        raise ValueError("gt_positions has no extent: all its cameras coincide")
    try:
        return unit * least_squares_rmse(gt, est)
    except ValueError:  # no scale helps: the best shrinks the estimate to the centroid
        return unit * float(np.sqrt(np.einsum("ni,ni->", gt, gt) / len(gt)))


def _normalise(positions: Floats) -> tuple[Floats, float]:
    """Return a cloud shifted to zero mean and scaled to unit extent, and its extent."""
    positions = np.clip(positions, -FARTHEST_SUMMABLE, FARTHEST_SUMMABLE)
    # Relative to a camera first: far-off frames lose no digits, and coinciding cameras give zeros.
    local = positions - positions[0]
    local -= local.mean(axis=0)
    extent = float(np.abs(local).max())
    return (local / extent if extent > 0 else local), extent
