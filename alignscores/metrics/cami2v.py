"""Errors of the cameras that a generated video should follow: RotErr, TransErr and CamMC."""

from functools import partial
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..averaging import rotation_angles
from .base import Metric
from .cameras import Cameras, NoValueError, check_choice

__all__ = ["METRICS", "Scale", "video_error"]

Error = Literal["rotation", "translation", "pose"]
Scale = Literal["cami2v", "cami2v-abs", "cameractrl"]
ADDED = 1e-9  # to a length that positions are divided by


def video_error(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    error: Error = "rotation",
    scale: Scale = "cami2v",
) -> float:
    """Sum over the frames of a video of the errors of the cameras, seen from the first one.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses of all frames, row i of both the same one.
    error : {"rotation", "translation", "pose"}
        RotErr, the angles in *radians*; TransErr, the distances; CamMC, the Frobenius norms of the
        differences of the 3 x 4 matrices.
    scale : {"cami2v", "cami2v-abs", "cameractrl"}
        "cami2v" divides positions by the largest distance from the first camera, estimate and truth
        each by its own; "cami2v-abs" both by that of the truth; "cameractrl", the paper's formula,
        by nothing.

    Returns
    -------
    float
        The sum; it grows with the number of frames.

    Raises
    ------
    NoValueError
        If a frame has no estimate.

    Notes
    -----
    Only the first cameras align the estimate: an error of the first frame is one of all frames.
    For "cami2v-abs" CamI2V takes the scale of the estimate from depth maps, which files of poses
    do not hold.

    References
    ----------
    ZGCTroy/CamI2V, evaluation/glomap_evaluation.py and evaluation/utils/common.py at c5d7b2f
    (2025). Without published code: He et al., "CameraCtrl", arXiv 2404.02101; Wang et al.,
    "MotionCtrl", arXiv 2312.03641, for CamMC.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import video_error
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> gt[:, 0, 3] = [0, 1, 2]
    >>> est = gt.copy()
    >>> est[:, :3, 3] *= 5
    >>> round(video_error(gt, est, error="translation"), 6)
    0.0
    >>> video_error(gt, est, error="translation", scale="cameractrl")
    12.0
    """
    check_choice(error, ("rotation", "translation", "pose"), "error")
    check_choice(scale, get_args(Scale), "scale")
    cameras = Cameras.check(gt_poses, est_poses)
    if not cameras.estimated.all():
        frame = int(np.argmin(cameras.estimated))
        raise NoValueError(f"all frames are needed, but frame {frame} has no estimate")
    seen = []
    for rotations, positions in (
        (cameras.gt_rotations, cameras.gt),
        (cameras.est_rotations, cameras.est),
    ):
        first = rotations[0].T
        seen.append((first @ rotations, (positions - positions[0]) @ first.T))
    (gt_rotations, gt), (est_rotations, est) = seen
    if error == "rotation":
        return float(
            np.radians(rotation_angles(gt_rotations.transpose(0, 2, 1) @ est_rotations)).sum()
        )
    if scale != "cameractrl":
        gt_size, est_size = (np.linalg.norm(of, axis=1).max() + ADDED for of in (gt, est))
        gt, est = gt / gt_size, est / (est_size if scale == "cami2v" else gt_size)
    squares = ((est - gt) ** 2).sum(axis=1)
    if error == "pose":
        squares = squares + ((est_rotations - gt_rotations) ** 2).sum(axis=(1, 2))
    return float(np.sqrt(squares).sum())


_SUMS: tuple[tuple[str, Error, str], ...] = (
    ("transerr", "translation", "sum of the distances"),
    ("cammc", "pose", "sum of the norms of differences of matrices"),
)
METRICS = [
    Metric(
        "roterr",
        video_error,
        unit="rad",
        needs=("rotations", "order"),
        description="sum of the angles in radians, seen from the first frame, of video generation",
    ),
    *(
        Metric(
            f"{name}:{scale}",
            partial(video_error, error=error, scale=scale),
            needs=("rotations", "order"),
            description=f"{description}, seen from the first frame, of video generation",
        )
        for name, error, description in _SUMS
        for scale in get_args(Scale)
    ),
]
"""RotErr, TransErr and CamMC, the latter two with each scale."""
