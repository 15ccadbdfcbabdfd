"""Robust registration of camera positions: PCR-99 with unknown scale (section 3, step 2).

The paper draws random triplets of cameras, prescreens them by the ratios of their edge lengths,
and takes the hypothesis whose m-th smallest position error is the smallest. There is no inlier
threshold and no refinement.

Inside this module points are stored component first, ``(3, n)``, so that every operation runs over
contiguous memory.
"""

import sys
from collections.abc import Callable
from itertools import combinations
from math import ceil, comb, inf
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from .similarity import Similarity, common_normal, cross

__all__ = ["Registration", "pcr99", "three_point_similarities"]

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Indices = NDArray[np.intp]

PRESCREEN_THRESHOLD = 0.1  # largest difference between the log edge ratios of a kept triplet
DRAWS_PER_HYPOTHESIS = 1000  # budget: after so many draws the hypotheses found so far are used
MAX_BATCH = 1 << 16  # triplets drawn at once, bounds the memory
SCREENED_AT_ONCE = 1 << 13  # triplets; their temporaries stay in the cache
TABLE_SIZE = 128  # up to so many cameras all edge ratios are computed once and looked up
FLAT = 1e-6  # sine of the angle at the first corner, below which a triangle has no usable normal
PAIRS = [0, 1, 2, 3, 0, 0, 0, 1, 1, 2], [0, 1, 2, 3, 1, 2, 3, 2, 3, 3]  # squares first
EPS = float(np.finfo(np.float32).eps)
ROUNDING = 256  # eps, of a squared error that is a sum of products, relative to its terms
CANCELLED = 1e-22  # likewise of what double precision loses, relative to squared coordinates
UNDERFLOW = 1e-19  # of products in single precision
LARGEST = 2.0**59  # square; sums of products of two such fit into single precision
TIE = 64 * float(np.finfo(np.float64).eps)  # of a squared error, relative to the largest |gt|^2
FIRST_CHUNK, GROWTH = 8, 32  # hypotheses: few find a good bound that spares most of the others
FEW = 1 << 12  # squared errors that are computed directly as quickly
LARGEST_CHUNK = 1 << 10
BLOCK = 128  # cameras evaluated at once: errors stay in the cache, a byte can count them
STRIP = 8  # cameras in a matrix product: BLAS keeps so small ones on one thread
CHUNK = 1 << 14  # coordinates evaluated at once: 128 KiB, stay in the cache


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
    prescreen: float = PRESCREEN_THRESHOLD,
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
    prescreen : float
        Largest difference between the log edge ratios of a triplet that is kept; infinite: all are,
        but for those with coincident cameras.

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
        triplets = _prescreened_triplets(gt, est, n_hypotheses, rng, prescreen)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        scale, rotation, translation, flat = three_point_similarities(gt, est, triplets)
        best = _cheapest(gt, est, scale, rotation, translation, flat, order)
    return Similarity(float(scale[best]), rotation[best], translation[best]), n_used


def _prescreened_triplets(
    gt: Floats,
    est: Floats,
    n_hypotheses: int,
    rng: np.random.Generator,
    threshold: float = PRESCREEN_THRESHOLD,
) -> Indices:
    """Collect the triplets that pass the prescreening test, (3, H)."""
    n = gt.shape[1]
    log_ratio = _log_edge_ratio(gt, est)
    if comb(n, 3) <= n_hypotheses:
        return _prescreen(_all_triplets(n), log_ratio, threshold)
    kept: Indices = np.empty((3, 0), dtype=np.intp)
    drawn, batch = 0, 2 * n_hypotheses
    while kept.shape[1] < n_hypotheses and drawn < DRAWS_PER_HYPOTHESIS * n_hypotheses:
        triplets = rng.integers(n, size=(3, batch), dtype=np.intp)
        parts = [triplets[:, i : i + SCREENED_AT_ONCE] for i in range(0, batch, SCREENED_AT_ONCE)]
        kept = np.concatenate(
            [kept, *(_prescreen(part, log_ratio, threshold) for part in parts)], axis=1
        )
        drawn += batch
        missing = n_hypotheses - kept.shape[1]
        batch = min(MAX_BATCH, 64 + int(1.1 * missing * drawn / max(1, kept.shape[1])))
    return kept[:, :n_hypotheses]


def _all_triplets(n: int) -> Indices:
    """All triplets of n cameras, each three times: every edge is the first edge once."""
    i, j, k = np.array(list(combinations(range(n), 3)), dtype=np.intp).reshape(-1, 3).T
    return np.array([np.r_[i, j, k], np.r_[j, k, i], np.r_[k, i, j]])


def _prescreen(
    triplets: Indices, log_ratio: Callable[[Indices, Indices], Floats], threshold: float
) -> Indices:
    """Keep the triplets whose three log edge ratios differ pairwise by at most the threshold.

    Coincident, repeated and unbounded points give ratios that are not finite and pass no test.
    """
    threshold = min(threshold, sys.float_info.max)  # which an infinite difference exceeds
    i, j, k = triplets
    ij, ik = log_ratio(i, j), log_ratio(i, k)
    close = np.flatnonzero(np.abs(ij - ik) <= threshold)  # few are: spares the third
    ij, ik, triplets = ij.take(close), ik.take(close), triplets.take(close, axis=1)
    jk = log_ratio(triplets[1], triplets[2])
    similar = (np.abs(jk - ij) <= threshold) & (np.abs(jk - ik) <= threshold)
    return triplets.compress(similar, axis=1)


def _log_edge_ratio(gt: Floats, est: Floats) -> Callable[[Indices, Indices], Floats]:
    """Return the function (i, j) -> log(|est_i - est_j| / |gt_i - gt_j|)."""
    n = gt.shape[1]
    if n <= TABLE_SIZE:
        gt_squared, est_squared = (
            scipy.spatial.distance.cdist(points.T, points.T, "sqeuclidean") for points in (gt, est)
        )
        table = (np.log(est_squared / gt_squared) / 2).ravel()
        return lambda i, j: table.take(i * n + j)

    points = np.stack([gt, est], axis=1)

    def log_ratio(i: Indices, j: Indices) -> Floats:
        edges = points.take(i, axis=2) - points.take(j, axis=2)
        gt_squared, est_squared = _dot(edges, edges)
        ratio: Floats = np.log(est_squared / gt_squared) / 2
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
    # Both worlds side by side: (3 components, 2 worlds, ...).
    corners = np.stack([gt, est], axis=1).take(triplets, axis=2)
    edge_1 = corners[:, :, 1] - corners[:, :, 0]
    edge_2 = corners[:, :, 2] - corners[:, :, 0]
    frames, flat = _frames(edge_1, edge_2)
    rotation = np.einsum("kih,kjh->ijh", frames[:, :, 1], frames[:, :, 0])

    # Sum of b . (R a) over sum of a . a, about the centroids. R takes first axis to first axis, so
    # that three of the four products of edges follow from their lengths along these.
    (a_1, b_1), (a_2, b_2) = _dot(edge_1, frames[0]), _dot(edge_2, frames[0])
    a_22 = _dot(edge_2[:, 0], edge_2[:, 0])
    b_22 = _dot(edge_2[:, 1], np.einsum("ijh,jh->ih", rotation, edge_2[:, 0]))
    scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1) / (2 * (a_1 * a_1 + a_22 - a_1 * a_2))
    gt_centroid, est_centroid = (np.add.reduce(corners, axis=2) / 3).swapaxes(0, 1)
    translation = est_centroid - scale * np.einsum("ijh,jh->ih", rotation, gt_centroid)
    return scale, rotation.transpose(2, 0, 1), translation.T, flat


def _frames(edge_1: Floats, edge_2: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Frames (3 axes, 3, 2, H) of triangles in both worlds, given by their two edges (3, 2, H)."""
    frames = np.empty((3, *edge_1.shape))
    first, normal, _ = frames
    first[:] = edge_1 / np.sqrt(_dot(edge_1, edge_1))
    normal[:] = cross(first, edge_2)
    flat: NDArray[np.bool_] = np.any(_dot(normal, normal) <= FLAT**2 * _dot(edge_2, edge_2), axis=0)
    if flat.any():
        np.copyto(normal, common_normal(first[:, 0], first[:, 1])[:, None], where=flat)
    normal -= _dot(normal, first) * first  # an approximate normal until here
    normal /= np.sqrt(_dot(normal, normal))
    frames[2] = cross(first, normal)
    return frames, flat


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

    The costs of few hypotheses are computed directly. Any other can only win if at least ``order``
    of its squared errors lie below the smallest cost so far, give or take the rounding: a matrix
    product in single precision dismisses nearly all.

    A flat triangle says nothing of the spin about its line, so it must beat all others by more than
    rounding: on a partly straight path many hypotheses fit ``order`` cameras exactly.
    """
    n = gt.shape[1]
    hypotheses = scale, rotation, translation
    tie = min(TIE * float(np.max(_dot(gt, gt))), sys.float_info.max)
    best, best_cost, factors = 0, inf, None
    for group in (np.flatnonzero(~flat), np.flatnonzero(flat)):
        start, size = 0, max(FIRST_CHUNK, FEW // n)
        while start < len(group):
            able = group[start : start + size]
            if start:
                factors = factors or _squared_error_factors(gt, est, *hypotheses, best)
                far = _count_far(factors[0].take(able, axis=1), factors[1], best_cost)
                able = able[far <= n - order]
            best, best_cost = _cheaper(gt, est, *hypotheses, order, able, best, best_cost)
            start, size = start + size, min(GROWTH * size, LARGEST_CHUNK)
        best_cost -= tie
    return best


def _squared_error_factors(
    gt: Floats, est: Floats, scale: Floats, rotation: Floats, translation: Floats, reference: int
) -> tuple[Singles, Singles]:
    """Return matrices (23, H) and (blocks, 23, cameras) whose product is all squared errors.

    Under the reference hypothesis (s', R', t') a camera has the residual
    ``d = R'^T (est - t') / s' - gt``. Under another one the error is the length of
    ``k d + B [gt, 1]`` with ``k = s' / s`` and ``B = [k I - R'^T R, R'^T (t' - t) / s]``. The
    square is linear in 10 products within [gt, 1], 12 of d with [gt, 1], and |d|^2. Nothing large
    cancels out, as it would in products of the coordinates of both worlds.

    With b = |B| |[gt, 1]|, the magnitudes of the 23 terms sum to at most (k |d| + b)^2, and
    k |d| <= e + b for an error e: to less than 5 (b^2 + e^2). Rounding of factors and sum changes
    no term by more than 17 eps. So ROUNDING eps of b^2 are taken off here, of e^2 where it is
    compared; and CANCELLED of the squared coordinates, for what B, d and the directly computed
    errors lose in double precision.
    """
    n = gt.shape[1]
    back, origin = rotation[reference].T, translation[reference]
    k = scale[reference] / scale
    turns = -(back @ rotation.transpose(1, 2, 0).reshape(3, -1)).reshape(9, -1)
    turns[::4] += k
    b = np.empty((3, 4, len(k)), dtype=np.float32)
    b[:, :3] = turns.reshape(3, 3, -1)
    b[:, 3] = back @ (origin - translation).T / scale
    k = k.astype(np.float32)
    coefficients = np.empty((23, len(k)), dtype=np.float32)
    np.einsum("ijh,ijh->jh", *(b.take(i, axis=1) for i in PAIRS), out=coefficients[:10])
    np.multiply(b.reshape(12, -1), k, out=coefficients[10:22])
    k *= k
    norm = np.add.reduce(coefficients[:4])
    cancelled = np.float32(CANCELLED * (1 + origin @ origin / scale[reference] ** 2))
    coefficients[:4] -= ROUNDING * EPS * norm + cancelled * (1 + k)
    # Where products might overflow, NaN makes the screening say nothing.
    coefficients[22] = np.where(norm + k < LARGEST, k, np.nan)

    width = min(BLOCK, STRIP * ceil(n / STRIP))  # the last block is filled up with NaN
    points = np.full((7, width * ceil(n / width)), np.nan, dtype=np.float32)
    points[:3, :n], points[3, :n] = gt, 1
    points[4:, :n] = back @ (est - origin[:, None]) / scale[reference] - gt
    blocks = points.reshape(7, -1, width).swapaxes(0, 1)
    ones, d = blocks[:, :4], blocks[:, 4:]
    features = np.empty((len(blocks), 23, width), dtype=np.float32)
    left, right = (ones.take(i, axis=1) for i in PAIRS)
    np.multiply(left, right, out=features[:, :10])
    np.multiply(d[:, :, None], ones[:, None], out=features[:, 10:22].reshape(-1, 3, 4, width))
    features[:, 4:22] *= 2
    squares = np.einsum("bin,bin->bn", d, d)
    size = squares + np.add.reduce(features[:, :4], axis=1)
    features[:, 22] = np.where(size < LARGEST, squares, np.nan)
    return coefficients, features


def _count_far(coefficients: Singles, features: Singles, bound: float) -> Indices:
    """Count the cameras with a squared error certainly not below a bound, for each hypothesis.

    NaN is not far: to be looked at, not to be passed over.
    """
    certain = np.float32(bound * (1 + ROUNDING * EPS) + UNDERFLOW)
    far = np.zeros(coefficients.shape[1], dtype=np.intp)
    for block in features:
        strips = block.reshape(23, -1, STRIP).transpose(1, 2, 0)
        above = (strips @ coefficients >= certain).reshape(-1, len(far))
        far += np.add.reduce(above.view(np.uint8), axis=0, dtype=np.uint8)
    return far


def _cheaper(
    gt: Floats,
    est: Floats,
    scale: Floats,
    rotation: Floats,
    translation: Floats,
    order: int,
    able: Indices,
    best: int,
    best_cost: float,
) -> tuple[int, float]:
    """Return the cheapest of some hypotheses and its cost, or the best so far."""
    size = max(1, CHUNK // est.size)
    for start in range(0, len(able), size):
        some = able[start : start + size]
        residuals = est - translation[some, :, None]
        residuals /= scale[some, None, None]
        residuals -= rotation[some] @ gt
        squared_errors = np.einsum("hin,hin->hn", residuals, residuals)
        n_near = np.add.reduce(squared_errors < best_cost, axis=1, dtype=np.intp)
        cheaper = np.flatnonzero(n_near >= order)
        if cheaper.size:  # few are: spares the selection
            squared_errors = squared_errors.take(cheaper, axis=0)
            squared_errors.partition(order - 1, axis=1)
            costs = squared_errors[:, order - 1]
            cheapest = costs.argmin()
            best, best_cost = int(some[cheaper[cheapest]]), float(costs[cheapest])
    return best, best_cost


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("i...,i...->...", a, b)
    return product
