"""Shares of images within a distance and an angle, and medians of both, of hloc."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..averaging import rotation_angles
from ..validation import check_positive
from .cameras import Cameras, check_choice
from .trajectory import least_squares_aligned

__all__ = ["hloc_median", "hloc_recall"]


def hloc_recall(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    max_error: float = 0.05,
    max_error_deg: float = 5.0,
    *,
    alignment: Literal["none", "sim3"] = "none",
) -> float:
    """Share of images within a distance and an angle, as hloc counts them for Cambridge Landmarks.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same image, in metres. An estimate that is not
        finite fails.
    max_error : float
        Distance in metres.
    max_error_deg : float
        Angle in degrees.
    alignment : {"none", "sim3"}
        hloc aligns nothing: the estimate is in the frame of the ground truth. "sim3" moves it by
        the least-squares similarity first, which is no part of hloc.

    Returns
    -------
    float
        Percent, of all images.
    NoValueError
        If there is no least-squares similarity; see `evo_ate`.

    References
    ----------
    cvg/Hierarchical-Localization, hloc/pipelines/Cambridge/utils.py at 0ea601c (2024).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import hloc_recall
    >>> gt = np.tile(np.eye(4), (4, 1, 1))
    >>> est = gt.copy()
    >>> est[:, 0, 3] = [0, 0.04, 0.06, np.nan]
    >>> hloc_recall(gt, est)
    50.0
    """
    check_positive(max_error, "max_error")
    check_positive(max_error_deg, "max_error_deg")
    distances, angles = image_errors(gt_poses, est_poses, alignment)
    right = np.count_nonzero((distances < max_error) & (angles < max_error_deg))
    return 100 * int(right) / len(distances)


def hloc_median(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    error: Literal["translation", "rotation"] = "translation",
    alignment: Literal["none", "sim3"] = "none",
) -> float:
    """Median distance, or median angle, over all images; see `hloc_recall`.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        As in `hloc_recall`. An estimate that is not finite is infinitely far off, and 180 degrees.
    error : {"translation", "rotation"}
        Distances or angles.
    alignment : {"none", "sim3"}
        As there.

    Returns
    -------
    float
        In ground-truth units, or degrees. Infinite where half of the images have no estimate.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import hloc_median
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> est = gt.copy()
    >>> est[:, 0, 3] = [0, 0.04, np.nan]
    >>> hloc_median(gt, est)
    0.04
    """
    check_choice(error, ("translation", "rotation"), "error")
    distances, angles = image_errors(gt_poses, est_poses, alignment)
    return float(np.median(distances if error == "translation" else angles))


def image_errors(
    gt_poses: ArrayLike, est_poses: ArrayLike, alignment: str
) -> tuple[Floats, Floats]:
    """Return distances, infinite for missing images, and angles, 180 degrees for these."""
    check_choice(alignment, ("none", "sim3"), "alignment")
    cameras = Cameras.check(gt_poses, est_poses)
    distances, angles = np.full(len(cameras), np.inf), np.full(len(cameras), 180.0)
    if cameras.estimated.any():
        matched = least_squares_aligned(cameras.matched(), alignment)
        distances[cameras.estimated] = np.linalg.norm(matched.est - matched.gt, axis=1)
        angles[cameras.estimated] = rotation_angles(
            matched.gt_rotations @ matched.est_rotations.transpose(0, 2, 1)
        )
    return distances, angles
