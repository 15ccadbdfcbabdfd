"""Robust registration of camera positions: PCR-99 with unknown scale (section 3, step 2).

The paper draws random triplets of cameras, prescreens them by the ratios of their edge lengths,
and takes the hypothesis whose m-th smallest position error is the smallest. There is no inlier
threshold and no refinement. Alignments that keep the scale, or only turn about the vertical axis,
are fitted to the same triplets.
"""

import sys
from functools import lru_cache
from itertools import combinations
from math import comb, inf

import numpy as np

from ..arrays import Floats, Indices
from ..similarity import Similarity, dot
from ..validation import check_positive
from .hypotheses import cheapest, similar_triplets, three_point_similarities

__all__ = ["check_rank", "check_shapes", "component_first", "pcr99", "prescreened_triplets"]


PRESCREEN_THRESHOLD = 0.1  # largest difference between the log edge ratios of a kept triplet
DRAWS_PER_HYPOTHESIS = 1000  # budget of draws; after it the hypotheses found so far are used
MAX_BATCH = 1 << 16  # triplets drawn at once; bounds the memory
MARGIN = 64 * float(np.finfo(np.float64).eps)  # of a squared error, relative to the largest |gt|^2


def pcr99(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    rank: int,
    threshold: float = inf,
    n_hypotheses: int,
    rng: np.random.Generator,
    alignment: str = "similarity",
    prescreen: float = PRESCREEN_THRESHOLD,
) -> tuple[Similarity | None, int]:
    """Register estimated positions (n, 3) to the ground truth, robustly.

    ``rank`` is m of the paper, the threshold is not used. The vertical axis of the alignment "yaw"
    is the third one. Where no more than ``n_hypotheses`` triplets exist, all of them are used, each
    with its three possible first edges, and nothing is random. Where they hardly ever pass the
    prescreening, the search ends after 1000 draws for each hypothesis that was asked for.
    O(n_hypotheses * n) time, O(n) memory.
    """
    gt, est = component_first(gt_positions, est_positions)
    check_rank(rank, gt.shape[1])
    with np.errstate(all="ignore"):  # NaN and infinity never win a comparison
        triplets = prescreened_triplets(gt, est, n_hypotheses, rng, prescreen)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        scale, rotation, translation, flat = three_point_similarities(gt, est, triplets, alignment)
        margin = min(MARGIN * float(np.max(dot(gt, gt))), sys.float_info.max)
        best = cheapest(gt, est, scale, rotation, translation, flat, rank, margin)
    return Similarity(float(scale[best]), rotation[best], translation[best]), n_used


def check_rank(rank: int, n: int) -> None:
    """Refuse the rank of no error of n cameras."""
    check_positive(rank, "rank", integer=True)
    if rank > n:
        raise ValueError(f"rank must be at most the number of cameras, {n}, not {rank}")


def check_shapes(gt_positions: Floats, est_positions: Floats) -> int:
    """Refuse arrays that are not two of the same shape (n, 3); return n."""
    shapes = np.shape(gt_positions), np.shape(est_positions)
    if shapes[0] != shapes[1] or shapes[0][1:] != (3,):
        raise ValueError(
            "gt_positions and est_positions must be (n, 3) arrays of the same length, but have the "
            f"shapes {shapes[0]} and {shapes[1]}"
        )
    return len(gt_positions)


def component_first(gt_positions: Floats, est_positions: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) positions as contiguous (3, n) arrays; their shapes are not checked again."""
    check_shapes(gt_positions, est_positions)
    gt, est = (np.asarray(p, dtype=np.float64).T.copy() for p in (gt_positions, est_positions))
    return gt, est


def prescreened_triplets(
    gt: Floats,
    est: Floats,
    n_hypotheses: int,
    rng: np.random.Generator,
    threshold: float = PRESCREEN_THRESHOLD,
) -> Indices:
    """Return triplets (3, H) whose log edge ratios differ pairwise by at most a threshold."""
    n = gt.shape[1]
    factor = float(np.exp(2 * threshold))  # of squared ratios
    if comb(n, 3) <= n_hypotheses:
        i, j, k = all_triplets(n)  # every edge is the first edge once
        triplets = np.array([np.r_[i, j, k], np.r_[j, k, i], np.r_[k, i, j]])
        return triplets[:, similar_triplets(gt, est, triplets, factor)]
    kept: Indices = np.empty((3, 0), dtype=np.intp)
    drawn, batch = 0, 2 * n_hypotheses
    while kept.shape[1] < n_hypotheses and drawn < DRAWS_PER_HYPOTHESIS * n_hypotheses:
        triplets = rng.integers(n, size=(3, batch), dtype=np.intp)
        passed = triplets.take(similar_triplets(gt, est, triplets, factor), axis=1)
        kept = np.concatenate([kept, passed], axis=1)
        drawn += batch
        missing = n_hypotheses - kept.shape[1]
        batch = min(MAX_BATCH, 64 + int(1.1 * missing * drawn / max(1, kept.shape[1])))
    return kept[:, :n_hypotheses]


@lru_cache(maxsize=32)
def all_triplets(n: int) -> Indices:
    """Return all triplets of n cameras, (3, H)."""
    triplets = np.array(list(combinations(range(n), 3)), dtype=np.intp).reshape(-1, 3)
    return np.ascontiguousarray(triplets.T)
