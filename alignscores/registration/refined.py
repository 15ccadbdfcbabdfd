"""Registration that maximises the score: a repeatable alternative to PCR-99.

TAS is, up to the step between its thresholds, the mean of ``max(0, 1 - e / T)`` over the cameras,
T being the largest threshold. So the alignment that maximises it minimises the truncated L1 cost
``sum(min(e, T))``. ``docs/explanation/registration.md`` derives the search.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, product
from math import comb

import numpy as np

from ..arrays import Floats, Indices
from ..similarity import FARTHEST_SQUARABLE, Similarity, dot
from .hypotheses import three_point_similarities
from .pcr99 import all_triplets, component_first, prescreened_triplets
from .reweighting import lane_sums, refine, truncated_costs, weighted_fits

__all__ = ["Search", "order_of", "refined"]


N_STARTS = 64  # hypotheses that are refined; their number is halved in each step
FEW = 30  # cameras up to which all triplets are tried
SEVERAL = 60  # cameras up to which twice as many triplets are drawn, and refined
N_SUBSETS = 300  # of few cameras, fits to which are tried, too
MORE = 10.0  # weight of one camera of a subset, where that of the others is 1
N_NEIGHBOURHOODS = 4  # the densest ones; a fit to each is tried as a start, too
N_FINALISTS = 8  # alignments left that are refined with all cameras
SAMPLE = 1000  # cameras with which the starts are refined until few are left
SMALL_SAMPLE = 250  # cameras with which hopeless hypotheses are sorted out
RESOLUTION = 0.01  # of the largest threshold: finer differences between errors do not count
TOLERANCE = 1e-5  # gain in score; refinement ends with the first step that gains less
FINE_TOLERANCE = 1e-9  # of up to SEVERAL cameras, where steps cost little


def refined(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    rank: int = 0,
    threshold: float,
    n_hypotheses: int,
    rng: np.random.Generator,
    alignment: str = "similarity",
) -> tuple[Similarity | None, int]:
    """Register estimated positions (n, 3) to the ground truth so that the TAS is the largest.

    The hypotheses are those of PCR-99, all triplets of up to 30 cameras and twice ``n_hypotheses``
    of up to 60; ``rank`` is not used. The best of them by the truncated L1 cost, and fits to the
    densest neighbourhoods, are refined by iteratively reweighted least squares; in each step the
    worse half is dropped. The cost has local minima. The smallest is found from nearly every seed,
    which is why the score repeats, but there is no guarantee.
    """
    search = Search(
        gt_positions, est_positions, n_hypotheses=n_hypotheses, rng=rng, alignment=alignment
    )
    return search.best(threshold), search.n_used


class Search:
    """Search for the alignment that maximises the TAS, at one or at several largest thresholds.

    The ``n_used`` hypotheses are drawn once. What is found at one threshold is a start at the next.
    The first of several, the extent of the scene, only leads to the next, so few starts do there.
    """

    def __init__(
        self,
        gt_positions: Floats,
        est_positions: Floats,
        *,
        n_hypotheses: int,
        rng: np.random.Generator,
        alignment: str = "similarity",
        several: bool = False,
    ) -> None:
        gt, est = component_first(gt_positions, est_positions)
        order = order_of(gt.shape[1])
        clipped = (points.clip(-FARTHEST_SQUARABLE, FARTHEST_SQUARABLE) for points in (gt, est))
        shuffled_gt, shuffled_est = (points.take(order, axis=1) for points in clipped)
        self._cameras = Cameras(shuffled_gt, shuffled_est, alignment)
        with np.errstate(all="ignore"):  # NaN and infinity never win a comparison
            triplets = triplets_to_try(gt, est, n_hypotheses, rng, alignment)
            scale, rotation, translation, _ = three_point_similarities(gt, est, triplets, alignment)
            hypotheses = np.hstack([scale[:, None], rotation.reshape(-1, 9), translation])
            if self._cameras.n <= FEW:
                hypotheses = np.concatenate([hypotheses, self._cameras.subset_fits()])
            usable = np.isfinite(hypotheses).all(axis=1) & (hypotheses[:, 0] > 0)
            self._hypotheses = hypotheses[usable]
            self.n_used = len(self._hypotheses)
        self._found = np.empty((0, 13))
        self._several = several

    def best(self, threshold: float) -> Similarity | None:
        """Return the best alignment for a largest threshold; None where there is none."""
        threshold = min(max(threshold, 1 / FARTHEST_SQUARABLE), FARTHEST_SQUARABLE)
        cameras, sample = self._cameras, self._cameras.first(SAMPLE)
        with np.errstate(all="ignore"):
            starts = self._hypotheses
            if cameras.n > SMALL_SAMPLE:
                starts = cameras.first(SMALL_SAMPLE).cheapest(starts, threshold, 4 * N_STARTS)
            many = cameras.n > SEVERAL
            n_starts = N_STARTS if many else 2 * N_STARTS
            if self._several and not len(self._found):
                n_starts = N_FINALISTS
            tolerance = TOLERANCE if many else FINE_TOLERANCE
            starts = sample.cheapest(starts, threshold, n_starts)
            starts = np.concatenate([starts, sample.neighbourhood_fits(threshold)])
            starts = sample.refine(starts, threshold, n_left=N_FINALISTS, tolerance=np.inf)
            starts = np.concatenate([starts, self._found])
            best = cameras.refine(starts, threshold, n_left=1, tolerance=tolerance)
        if not (np.isfinite(best[0]).all() and best[0, 0] > 0):
            return None
        self._found = best
        return Similarity(float(best[0, 0]), best[0, 1:10].reshape(3, 3), best[0, 10:])


@dataclass(frozen=True)
class Cameras:
    """Finite camera centres in both worlds, component first, (3, n)."""

    gt: Floats
    est: Floats
    alignment: str = "similarity"

    @property
    def n(self) -> int:
        """Number of cameras."""
        return int(self.gt.shape[1])

    def first(self, n: int) -> "Cameras":
        """Return the first n cameras, or all where there are fewer."""
        gt, est = (np.ascontiguousarray(points[:, :n]) for points in (self.gt, self.est))
        return Cameras(gt, est, self.alignment)

    def cheapest(self, similarities: Floats, threshold: float, n_left: int) -> Floats:
        """Return the ``n_left`` cheapest similarities, the cheapest first."""
        costs = self.costs(similarities, threshold)
        return similarities[np.argsort(costs, kind="stable")[:n_left]]

    def costs(self, similarities: Floats, threshold: float) -> Floats:
        """Return the truncated L1 cost of each similarity."""
        return truncated_costs(self.gt, self.est, similarities, threshold, RESOLUTION * threshold)

    def neighbourhood_fits(self, threshold: float) -> Floats:
        """Return the least-squares fits to all cameras, and to those within T of a camera.

        An estimate that is shrunk to a place where many cameras stand scores all of them, however
        wrong it is. Where that is the best alignment, hypotheses of three cameras hardly ever find
        it.
        """
        candidates = self.gt[:, :SMALL_SAMPLE]
        costs = lane_sums(np.minimum(_distances(candidates, candidates), threshold))
        densest = candidates[:, np.argsort(costs, kind="stable")[:N_NEIGHBOURHOODS]]
        near = _distances(densest, self.gt) < threshold
        weights = np.vstack([near, np.ones_like(near[:1])]).astype(np.float64)
        return weighted_fits(self.gt, self.est, weights, self.alignment)

    def subset_fits(self) -> Floats:
        """Return the least-squares fits to subsets of few cameras, see `_subsets`."""
        least = 3 if self.alignment == "similarity" else 2  # two have an exact similarity
        return weighted_fits(self.gt, self.est, _subsets(self.n, least), self.alignment)

    def refine(
        self, similarities: Floats, threshold: float, *, n_left: int, tolerance: float
    ) -> Floats:
        """Refine until ``n_left`` are left and none of them gains more than the tolerance."""
        resolution, least_gain = RESOLUTION * threshold, tolerance * threshold * self.n
        return refine(
            *(self.gt, self.est, similarities, threshold, resolution, n_left, least_gain),
            self.alignment,
        )


def _distances(a: Floats, b: Floats) -> Floats:
    """Return the distances (k, n) between positions (3, k) and (3, n)."""
    differences = a[:, :, None] - b[:, None]
    distances: Floats = np.sqrt(dot(differences, differences))
    return distances


def order_of(n: int) -> Indices:
    """Return an order of n cameras in which the first ones are a fair sample."""
    return _order_of_few(n) if n <= SAMPLE else np.random.default_rng(0).permutation(n)


@lru_cache(maxsize=256)
def _order_of_few(n: int) -> Indices:
    return np.random.default_rng(0).permutation(n)


@lru_cache(maxsize=2 * FEW)
def _subsets(n: int, least: int) -> Floats:
    """Return weights of n cameras, (H, n), 1 for those of a subset and 0 for the others.

    Each size that has room, the largest first; then likewise with one camera that counts more: the
    cost of few cameras has minima at which the error of one of them is zero.
    """
    rows: list[Floats] = []
    sizes = range(n, least - 1, -1)
    for one_counts_more, size in product([False, True], sizes):
        n_each = size if one_counts_more else 1
        if len(rows) + n_each * comb(n, size) > N_SUBSETS:
            continue
        for members in combinations(range(n), size):
            for heavy in members[:n_each]:
                row = np.zeros(n)
                row[list(members)] = 1.0
                row[heavy] = MORE if one_counts_more else 1.0
                rows.append(row)
    return np.array(rows).reshape(-1, n)


def triplets_to_try(
    gt: Floats, est: Floats, n_hypotheses: int, rng: np.random.Generator, alignment: str
) -> Indices:
    """Return triplets of cameras, (3, H): all of few; else drawn, prescreened where that helps.

    The prescreening finds the right triplets where most are wrong. It misleads where the noise is
    as large as the triangles, which matters with few cameras, and an alignment that keeps the scale
    fits what passes it no better than others where the estimate has another size.
    """
    n = gt.shape[1]
    if n <= FEW:
        return _longest_edge_first(gt, all_triplets(n))
    if alignment == "similarity" and n > SEVERAL:
        return prescreened_triplets(gt, est, n_hypotheses, rng)
    half = (n_hypotheses + 1) // 2
    n_any = half if n > SEVERAL else 3 * half
    return np.hstack([prescreened_triplets(gt, est, half, rng), _any_triplets(n, n_any, rng)])


def _longest_edge_first(gt: Floats, triplets: Indices) -> Indices:
    """Return triplets whose first edge is the longest, so that no order of the cameras matters."""
    i, j, k = triplets
    turned = np.array([triplets, [j, k, i], [k, i, j]])
    edges = gt[:, turned[:, 0]] - gt[:, turned[:, 1]]
    longest = dot(edges, edges).argmax(axis=0)
    return np.ascontiguousarray(turned[longest, :, np.arange(len(i))].T)


def _any_triplets(n: int, n_triplets: int, rng: np.random.Generator) -> Indices:
    """Return triplets of distinct cameras, (3, H), all equally probable."""
    i, j, k = rng.integers([[n], [n - 1], [n - 2]], size=(3, n_triplets), dtype=np.intp)
    j += j >= i  # one of the others
    k += k >= np.minimum(i, j)
    k += k >= np.maximum(i, j)
    return np.array([i, j, k])
