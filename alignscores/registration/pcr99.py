"""Robust registration of camera positions: PCR-99 with unknown scale (section 3, step 2).

The paper draws random triplets of cameras, prescreens them by the ratios of their edge lengths,
and takes the hypothesis whose m-th smallest position error is the smallest. There is no inlier
threshold and no refinement.

Inside this module points are stored component first, ``(3, n)``, so that every operation runs over
contiguous memory.
"""

import sys
from itertools import combinations
from math import comb, inf

import numpy as np

from ..arrays import Floats, Indices
from ..similarity import Similarity, dot
from ..validation import check_positive
from .kernel import cheapest, similar_triplets, three_point_similarities

__all__ = ["component_first", "pcr99", "prescreened_triplets"]


PRESCREEN_THRESHOLD = 0.1  # largest difference between the log edge ratios of a kept triplet
DRAWS_PER_HYPOTHESIS = 1000  # budget of draws; after it the hypotheses found so far are used
MAX_BATCH = 1 << 16  # triplets drawn at once; bounds the memory
TIE = 64 * float(np.finfo(np.float64).eps)  # of a squared error, relative to the largest |gt|^2


def pcr99(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    rank: int,
    threshold: float = inf,
    n_hypotheses: int,
    rng: np.random.Generator,
    prescreen: float = PRESCREEN_THRESHOLD,
) -> tuple[Similarity | None, int]:
    """Register estimated camera positions to the ground truth, robustly and up to scale.

    The positions should be centred near the origin: differences of large coordinates lose digits.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array
        Finite camera centres in the ground-truth and in the estimated world.
    rank : int
        m of the paper, from 1 to n: the cost of a hypothesis is its m-th smallest position error.
    threshold : float
        Not used; accepted because all registrations are called with the same arguments.
    n_hypotheses : int
        Number of prescreened triplets to collect. Where no more than so many triplets exist, all of
        them are used, each with its three possible first edges, and nothing is random.
    rng : numpy.random.Generator
        Source of the random triplets.
    prescreen : float
        Largest difference between the log edge ratios of a triplet that is kept. If infinite, all
        triplets are kept but those with coincident cameras.

    Returns
    -------
    alignment : Similarity or None
        The cheapest hypothesis, from ground truth to estimate; None where no triplet passed.
    n_used : int
        Number of hypotheses it was chosen from.

    Raises
    ------
    ValueError
        Where the positions are not (n, 3) arrays of one length, or the rank is not from 1 to n.

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
    >>> alignment, n_used = pcr99(gt, est, rank=4, n_hypotheses=100, rng=rng)
    >>> round(alignment.scale, 6), n_used
    (2.0, 100)
    """
    gt, est = component_first(gt_positions, est_positions)
    n = gt.shape[1]
    check_positive(rank, "rank", integer=True)
    if rank > n:
        raise ValueError(f"rank must be at most the number of cameras, {n}, not {rank}")
    with np.errstate(all="ignore"):  # NaN and infinity never win a comparison
        triplets = prescreened_triplets(gt, est, n_hypotheses, rng, prescreen)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        scale, rotation, translation, flat = three_point_similarities(gt, est, triplets)
        tie = min(TIE * float(np.max(dot(gt, gt))), sys.float_info.max)
        best = cheapest(gt, est, scale, rotation, translation, flat, rank, tie)
    return Similarity(float(scale[best]), rotation[best], translation[best]), n_used


def component_first(gt_positions: Floats, est_positions: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) positions as contiguous (3, n) arrays.

    Raises
    ------
    ValueError
        Where they are not (n, 3) arrays of one length; this is not checked again later.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration.pcr99 import component_first
    >>> component_first(np.zeros((5, 3)), np.ones((5, 3)))[1].shape
    (3, 5)
    """
    shapes = np.shape(gt_positions), np.shape(est_positions)
    if shapes[0] != shapes[1] or shapes[0][1:] != (3,):
        raise ValueError(
            "gt_positions and est_positions must be (n, 3) arrays of the same length, but have the "
            f"shapes {shapes[0]} and {shapes[1]}"
        )
    gt, est = (np.asarray(p, dtype=np.float64).T.copy() for p in (gt_positions, est_positions))
    return gt, est


def prescreened_triplets(
    gt: Floats,
    est: Floats,
    n_hypotheses: int,
    rng: np.random.Generator,
    threshold: float = PRESCREEN_THRESHOLD,
) -> Indices:
    """Collect the triplets that pass the prescreening test.

    Parameters
    ----------
    gt, est : (3, n) array
        Camera centres, component first.
    n_hypotheses, rng, threshold
        As in `pcr99`.

    Returns
    -------
    (3, H) ndarray of int
        Camera indices.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration.pcr99 import prescreened_triplets
    >>> gt = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    >>> prescreened_triplets(gt, 2 * gt, 10, np.random.default_rng(0))
    array([[0, 1, 2],
           [1, 2, 0],
           [2, 0, 1]])
    """
    n = gt.shape[1]
    factor = float(np.exp(2 * threshold))  # of squared ratios
    if comb(n, 3) <= n_hypotheses:
        triplets = _all_triplets(n)
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


def _all_triplets(n: int) -> Indices:
    """All triplets of n cameras, each three times: every edge is the first edge once."""
    i, j, k = np.array(list(combinations(range(n), 3)), dtype=np.intp).reshape(-1, 3).T
    return np.array([np.r_[i, j, k], np.r_[j, k, i], np.r_[k, i, j]])
