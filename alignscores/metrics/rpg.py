"""Relative errors over a path length of rpg_trajectory_evaluation."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Indices
from ..similarity import Similarity
from ..validation import check_positive
from .base import Metric
from .base import length as read_length
from .cameras import Cameras, NoValueError, check_choice
from .paths import Statistic, motion_errors, path_lengths, statistic_of

__all__ = ["METRICS", "rpg_relative_error"]

Error = Literal["translation", "rotation"]
RPG_TOLERANCE = 0.2


def rpg_relative_error(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    length: float,
    *,
    error: Error = "translation",
    alignment: Literal["sim3", "se3"] = "sim3",
    statistic: Statistic = "mean",
) -> float:
    """Relative error over one path length, of rpg_trajectory_evaluation.

    For each frame the program looks for the one nearest to `length` further along the true path, at
    most a fifth of it off. Frames without one are dropped from the list of ends, and the k-th end
    of what is left is paired with frame k: where poses are sparse, not with its own start.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses in the order of time, row i of both the same frame. Estimates that are
        not finite are left out first.
    length : float
        Path length in ground-truth units.
    error : {"translation", "rotation"}
        Length of the translation in percent of `length`, or angle of the rotation in degrees,
        divided by `length`.
    alignment : {"sim3", "se3"}
        Whether translations are multiplied by the scale of the least-squares similarity of all
        centres.
    statistic : {"mean", "rmse", "median", "std", "min", "max", "sse"}
        What is returned of the errors.

    Returns
    -------
    float
        Percent, or degrees per ground-truth unit.

    Raises
    ------
    NoValueError
        If no two frame pairs are at that distance (the program's statistics are 0 there), or
        the estimated centres coincide.

    References
    ----------
    uzh-rpg/rpg_trajectory_evaluation at 2d29ae9 (2019), compute_trajectory_errors.py,
    trajectory.py.
    Zhang and Scaramuzza, "A tutorial on quantitative trajectory evaluation for visual(-inertial)
    odometry", IROS 2018.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import rpg_relative_error
    >>> gt = np.tile(np.eye(4), (50, 1, 1))
    >>> gt[:, 2, 3] = np.arange(50)
    >>> est = gt.copy()
    >>> est[:, 2, 3] *= 1.01
    >>> round(rpg_relative_error(gt, est, 10, alignment="se3"), 9)
    1.0
    """
    check_positive(length, "length")
    check_choice(error, ("translation", "rotation"), "error")
    check_choice(alignment, ("sim3", "se3"), "alignment")
    cameras = Cameras.check(gt_poses, est_poses).matched()
    if len(cameras) == 0:
        raise NoValueError("no camera was estimated")
    if alignment == "sim3":
        try:
            scale = Similarity.fit(cameras.gt, cameras.est).scale
        except ValueError:
            raise NoValueError("the estimate has no scale: its centres coincide") from None
        cameras = replace(cameras, est=cameras.est / scale)
    path = path_lengths(cameras.gt)
    starts = np.arange(len(path))
    ends = _nearest(path, starts, length)
    ends = ends[np.abs(path[ends] - (path + length)) < RPG_TOLERANCE * length]
    if len(ends) < 2:
        raise NoValueError(f"no two frame pairs are {length:g} apart along the path")
    distances, angles = motion_errors(cameras, starts[: len(ends)], ends)
    errors = 100 * distances / length if error == "translation" else angles / length
    return statistic_of(errors, statistic)


def _nearest(path: Floats, first: Indices, distance: float) -> Indices:
    """Return the frames nearest to a path length after others; of equal ones the earliest."""
    above = np.clip(np.searchsorted(path, path[first] + distance), first, len(path) - 1)
    below = np.maximum(above - 1, first)
    below = np.maximum(np.searchsorted(path, path[below]), first)
    gaps = (np.abs(path[j] - path[first] - distance) for j in (below, above))
    nearest = np.where(np.less_equal(*gaps), below, above)
    return np.maximum(np.searchsorted(path, path[nearest]), first)


def _length(text: str) -> Mapping[str, float] | None:
    metres = read_length(text)
    return None if metres is None else {"length": metres}


_ERRORS: tuple[tuple[str, Error, str], ...] = (
    ("", "translation", "%"),
    (":rotation", "rotation", "deg/unit"),
)
METRICS = [
    Metric(
        f"rpg@DISTANCE{words}",
        partial(rpg_relative_error, error=error),
        unit=unit,
        needs=("rotations", "order", "metres"),
        description=f"relative {error} error over a path length, of rpg_trajectory_evaluation",
        argument=_length,
        options={
            "alignment": ("sim3", "se3"),
            "statistic": ("mean", "rmse", "median", "std", "min", "max"),
        },
        example=f"rpg@100m{words}",
    )
    for words, error, unit in _ERRORS
]
"""The two errors over a length."""
