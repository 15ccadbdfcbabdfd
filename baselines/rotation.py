"""Statistics of the rotation errors after a least-squares or a least-deviations alignment."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats
from alignscores.averaging import rotation_angles
from alignscores.validation import check_rotations

from .averages import rotation_l1_means, rotation_l2_means
from .stacks import check_stacks, unstacked

__all__ = ["aligned_angles", "rotation_statistics"]


def rotation_statistics(
    gt_rotations: ArrayLike | Rotation, est_rotations: ArrayLike | Rotation
) -> dict[str, float | Floats]:
    """Median, mean and RMS of the angular errors after the geodesic L1 and the L2 alignment.

    Parameters
    ----------
    gt_rotations, est_rotations : (..., n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations, row i of both the same camera: the columns are its axes. Leading
        axes are scenes.

    Returns
    -------
    dict of str to float, or to (...) ndarray of a stack of scenes
        "Median-1", "Mean-1" and "RMS-1" after the L1 alignment, "Median-2", "Mean-2" and "RMS-2"
        after the L2 alignment, in degrees.

    Raises
    ------
    ValueError
        If the input is malformed or not finite, or a matrix is no rotation.

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
    gt, est, lead = check_stacks(check_rotations, gt_rotations, est_rotations, "rotations")
    between = gt @ est.swapaxes(2, 3)
    statistics = {}
    for norm, means in (("1", rotation_l1_means(between)), ("2", rotation_l2_means(between))):
        errors = aligned_angles(gt, est, means)
        statistics[f"Median-{norm}"] = np.median(errors, axis=1)
        statistics[f"Mean-{norm}"] = errors.mean(axis=1)
        statistics[f"RMS-{norm}"] = np.sqrt((errors**2).mean(axis=1))
    return {name: unstacked(values, lead) for name, values in statistics.items()}


def aligned_angles(gt: Floats, est: Floats, alignments: Floats) -> Floats:
    """Return the angles of ``(alignment @ est).T @ gt`` in degrees, which are the errors.

    Of stacks of rotations (..., n, 3, 3), with an alignment (..., 3, 3) each.
    """
    return rotation_angles((alignments[..., None, :, :] @ est).swapaxes(-1, -2) @ gt)
