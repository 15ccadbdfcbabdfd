"""Absolute trajectory error, ATE."""

import numpy as np
from evo.core.geometry import GeometryException, umeyama_alignment
from numpy.typing import ArrayLike, NDArray

from alignscores.averaging import project_to_rotation
from alignscores.validation import check_positions, check_same_length

__all__ = ["ate"]

Floats = NDArray[np.float64]

FARTHEST = 1e300  # sums of more overflow


def ate(gt_positions: ArrayLike, est_positions: ArrayLike) -> float:
    """Absolute trajectory error: RMSE of the positions after the least-squares alignment.

    The estimate is rotated, shifted and scaled so that the RMSE is the smallest possible.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Finite camera centres in the ground-truth world.
    est_positions : (n, 3) array_like
        Finite camera centres in the estimated world, row i for the camera of row i of the ground
        truth.

    Returns
    -------
    float
        The RMSE in ground-truth units.

    Raises
    ------
    ValueError
        Where the input is malformed or not finite, or the ground truth has no extent: every
        estimate could then be scaled down to an error of 0.

    Notes
    -----
    evo computes the alignment, of clouds brought to unit extent, since its test for degenerate
    data is absolute, and reduced to 12 points, since it loops over points in Python. Where it still
    refuses (collinear cameras; an estimate that is one point) the alignment is not unique but the
    RMSE is. That of an estimate that is one point is the RMS distance of the ground truth to its
    centroid.

    O(n) time and memory.

    References
    ----------
    Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
    Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
    PAMI 1991.

    Examples
    --------
    >>> from baselines import ate
    >>> gt = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]
    >>> ate(gt, [[5, 0, 0], [5, 2, 0], [5, 4, 0], [5, 6, 0]])
    0.0
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
        rotation, _, scale = umeyama_alignment(*_same_moments(est, gt), with_scale=True)
    except GeometryException:
        rotation, scale = _degenerate_alignment(est, gt)
    residuals = scale * est @ rotation.T - gt
    return unit * float(np.sqrt(np.einsum("ni,ni->", residuals, residuals) / len(gt)))


def _normalise(positions: Floats) -> tuple[Floats, float]:
    """Return a cloud shifted to zero mean and scaled to unit extent, and its extent."""
    positions = np.clip(positions, -FARTHEST, FARTHEST)
    # Relative to a camera first: far-off worlds lose no digits, and coinciding cameras give zeros.
    local = positions - positions[0]
    local -= local.mean(axis=0)
    extent = float(np.abs(local).max())
    return (local / extent if extent > 0 else local), extent


def _same_moments(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return 12 pairs of points (3, 12) with the mean and second moments of centred clouds.

    The least-squares alignment depends on nothing else.
    """
    # The rows of the triangle have the second moments of the clouds' rows.
    triangle = np.asarray(np.linalg.qr(np.hstack([a, b]), mode="r"))
    points = np.sqrt(len(triangle) / len(a)) * np.vstack([triangle, -triangle])
    return points[:, :3].T, points[:, 3:].T


def _degenerate_alignment(est: Floats, gt: Floats) -> tuple[Floats, float]:
    """Return a least-squares alignment of centred clouds of any rank; many are equally good."""
    covariance = gt.T @ est
    rotation = project_to_rotation(covariance)
    variance = np.einsum("ni,ni->", est, est)
    scale = float(np.einsum("ij,ij->", rotation, covariance) / variance) if variance > 0 else 1.0
    return rotation, scale
