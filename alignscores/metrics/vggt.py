"""Accuracy of relative poses between all pairs: RRA, RTA and AUC of VGGT and its followers."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Literal, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..pairs import PairBlock, pair_blocks
from ..validation import check_positive
from .base import Metric, whole
from .cameras import Cameras, NoValueError, check_choice

__all__ = ["METRICS", "Convention", "direction_blocks", "vggt_auc", "vggt_rra", "vggt_rta"]

Convention = Literal["vggt", "mapanything", "da3"]

SHORTEST = 1e-15  # added to lengths, smallest squared sine of an error
SMALLEST_ROTATION = float(np.degrees(np.arccos(1 - 2 * SHORTEST)))
MAX_DEGREES = 180


def vggt_rra(
    gt_poses: ArrayLike, est_poses: ArrayLike, k: float, *, convention: Convention = "vggt"
) -> float:
    """Relative rotation accuracy, RRA@k: share of pairs with a rotation error below k degrees.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        As in `vggt_auc`, whose errors these are.
    k : float
        Threshold in degrees.
    convention : {"vggt", "mapanything", "da3"}
        As there.

    Returns
    -------
    float
        Percent.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import vggt_rra
    >>> gt = np.tile(np.eye(4), (4, 1, 1))
    >>> est = gt.copy()
    >>> est[3] = np.nan
    >>> vggt_rra(gt, est, 5)
    50.0
    """
    return _rate(gt_poses, est_poses, k, convention, which=0)


def vggt_rta(
    gt_poses: ArrayLike, est_poses: ArrayLike, k: float, *, convention: Convention = "vggt"
) -> float:
    """Relative translation accuracy, RTA@k: share of pairs with a direction error below k degrees.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        As in `vggt_auc`, whose errors these are.
    k : float
        Threshold in degrees.
    convention : {"vggt", "mapanything", "da3"}
        As there.

    Returns
    -------
    float
        Percent.

    Examples
    --------
    A step in the opposite direction counts as right:

    >>> import numpy as np
    >>> from alignscores.metrics import vggt_rta
    >>> gt = np.tile(np.eye(4), (2, 1, 1))
    >>> gt[1, 0, 3] = 1
    >>> est = gt.copy()
    >>> est[1, 0, 3] = -1
    >>> vggt_rta(gt, est, 5)
    100.0
    """
    return _rate(gt_poses, est_poses, k, convention, which=1)


def vggt_auc(
    gt_poses: ArrayLike, est_poses: ArrayLike, k: int, *, convention: Convention = "vggt"
) -> float:
    """Area under the accuracy of relative poses up to k degrees, in bins of one degree: AUC@k.

    The error e of a pair i < j is the larger of the angle between the relative rotations and the
    angle between the directions of the relative translations; the latter is folded, so that
    opposite directions are equal. AUC@k is the mean over m = 1, ..., k of the share of pairs with
    e < m (e <= k for m = k): an error of 0.99 degrees costs nothing.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses of at least 2 cameras, row i of both the same one; the estimate in any
        frame. The programs have no notion of an estimate that is not finite; fed with one, all its
        pairs fail.
    k : int
        Whole degrees, at most 180.
    convention : {"vggt", "mapanything", "da3"}
        The relative translation is that of camera i seen from camera j (Pi3's copy of VGGT's
        script), of j seen from i (VGGT's later script, MapAnything), or, in Depth Anything 3,
        R_0^T [(c_i - c_0) - R_i R_j^T (c_j - c_0)], with the rotation R_0^T R_i R_j^T R_0: no
        motion between the two cameras, and all of it depends on the first image.

    Returns
    -------
    float
        Percent.

    Raises
    ------
    NoValueError
        If there is no pair.

    Notes
    -----
    1e-15 is added to the length of a translation before it is divided by it. Where the true or the
    estimated centres of a pair coincide the direction error is 90 degrees, and the pair fails
    whatever its rotation. O(n^2) time, O(n) memory.

    References
    ----------
    Pi3, relpose/metric.py and eval_angle.py at 9125273 (2025), after facebookresearch/vggt,
    evaluation/test_co3d.py; facebookresearch/map-anything, mapanything/utils/metrics.py at 5e21566
    (2025); ByteDance-Seed/Depth-Anything-3, src/depth_anything_3/bench/utils.py at 33c29cc (2025).

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.metrics import vggt_auc
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> gt[:, :3, 3] = np.eye(3)
    >>> est = gt.copy()
    >>> est[2, :3, :3] = Rotation.from_euler("x", 1.5, degrees=True).as_matrix()
    >>> round(vggt_auc(gt, est, 3), 1)
    77.8
    """
    check_positive(k, "k", integer=True)
    if k > MAX_DEGREES:
        raise ValueError(f"k must be at most {MAX_DEGREES}, not {k}")
    edges = np.linspace(0, k, k + 1)
    cameras = Cameras.check(gt_poses, est_poses)
    n_pairs = _n_pairs(cameras)
    counts = np.zeros(k, dtype=np.int64)
    for block in direction_blocks(cameras, convention):
        errors = np.maximum(*_errors(block))
        counts += np.histogram(errors[errors <= k], edges)[0]
    return 100 * int(np.cumsum(counts).sum()) / (k * n_pairs)


def _errors(block: PairBlock) -> tuple[Floats, Floats]:
    """Return rotation and direction errors of the pairs of a block in degrees."""
    lengths = (block.gt_lengths + SHORTEST) * (block.est_lengths + SHORTEST)
    cosines = (block.dots / lengths)[block.pairs]
    squared_sines = np.maximum(1 - cosines * cosines, SHORTEST)
    rotation_errors = np.maximum(block.rotation_angles()[block.pairs], SMALLEST_ROTATION)
    return rotation_errors, np.degrees(np.arccos(np.sqrt(1 - squared_sines)))


def direction_blocks(cameras: Cameras, convention: Convention) -> Iterator[PairBlock]:
    """Yield the pairs of estimated cameras; in reversed order for "vggt", seen from the second."""
    check_choice(convention, get_args(Convention), "convention")
    if convention == "da3" and not cameras.estimated[0]:
        return iter(())  # camera 0 is its frame
    cameras = cameras.matched()
    if len(cameras) < 2:
        return iter(())
    gt_rotations, gt = cameras.gt_rotations, cameras.gt
    est_rotations, est = cameras.est_rotations, cameras.est
    if convention == "da3":
        # As steps g_i - g_j with g_i = R_i^T (c_i - c_0), rotated to the frame's axes by R_i; the
        # rotations between the frames become those of camera i, seen from camera 0.
        gt, est = _in_own_axes(gt_rotations, gt), _in_own_axes(est_rotations, est)
        aligned = (est_rotations[0] @ gt_rotations[0].T).T @ est_rotations
        between = aligned.transpose(0, 2, 1) @ gt_rotations
    else:
        between = est_rotations @ gt_rotations.transpose(0, 2, 1)
        if convention == "vggt":
            gt, est, between = gt[::-1], est[::-1], between[::-1]
    rotations = scipy.spatial.transform.Rotation.from_matrix(between)
    return pair_blocks(gt, est, rotations.as_quat(), rotations.as_matrix())


def _in_own_axes(rotations: Floats, positions: Floats) -> Floats:
    return np.asarray(np.einsum("nki,nk->ni", rotations, positions - positions[0]))


def _rate(
    gt_poses: ArrayLike, est_poses: ArrayLike, k: float, convention: Convention, *, which: int
) -> float:
    check_positive(k, "k")
    cameras = Cameras.check(gt_poses, est_poses)
    n_pairs = _n_pairs(cameras)
    errors = (_errors(block)[which] for block in direction_blocks(cameras, convention))
    return 100 * sum(int(np.count_nonzero(part < k)) for part in errors) / n_pairs


def _n_pairs(cameras: Cameras) -> int:
    n = len(cameras)
    if n < 2:
        raise NoValueError("relative accuracies need at least 2 cameras, but gt_poses has 1")
    return n * (n - 1) // 2


def _degrees(text: str) -> Mapping[str, int] | None:
    k = whole(text)
    return None if k is None else {"k": k}


METRICS = [
    Metric(
        f"{name}@K:{convention}",
        partial(function, convention=convention),
        unit="%",
        larger_is_better=True,
        description=description,
        argument=_degrees,
        example=f"{name}@{30 if name == 'auc' else 5}:{convention}",
    )
    for name, function, description in (
        (
            "rra",
            vggt_rra,
            "relative rotation accuracy: pairs with a rotation error below K degrees",
        ),
        (
            "rta",
            vggt_rta,
            "relative translation accuracy: pairs with a direction error, sign folded, below K "
            "degrees",
        ),
        (
            "auc",
            vggt_auc,
            "area under the accuracy of relative poses up to K degrees, in bins of one degree",
        ),
    )
    for convention in get_args(Convention)
]
"""RRA, RTA and AUC, in each convention."""
