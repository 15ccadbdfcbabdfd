"""The medoid of rotations: the one with the smallest sum of truncated distances to all others."""

import numpy as np

from .arrays import Floats, Indices
from .registration import kernel

__all__ = ["TLUD_THRESHOLD", "medoid"]

TLUD_THRESHOLD = 0.5  # chordal distance at which a deviation is truncated, about 20 degrees
N_ALL_PAIRS = 5000  # rotations up to which all pairs are compared; bounds are faster beyond
AT_ONCE = 1 << 17  # distances, 1 MiB, which fits in the cache
BATCH = 8  # smallest number of rotations that are compared with all others at once
NEGLIGIBLE = 1e-12  # of a mean distance; rotations whose means differ by less are equally good
N_PLANES = 4  # in each batch, that bound the sums of the rotations left
FLAT = 1e-4  # of a mean distance; nearer rotations have no direction
N_KNOTS = 64  # of the curve by how much truncation lowers a plane
SAMPLE = 256  # rotations that give the first guess


def medoid(rotations: Floats) -> int:
    """Return the index of the medoid of rotations (n, 3, 3).

    All pairs are compared up to some thousands of rotations. Beyond, the sums of few bound those of
    the others. O(n) memory.
    """
    n = len(rotations)
    if n <= N_ALL_PAIRS:
        return kernel.medoid(np.ascontiguousarray(rotations), TLUD_THRESHOLD)
    points = rotations.reshape(n, 9)
    order = np.random.default_rng(0).permutation(n)  # failures may be periodic
    sample = points[order[:SAMPLE]]
    distances, _ = _distances(sample, sample)
    return _medoid_by_bounds(points, int(order[distances.sum(axis=1).argmin()]))


def _distances(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return truncated and squared distances between points (m, 9) and (n, 9)."""
    squared = -2 * a @ b.T
    squared += np.einsum("ni,ni->n", b, b)
    squared += np.einsum("mi,mi->m", a, a)[:, None]
    distances = np.clip(squared, 0, TLUD_THRESHOLD**2)
    return np.sqrt(distances, out=distances), squared


def _medoid_by_bounds(points: Floats, guess: int) -> int:
    """Find the medoid: the sums of few points (n, 9) bound those of the others.

    Truncated distances obey the triangle inequality. With f_i the sum and d the truncated distance
    to i, f_j >= n d - f_i. Where d is not truncated, only the terms of points within two thresholds
    of i differ: if these are m, f_j >= f_i - m d. The points with the lowest bounds come first
    (Newling and Fleuret, "A sub-quadratic exact medoid algorithm", AISTATS 2017). Near the medoid,
    where sums hardly differ, planes below the sums rule out more, as in Kelley's cutting planes
    ("The cutting-plane method for solving convex programs", J. SIAM 1960).
    """
    n = len(points)
    points = points - points[guess]  # squared distances are differences of small numbers
    rows = max(1, AT_ONCE // n)  # whose bounds are computed at once
    size = max(BATCH, rows)
    best, best_sum, left, bounds = guess, np.inf, np.arange(n), np.zeros(n)
    bounds[guess] = -1  # to be tried first
    while left.size:
        if left.size > size:
            left = left[np.argpartition(bounds[left], size)]
        batch, left = left[:size], left[size:]
        distances, squared = _distances(points[batch], points)
        sums = distances.sum(axis=1)
        lowest = int(np.argmin(sums))
        if sums[lowest] < best_sum:
            best, best_sum = int(batch[lowest]), sums[lowest]
        near = np.count_nonzero(squared < (2 * TLUD_THRESHOLD) ** 2, axis=1)
        for indices in np.split(np.arange(len(batch)), range(rows, len(batch), rows)):
            d, f, m = distances[indices][:, left], sums[indices, None], near[indices, None]
            bound = np.maximum(n * d - f, np.where(d < TLUD_THRESHOLD, f - m * d, 0))
            bounds[left] = np.maximum(bounds[left], bound.max(axis=0))
        for i in np.argsort(sums)[:N_PLANES].tolist():
            plane = _plane(points, int(batch[i]), left, np.sqrt(np.maximum(squared[i], 0)))
            bounds[left] = np.maximum(bounds[left], plane)
        left = left[bounds[left] < best_sum - NEGLIGIBLE * n]
    return best


def _plane(points: Floats, i: int, left: Indices, distances: Floats) -> Floats:
    """Bound the sums of those left by a plane below them, given the distances from i to all points.

    The distance from x to a point p is convex: it is at least the distance from i and u (x - i),
    where u points from p to i. Truncated at T, and with D from i to x, this holds less at most
    D - |distance from i - T|, where that is positive: where x may be on the other side of T. The
    sum of these losses is convex in D, so between knots it is below its chord.
    """
    truncated, near = np.minimum(distances, TLUD_THRESHOLD), distances < TLUD_THRESHOLD
    flat = max(FLAT * float(distances[near].mean()), NEGLIGIBLE)
    pull = np.where(near, 1 / np.maximum(distances, flat), 0.0)
    slope = points[i] * pull.sum() - pull @ points
    gaps = np.abs(distances - TLUD_THRESHOLD) * (N_KNOTS / TLUD_THRESHOLD)
    counts = np.bincount(np.minimum(gaps, N_KNOTS).astype(np.intp), minlength=N_KNOTS + 1)
    losses = np.cumsum(np.cumsum(counts[:-1])) * (TLUD_THRESHOLD / N_KNOTS)
    knots = np.linspace(0, TLUD_THRESHOLD, N_KNOTS + 1)
    loss = np.interp(truncated[left], knots, np.append(0.0, losses))
    loss += truncated[distances < flat].sum()  # their directions are not known
    bounds: Floats = truncated.sum() + (points[left] - points[i]) @ slope - loss
    return np.where(near[left], bounds, 0.0)
