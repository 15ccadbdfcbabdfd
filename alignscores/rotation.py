"""Rotation Alignment Score, RAS (section 4)."""

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .averaging import rotation_angles, tlud_mean, yaw_mean
from .histogram import AlignmentScore, area, cumulative_frequency, equal_steps
from .similarity import check_alignment
from .validation import (
    AlignmentWarning,
    check_rotations,
    check_same_length,
    finite_rows,
)

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["RASResult", "align_rotations", "average_rotation", "ras"]

CAMERAS_AT_ONCE = 1 << 14  # whose errors are computed


@dataclass(frozen=True, eq=False, repr=False)
class RASResult(AlignmentScore):
    """Rotation Alignment Score and what it was computed from.

    Parameters
    ----------
    score : float
        RAS, from 0 to 1; also ``float(result)``.
    errors : (n,) ndarray
        Angular error of each camera in degrees; infinite for a camera that was not estimated.
    thresholds : (K,) ndarray
        Error thresholds in degrees.
    cumulative_frequency : (K,) ndarray of int
        Number of errors below each threshold.
    alignment : (3, 3) ndarray or None
        Rotation from the ground-truth to the estimated frame; None if no camera was estimated.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import ras
    >>> gt = np.tile(np.eye(3), (4, 1, 1))
    >>> est = gt.copy()
    >>> est[3] = np.nan
    >>> result = ras(gt, est)
    >>> result.score, result.errors
    (0.75, array([ 0.,  0.,  0., inf]))
    """

    alignment: Floats | None


def ras(
    gt_rotations: "ArrayLike | Rotation",
    est_rotations: "ArrayLike | Rotation",
    *,
    max_threshold_deg: float = 10.0,
    n_thresholds: int = 100,
    alignment: str = "similarity",
    up: str = "z",
) -> RASResult:
    """Score how well estimated camera rotations match the ground truth: RAS.

    The estimate may be in another coordinate frame: it is aligned by a robust average of the
    rotations between the two frames. No positions are needed, and nothing is random.

    Parameters
    ----------
    gt_rotations : (n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations: the columns are the camera's axes in the ground-truth frame.
    est_rotations : (n, 3, 3) array_like or scipy Rotation
        Estimated rotations; row i is the camera of row i of the ground truth. A row that is not
        finite is a camera that was not estimated: it counts as a failure.
    max_threshold_deg : float
        Largest error threshold in degrees.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.
    alignment : {"similarity", "rigid", "yaw", "none"}
        How the alignment may rotate: "similarity" and "rigid" freely, "yaw" about the vertical
        axis, "none" not at all.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both frames, for "yaw"; its sign has no effect.

    Returns
    -------
    RASResult
        The score with errors, thresholds, cumulative frequency and alignment.

    Raises
    ------
    ValueError
        If the input is malformed, or a matrix is not a rotation.

    Warns
    -----
    AlignmentWarning
        If no camera was estimated; the score is 0.

    Notes
    -----
    O(n) memory. The time grows little faster than n where many rotations agree, and with its square
    where few do, or where all errors are about 20 degrees.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 4, with the average of "Robust Single Rotation
    Averaging Revisited", arXiv 2309.05388.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import ras
    >>> gt = Rotation.from_euler("z", [[0], [40], [80], [120]], degrees=True)
    >>> est = Rotation.from_euler("x", [[5], [5], [5], [90]], degrees=True) * gt
    >>> ras(gt, est).score
    0.75
    """
    gt = check_rotations(gt_rotations, "gt_rotations", complete=True)
    est = check_rotations(est_rotations, "est_rotations", complete=False)
    check_same_length(gt, est, "gt_rotations", "est_rotations")
    return _checked_ras(gt, est, max_threshold_deg, n_thresholds, alignment, up)


def _checked_ras(
    gt: Floats,
    est: Floats,
    max_threshold_deg: float,
    n_thresholds: int,
    alignment: str,
    up: str,
) -> RASResult:
    """Return the RAS of checked rotations; a warning points to the caller of `ras` or `pas`."""
    check_alignment(alignment, up)
    thresholds = equal_steps(max_threshold_deg, n_thresholds, "max_threshold_deg")
    # Steps 1 and 2: the alignment, and the angular errors with their cumulative frequencies f_k.
    Q, errors = align_rotations(gt, est, alignment, up)
    frequency = cumulative_frequency(errors, thresholds)
    # Step 3: the RAS is the normalised sum of the f_k (eq. 4).
    score = area(frequency, len(errors))
    if Q is None:
        warnings.warn(
            "RAS is 0: no camera in est_rotations was estimated", AlignmentWarning, stacklevel=3
        )
    return RASResult(
        score=score,
        errors=errors,
        thresholds=thresholds,
        cumulative_frequency=frequency,
        alignment=Q,
    )


def align_rotations(
    gt: Floats, est: Floats, alignment: str = "similarity", up: str = "z"
) -> tuple[Floats | None, Floats]:
    """Return the alignment of checked rotations (n, 3, 3), and their errors (n,) in degrees."""
    estimated = finite_rows(est)
    errors = np.full(len(gt), np.inf)
    if not estimated.any():
        return None, errors
    if not estimated.all():
        gt, est = gt[estimated], est[estimated]
    # Step 1: the alignment is the robust average of the rotations from camera to camera.
    Q = average_rotation(est @ gt.swapaxes(1, 2), alignment, up)
    # Step 2: the angular errors.
    errors[estimated] = np.concatenate(
        [rotation_angles((Q @ gt[block]).swapaxes(1, 2) @ est[block]) for block in _blocks(len(gt))]
    )
    return Q, errors


def average_rotation(rotations: Floats, alignment: str, up: str) -> Floats:
    """Return the rotation between two frames from those of the cameras (n, 3, 3)."""
    if alignment == "none":
        return np.eye(3)
    if alignment == "yaw":
        return yaw_mean(rotations, up)
    return tlud_mean(rotations)


def _blocks(n: int) -> list[slice]:
    """Return slices of the cameras whose errors are computed at once."""
    return [slice(i, i + CAMERAS_AT_ONCE) for i in range(0, n, CAMERAS_AT_ONCE)]
