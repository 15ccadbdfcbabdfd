"""The mean average accuracy of the Image Matching Challenge: the best of all triplets."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Booleans, Floats, Indices
from .alignment import block_size, fit
from .cameras import Positions

__all__ = ["IMC_2024", "IMC_2025", "imc_maa"]


MOST_KNOWN = 1 << 18  # sets of inliers that are remembered
IMC_2024 = (0.025, 0.05, 0.1, 0.2, 0.5, 1.0)
IMC_2025 = (0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.1, 0.15, 0.2)


def imc_maa(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    *,
    thresholds: Sequence[float] = IMC_2025,
    skip: int = 2,
) -> float:
    """Mean average accuracy of camera centres under the best similarity for each threshold.

    From each triplet of cameras follows a similarity, from its inliers at each threshold a refit,
    and from each refit the number of centres within each threshold. For each threshold the largest
    number counts: ``mean(max(0, number - 3)) / (n - 3)``, as any three cameras fit. The rotations
    of the cameras are not used.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Camera centres, row i of both the same camera; the estimate in any world. An estimate that
        is not finite is out of reach of any threshold.
    thresholds : sequence of float
        Distances in ground-truth units; by default the organisers' list of 2025. The challenge of
        2024 has `IMC_2024` for outdoor scenes, and skips none.
    skip : int
        Number of thresholds that are refitted for, but do not count.

    Returns
    -------
    float
        From 0 to 1.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Notes
    -----
    The scale of a fit is the ratio of the spreads, not the least-squares one. All true centres in
    one point give a scale of 0 and the value 1, whatever the estimate. Fewer than 4 cameras have
    the value 0, as in 2025 (0/0 in 2024).

    The program examines n^3 / 6 triplets, with up to one refit for each threshold. So does this,
    in blocks, but refits each set of inliers once and stops when all numbers are n. O(n^4) time:
    seconds for 100 cameras, out of reach for 1000. O(n) memory.

    References
    ----------
    Image Matching Challenge 2024 and 2025 (Kaggle), metric.py; also fb82/IMPED, src/imc.py at
    07a3265, with ``inl_cf = 0`` and ``strict_cf = -1``.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import imc_maa
    >>> gt = np.random.default_rng(0).random((13, 3))
    >>> est = 5 * gt + 1
    >>> est[0] = 0
    >>> imc_maa(gt, est)
    0.9
    """
    positions = Positions.check(gt_positions, est_positions)
    n = len(positions.gt)
    levels = np.array(thresholds, dtype=np.float64)
    if not np.all((levels > 0) & np.isfinite(levels)):
        raise ValueError(f"thresholds must be positive, finite numbers, not {levels.tolist()}")
    if not 0 <= skip < len(levels):
        raise ValueError(f"skip must leave one of {len(levels)} thresholds, not be {skip!r}")
    counts = largest_counts(*positions.matched(), levels)[skip:]
    counted = int(np.maximum(counts - 3, 0).sum())
    return counted / (len(counts) * (n - 3)) if counted else 0.0


@np.errstate(all="ignore")  # what is not finite is never an inlier
def largest_counts(gt: Floats, est: Floats, thresholds: Floats) -> Indices:
    """Return for each threshold the largest number of centres within it under any refit."""
    bounds = thresholds**2
    best = np.zeros(len(thresholds), dtype=np.intp)
    known: set[bytes] = set()
    for triplets in _triplets(len(gt)):
        first = fit(est[triplets], gt[triplets]).equal_spreads()
        squares = first.squared_distances(est, gt)
        inliers = (squares < bounds[:, None, None]).reshape(-1, len(gt))
        inliers = inliers[np.count_nonzero(inliers, axis=1) > 2]
        for subsets in _new(inliers, known):
            refits = fit(est, gt, subsets.astype(np.float64)).equal_spreads()
            squares = refits.squared_distances(est, gt)
            for k, bound in enumerate(bounds):
                within = np.count_nonzero(squares < bound, axis=1)
                best[k] = max(best[k], within.max())
        if best.min() == len(gt):
            break
    return best


def _new(inliers: Booleans, known: set[bytes]) -> Iterator[Booleans]:
    """Go through the sets of inliers that are not known yet, and know them from then on."""
    n = inliers.shape[1]
    packed = np.packbits(inliers, axis=1)
    rows = packed.view(np.dtype((np.void, packed.shape[1]))).ravel()
    keys = {bytes(row) for row in rows.tolist()} - known
    if len(known) > MOST_KNOWN:
        known.clear()  # refitting some again is all it costs
    known |= keys
    new = np.frombuffer(b"".join(sorted(keys)), dtype=np.uint8).reshape(-1, packed.shape[1])
    step = block_size(n)
    for start in range(0, len(new), step):
        yield np.unpackbits(new[start : start + step], axis=1, count=n).view(bool)


def _triplets(n: int) -> Iterator[Indices]:
    """Go through all a < b < c of n, in blocks."""
    step = block_size(n)
    block: list[Indices] = []
    size = 0
    for a in range(n - 2):
        for b in range(a + 1, n - 1):
            c = np.arange(b + 1, n)
            block.append(np.stack([np.full(len(c), a), np.full(len(c), b), c], axis=1))
            size += len(c)
            if size >= step or (a, b) == (n - 3, n - 2):
                yield np.concatenate(block)
                block, size = [], 0
