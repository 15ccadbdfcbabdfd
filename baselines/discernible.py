"""Discernible trajectory error, DTE, and discernible rotation error, DRE."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats
from alignscores.similarity import FARTHEST_SQUARABLE
from alignscores.validation import check_poses, check_positive

from .averages import geometric_medians, rotation_l1_means
from .rotation import rotation_statistics
from .stacks import check_stacks, unstacked

__all__ = ["dre", "dte"]


def dte(gt_poses: ArrayLike, est_poses: ArrayLike, *, k: float = 5.0) -> float | Floats:
    """Discernible trajectory error: robustly aligned, winsorised position errors.

    The clouds are aligned by their geometric medians, the rotations of the cameras and the median
    distance to the geometric median.

    Parameters
    ----------
    gt_poses, est_poses : (..., n, 4, 4) or (..., n, 3, 4) array_like
        Finite camera-to-world poses, row i of both the same camera: the left 3 x 3 block holds the
        camera's axes, the last column its centre. Leading axes are scenes.
    k : float
        Errors are cut at k times the median distance of the ground-truth cameras to their geometric
        median.

    Returns
    -------
    float, or (...) ndarray of a stack of scenes
        Mean of the mean and the RMS of the errors relative to the cut, from 0 to 1, without unit.

    Raises
    ------
    ValueError
        If the input is malformed or not finite, or the median distance of the ground truth is 0.

    Notes
    -----
    The geometric medians are what 10 steps give, as in the published implementation, from a start
    that depends on the axes of the frame. So an exact estimate whose frame is turned has a DTE of
    about 1e-6 with 100 cameras and up to 0.04 with 5, not 0.

    If the median distance of the estimate is 0 the estimate takes its limit, scaled without
    bound: cameras at the geometric median stay there, the errors of all others are cut.

    References
    ----------
    Lee and Civera, "What's Wrong with the Absolute Trajectory Error?", arXiv 2212.05376.

    Examples
    --------
    >>> import numpy as np
    >>> from baselines import dte
    >>> gt = np.tile(np.eye(4), (5, 1, 1))
    >>> gt[:, 0, 3] = [-2, -1, 0, 1, 2]
    >>> est = gt.copy()
    >>> est[4, 0, 3] = 100
    >>> dte(gt, gt), round(dte(gt, est), 3)
    (0.0, 0.324)
    """
    check_positive(k, "k")
    (gt_rotations, gt_positions), (est_rotations, est_positions), lead = check_stacks(
        check_poses, gt_poses, est_poses, "poses"
    )
    gt, gt_spreads = _centre(gt_positions)
    est, est_spreads = _centre(est_positions)
    if (gt_spreads == 0).any():
        raise ValueError(
            "DTE has no unit: at least half of the cameras in gt_poses coincide at their geometric "
            "median"
        )
    rotations = rotation_l1_means(gt_rotations @ est_rotations.swapaxes(2, 3))
    cuts = (k * gt_spreads)[:, None]
    degenerate = est_spreads == 0
    ratios = gt_spreads / np.where(degenerate, 1, est_spreads)
    errors = np.linalg.norm(ratios[:, None, None] * est @ rotations.swapaxes(1, 2) - gt, axis=2)
    if degenerate.any():
        limits = np.where(est.any(axis=2), np.inf, np.linalg.norm(gt, axis=2))
        errors = np.where(degenerate[:, None], limits, errors)
    shares = np.minimum(errors, cuts) / cuts
    return unstacked((shares.mean(axis=1) + np.sqrt((shares**2).mean(axis=1))) / 2, lead)


def dre(gt_rotations: ArrayLike | Rotation, est_rotations: ArrayLike | Rotation) -> float | Floats:
    """Discernible rotation error: angular errors after the geodesic L1 alignment.

    Parameters
    ----------
    gt_rotations, est_rotations : (..., n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations, row i of both the same camera: the columns are its axes. Leading
        axes are scenes.

    Returns
    -------
    float, or (...) ndarray of a stack of scenes
        Mean of the mean and the RMS of the angular errors, in degrees.

    Raises
    ------
    ValueError
        If the input is malformed or not finite, or a matrix is no rotation.

    References
    ----------
    Lee and Civera, "What's Wrong with the Absolute Trajectory Error?", arXiv 2212.05376.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from baselines import dre
    >>> gt = Rotation.from_euler("x", [[0], [10], [20], [30]], degrees=True)
    >>> est = Rotation.from_euler("z", [[90], [90], [90], [94]], degrees=True) * gt
    >>> round(dre(gt, est), 6)
    1.5
    """
    statistics = rotation_statistics(gt_rotations, est_rotations)
    return (statistics["Mean-1"] + statistics["RMS-1"]) / 2


def _centre(positions: Floats) -> tuple[Floats, Floats]:
    """Return positions relative to their geometric medians and the median distances to these."""
    positions = np.clip(positions, -FARTHEST_SQUARABLE, FARTHEST_SQUARABLE)
    centred = positions - geometric_medians(positions)[:, None]
    return centred, np.median(np.linalg.norm(centred, axis=2), axis=1)
