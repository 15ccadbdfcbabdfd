"""Mean average accuracy, mAA: the share of camera pairs whose relative pose is right."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from alignscores.arrays import Booleans, Floats
from alignscores.histogram import equal_steps
from alignscores.metrics.cameras import moderate
from alignscores.pairs import PairBlock, pair_blocks
from alignscores.validation import check_poses

from .stacks import check_stacks, unstacked

__all__ = ["maa"]


FINEST_STEP_DEG = 1e-3  # a cosine resolves angles down to about 1e-6 degrees


def maa(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    max_threshold_deg: ArrayLike = 10.0,
    n_thresholds: ArrayLike = 100,
    fold_sign: ArrayLike = False,
    pooled: ArrayLike = False,
) -> float | Floats:
    """Mean average accuracy of the relative poses between all pairs of cameras.

    The error of a pair is the larger of two angles: between the true and the estimated relative
    rotation, and between the true and the estimated direction from one camera to the other, seen
    from the camera that comes first. No alignment is needed.

    Parameters
    ----------
    gt_poses, est_poses : (..., n, 4, 4) or (..., n, 3, 4) array_like
        Camera-to-world poses of at least 2 cameras, row i of both the same one: the left 3 x 3
        block holds its axes, the last column its centre. The pairs of an estimate that is not
        finite fail. Leading axes are scenes.
    max_threshold_deg : float
        Largest error threshold in degrees, at most 180.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest. The original benchmark has 10.
    fold_sign : bool
        Take opposite directions for equal, as the original benchmark does.
    pooled : bool
        Count both angles of every pair instead of the larger one. Each of these four options may be
        a list: several ways to count the same pairs, in one pass.

    Returns
    -------
    float, or (...) ndarray of a stack of scenes, with a last axis for options that are lists
        Mean over the thresholds of the share of the n (n - 1) / 2 pairs (of their angles, if
        pooled) with an error below (not at) the threshold, from 0 to 1.

    Raises
    ------
    ValueError
        If the input is malformed, there are fewer than 2 cameras, or the thresholds are more
        than 180 or less than 0.001 degrees.

    Notes
    -----
    A pair whose direction is undefined, since its true or its estimated positions coincide, fails;
    if pooled, only its direction does. The order of the cameras matters, if little: rotation
    errors enter the direction only through the first camera of a pair. O(n^2) time, O(n) memory.

    References
    ----------
    Yi et al., "Learning to find good correspondences", CVPR 2018.
    Jin et al., "Image matching across wide baselines: from paper to practice", IJCV 2021.

    Examples
    --------
    >>> import numpy as np
    >>> from baselines import maa
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> gt[:, :3, 3] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> est = gt.copy()
    >>> est[:, :3, 3] *= 10
    >>> est[2] = np.nan
    >>> maa(gt, gt), round(maa(gt, est), 3)
    (1.0, 0.333)
    """
    ways = np.broadcast(*map(np.asarray, (max_threshold_deg, n_thresholds, fold_sign, pooled)))
    counts = [_Count(*(option.item() for option in way)) for way in ways]
    (gt_rotations, gt), (est_rotations, est), lead = check_stacks(
        check_poses, gt_poses, est_poses, "poses", est_complete=False
    )
    if gt.shape[1] < 2:
        raise ValueError("mAA needs at least 2 cameras, but gt_poses has 1")
    estimated = np.isfinite(est_rotations).all(axis=(2, 3)) & np.isfinite(est).all(axis=2)
    between = est_rotations @ gt_rotations.swapaxes(2, 3)
    between[~estimated] = np.eye(3)
    # At once for all scenes: a call of SciPy's takes as long as a small scene.
    of_all = Rotation.from_matrix(between.reshape(-1, 3, 3), assume_valid=True)
    quaternions = of_all.as_quat().reshape(*between.shape[:2], 4)
    rotations = of_all.as_matrix().reshape(between.shape)
    cameras = moderate(gt), moderate(est), quaternions, rotations, estimated
    areas = [_areas(*scene, counts) for scene in zip(*cameras, strict=True)]
    return unstacked(np.reshape(areas, (-1, *ways.shape)), lead)


@dataclass(frozen=True)
class _Count:
    """How pairs are counted: the options of `maa`, with its errors."""

    max_threshold_deg: float
    n_thresholds: int
    fold_sign: bool
    pooled: bool

    def __post_init__(self) -> None:
        largest, finest = self.max_threshold_deg, self._degrees[0]
        if largest > 180:
            raise ValueError(f"max_threshold_deg must be at most 180, not {largest!r}")
        if finest < FINEST_STEP_DEG:
            raise ValueError(
                f"max_threshold_deg / n_thresholds must be at least {FINEST_STEP_DEG}, "
                f"not {finest:.1e}"
            )

    @cached_property
    def _degrees(self) -> Floats:
        return equal_steps(self.max_threshold_deg, self.n_thresholds, "max_threshold_deg")

    @cached_property
    def thresholds(self) -> Floats:
        """The equally spaced thresholds in radians."""
        return np.radians(self._degrees)


def _areas(
    gt: Floats,
    est: Floats,
    quaternions: Floats,
    rotations: Floats,
    estimated: Booleans,
    counts: list[_Count],
) -> list[float]:
    """Return the mAA of a scene, counted in several ways; see `pair_blocks`."""
    n_pairs = len(gt) * (len(gt) - 1) // 2
    cameras = [array[estimated] for array in (gt, est, quaternions, rotations)]
    steps = [np.zeros(count.n_thresholds, dtype=np.int64) for count in counts]
    for block in pair_blocks(*cameras):
        cosines = _cosines(block)
        for count, counted in zip(counts, steps, strict=True):
            counted += _steps(count, block, *cosines)
    # Whole numbers until the one division: a perfect estimate scores exactly 1.
    return [
        int(np.cumsum(counted).sum()) / (len(counted) * n_pairs * (2 if count.pooled else 1))
        for count, counted in zip(counts, steps, strict=True)
    ]


def _cosines(block: PairBlock) -> tuple[Floats, Floats]:
    """Return the cosines of the angles between the directions and between the rotations."""
    lengths = block.gt_lengths * block.est_lengths
    lengths[lengths == 0] = np.nan  # no direction: above no cosine
    return block.dots / lengths, 2 * block.half_cosines() ** 2 - 1


def _steps(count: _Count, block: PairBlock, directions: Floats, turns: Floats) -> NDArray[np.int64]:
    """Count the pairs (if pooled, their angles) from each threshold but one up to the next."""
    directions = np.abs(directions) if count.fold_sign else directions
    last_cosine = np.cos(count.thresholds[-1])
    counted = np.zeros(count.n_thresholds, dtype=np.int64)
    for cosines in (directions, turns) if count.pooled else (np.minimum(directions, turns),):
        near = cosines[block.pairs & (cosines > last_cosine)]
        angles = np.arccos(np.minimum(near, 1.0))  # rounding takes a cosine above 1
        # Below the k-th threshold (k = 1, 2, ...) lie the angles of less than k whole steps.
        steps = (angles / count.thresholds[0]).astype(np.intp)
        counted += np.bincount(steps, minlength=len(counted))[: len(counted)]
    return counted
