"""Robust registration of camera positions: PCR-99 with unknown scale (section 3, step 2).

The paper draws random triplets of cameras, prescreens them by the ratios of their edge lengths,
and takes the hypothesis whose m-th smallest position error is the smallest. There is no inlier
threshold and no refinement.

Inside this module points are stored component first, ``(3, n)``, so that every operation runs over
contiguous memory.
"""

from collections.abc import Callable
from itertools import combinations
from math import comb, inf
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from .similarity import Similarity

__all__ = ["Registration", "pcr99", "three_point_similarities"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

PRESCREEN_THRESHOLD = 0.1  # largest difference between the log edge ratios of a kept triplet
DRAWS_PER_HYPOTHESIS = 1000  # budget: after so many draws the hypotheses found so far are used
MAX_BATCH = 1 << 16  # triplets drawn at once, bounds the memory
TABLE_SIZE = 256  # up to so many cameras all edge ratios are computed once and looked up
FLAT = 1e-6  # sine of the angle at the first corner, below which a triangle has no usable normal
ROUNDING = 64 * float(np.finfo(np.float64).eps)  # of a squared error, relative to its terms
CHUNK = 1 << 15  # squared errors evaluated at once: 256 KiB, stays in the cache


class Registration(Protocol):
    """What `tas` calls to align the estimate: any function of this signature.

    It is given the cameras that were estimated, both worlds about their median and in units of
    their spread, and settings of which it uses what it needs. It returns the alignment, from ground
    truth to estimate (None where there is none), and the number of hypotheses it was chosen from.
    """

    def __call__(
        self,
        gt_positions: Floats,
        est_positions: Floats,
        /,
        *,
        order: int,
        threshold: float,
        n_hypotheses: int,
        rng: np.random.Generator,
    ) -> tuple[Similarity | None, int]:
        """Register ``(n, 3)`` estimated positions to the ground truth.

        ``order`` is m of the paper, ``threshold`` the largest error threshold in the given
        ground-truth units.
        """
        ...


def pcr99(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    order: int,
    threshold: float = inf,
    n_hypotheses: int,
    rng: np.random.Generator,
) -> tuple[Similarity | None, int]:
    """Register estimated camera positions to the ground truth, robustly and up to scale.

    The positions should be centred near the origin: the errors of all hypotheses come from one
    matrix product, which loses digits where the coordinates are large against the distances.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array
        Finite camera centres in the ground-truth and in the estimated world.
    order : int
        m of the paper, from 1 to n: the cost of a hypothesis is its m-th smallest position error.
    threshold : float
        Not used: taken since all registrations are called alike.
    n_hypotheses : int
        Number of prescreened triplets to collect. Where no more than so many triplets exist, all of
        them are used, each with its three possible first edges, and nothing is random.
    rng : numpy.random.Generator
        Source of the random triplets.

    Returns
    -------
    alignment : Similarity or None
        The cheapest hypothesis, from ground truth to estimate; None where no triplet passed.
    n_used : int
        Number of hypotheses it was chosen from.

    Notes
    -----
    O(n_hypotheses * n) time; memory is bounded by a constant plus O(n). Where triplets hardly ever
    pass, the search ends after ``1000 * n_hypotheses`` draws.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 3, step 2.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration import pcr99
    >>> rng = np.random.default_rng(0)
    >>> gt = rng.normal(size=(30, 3))
    >>> est = 2.0 * gt + [1.0, 2.0, 3.0]
    >>> est[:10] = rng.normal(size=(10, 3))
    >>> alignment, n_used = pcr99(gt, est, order=4, n_hypotheses=100, rng=rng)
    >>> round(alignment.scale, 6), n_used
    (2.0, 100)
    """
    gt = np.ascontiguousarray(gt_positions.T)
    est = np.ascontiguousarray(est_positions.T)
    with np.errstate(all="ignore"):  # non-finite ratios and errors lose every comparison
        triplets = _prescreened_triplets(gt, est, n_hypotheses, rng)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        scale, rotation, translation, flat = three_point_similarities(gt, est, triplets)
        best = _cheapest(gt, est, scale, rotation, translation, flat, order)
    return Similarity(float(scale[best]), rotation[best], translation[best]), n_used


def _prescreened_triplets(
    gt: Floats, est: Floats, n_hypotheses: int, rng: np.random.Generator
) -> Indices:
    """Collect the triplets that pass the prescreening test, (3, H)."""
    n = gt.shape[1]
    log_ratio = _log_edge_ratio(gt, est)
    if comb(n, 3) <= n_hypotheses:
        return _prescreen(_all_triplets(n), log_ratio)
    kept: Indices = np.empty((3, 0), dtype=np.intp)
    drawn, batch = 0, 2 * n_hypotheses
    while kept.shape[1] < n_hypotheses and drawn < DRAWS_PER_HYPOTHESIS * n_hypotheses:
        passed = _prescreen(rng.integers(n, size=(3, batch), dtype=np.intp), log_ratio)
        kept = np.concatenate([kept, passed], axis=1)
        drawn += batch
        missing = n_hypotheses - kept.shape[1]
        batch = min(MAX_BATCH, 64 + int(1.1 * missing * drawn / max(1, kept.shape[1])))
    return kept[:, :n_hypotheses]


def _all_triplets(n: int) -> Indices:
    """All triplets of n cameras, each three times: every edge is the first edge once."""
    i, j, k = np.array(list(combinations(range(n), 3)), dtype=np.intp).reshape(-1, 3).T
    return np.array([np.r_[i, j, k], np.r_[j, k, i], np.r_[k, i, j]])


def _prescreen(triplets: Indices, log_ratio: Callable[[Indices, Indices], Floats]) -> Indices:
    """Keep the triplets whose three log edge ratios differ pairwise by at most the threshold.

    Coincident, repeated and unbounded points give ratios that are not finite and pass no test.
    """
    i, j, k = triplets
    ij, ik = log_ratio(i, j), log_ratio(i, k)
    close = np.flatnonzero(np.abs(ij - ik) <= PRESCREEN_THRESHOLD)  # few are: spares the third
    ij, ik, triplets = ij[close], ik[close], triplets[:, close]
    jk = log_ratio(triplets[1], triplets[2])
    similar = (np.abs(jk - ij) <= PRESCREEN_THRESHOLD) & (np.abs(jk - ik) <= PRESCREEN_THRESHOLD)
    return triplets[:, similar]


def _log_edge_ratio(gt: Floats, est: Floats) -> Callable[[Indices, Indices], Floats]:
    """Return the function (i, j) -> log(|est_i - est_j| / |gt_i - gt_j|)."""
    n = gt.shape[1]
    if n <= TABLE_SIZE:
        cdist = scipy.spatial.distance.cdist
        table = np.log(cdist(est.T, est.T) / cdist(gt.T, gt.T)).ravel()
        return lambda i, j: table.take(i * n + j)

    def log_ratio(i: Indices, j: Indices) -> Floats:
        gt_edge = gt.take(i, axis=1) - gt.take(j, axis=1)
        est_edge = est.take(i, axis=1) - est.take(j, axis=1)
        ratio: Floats = np.log(_dot(est_edge, est_edge) / _dot(gt_edge, gt_edge)) / 2
        return ratio

    return log_ratio


def three_point_similarities(
    gt: Floats, est: Floats, triplets: Indices
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Similarities from ground truth to estimate, each from three cameras.

    The rotation takes the triangle's frame in the ground truth (first axis along the first edge,
    second along the normal) to its frame in the estimate; scale and translation are the
    least-squares ones about the two centroids. A triangle that is flat in either world has no
    normal: its rotation is the smallest that takes one first edge to the other. The spin about the
    line that is left open changes no position on that line.

    Parameters
    ----------
    gt, est : (3, n) array
        Camera centres, component first.
    triplets : (3, H) array of int
        Camera indices; the first edge goes from the first camera to the second.

    Returns
    -------
    scale : (H,) ndarray
    rotation : (H, 3, 3) ndarray
    translation : (H, 3) ndarray
    flat : (H,) ndarray of bool
        Where the triangle is flat.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 3, step 2.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration import three_point_similarities
    >>> gt = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    >>> triplets = np.array([[0], [1], [2]])
    >>> scale, _, translation, flat = three_point_similarities(gt, 2 * gt + 1, triplets)
    >>> scale, translation, flat
    (array([2.]), array([[1., 1., 1.]]), array([False]))
    """
    gt_corners, est_corners = gt.take(triplets, axis=1), est.take(triplets, axis=1)
    gt_1, gt_2 = gt_corners[:, 1] - gt_corners[:, 0], gt_corners[:, 2] - gt_corners[:, 0]
    est_1, est_2 = est_corners[:, 1] - est_corners[:, 0], est_corners[:, 2] - est_corners[:, 0]
    gt_frame, est_frame, flat = _frames(gt_1, gt_2, est_1, est_2)
    rotation = np.einsum("kih,kjh->ijh", est_frame, gt_frame)

    # With their frames' coordinates no triangle needs to be rotated to be compared.
    gt_edges = _dot(gt_1, gt_frame[0]), np.stack([_dot(gt_2, axis) for axis in gt_frame])
    est_edges = _dot(est_1, est_frame[0]), np.stack([_dot(est_2, axis) for axis in est_frame])
    scale = _corner_product(est_edges, gt_edges) / _corner_product(gt_edges, gt_edges)
    gt_centroid, est_centroid = gt_corners.mean(axis=1), est_corners.mean(axis=1)
    translation = est_centroid - scale * np.einsum("ijh,jh->ih", rotation, gt_centroid)
    return scale, rotation.transpose(2, 0, 1), translation.T, flat


def _corner_product(a: tuple[Floats, Floats], b: tuple[Floats, Floats]) -> Floats:
    """Sum of a . b over the corners about the centroids.

    Triangles are given by the length of the first edge, along the first axis, and the second edge.
    """
    (a_1, a_2), (b_1, b_2) = a, b
    product = _dot(a_2, b_2)
    cross_terms: Floats = a_1 * (b_1 + b_2[0]) + a_2[0] * b_1
    return a_1 * b_1 + product - (product + cross_terms) / 3


def _frames(
    gt_1: Floats, gt_2: Floats, est_1: Floats, est_2: Floats
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Frames (3 axes, 3, H) of triangles in both worlds, given by their two edges (3, H)."""
    gt_first, est_first = _unit(gt_1), _unit(est_1)
    gt_normal, est_normal = _cross(gt_first, _unit(gt_2)), _cross(est_first, _unit(est_2))
    sine_squared = np.minimum(_dot(gt_normal, gt_normal), _dot(est_normal, est_normal))
    flat = sine_squared <= FLAT**2
    if flat.any():
        axis = _common_normal(gt_first[:, flat], est_first[:, flat])
        gt_normal[:, flat] = est_normal[:, flat] = axis
    return _frame(gt_first, gt_normal), _frame(est_first, est_normal), flat


def _common_normal(gt_first: Floats, est_first: Floats) -> Floats:
    """Axis (3, H) of the smallest rotation between unit vectors; any normal if parallel."""
    axis = _cross(gt_first, est_first)
    parallel = np.flatnonzero(_dot(axis, axis) <= FLAT**2)
    direction = gt_first[:, parallel]
    least = np.zeros_like(direction)
    least[np.argmin(np.abs(direction), axis=0), np.arange(parallel.size)] = 1.0
    axis[:, parallel] = _cross(direction, least)
    return axis


def _frame(first: Floats, normal: Floats) -> Floats:
    """Right-handed orthonormal frames (3 axes, 3, H) from first axes and approximate normals."""
    second = _unit(normal - _dot(normal, first) * first)
    return np.stack([first, second, _cross(first, second)])


def _cheapest(
    gt: Floats,
    est: Floats,
    scale: Floats,
    rotation: Floats,
    translation: Floats,
    flat: NDArray[np.bool_],
    order: int,
) -> int:
    """Index of the hypothesis with the smallest ``order``-th smallest squared error.

    The squared errors of all cameras under all hypotheses are one matrix product. It tells which
    hypotheses can win: at least ``order`` of their squared errors lie below the smallest cost so
    far, give or take the rounding. Their costs are then computed directly.

    A flat triangle says nothing of the spin about its line, so it must beat all others by more than
    rounding: on a partly straight path many hypotheses fit ``order`` cameras exactly.
    """
    n = gt.shape[1]
    coefficients, features = _squared_error_factors(gt, est, scale, rotation, translation)
    # Where the error is small |est| / s is at most |t| / s + |gt|, and so bounds all terms.
    gt_extent = np.sqrt(np.max(features[4]))
    rounding = ROUNDING * (np.sqrt(coefficients[:, 17]) + gt_extent) ** 2

    best, best_cost = 0, np.inf
    for group in (np.flatnonzero(~flat), np.flatnonzero(flat)):
        start, size = 0, 16  # a small first chunk finds a good bound
        while start < len(group):
            chunk = group[start : start + size]
            bound = best_cost + rounding[chunk, None]
            # Counted this way round, NaN counts as below: to be looked at, not to be passed over.
            far = np.count_nonzero(coefficients[chunk] @ features >= bound, axis=1)
            able = chunk[far <= n - order]
            if able.size:
                costs = _costs(gt, est, scale[able], rotation[able], translation[able], order)
                cheapest = int(np.argmin(costs))
                if costs[cheapest] < best_cost:
                    best, best_cost = int(able[cheapest]), costs[cheapest]
            start, size = start + size, max(16, CHUNK // n)
        best_cost -= ROUNDING * gt_extent**2
    return best


def _squared_error_factors(
    gt: Floats, est: Floats, scale: Floats, rotation: Floats, translation: Floats
) -> tuple[Floats, Floats]:
    """Return matrices (H, 18) and (18, n) whose product is all squared errors.

    The squared error ``|est - t|^2 / s^2 - 2 (est - t) . (R gt) / s + |gt|^2`` is linear in 18
    products of the coordinates.
    """
    n = gt.shape[1]
    outer = (est[:, None] * gt).reshape(9, n)
    features = np.vstack([_dot(est, est), est, _dot(gt, gt), gt, outer, np.ones(n)])
    r, t = rotation / scale[:, None, None], translation / scale[:, None]
    coefficients = np.empty((len(scale), 18))
    coefficients[:, 0] = 1 / scale**2
    coefficients[:, 1:4] = -2 * t / scale[:, None]
    coefficients[:, 4] = 1
    coefficients[:, 5:8] = 2 * np.einsum("hij,hi->hj", rotation, t)
    coefficients[:, 8:17] = -2 * r.reshape(-1, 9)
    coefficients[:, 17] = np.einsum("hi,hi->h", t, t)
    return coefficients, features


def _costs(
    gt: Floats, est: Floats, scale: Floats, rotation: Floats, translation: Floats, order: int
) -> Floats:
    """Return the ``order``-th smallest squared error of each hypothesis."""
    residuals = (est - translation[..., None]) / scale[:, None, None] - rotation @ gt
    squared_errors = np.einsum("hin,hin->hn", residuals, residuals)
    return np.partition(squared_errors, order - 1, axis=1)[:, order - 1]


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def _unit(a: Floats) -> Floats:
    return a / np.sqrt(_dot(a, a))
