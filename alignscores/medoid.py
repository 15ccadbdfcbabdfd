"""The medoid of rotations: the one with the smallest sum of truncated distances to all others."""

from math import ceil, sqrt

import numpy as np
import scipy

from .arrays import Floats, Indices

__all__ = ["TLUD_THRESHOLD", "medoid", "medoids"]

TLUD_THRESHOLD = 0.5  # chordal distance at which a deviation is truncated, about 20 degrees
NEGLIGIBLE = 1e-12  # of a mean distance; rotations whose means differ by less are equally good
DISTANCES_AT_ONCE = 1 << 17  # 1 MiB, which fits in the cache
BATCH = 8  # smallest number of rotations that are compared with all others at once
N_PLANES = 4  # in each batch, that bound the sums of the rotations left
FLAT = 1e-4  # of a mean distance; nearer rotations have no direction
N_KNOTS = 64  # of the curve by how much truncation lowers a plane
SAMPLE = 256  # rotations that give the first guess and estimate the share of near pairs
SPARSE = 1 / 32  # share of near pairs below which a tree is faster than bounds
NEAR_PAIRS_AT_ONCE = 1 << 20  # 24 MiB
TREE_COST = 10  # of a near pair in the tree, in distances

MANY = 2_000  # rotations from which on cells are faster than bounds alone
SPLITS = 3  # of cells between two looks at all candidates
FULL = 64  # rotations in a cell on average: with fewer, planes are faster
CLOSE = 1 / 4  # of the mean gap; bounds of cells with less are close enough


def medoid(rotations: Floats) -> int:
    """Return the index of the rotation whose truncated distances to all have the smallest sum.

    O(n) memory beyond a constant.
    """
    return int(medoids(rotations[None])[0])


def medoids(rotations: Floats) -> Indices:
    """Return the medoid of each stack of rotations (G, n, 3, 3)."""
    n = rotations.shape[1]
    if n**2 > DISTANCES_AT_ONCE:
        return np.array([_medoid_of_many(stack) for stack in rotations])
    points = rotations.reshape(-1, n, 9)
    size = DISTANCES_AT_ONCE // n**2
    parts = [_medoids_of_few(points[i : i + size]) for i in range(0, len(points), size)]
    return np.concatenate(parts)


def _medoids_of_few(points: Floats) -> Indices:
    """Return the medoids of stacks of points (G, n, 9) by all distances."""
    n = points.shape[1]
    # Relative to the median, so that squared distances are differences of small numbers.
    points = points - np.partition(points, n // 2, axis=1)[:, n // 2, None]
    squares = np.einsum("gni,gni->gn", points, points)
    squared = points @ (-2 * points.swapaxes(1, 2))
    squared += squares[:, None]
    squared += squares[:, :, None]
    distances = np.sqrt(np.clip(squared, 0, TLUD_THRESHOLD**2))
    return np.asarray(distances.sum(axis=2).argmin(axis=1))


def _medoid_of_many(rotations: Floats) -> int:
    points = rotations.reshape(-1, 9)
    n = len(points)
    order = np.random.default_rng(0).permutation(n)  # failures may be periodic
    sample = points[order[:SAMPLE]]
    distances = _distances(sample, sample)
    share = float(np.mean(distances < TLUD_THRESHOLD))
    guess = int(order[distances.sum(axis=1).argmin()])
    points = points - points[guess]  # squared distances are differences of small numbers
    left, bounds = np.arange(n), np.zeros(n)
    bounds[guess] = -1  # to be tried first
    if n >= MANY:
        left, bounds = _candidates(points, guess, share)
    if share < SPARSE and len(left) > TREE_COST * share * n:
        return int(order[_medoid_by_tree(rotations[order], share)])
    return _medoid_by_bounds(points, left, bounds)


def _candidates(points: Floats, best: int, share: float) -> tuple[Indices, Floats]:
    """Return the points (n, 9) that may be the medoid, and lower bounds of all points' sums.

    Bounds by cells that are split until few points are left, or the cells hold few points.
    """
    n = len(points)
    left, bounds, smallest = np.arange(n), np.zeros(n), np.inf
    bounds[best] = -1
    far = np.linalg.norm(points, axis=1) > TLUD_THRESHOLD
    cells = _Cells(points)
    n_cells = looks = 0
    while n_cells < len(cells.counts) <= n / FULL and len(left) > BATCH:
        n_cells = len(cells.counts)
        tried = left[np.argpartition(bounds[left], 1)[:2]]
        sums = cells.split(points[tried])
        if sums.min() < smallest:
            best, smallest = int(tried[np.argmin(sums)]), sums.min()
        bounds[left] = cells.bounds(points, left)
        looks += len(left) * len(cells.counts)
        left = left[bounds[left] < smallest - NEGLIGIBLE * n]
        if BATCH * len(left) < n and np.count_nonzero(far[left]) < BATCH:
            break  # planes are faster
        if share < SPARSE and looks > share * n**2:
            break  # near pairs are fewer
    bounds[best] = -1
    return np.union1d(left, best), bounds


class _Cells:
    """Points (n, 9) in cells of neighbours: bounds of truncated distances to all of them.

    The mean distance to the points of a cell is at least the distance to their mean (Jensen), as
    long as none is truncated. It is at least that distance less the radius in any case.
    """

    def __init__(self, points: Floats) -> None:
        """Begin with shells around 0, each twice as wide as the one within."""
        _, shells = np.frexp(np.maximum(np.linalg.norm(points, axis=1), NEGLIGIBLE))
        order = np.argsort(shells, kind="stable")
        self.points = points[order]
        self._describe(np.flatnonzero(np.diff(shells[order], prepend=shells.min() - 1)))

    def _describe(self, starts: Indices) -> None:
        self.starts = starts
        self.counts = np.diff(starts, append=len(self.points))
        self.means = np.add.reduceat(self.points, starts) / self.counts[:, None]
        sums, spreads = np.zeros(len(self.points)), []
        for column, mean in zip(self.points.T, self.means.T, strict=True):  # to save memory
            squares = (column - mean.repeat(self.counts)) ** 2
            sums += squares
            spreads.append(np.add.reduceat(squares, starts))
        self.radii = np.sqrt(np.maximum.reduceat(sums, starts))
        self.widest = np.argmax(spreads, axis=0)

    def split(self, tried: Floats) -> Floats:
        """Split cells whose bounds for one of the points tried are far off; return their sums."""
        distances = _distances(tried, self.points)
        for _ in range(SPLITS):
            gaps = np.add.reduceat(distances, self.starts, axis=1) - self._least(tried)
            loose = (gaps > CLOSE * gaps.mean(axis=1, keepdims=True)).any(axis=0)
            label = np.arange(len(self.starts)).repeat(self.counts)
            rows = np.flatnonzero(loose[label])
            label = label[rows]
            axis = self.widest[label]
            upper = self.points[rows, axis] > self.means[label, axis]
            order = rows[np.argsort(2 * label + upper, kind="stable")]
            for column in (*self.points.T, *distances):
                column[rows] = column[order]
            n_upper = np.bincount(label[upper], minlength=len(self.starts))
            middles = self.starts + self.counts - n_upper
            divided = (n_upper > 0) & (n_upper < self.counts)
            self._describe(np.sort(np.concatenate([self.starts, middles[divided]])))
        sums: Floats = distances.sum(axis=1)
        return sums

    def bounds(self, points: Floats, rows: Indices) -> Floats:
        """Return lower bounds of the sums of truncated distances from some points to all."""
        sums, size = np.empty(len(rows)), max(1, DISTANCES_AT_ONCE // len(self.counts))
        for start in range(0, len(rows), size):
            some = slice(start, start + size)
            sums[some] = self._least(points[rows[some]]).sum(axis=1)
        return sums

    def _least(self, points: Floats) -> Floats:
        """Return lower bounds of the truncated distances from points to each cell."""
        distances: Floats = scipy.spatial.distance.cdist(points, self.means)
        distances -= self.radii * (distances > TLUD_THRESHOLD - self.radii)
        np.clip(distances, 0, TLUD_THRESHOLD, out=distances)
        distances *= self.counts
        return distances


def _distances(first: Floats, second: Floats) -> Floats:
    """Return the truncated distances from points (m, 9) to points (n, 9)."""
    distances: Floats = scipy.spatial.distance.cdist(first, second)
    return np.minimum(distances, TLUD_THRESHOLD, out=distances)


def _medoid_by_bounds(points: Floats, left: Indices, bounds: Floats) -> int:
    """Find the medoid among those left: the sums of few points (n, 9) bound those of the others.

    Truncated distances obey the triangle inequality. With f_i the sum and d the truncated distance
    to i, f_j >= n d - f_i. Where d is not truncated, only the terms of points within two thresholds
    of i differ: if these are m, f_j >= f_i - m d. The points with the lowest bounds come first
    (Newling and Fleuret, "A sub-quadratic exact medoid algorithm", AISTATS 2017). Near the medoid,
    where sums hardly differ, planes below the sums rule out more, as in Kelley's cutting planes
    ("The cutting-plane method for solving convex programs", J. SIAM 1960).
    """
    n = len(points)
    squares = np.einsum("ni,ni->n", points, points)
    size = max(BATCH, DISTANCES_AT_ONCE // n)
    best, best_sum = 0, np.inf
    bounds = bounds.copy()
    while left.size:
        if left.size > size:
            left = left[np.argpartition(bounds[left], size)]
        batch, left = left[:size], left[size:]
        squared = (-2 * points[batch]) @ points.T
        squared += squares
        squared += squares[batch, None]
        distances = np.clip(squared, 0, TLUD_THRESHOLD**2)
        np.sqrt(distances, out=distances)
        sums = distances.sum(axis=1)
        smallest = int(np.argmin(sums))
        if sums[smallest] < best_sum:
            best, best_sum = int(batch[smallest]), sums[smallest]
        if left.size:
            near = [np.count_nonzero(row < (2 * TLUD_THRESHOLD) ** 2) for row in squared]
            bound, step = np.zeros(left.size), ceil(DISTANCES_AT_ONCE / left.size)
            for start in range(0, len(batch), step):
                some = slice(start, start + step)
                d, f, m = distances[some, left], sums[some, None], np.array(near[some])[:, None]
                found = np.maximum(n * d - f, np.where(d < TLUD_THRESHOLD, f - m * d, 0))
                np.maximum(bound, found.max(axis=0), out=bound)
            for i in np.argsort(sums)[:N_PLANES].tolist():
                plane = _plane(points, int(batch[i]), left, np.sqrt(np.maximum(squared[i], 0)))
                np.maximum(bound, plane, out=bound)
            bounds[left] = np.maximum(bounds[left], bound)
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
    lost = np.interp(truncated[left], knots, np.append(0.0, losses))
    lost += truncated[distances < flat].sum()  # whose directions are not known
    bounds: Floats = truncated.sum() + (points[left] - points[i]) @ slope - lost
    return np.where(near[left], bounds, 0.0)


def _medoid_by_tree(rotations: Floats, share: float) -> int:
    """Find the medoid where few agree, from the near pairs alone: about that share of all pairs."""
    n = len(rotations)
    quaternions = scipy.spatial.transform.Rotation.from_matrix(rotations).as_quat()
    # The chordal distance is sqrt(8) sin(angle / 2); that of quaternions v = 2 sin(angle / 4).
    both_signs = scipy.spatial.KDTree(np.vstack([quaternions, -quaternions]))
    reach = sqrt(2 - 2 * sqrt(1 - TLUD_THRESHOLD**2 / 8))
    agreement = np.zeros(n)  # by how much each sum of distances is below n thresholds
    n_parts = ceil(share * n * n / NEAR_PAIRS_AT_ONCE)
    for i in range(n_parts):
        part = scipy.spatial.KDTree(quaternions[i::n_parts])
        pairs = part.sparse_distance_matrix(both_signs, reach, output_type="ndarray")
        v = pairs["v"]
        agreement[i::n_parts] = np.bincount(
            pairs["i"], TLUD_THRESHOLD - sqrt(8) * v * np.sqrt(1 - v * v / 4)
        )
    return int(np.argmax(agreement))
