"""Statistics of the rotation errors after a least-squares or a least-deviations alignment."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats
from alignscores.averaging import rotation_angles
from alignscores.validation import check_rotations, check_same_length

from .averages import median, rotation_l1_mean, rotation_l2_mean

__all__ = ["aligned_angles", "checked", "rotation_statistics"]


def rotation_statistics(
    gt_rotations: ArrayLike | Rotation, est_rotations: ArrayLike | Rotation
) -> dict[str, float]:
    """Median, mean and RMS of the angular errors after the geodesic L1 and the L2 alignment.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations, row i of both the same camera: the columns are its axes.

    Returns
    -------
    dict of str to float
        "Median-1", "Mean-1" and "RMS-1" after the L1 alignment, "Median-2", "Mean-2" and "RMS-2"
        after the L2 alignment, in degrees.

    Raises
    ------
    ValueError
        Where the input is malformed or not finite, or a matrix is no rotation.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 6.2, for the selection.
    Hartley et al., "Rotation Averaging", IJCV 2013, for the alignments.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from baselines import rotation_statistics
    >>> gt = Rotation.from_euler("x", [[0], [10], [20], [30]], degrees=True)
    >>> est = Rotation.from_euler("z", [[90], [90], [90], [94]], degrees=True) * gt
    >>> statistics = rotation_statistics(gt, est)
    >>> {name: round(value, 3) for name, value in statistics.items()}
    {'Median-1': 0.0, 'Mean-1': 1.0, 'RMS-1': 2.0, 'Median-2': 1.0, 'Mean-2': 1.5, 'RMS-2': 1.732}
    """
    gt, est = checked(gt_rotations, est_rotations)
    between = gt @ est.transpose(0, 2, 1)
    statistics = {}
    for norm, mean in (("1", rotation_l1_mean(between)), ("2", rotation_l2_mean(between))):
        errors = aligned_angles(gt, est, mean)
        statistics[f"Median-{norm}"] = float(median(errors))
        statistics[f"Mean-{norm}"] = float(errors.mean())
        statistics[f"RMS-{norm}"] = float(np.sqrt((errors**2).mean()))
    return statistics


def checked(
    gt_rotations: ArrayLike | Rotation, est_rotations: ArrayLike | Rotation
) -> tuple[Floats, Floats]:
    """Return the rotations of both worlds as arrays; refuse malformed and missing ones."""
    gt = check_rotations(gt_rotations, "gt_rotations", complete=True)
    est = check_rotations(est_rotations, "est_rotations", complete=True)
    check_same_length(gt, est, "gt_rotations", "est_rotations")
    return gt, est


def aligned_angles(gt: Floats, est: Floats, alignment: Floats) -> Floats:
    """Return the angles of ``(alignment @ est).T @ gt`` in degrees, which are the errors."""
    return rotation_angles((alignment @ est).transpose(0, 2, 1) @ gt)
