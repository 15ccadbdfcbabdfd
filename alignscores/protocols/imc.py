"""The mean average accuracy of the Image Matching Challenge: the best of all triplets."""

import ctypes
import math
import os
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Booleans, Floats, Indices
from ..progress import show
from ..registration import kernel
from ..registration.pcr99 import pcr99
from .alignment import block_size, fit
from .cameras import Positions

__all__ = ["IMC_2024", "IMC_2025", "imc_maa"]


MOST_KNOWN = 1 << 18  # sets of inliers that are remembered
MOST_CAMERAS = 1000  # which take sixteen times as long as 500
PER_THREAD = 50  # cameras; with fewer a thread costs more than it saves
TRIED_AT_ONCE = 10_000_000  # distances, about a quarter of a second
PATIENCE = 2.0  # seconds, after which it says how long it will take
NEAR = 1e-9  # relative; what is so near a threshold, rounding could decide
ROUNDING = 1e-13  # relative, of coordinates
MOST_LEVELS, SEVERAL_LEVELS, BIN_SHIFT, BINS, KNOWN = 64, 255, 46, 131072, 8192  # as in kernel.c
N_HYPOTHESES = 1000  # of a similarity that only orders cameras
N_BINS = 256  # of scales, four octaves
SMALLEST, LARGEST = 1e-300, 1e300
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
        Where the input is malformed, or more than 1000 cameras were estimated.

    Notes
    -----
    The scale of a fit is the ratio of the spreads, not the least-squares one. All true centres in
    one point give a scale of 0 and the value 1, whatever the estimate. Fewer than 4 cameras have
    the value 0, as in 2025 (0/0 in 2024).

    The program examines n^3 / 6 triplets, with up to one refit for each threshold. So does this,
    but refits hardly any set of inliers twice, and stops when no number can grow: of the cameras
    within a threshold t, distances in pairs agree up to 2 t under one scale. Where the kernel is
    compiled it does all that rounding cannot decide, on all processors; NumPy does the rest, so
    that the value is the same. O(n^4) time: less than a second for 100 cameras, about a minute for
    500. The command says how long it will take. O(n^2) memory.

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
    if (estimated := np.count_nonzero(positions.estimated)) > MOST_CAMERAS:
        raise ValueError(
            f"the mAA of the Image Matching Challenge tries all triplets of cameras: of {estimated}"
            f" that would take hours or days; score at most {MOST_CAMERAS}, or leave it out"
        )
    counts = largest_counts(*positions.matched(), levels, skip)
    counted = int(np.maximum(counts - 3, 0).sum())
    return counted / (len(counts) * (n - 3)) if counted else 0.0


def largest_counts(gt: Floats, est: Floats, thresholds: Floats, skip: int = 0) -> Indices:
    """Return for each threshold the largest number of centres within it under any refit.

    The first `skip` thresholds are refitted for, but have no number.
    """
    n = len(gt)
    if n < 3:
        return np.zeros(len(thresholds) - skip, dtype=np.intp)
    cameras = _best_first(gt, est)
    gt, est = gt[cameras], est[cameras]
    order = np.argsort(thresholds, kind="stable")
    best = np.where(order < skip, n, 0)
    refits = _Refits(gt, est, thresholds[order], best)
    most = _most_near(gt, est, thresholds[order])
    own = threading.local()

    def attempt(block: tuple[int, int, int]) -> tuple[Indices, Indices]:
        if not _can_try(order):
            return _triplets(*block, n), best
        if not hasattr(own, "tries"):
            own.tries = _Tries(gt, est, thresholds[order], most)
        tries: _Tries = own.tries
        return tries.unclear(*block, best)

    started, done, total = time.monotonic(), 0, math.comb(n, 3)
    threads = min(os.cpu_count() or 1, 1 + n // PER_THREAD)
    pool, blocks = ThreadPoolExecutor(threads), _blocks(n)
    waiting = deque((block, pool.submit(attempt, block)) for block in islice(blocks, 2 * threads))
    try:
        while waiting and np.any(best < most):
            (_, start, end), future = waiting.popleft()
            triplets, found = future.result()
            waiting.extend((block, pool.submit(attempt, block)) for block in islice(blocks, 1))
            np.maximum(best, found, out=best)
            refits.try_all(triplets)
            done += sum(range(n - end, n - start))
            share, seconds = done / total, time.monotonic() - started
            if seconds > PATIENCE:
                left = seconds / share - seconds
                show.get()(f"maa:imc: {share:.0%} of the triplets, about {left:.0f} s left")
    finally:
        pool.shutdown(cancel_futures=True)
    counts = np.empty_like(best)
    counts[order] = best
    return counts[skip:]


@np.errstate(all="ignore")
def _best_first(gt: Floats, est: Floats) -> Indices:
    """Order cameras by their distances under a robust similarity.

    Large numbers are then found early, and the last cameras show of most refits that they have
    smaller ones.
    """
    rank, rng = 1 + len(gt) // 4, np.random.default_rng(0)
    found, _ = pcr99(gt, est, rank=rank, n_hypotheses=N_HYPOTHESES, rng=rng)
    if found is None:
        return np.arange(len(gt))
    return np.argsort(np.linalg.norm(found.apply(gt) - est, axis=1), kind="stable")


def _can_try(order: Indices) -> bool:
    return kernel.LIBRARY is not None and len(order) <= MOST_LEVELS


class _Refits:
    """The definition in NumPy: it tries triplets and keeps the largest numbers."""

    def __init__(self, gt: Floats, est: Floats, thresholds: Floats, best: Indices) -> None:
        self._gt, self._est, self._bounds, self._best = gt, est, thresholds**2, best
        self._known: set[bytes] = set()

    @np.errstate(all="ignore")  # what is not finite is never an inlier
    def try_all(self, triplets: Indices) -> None:
        """Try triplets (H, 3), in blocks."""
        gt, est, best = self._gt, self._est, self._best
        step = block_size(len(gt))
        for start in range(0, len(triplets), step):
            some = triplets[start : start + step]
            first = fit(est[some], gt[some]).equal_spreads()
            squares = first.squared_distances(est, gt)
            inliers = (squares < self._bounds[:, None, None]).reshape(-1, len(gt))
            inliers = inliers[np.count_nonzero(inliers, axis=1) > 2]
            for subsets in _new(inliers, self._known):
                refits = fit(est, gt, subsets.astype(np.float64)).equal_spreads()
                squares = refits.squared_distances(est, gt)
                for k, bound in enumerate(self._bounds):
                    within = np.count_nonzero(squares < bound, axis=1)
                    best[k] = max(best[k], within.max())


class _Consensus(ctypes.Structure):
    """As in ``kernel.c``."""

    _fields_ = (
        ("n", ctypes.c_size_t),
        ("n_levels", ctypes.c_size_t),
        *((name, ctypes.c_void_p) for name in ("gt", "est", "rows")),
        *((name, ctypes.c_void_p) for name in ("levels", "lower", "upper")),
        ("largest_scale", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("most", "known", "best")),
    )


class _Tries:
    """The same, compiled, but for triplets and refits that rounding could decide."""

    @np.errstate(all="ignore")
    def __init__(self, gt: Floats, est: Floats, thresholds: Floats, most: Indices) -> None:
        n = len(gt)
        self._best = np.zeros_like(most)
        centres = np.median(gt, axis=0), np.median(est, axis=0)
        y, x = gt - centres[0], est - centres[1]
        products = (x[:, :, None] * y[:, None, :]).reshape(n, 9)
        squares = np.stack([(x * x).sum(axis=1), (y * y).sum(axis=1)], axis=1)
        slack = NEAR * (thresholds + np.abs(y).max()) + ROUNDING * np.abs(gt).max()
        lower, upper = np.maximum(thresholds - slack, 0) ** 2, (thresholds + slack) ** 2
        edges = (np.arange(BINS + 1, dtype=np.uint64) << np.uint64(BIN_SHIFT)).view(np.float64)
        edges = np.where(np.isnan(edges), np.inf, edges)
        levels, ends = lower.searchsorted(edges[:-1], "right"), upper.searchsorted(edges[1:])
        levels[levels != ends] = SEVERAL_LEVELS
        names = np.random.default_rng(0).integers(1 << 43, size=(n, 2))
        self._arrays = (
            *(np.ascontiguousarray(y.T), np.ascontiguousarray(x.T)),
            np.hstack([x, y, products, squares, np.ones((n, 1)), names]),
            *(levels.astype(np.uint8), lower, upper),
            *(most, np.zeros(KNOWN, dtype=np.uint64), self._best, np.empty(n)),
            *(np.empty(n, dtype=np.intp), np.empty(n, dtype=np.uint8)),
            np.empty(n * n, dtype=np.intp),
        )
        addresses = [array.ctypes.data for array in self._arrays]
        scale = float(slack.min() / (ROUNDING * np.abs(centres[1]).max()))
        self._consensus = _Consensus(*(n, len(thresholds), *addresses[:6], scale, *addresses[6:9]))
        self._room = addresses[9:]

    def unclear(self, a: int, start: int, end: int, best: Indices) -> tuple[Indices, Indices]:
        """Try the triplets of a block, given the largest numbers so far.

        Return those that are left to NumPy, and the largest numbers now.
        """
        assert kernel.LIBRARY is not None
        np.maximum(self._best, best, out=self._best)
        block = ctypes.byref(self._consensus), a, start, end
        count = kernel.LIBRARY.try_triplets(*block, *self._room)
        others = self._arrays[-1][: 2 * count].reshape(-1, 2)
        return np.insert(others, 0, a, axis=1), self._best.copy()


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


@np.errstate(all="ignore")
def _most_near(gt: Floats, est: Floats, thresholds: Floats) -> Indices:
    """Return for each threshold a number of centres that no similarity exceeds.

    Cameras i and j are within t of their true places only if the scale times their distance is
    within 2 t of the true one. Each of m such cameras has m - 1 others that it agrees with so.
    """
    n = len(gt)
    i, j = np.triu_indices(n, 1)
    true, found = (np.linalg.norm(p[i] - p[j], axis=1) for p in (gt, est))
    middle = np.median(true / np.maximum(found, SMALLEST))
    first = _bin(np.clip(middle, SMALLEST, LARGEST)) - N_BINS // 2
    most = np.empty(len(thresholds), dtype=np.intp)
    for k, t in enumerate(thresholds):
        low, high = ((true + sign * 2 * t) / found * (1 + sign * NEAR) for sign in (-1, 1))
        low, high = np.fmax(low, 0), np.where(np.isnan(high), np.inf, high)
        low_bin, high_bin = (np.clip(_bin(s) - first, 0, N_BINS - 1) for s in (low, high))
        changes = np.zeros((n, N_BINS + 1), dtype=np.intp)
        for camera in (i, j):
            for bins, sign in ((low_bin, 1), (high_bin + 1, -1)):
                cells = camera * (N_BINS + 1) + bins
                changes += sign * np.bincount(cells, minlength=changes.size).reshape(n, -1)
        others = -np.sort(-changes.cumsum(axis=1)[:, :-1], axis=0)
        most[k] = np.count_nonzero(others >= np.arange(n)[:, None], axis=0).max()
    return most


def _bin(values: Floats) -> Indices:
    """Return bins of positive numbers, 64 an octave, as in ``kernel.c``."""
    bits = np.asarray(values, dtype=np.float64).view(np.uint64)
    return (bits >> np.uint64(BIN_SHIFT)).astype(np.intp)


def _blocks(n: int) -> Iterator[tuple[int, int, int]]:
    """Go through all triplets in blocks: the first camera, and the second from one to another."""
    size = max(1, TRIED_AT_ONCE // n**2)
    for a in range(n - 2):
        for start in range(a + 1, n - 1, size):
            yield a, start, min(start + size, n - 1)


def _triplets(a: int, start: int, end: int, n: int) -> Indices:
    """Return the triplets of a block, of n cameras."""
    b, c = np.nonzero(np.arange(start, end)[:, None] < np.arange(n))
    return np.stack([np.full_like(b, a), b + start, c], axis=1)
