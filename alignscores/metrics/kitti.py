"""Relative errors over path lengths of the KITTI odometry benchmark."""

from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .base import Metric
from .cameras import Cameras, NoValueError, check_choice
from .paths import motion_errors, path_lengths

__all__ = ["METRICS", "kitti_relative_error"]

KITTI_LENGTHS = range(100, 801, 100)  # metres
KITTI_STEP = 10  # frames from start to start


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

    Raises
    ------
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
    >>> from alignscores.metrics import kitti_relative_error
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


METRICS = [
    Metric(
        "kitti",
        kitti_relative_error,
        unit="%",
        needs=("rotations", "order", "metres"),
        description="mean relative translation error over 100 to 800 m, of the KITTI benchmark",
    ),
    Metric(
        "kitti:rotation",
        partial(kitti_relative_error, error="rotation"),
        unit="deg/unit",
        needs=("rotations", "order", "metres"),
        description="mean relative rotation error over 100 to 800 m, of the KITTI benchmark",
    ),
]
"""The two errors of its table."""
