"""Absolute and relative pose errors as evo computes them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Indices
from ..averaging import rotation_angles
from ..similarity import Similarity
from ..validation import check_positive
from .cameras import Cameras, NoValueError, check_choice, estimated_positions

__all__ = [
    "STATISTICS",
    "Alignment",
    "Pairs",
    "Statistic",
    "evo_are",
    "evo_ate",
    "evo_rpe",
    "least_squares_aligned",
    "motion_errors",
    "statistic_of",
]

Alignment = Literal["sim3", "se3", "scale", "none"]
Pairs = Literal["consecutive", "consecutive-reference", "all", "all-reference"]
Statistic = Literal["rmse", "mean", "median", "std", "min", "max", "sse"]

STATISTICS: Mapping[str, Callable[[Floats], np.floating]] = {
    "rmse": lambda errors: np.sqrt(np.mean(errors * errors)),
    "mean": np.mean,
    "median": np.median,
    "std": np.std,
    "min": np.min,
    "max": np.max,
    "sse": lambda errors: np.sum(errors * errors),
}
RANK = float(np.finfo(np.float64).eps)  # a smaller singular value of the covariance is none
ROUNDING = 1e-6  # seconds, of sums of time stamps
TOLERANCE = 0.1  # of a distance: how far the nearest pair may be from it


def evo_ate(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    *,
    alignment: Alignment = "sim3",
    statistic: Statistic = "rmse",
) -> float:
    """Absolute trajectory error: distances after a least-squares alignment, as evo_ape has it.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Camera centres, row i of both the same camera. An estimate that is not finite is left out:
        losing a bad camera improves the value.
    alignment : {"sim3", "se3", "scale", "none"}
        What moves the estimate to the ground truth: the least-squares similarity (Umeyama), the
        same without scale, its scale alone, about the origin, or nothing.
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the distances; the divisor of the standard deviation is n.

    Returns
    -------
    float
        In ground-truth units; "sse" in their square.
    NoValueError
        If evo does not align: fewer than two singular values of the covariance of the centres
        exceed 2.2e-16, as for collinear or coinciding cameras, and for two; or nothing was
        estimated.

    Notes
    -----
    `baselines.ate` is the RMSE with a similarity, with a value for collinear cameras, too.

    References
    ----------
    evo 1.38.1 (github.com/MichaelGrupp/evo, 2026), evo_ape.
    Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import evo_ate
    >>> gt = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> est = gt + [3, 0, 0]
    >>> evo_ate(gt, est, alignment="none"), round(evo_ate(gt, est), 9)
    (3.0, 0.0)
    """
    gt, est = estimated_positions(gt_positions, est_positions)
    rotations = np.broadcast_to(np.eye(3), (len(gt), 3, 3))
    cameras = Cameras(rotations, gt, rotations, est, np.ones(len(gt), dtype=bool))
    aligned = least_squares_aligned(cameras, alignment)
    return statistic_of(np.linalg.norm(aligned.est - aligned.gt, axis=1), statistic)


def evo_are(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    alignment: Alignment = "sim3",
    statistic: Statistic = "rmse",
) -> float:
    """Absolute rotation error: angles after an alignment of the centres, evo_ape's ``angle_deg``.

    The rotations are turned as the centres are; none of them takes part in the alignment.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same camera. Estimates that are not finite are left
        out first.
    alignment : {"sim3", "se3", "scale", "none"}
        As in `evo_ate`, with its errors.
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the angles.

    Returns
    -------
    float
        Degrees.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.protocols import evo_are
    >>> gt = np.tile(np.eye(4), (4, 1, 1))
    >>> gt[1:, :3, 3] = np.eye(3)
    >>> est = gt.copy()
    >>> est[0, :3, :3] = Rotation.from_euler("x", 2, degrees=True).as_matrix()
    >>> round(evo_are(gt, est, statistic="mean"), 9)
    0.5
    """
    cameras = least_squares_aligned(Cameras.check(gt_poses, est_poses).matched(), alignment)
    angles = rotation_angles(cameras.est_rotations.transpose(0, 2, 1) @ cameras.gt_rotations)
    return statistic_of(angles, statistic)


def evo_rpe(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    distance: float | None = None,
    *,
    error: Literal["translation", "rotation", "distance"] = "translation",
    alignment: Alignment = "none",
    statistic: Statistic = "rmse",
    pairs: Pairs = "consecutive",
    frames: int = 1,
    seconds: float | None = None,
    stamps: ArrayLike | None = None,
) -> float:
    """Relative pose error over some frames, or over a distance along the path, as evo_rpe has it.

    Over seconds, which evo has not, pairs are found by time as evo finds them by the path.

    With Q and P the true and the estimated motion from one pose to another, the error is of Q^-1 P.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses in the order of time, row i of both the same frame. Estimates that are
        not finite are left out first: the next frame may be many later.
    distance : float, optional
        Path length of the pairs; by default `frames` count.
    error : {"translation", "rotation", "distance"}
        Length of the translation, angle of the rotation, or the difference between the lengths of
        the two motions.
    alignment : {"sim3", "se3", "scale", "none"}
        See `evo_ate`. Only the scale, and with it the path length, matters. evo aligns nothing by
        default; CUT3R, MonST3R and Pi3 take "sim3".
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the errors.
    pairs : {"consecutive", "consecutive-reference", "all", "all-reference"}
        "consecutive", as evo by default: pairs one after the other, each of at least `distance` of
        the path of the aligned *estimate*. "all" (evo's ``--all_pairs``): of each frame, the later
        one whose path length from it is nearest to `distance`, if they differ by at most a tenth of
        that. With "-reference" (evo's ``--pairs_from_reference``) the reference's path counts.
    frames : int
        Frames with an estimate from one pose of a pair to the other, where no distance is given.
    seconds : float, optional
        Time from one pose of a pair to the other, instead of a distance.
    stamps : (n,) array_like, optional
        Time stamps of the poses in seconds, ascending, where `seconds` are given.

    Returns
    -------
    float
        In ground-truth units, or degrees.
    NoValueError
        If no pair has that distance, or evo does not align.

    Notes
    -----
    O(n log n) time, O(n) memory.

    References
    ----------
    evo 1.38.1 (github.com/MichaelGrupp/evo, 2026), evo_rpe; for "sim3" and frames also Pi3,
    relpose/evo_utils.py at 9125273 (2025).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import evo_rpe
    >>> gt = np.tile(np.eye(4), (5, 1, 1))
    >>> gt[:, 0, 3] = [0, 1, 2, 3, 4]
    >>> est = gt.copy()
    >>> est[:, 0, 3] *= 1.1
    >>> round(evo_rpe(gt, est), 9), round(evo_rpe(gt, est, 2, pairs="all-reference"), 9)
    (0.1, 0.2)
    """
    checked = Cameras.check(gt_poses, est_poses)
    cameras = least_squares_aligned(checked.matched(), alignment)
    check_choice(pairs, get_args(Pairs), "pairs")
    check_positive(frames, "frames", integer=True)
    check_choice(error, ("translation", "rotation", "distance"), "error")
    consecutive = pairs.startswith("consecutive")
    find_pairs = consecutive_pairs if consecutive else nearest_pairs
    if seconds is not None:
        check_positive(seconds, "seconds")
        times = np.asarray(stamps, dtype=np.float64)
        if times.shape != checked.estimated.shape:
            raise ValueError("stamps must have a time stamp of each pose, where seconds are given")
        first, second = find_pairs(times[checked.estimated], seconds - ROUNDING)
        spacing = f"{seconds:g} s apart"
    elif distance is not None:
        check_positive(distance, "distance")
        path = path_lengths(cameras.gt if pairs.endswith("reference") else cameras.est)
        first, second = find_pairs(path, distance)
        spacing = f"{distance:g} apart on the path"
    else:
        first = np.arange(0, len(cameras) - frames, frames if consecutive else 1)
        second = first + frames
        spacing = f"{frames} frames apart"
    if len(first) == 0:
        raise NoValueError(f"no two poses with an estimate are {spacing}")
    if error == "distance":
        lengths = (np.linalg.norm(c[first] - c[second], axis=1) for c in (cameras.gt, cameras.est))
        return statistic_of(np.abs(np.subtract(*lengths)), statistic)
    distances, angles = motion_errors(cameras, first, second)
    return statistic_of(distances if error == "translation" else angles, statistic)


def motion_errors(cameras: Cameras, first: Indices, second: Indices) -> tuple[Floats, Floats]:
    """Return lengths and angles of Q^-1 P, of the true motion Q and the estimated one P."""

    def motions(rotations: Floats, positions: Floats) -> tuple[Floats, Floats]:
        inverse = rotations[first].transpose(0, 2, 1)
        steps = (positions[second] - positions[first])[:, :, None]
        return inverse @ rotations[second], (inverse @ steps)[:, :, 0]

    gt_rotations, gt_steps = motions(cameras.gt_rotations, cameras.gt)
    est_rotations, est_steps = motions(cameras.est_rotations, cameras.est)
    distances = np.linalg.norm(est_steps - gt_steps, axis=1)
    return distances, rotation_angles(gt_rotations.transpose(0, 2, 1) @ est_rotations)


def path_lengths(positions: Floats) -> Floats:
    """Return the length of the path up to each camera."""
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def nearest_pairs(path: Floats, distance: float) -> tuple[Indices, Indices]:
    """Pair each frame with the later one nearest to a distance, within the tolerance."""
    first = np.arange(len(path) - 1)
    second = nearest_after(path, first, first + 1, distance)
    near = np.abs(path[second] - path[first] - distance) <= TOLERANCE * distance
    return first[near], second[near]


def nearest_after(path: Floats, first: Indices, earliest: Indices, distance: float) -> Indices:
    """Return the frames nearest to a path length after others, not before the earliest."""
    above = np.searchsorted(path, path[first] + distance)
    above = np.clip(above, earliest, len(path) - 1)
    below = np.maximum(above - 1, earliest)
    below = np.maximum(np.searchsorted(path, path[below]), earliest)  # the first of equal ones
    gaps = (np.abs(path[j] - path[first] - distance) for j in (below, above))
    nearest = np.where(np.less_equal(*gaps), below, above)
    return np.maximum(np.searchsorted(path, path[nearest]), earliest)


def consecutive_pairs(path: Floats, distance: float) -> tuple[Indices, Indices]:
    """Cut the path in pieces of at least a distance; return their ends."""
    ends, length = [0], 0.0
    for k, step in enumerate(np.diff(path).tolist(), start=1):
        length += step
        if length >= distance:
            ends.append(k)
            length = 0.0
    return np.array(ends[:-1], dtype=np.intp), np.array(ends[1:], dtype=np.intp)


def least_squares_aligned(cameras: Cameras, alignment: str) -> Cameras:
    """Move the estimate, of cameras that have one, by evo's alignment of the centres."""
    check_choice(alignment, get_args(Alignment), "alignment")
    if len(cameras) == 0:
        raise NoValueError("no camera was estimated")
    if alignment == "none":
        return cameras
    gt, est = cameras.gt, cameras.est
    refusal = NoValueError(
        "evo does not align these cameras: their centres lie on a line or in a point, in the "
        "ground truth or in the estimate"
    )
    covariance = (gt - gt.mean(axis=0)).T @ (est - est.mean(axis=0)) / len(gt)
    if np.count_nonzero(np.linalg.svd(covariance, compute_uv=False) > RANK) < 2:
        raise refusal
    try:
        to_gt = Similarity.fit(gt, est).inverse()
    except ValueError:  # what passed for a rank was rounding
        raise refusal from None
    scale = to_gt.scale if alignment != "se3" else 1.0
    if alignment == "scale":
        return replace(cameras, est=scale * est)
    turned = scale * (est - est.mean(axis=0)) @ to_gt.rotation.T + gt.mean(axis=0)
    return replace(cameras, est_rotations=to_gt.rotation @ cameras.est_rotations, est=turned)


def statistic_of(errors: Floats, statistic: str) -> float:
    """Return a statistic of errors by its name."""
    check_choice(statistic, STATISTICS, "statistic")
    return float(STATISTICS[statistic](errors))
