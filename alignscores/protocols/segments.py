"""Relative errors over path lengths: the KITTI devkit and rpg_trajectory_evaluation."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..similarity import Similarity
from ..validation import check_positive
from .cameras import Cameras, NoValueError, check_choice
from .trajectory import Statistic, motion_errors, nearest_after, path_lengths, statistic_of

__all__ = ["kitti_relative_error", "rpg_relative_error"]


KITTI_LENGTHS = range(100, 801, 100)  # metres
KITTI_STEP = 10  # frames from start to start
RPG_TOLERANCE = 0.2


def kitti_relative_error(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    error: Literal["translation", "rotation"] = "translation",
) -> float:
    """Mean relative error over segments of 100, 200, ..., 800 m, of the KITTI odometry benchmark.

    From every tenth frame a segment goes to the first frame more than its length further along the
    true path. With Q and P the true and the estimated motion over it, the error is of P^-1 Q,
    divided by the length. The mean is over all segments of all lengths.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Finite camera-to-world poses of all frames in the order of time, in metres, row i of both
        the same frame. The first pose need not be the identity. There is no scale.
    error : {"translation", "rotation"}
        Length of the translation in percent, or angle of the rotation in degrees per metre.

    Returns
    -------
    float
        Percent, or degrees per metre.
    NoValueError
        If a frame has no estimate, or the path is not longer than 100 m: the program crashes,
        or writes nothing.

    Notes
    -----
    Divided by the nominal length, not by the true one: a path with few frames has larger errors.
    Shorter lengths have more segments and weigh more. The program is in single precision, this is
    not. O(n log n) time, O(n) memory.

    References
    ----------
    KITTI odometry development kit, cpp/evaluate_odometry.cpp.
    Geiger et al., "Are we ready for autonomous driving? The KITTI vision benchmark suite",
    CVPR 2012.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import kitti_relative_error
    >>> gt = np.tile(np.eye(4), (500, 1, 1))
    >>> gt[:, 2, 3] = np.arange(500)
    >>> est = gt.copy()
    >>> est[:, 2, 3] *= 1.01
    >>> round(kitti_relative_error(gt, est), 4)
    1.0064
    """
    check_choice(error, ("translation", "rotation"), "error")
    cameras = Cameras.check(gt_poses, est_poses)
    if not cameras.estimated.all():
        row = int(np.argmin(cameras.estimated))
        raise NoValueError(f"the KITTI errors need all poses, but frame {row} has no estimate")
    path = path_lengths(cameras.gt)
    starts = np.arange(0, len(path), KITTI_STEP)
    errors = []
    for length in KITTI_LENGTHS:
        ends = np.searchsorted(path, path[starts] + length, side="right")
        within = ends < len(path)
        distances, angles = motion_errors(cameras, starts[within], ends[within])
        errors.append(100 * distances / length if error == "translation" else angles / length)
    segments = np.concatenate(errors)
    if len(segments) == 0:
        raise NoValueError(f"the KITTI errors need a path longer than {KITTI_LENGTHS[0]} m")
    return float(segments.mean())


def rpg_relative_error(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    length: float,
    *,
    error: Literal["translation", "rotation"] = "translation",
    alignment: Literal["sim3", "se3"] = "sim3",
    statistic: Statistic = "rmse",
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
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the errors.

    Returns
    -------
    float
        Percent, or degrees per ground-truth unit.
    NoValueError
        If fewer than two frames have one at that distance (the program's statistics are 0
        there), or the estimated centres coincide.

    References
    ----------
    uzh-rpg/rpg_trajectory_evaluation at 2d29ae9 (2019), compute_trajectory_errors.py,
    trajectory.py.
    Zhang and Scaramuzza, "A tutorial on quantitative trajectory evaluation for visual(-inertial)
    odometry", IROS 2018.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import rpg_relative_error
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
    ends = nearest_after(path, starts, starts, length)
    ends = ends[np.abs(path[ends] - (path + length)) < RPG_TOLERANCE * length]
    if len(ends) < 2:
        raise NoValueError(f"fewer than two frames have one {length:g} further along the path")
    distances, angles = motion_errors(cameras, starts[: len(ends)], ends)
    errors = 100 * distances / length if error == "translation" else angles / length
    return statistic_of(errors, statistic)
