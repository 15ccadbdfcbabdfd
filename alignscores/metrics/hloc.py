"""Shares of images within a distance and an angle, and medians of both, of hloc."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..averaging import rotation_angles
from ..similarity import Similarity
from ..validation import check_positive
from .base import Metric, angle, length
from .cameras import Cameras, NoValueError, check_choice

__all__ = ["METRICS", "hloc_median", "hloc_recall"]

Alignment = Literal["none", "sim3"]
RANK = float(np.finfo(np.float64).eps)  # evo's bound: a smaller singular value is none


def hloc_recall(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    max_error: float = 0.05,
    max_error_deg: float = 5.0,
    *,
    alignment: Alignment = "none",
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

    Raises
    ------
    NoValueError
        If no least-squares similarity is unique: the centres lie on a line or in a point.

    References
    ----------
    cvg/Hierarchical-Localization, hloc/pipelines/Cambridge/utils.py at 0ea601c (2024).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import hloc_recall
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
    alignment: Alignment = "none",
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
    >>> from alignscores.metrics import hloc_median
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
        matched = cameras.matched()
        if alignment == "sim3":
            matched = _aligned(matched)
        distances[cameras.estimated] = np.linalg.norm(matched.est - matched.gt, axis=1)
        angles[cameras.estimated] = rotation_angles(
            matched.gt_rotations @ matched.est_rotations.transpose(0, 2, 1)
        )
    return distances, angles


def _aligned(cameras: Cameras) -> Cameras:
    """Move the estimate by the least-squares similarity of the centres."""
    gt, est = cameras.gt, cameras.est
    covariance = (gt - gt.mean(axis=0)).T @ (est - est.mean(axis=0)) / len(gt)
    refusal = NoValueError(
        "no least-squares similarity is unique: the centres lie on a line or in a point, in the "
        "ground truth or in the estimate"
    )
    if np.count_nonzero(np.linalg.svd(covariance, compute_uv=False) > RANK) < 2:
        raise refusal
    try:
        to_gt = Similarity.fit(gt, est).inverse()
    except ValueError:  # what passed for a rank was rounding
        raise refusal from None
    rotations = to_gt.rotation @ cameras.est_rotations
    moved = to_gt.scale * (est - est.mean(axis=0)) @ to_gt.rotation.T + gt.mean(axis=0)
    return replace(cameras, est_rotations=rotations, est=moved)


def _thresholds(text: str) -> Mapping[str, float] | None:
    distance, _, degrees = text.partition(",")
    values = {"max_error": length(distance), "max_error_deg": angle(degrees.strip())}
    valid = {key: value for key, value in values.items() if value is not None}
    return valid if len(valid) == len(values) else None


def _metrics() -> list[Metric]:
    metrics = []
    ways: tuple[tuple[str, Alignment, str], ...] = (
        ("hloc", "none", "of hloc: not aligned"),
        ("hloc-sim3", "sim3", "as of hloc, but aligned by least squares"),
    )
    for project, alignment, how in ways:
        median = partial(hloc_median, alignment=alignment)
        metrics += [
            Metric(
                f"recall@DISTANCE,ANGLE:{project}",
                partial(hloc_recall, alignment=alignment),
                unit="%",
                larger_is_better=True,
                needs=("rotations", "metres"),
                description=f"images within a distance and an angle, {how}",
                argument=_thresholds,
                example=f"recall@5cm,5deg:{project}",
            ),
            Metric(
                f"median:{project}",
                median,
                unit="units",
                description=f"median distance of the images, {how}",
            ),
            Metric(
                f"median:{project}:rotation",
                partial(median, error="rotation"),
                unit="deg",
                description=f"median angle of the images, {how}",
            ),
        ]
    return metrics


METRICS = _metrics()
"""The recall and the medians, with and without an alignment."""
