"""The relative and absolute errors of COLMAP's reconstruction benchmark, and their AUC."""

from collections.abc import Iterable, Iterator
from math import ceil, inf, log

import numpy as np
from numpy.typing import ArrayLike

from ..aligner import Seed
from ..arrays import Booleans, Floats, Indices
from ..validation import check_positive
from .alignment import ERRORS_AT_ONCE, Transform, fit, random_triplets
from .cameras import Cameras, Positions
from .relative import direction_blocks

__all__ = [
    "colmap_absolute_auc",
    "colmap_absolute_recall",
    "colmap_relative_auc",
    "colmap_relative_recall",
]


SHORTEST = 1e-10  # a shorter step is divided by this
FAILED = 180.0  # degrees
PIVOT = 3 * float(np.finfo(np.float64).eps)  # relative to the largest; smaller ones are no rank
CONFIDENCE = 0.99
TRIALS_FACTOR = 3
MIN_INLIER_RATIO = 0.1
REFITS = 10
# Both decide what a seed draws.
BATCH = 256  # samples drawn at once
BATCH_ERRORS = 1 << 16  # errors that they may have


def colmap_relative_auc(
    gt_poses: ArrayLike, est_poses: ArrayLike, max_error_deg: float, *, accuracy: float = 1e-3
) -> float:
    """Area under the recall of relative poses, as COLMAP's benchmark computes it.

    The error of an ordered pair of cameras is the larger of the angle between the relative
    rotations and the angle between the directions of the relative translations, 0 to 180 degrees;
    a direction is 0 where the true centres are closer than `accuracy`. The recall is interpolated
    linearly between the errors, from `accuracy` (as degrees) on, and flat after the last one.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same camera; the estimate in any world. All pairs
        of an estimate that is not finite have an error of 180 degrees.
    max_error_deg : float
        Upper end t of the area; the benchmark has 0.5, 1, 5, 10.
    accuracy : float
        Accuracy of the reference in metres: 0.001 for ETH3D and BlendedMVS, 0.02 for the Image
        Matching Challenge. The same number is used in degrees: smaller errors count as equal.

    Returns
    -------
    float
        Percent.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Notes
    -----
    The benchmark of one reference model and one estimated model.

    No sorting: of N pairs, K have errors up to t, the last of them e, and those above `accuracy`
    sum to S; the trapezoids are ``K t - S + (e - accuracy) / 2``, over ``N t``. O(n^2) time, O(n)
    memory.

    References
    ----------
    colmap/colmap, benchmark/reconstruction/evaluation/utils.py at ee667dd (2026).

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.protocols import colmap_relative_auc
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> gt[:, :3, 3] = np.eye(3)
    >>> est = gt.copy()
    >>> est[2, :3, :3] = Rotation.from_euler("x", 1.5, degrees=True).as_matrix()
    >>> round(colmap_relative_auc(gt, est, 3), 1)
    70.8
    """
    check_positive(max_error_deg, "max_error_deg")
    errors, n_pairs = _relative_errors(gt_poses, est_poses, accuracy)
    return interpolated_auc(errors, n_pairs, max_error_deg, accuracy)


def colmap_relative_recall(
    gt_poses: ArrayLike, est_poses: ArrayLike, max_error_deg: float, *, accuracy: float = 1e-3
) -> float:
    """Share of ordered pairs with an error up to `max_error_deg`; see `colmap_relative_auc`.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        As in `colmap_relative_auc`.
    max_error_deg : float
        Largest error in degrees.
    accuracy : float
        As there, in metres.

    Returns
    -------
    float
        Percent.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import colmap_relative_recall
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> est = gt.copy()
    >>> est[:, :3, 3] = np.eye(3)  # no direction counts: the true centres coincide
    >>> colmap_relative_recall(gt, est, 1)
    100.0
    """
    check_positive(max_error_deg, "max_error_deg")
    errors, n_pairs = _relative_errors(gt_poses, est_poses, accuracy)
    return _recall(errors, n_pairs, max_error_deg)


def _relative_errors(
    gt_poses: ArrayLike, est_poses: ArrayLike, accuracy: float
) -> tuple[Iterator[Floats], int]:
    """Return the errors of all ordered pairs, some thousand at a time, and their number."""
    check_positive(accuracy, "accuracy")
    cameras = Cameras.check(gt_poses, est_poses)
    n = len(cameras)
    return relative_errors(cameras, accuracy), max(n * (n - 1), 1)


def relative_errors(cameras: Cameras, accuracy: float) -> Iterator[Floats]:
    """Go through the errors of all ordered pairs in degrees; the list is never empty."""
    for convention in ("vggt", "mapanything"):  # each pair is seen from either camera
        for block in direction_blocks(cameras, convention):
            pairs = block.pairs
            lengths = np.maximum(block.gt_lengths, SHORTEST) * np.maximum(
                block.est_lengths, SHORTEST
            )
            directions = np.degrees(np.arccos(np.clip(block.dots / lengths, -1, 1)[pairs]))
            directions[block.gt_lengths[pairs] < accuracy] = 0
            yield np.maximum(directions, block.rotation_angles()[pairs])
    n, v = len(cameras), int(np.count_nonzero(cameras.estimated))
    failed = n * (n - 1) - v * (v - 1) if n > 1 else 1
    for start in range(0, failed, ERRORS_AT_ONCE):
        yield np.full(min(ERRORS_AT_ONCE, failed - start), FAILED)


def interpolated_auc(errors: Iterable[Floats], n: int, end: float, min_error: float) -> float:
    """Return the area under linearly interpolated recall up to an end, in percent of the box."""
    if end < min_error:
        within = sum(int(np.count_nonzero(part <= min_error)) for part in errors)
        return 100 * within / n
    count, total, last = 0, 0.0, min_error
    for part in errors:
        part = part[part <= end]
        count += len(part)
        part = part[part > min_error] if min_error > 0 else part
        total += float(part.sum())
        last = max(last, float(part.max(initial=min_error)))
    return 100 * (count * end - total + (last - min_error) / 2) / (n * end)


def _recall(errors: Iterable[Floats], n: int, end: float) -> float:
    return 100 * sum(int(np.count_nonzero(part <= end)) for part in errors) / n


def colmap_absolute_auc(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    max_error: float,
    *,
    accuracy: float = 1e-3,
    rng: Seed = 0,
) -> float:
    """Area under the recall of camera centres after a robust alignment, of COLMAP's benchmark.

    The similarity from estimate to reference is that of LO-RANSAC: the sample of three cameras, or
    refit to its inliers, with the most centres within `accuracy`. The rotations of the cameras are
    not used. For the area see `colmap_relative_auc`.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Camera centres, row i of both the same camera, the truth in metres, the estimate in any
        world. An estimate that is not finite has an infinite error.
    max_error : float
        Upper end of the area in metres; the benchmark has 0.02, 0.05, 0.2, 0.5.
    accuracy : float
        Accuracy of the reference in metres: 0.001 for ETH3D and BlendedMVS, 0.02 for the Image
        Matching Challenge. Inlier threshold; smaller errors count as equal.
    rng : int, SeedSequence, Generator or None
        Seed of the samples.

    Returns
    -------
    float
        Percent; 0 where no alignment has 3 inliers.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Notes
    -----
    A sample whose 3 x 3 matrix of coordinates is singular in either world is dropped: cameras in a
    plane, or on a line, through the world's origin are never aligned. The search stops at the
    number of samples that finds three inliers with probability 0.99 at the best inlier ratio so
    far, times 3, and after 13,809 samples. It is not repeated: values scatter with the seed.
    O(n) time for each sample, O(n) memory.

    References
    ----------
    colmap/colmap at ee667dd (2026): benchmark/reconstruction/evaluation/utils.py,
    src/colmap/estimators/alignment.cc, src/colmap/optim/loransac.h.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import colmap_absolute_auc
    >>> gt = np.random.default_rng(0).random((20, 3))
    >>> est = 2 * gt
    >>> est[:5] = np.nan
    >>> colmap_absolute_auc(gt, est, 0.05)
    75.0
    """
    check_positive(max_error, "max_error")
    errors = _absolute_errors(gt_positions, est_positions, accuracy, rng)
    return interpolated_auc([errors], len(errors), max_error, accuracy)


def colmap_absolute_recall(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    max_error: float,
    *,
    accuracy: float = 1e-3,
    rng: Seed = 0,
) -> float:
    """Share of cameras with a centre within `max_error`; see `colmap_absolute_auc`.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        As in `colmap_absolute_auc`.
    max_error : float
        Largest error in metres.
    accuracy : float
        Largest error of an inlier of the alignment in metres.
    rng : int, SeedSequence, Generator or None
        Seed of the samples.

    Returns
    -------
    float
        Percent.

    Examples
    --------
    Cameras in a plane through the origin are never aligned, however good they are:

    >>> import numpy as np
    >>> from alignscores.protocols import colmap_absolute_recall
    >>> gt = np.random.default_rng(0).random((20, 3))
    >>> gt[:, 2] = 0
    >>> colmap_absolute_recall(gt, gt, 0.05)
    0.0
    """
    check_positive(max_error, "max_error")
    errors = _absolute_errors(gt_positions, est_positions, accuracy, rng)
    return _recall([errors], len(errors), max_error)


def _absolute_errors(
    gt_positions: ArrayLike, est_positions: ArrayLike, accuracy: float, rng: Seed
) -> Floats:
    """Return the error of each camera after the alignment; infinite without one."""
    check_positive(accuracy, "accuracy")
    positions = Positions.check(gt_positions, est_positions)
    gt, est = positions.matched()
    errors = np.full(len(positions.gt), inf)
    transform = locally_optimised_ransac(est, gt, accuracy, np.random.default_rng(rng))
    if transform is not None:
        errors[positions.estimated] = transform.distances(est, gt)
    return errors


@np.errstate(all="ignore")  # what is not finite is never an inlier
def locally_optimised_ransac(
    source: Floats,
    target: Floats,
    threshold: float,
    rng: np.random.Generator,
    *,
    confidence: float = CONFIDENCE,
    trials: tuple[int, float] = (0, inf),
) -> Transform | None:
    """Return COLMAP's robust similarity from source to target; None without 3 inliers.

    It draws at least and at most so many `trials`; by default as in COLMAP's benchmark.
    """
    n = len(source)
    if n < 3:
        return None
    best: tuple[int, float] = (0, -inf)  # inliers, and minus the sum of their squared residuals
    chosen = None
    least, most = trials
    limit = min(_trials(MIN_INLIER_RATIO**3, confidence), most)
    done = 0
    while done < limit:
        batch = min(BATCH, max(1, BATCH_ERRORS // n))
        samples = random_triplets(n, batch, rng)
        usable = np.flatnonzero(_spans_space(source[samples]) & _spans_space(target[samples]))
        samples = samples[usable]
        transforms = _models(source[samples], target[samples])
        counts, costs = _support(transforms, source, target, threshold)
        for k, trial in enumerate(usable):
            if done + trial >= limit:
                break
            support = int(counts[k]), -float(costs[k])
            if support <= best:
                continue
            best, chosen = support, transforms[k]
            if best[0] > 3:
                best, chosen = _refitted(chosen, best, source, target, threshold)
            ratio = np.prod([(best[0] - i) / (n - i) for i in range(3)])
            limit = max(min(limit, _trials(float(ratio), confidence)), least)
        done += batch
    return chosen if best[0] >= 3 else None


def _trials(probability: float, confidence: float) -> int:
    """Return how many samples are drawn where each is of inliers alone with a probability."""
    if probability <= 0:
        return np.iinfo(np.int64).max
    if probability >= 1:
        return 1
    return ceil(TRIALS_FACTOR * log(1 - confidence) / log(1 - probability))


def _refitted(
    transform: Transform,
    best: tuple[int, float],
    source: Floats,
    target: Floats,
    threshold: float,
) -> tuple[tuple[int, float], Transform]:
    """Fit to the inliers while that gives more of them, or the same closer."""
    for _ in range(REFITS):
        inliers = transform.distances(source, target) <= threshold
        points = source[inliers][None], target[inliers][None]
        if not (_spans_space(points[0]) & _spans_space(points[1]))[0]:
            break
        models = _models(*points)
        counts, costs = _support(models, source, target, threshold)
        support = int(counts[0]), -float(costs[0])
        if support <= best:
            break
        best, transform = support, models[0]
    return best, transform


def _models(source: Floats, target: Floats) -> Transform:
    """Fit (H, k, 3) points; where they coincide the scale is not finite, and nothing an inlier."""
    return fit(source, target).least_squares()


def _support(
    transforms: Transform, source: Floats, target: Floats, threshold: float
) -> tuple[Indices, Floats]:
    squares = transforms.squared_distances(source, target)
    inliers = squares <= threshold**2
    return np.count_nonzero(inliers, axis=-1), np.where(inliers, squares, 0).sum(axis=-1)


def _spans_space(points: Floats) -> Booleans:
    """Tell whether (H, k, 3) matrices of points have rank 3, by elimination with full pivoting."""
    matrices = points.copy()
    rows = np.arange(len(matrices))
    largest = np.zeros(len(matrices))
    full = np.ones(len(matrices), dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(3):
            flat = np.abs(matrices).reshape(len(matrices), -1)
            at = flat.argmax(axis=1)
            pivots = flat[rows, at]
            largest = np.maximum(largest, pivots)
            full &= pivots > PIVOT * largest
            row, column = np.divmod(at, 3)
            pivot_rows = matrices[rows, row] / matrices[rows, row, column][:, None]
            matrices -= matrices[rows, :, column][:, :, None] * pivot_rows[:, None, :]
            matrices[rows, row] = 0
            matrices[rows, :, column] = 0
    return full
