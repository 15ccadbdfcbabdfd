"""Registration that maximises the score: a repeatable alternative to PCR-99.

TAS is, up to the step between its thresholds, the mean of ``max(0, 1 - e / T)`` over the cameras,
T being the largest threshold. So the alignment that maximises it minimises the truncated L1 cost
``sum(min(e, T))``. The derivation is in ``docs/refined-registration.md``.

An alignment is stored as the (3, 7) matrix that takes a camera's stacked coordinates
``[est, gt, 1]`` to its residual ``(est - translation) / scale - rotation @ gt``.
"""

import numpy as np
import scipy
from numpy.typing import NDArray

from ..similarity import FARTHEST_SQUARABLE, Similarity, weighted_similarities
from .kernel import three_point_similarities
from .pcr99 import component_first, prescreened_triplets

__all__ = ["refined"]

Floats = NDArray[np.float64]

N_STARTS = 64  # hypotheses that are refined; their number is halved in each step
N_CROWDED_PLACES = 4  # where most cameras stand; each is tried as a start, too
N_FINALISTS = 8  # alignments left that are refined with all cameras
SAMPLE = 1000  # cameras with which the starts are refined until few are left
SMALL_SAMPLE = 250  # cameras with which hopeless hypotheses are sorted out
RESOLUTION = 0.01  # of the largest threshold: finer differences between errors do not count
TOLERANCE = 1e-5  # gain in score; refinement ends with the first step that gains less
CHUNK = 1 << 14  # errors evaluated at once: 128 KiB, which fit in the cache


def refined(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    rank: int = 0,
    threshold: float,
    n_hypotheses: int,
    rng: np.random.Generator,
) -> tuple[Similarity | None, int]:
    """Register estimated camera positions to the ground truth so that the TAS is the largest.

    The hypotheses are those of PCR-99. The best of them by the truncated L1 cost, and fits to the
    places where most cameras stand, are refined by iteratively reweighted least squares; in each
    step the worse half is dropped.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array
        Finite camera centres in the ground-truth and in the estimated world, near the origin.
    rank : int
        Not used; accepted because all registrations are called with the same arguments.
    threshold : float
        T, the largest position error that counts, in ground-truth units.
    n_hypotheses : int
        Number of prescreened triplets to collect; see `pcr99`.
    rng : numpy.random.Generator
        Source of the random triplets.

    Returns
    -------
    alignment : Similarity or None
        The refined alignment, from ground truth to estimate; None where no triplet passed.
    n_used : int
        Number of hypotheses of PCR-99.

    Raises
    ------
    ValueError
        Where the positions are not (n, 3) arrays of one length.

    Notes
    -----
    The cost has local minima. The smallest is found from nearly every seed, which is why the score
    repeats, but there is no guarantee.

    References
    ----------
    ``docs/refined-registration.md``. Not in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration import refined
    >>> rng = np.random.default_rng(0)
    >>> gt = rng.normal(size=(30, 3))
    >>> est = 2.0 * gt + [1.0, 2.0, 3.0]
    >>> est[:10] = rng.normal(size=(10, 3))
    >>> alignment, n_used = refined(gt, est, threshold=0.3, n_hypotheses=100, rng=rng)
    >>> round(alignment.scale, 6), n_used
    (2.0, 100)
    """
    gt, est = component_first(gt_positions, est_positions)
    threshold = min(max(threshold, 1 / FARTHEST_SQUARABLE), FARTHEST_SQUARABLE)
    with np.errstate(all="ignore"):  # NaN and infinity never win a comparison
        triplets = prescreened_triplets(gt, est, n_hypotheses, rng)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        alignments = _residual_matrices(*three_point_similarities(gt, est, triplets)[:3])
        points = np.vstack([est, gt, np.ones(gt.shape[1])])
        points = _shuffled(points.clip(-FARTHEST_SQUARABLE, FARTHEST_SQUARABLE))
        sample = points[:, :SAMPLE]
        if points.shape[1] > SMALL_SAMPLE:
            alignments = _cheapest(alignments, points[:, :SMALL_SAMPLE], threshold, 4 * N_STARTS)
        alignments = _cheapest(alignments, sample, threshold, N_STARTS)
        alignments = np.concatenate([alignments, _crowded_place_fits(sample, threshold)])
        alignments = _refine(alignments, sample, threshold, n_left=N_FINALISTS, tolerance=np.inf)
        alignments = _refine(alignments, points, threshold, n_left=1, tolerance=TOLERANCE)
    best = alignments[0]
    scale = 1 / float(best[0, 0])
    return Similarity(scale, -best[:, 3:6], -scale * best[:, 6]), n_used


def _shuffled(points: Floats) -> Floats:
    """Return the cameras in random order, so that the first of them are a fair sample.

    The order does not depend on the seed of the registration.
    """
    return points.take(np.random.default_rng(0).permutation(points.shape[1]), axis=1)


def _cheapest(alignments: Floats, points: Floats, threshold: float, n_left: int) -> Floats:
    """Return the ``n_left`` cheapest alignments, the cheapest first."""
    size = max(16, CHUNK // points.shape[1])
    costs = [
        _costs(_smoothed_errors(alignments[start : start + size], points, threshold), threshold)
        for start in range(0, len(alignments), size)
    ]
    return alignments[np.argsort(np.concatenate(costs), kind="stable")[:n_left]]


def _crowded_place_fits(points: Floats, threshold: float) -> Floats:
    """Return the least-squares alignments of the cameras around each of the most crowded places.

    An estimate that is shrunk to a place where many cameras stand scores all of them, however wrong
    it is. Where that is the best alignment, hypotheses of three cameras hardly ever find it.
    """
    est, gt = points[:3].T, points[3:6].T
    candidates = gt[:SMALL_SAMPLE]
    distances = scipy.spatial.distance.cdist(candidates, candidates)
    crowded = np.argsort(_costs(distances, threshold), kind="stable")[:N_CROWDED_PLACES]
    around = scipy.spatial.distance.cdist(candidates[crowded], gt) < threshold
    return _residual_matrices(*weighted_similarities(gt, est, around.astype(np.float64)))


def _refine(
    alignments: Floats, points: Floats, threshold: float, *, n_left: int, tolerance: float
) -> Floats:
    """Refine alignments by iteratively reweighted least squares; return the best, cheapest first.

    The worse half is dropped in each step, until ``n_left`` are left and none of them gains more
    than the tolerance. In exact arithmetic no step raises a cost where the cameras within the
    threshold determine the fit; a step that does is not taken.
    """
    est, gt = points[:3].T, points[3:6].T
    errors = _smoothed_errors(alignments, points, threshold)
    costs = _costs(errors, threshold)
    gains = np.full(len(costs), np.inf)
    while len(alignments) > n_left or np.any(gains > tolerance * threshold * len(gt)):
        weights = np.where(errors < threshold, 1 / errors, 0.0)
        steps = _residual_matrices(*weighted_similarities(gt, est, weights))
        step_errors = _smoothed_errors(steps, points, threshold)
        step_costs = _costs(step_errors, threshold)
        gains = costs - step_costs
        better = gains > 0
        alignments[better], errors[better] = steps[better], step_errors[better]
        costs[better] = step_costs[better]
        kept = np.argsort(costs, kind="stable")[: max(n_left, len(costs) // 2)]
        alignments, errors, costs, gains = alignments[kept], errors[kept], costs[kept], gains[kept]
    return alignments


def _residual_matrices(scale: Floats, rotation: Floats, translation: Floats) -> Floats:
    """Return similarities as the (H, 3, 7) matrices that give the residuals."""
    matrices = np.empty((len(scale), 3, 7))
    matrices[:, :, :3] = np.eye(3) / scale[:, None, None]
    matrices[:, :, 3:6] = -rotation
    matrices[:, :, 6] = -translation / scale[:, None]
    return matrices


def _smoothed_errors(alignments: Floats, points: Floats, threshold: float) -> Floats:
    """Return ``sqrt(e^2 + r^2)`` of all cameras under all alignments, (H, n), r the resolution."""
    x, y, z = (alignments[:, i] @ points for i in range(3))
    x *= x
    y *= y
    z *= z
    x += y
    x += z
    x += (RESOLUTION * threshold) ** 2
    return np.sqrt(x, out=x)


def _costs(errors: Floats, threshold: float) -> Floats:
    """Return the truncated L1 cost of each alignment."""
    costs: Floats = np.minimum(errors, threshold).sum(axis=1)
    return costs
