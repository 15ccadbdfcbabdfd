"""Absolute trajectory error, ATE, computed by evo (which is under the GPL)."""

import numpy as np
from evo.core.geometry import GeometryException, umeyama_alignment
from numpy.typing import ArrayLike

from alignscores.arrays import Floats
from alignscores.similarity import FARTHEST_SQUARABLE, FARTHEST_SUMMABLE, least_squares_rmse
from alignscores.validation import check_positions

from .stacks import check_stacks, unstacked

__all__ = ["ate"]


def ate(gt_positions: ArrayLike, est_positions: ArrayLike) -> float | Floats:
    """Absolute trajectory error: RMSE of the positions after the least-squares alignment.

    The estimate is rotated, shifted and scaled so that the RMSE is the smallest possible.

    Parameters
    ----------
    gt_positions, est_positions : (..., n, 3) array_like
        Finite camera centres, row i of both the same camera; leading axes are scenes.

    Returns
    -------
    float, or (...) ndarray of a stack of scenes
        The RMSE in ground-truth units.

    Raises
    ------
    ValueError
        If the input is malformed or not finite, or the ground truth has no extent: every
        estimate could then be scaled down to an error of 0.

    Notes
    -----
    Alignment and value are evo's (``evo_ape --align --correct_scale``). evo refuses
    collinear cameras on an axis of the frame, an estimate that is one point, and clouds whose
    covariance is below 2e-16, since its test of the rank is absolute. The rotation is not unique
    there, but the RMSE is: ``alignscores.similarity.least_squares_rmse`` computes it, as for
    coordinates whose squares would overflow. An estimate that is one point has the RMS distance of
    the ground truth from its centroid.

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
    gt, est, lead = check_stacks(check_positions, gt_positions, est_positions, "positions")
    return unstacked([_rmse(*scene) for scene in zip(gt, est, strict=True)], lead)


def _rmse(gt: Floats, est: Floats) -> float:
    gt, est = _from_first(gt), _from_first(est)
    if not gt.any():
        raise ValueError("gt_positions has no extent: all its cameras coincide")
    if max(np.abs(gt).max(), np.abs(est).max()) > FARTHEST_SQUARABLE:
        return _rmse_of_any_cameras(gt, est)
    try:
        rotation, translation, scale = umeyama_alignment(est.T, gt.T, with_scale=True)
    except GeometryException:
        return _rmse_of_any_cameras(gt, est)
    return _rms(gt - (scale * est @ rotation.T + translation))


def _rmse_of_any_cameras(gt: Floats, est: Floats) -> float:
    """Return the RMSE where evo does not align: on a line, in a point, tiny or huge."""
    unit = float(np.abs(gt).max())
    try:
        return unit * least_squares_rmse(gt / unit, est)
    except ValueError:  # no scale helps: the best shrinks the estimate to the centroid
        return unit * _rms(gt / unit - (gt / unit).mean(axis=0))


def _from_first(positions: Floats) -> Floats:
    """Return positions relative to the first: far-off frames lose no digits."""
    positions = np.clip(positions, -FARTHEST_SUMMABLE, FARTHEST_SUMMABLE)
    return np.asarray(positions - positions[0])


def _rms(offsets: Floats) -> float:
    """Return the root mean square length of offsets (n, 3)."""
    return float(np.sqrt(np.einsum("ni,ni->", offsets, offsets) / len(offsets)))
