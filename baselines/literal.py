"""PCR-99 with the frames of triangles taken literally: a reading of the paper, not a registration.

Three cameras on a line have no normal. Computed all the same, it is a rounding error scaled to unit
length: it need not be normal to the line, and the "rotation" between two such frames is none.
"""

from itertools import combinations
from math import comb
from typing import Any

import numpy as np

from alignscores.arrays import Booleans, Floats, Indices
from alignscores.similarity import Similarity

__all__ = ["literal_frames"]

PRESCREEN = 0.1  # largest difference between the log edge ratios of a triplet
DRAWS_PER_HYPOTHESIS = 1000  # after which the hypotheses found so far are used
AT_ONCE = 1 << 16  # triplets that are drawn at most


def literal_frames(
    gt_positions: Floats,
    est_positions: Floats,
    /,
    *,
    rank: int,
    n_hypotheses: int,
    rng: np.random.Generator,
    **_: Any,
) -> tuple[Similarity | None, int]:
    """Register as `alignscores.registration.pcr99`, but for triangles of collinear cameras.

    Every triangle has the frame of its first edge and its computed normal, whatever that is.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array
        Finite camera centres, row i of both the same camera.
    rank : int
        m of the paper: the hypothesis with the smallest rank-th smallest error wins.
    n_hypotheses : int
        Number of triplets that are drawn.
    rng : Generator
        Draws them.
    **_ : object
        Further arguments of a registration; not used.

    Returns
    -------
    alignment : Similarity or None
        The cheapest hypothesis, from ground truth to estimate; None where there is none. Where the
        cameras are collinear its matrix is in general no rotation.
    n_used : int
        Number of hypotheses it was chosen from.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 3, step 2.

    Examples
    --------
    >>> import numpy as np
    >>> from baselines import literal_frames
    >>> gt = np.random.default_rng(0).normal(size=(9, 3))
    >>> seed = np.random.default_rng(0)
    >>> alignment, n_used = literal_frames(gt, 2 * gt + 1, rank=4, n_hypotheses=9, rng=seed)
    >>> round(alignment.scale, 9), n_used
    (2.0, 9)
    """
    gt, est = (np.ascontiguousarray(np.transpose(p)) for p in (gt_positions, est_positions))
    with np.errstate(all="ignore"):  # NaN and infinity never win a comparison
        triplets = _prescreened(gt, est, n_hypotheses, rng)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        scale, rotation, translation = _similarities(gt, est, triplets)
        # (est - t) / s - R gt of all hypotheses in one product, which is faster.
        rows = np.zeros((n_used, 3, 7))
        rows[:, :, :3] = np.eye(3) / scale[:, None, None]
        rows[:, :, 3:6], rows[:, :, 6] = -rotation, -translation / scale[:, None]
        points = np.vstack([est, gt, np.ones(gt.shape[1])])
        residuals = (rows.reshape(-1, 7) @ points).reshape(n_used, 3, -1)
        errors = np.einsum("hin,hin->hn", residuals, residuals)
        costs = np.partition(errors, rank - 1, axis=1)[:, rank - 1]
        best = int(np.argmin(np.where(np.isnan(costs), np.inf, costs)))
    return Similarity(float(scale[best]), rotation[best], translation[best]), n_used


def _prescreened(gt: Floats, est: Floats, n: int, rng: np.random.Generator) -> Indices:
    """Draw n triplets (3, n) whose log edge ratios differ pairwise by at most a threshold.

    Or return all that do, each with its three first edges, where no more than n triplets exist.
    """
    n_cameras = gt.shape[1]
    if comb(n_cameras, 3) <= n:
        i, j, k = np.array(list(combinations(range(n_cameras), 3)), dtype=np.intp).reshape(-1, 3).T
        triplets = np.hstack([(i, j, k), (j, k, i), (k, i, j)])
        return triplets[:, _are_similar(gt, est, triplets)]
    similar: Indices = np.empty((3, 0), dtype=np.intp)
    drawn, batch = 0, 2 * n
    while similar.shape[1] < n and drawn < DRAWS_PER_HYPOTHESIS * n:
        triplets = rng.integers(n_cameras, size=(3, batch))
        similar = np.hstack([similar, triplets[:, _are_similar(gt, est, triplets)]])
        drawn += batch
        missing = n - similar.shape[1]
        batch = min(AT_ONCE, 64 + int(1.1 * missing * drawn / max(1, similar.shape[1])))
    return similar[:, :n]


def _are_similar(gt: Floats, est: Floats, triplets: Indices) -> Booleans:
    corners = (points.take(triplets, axis=1) for points in (gt, est))
    edges = (c - np.roll(c, 1, axis=1) for c in corners)
    a, b = (np.linalg.norm(edge, axis=0) for edge in edges)
    ratios = np.log(b / a)  # (3, H)
    similar = np.isfinite(ratios).all(axis=0) & (np.ptp(ratios, axis=0) <= PRESCREEN)
    return np.asarray(similar)


def _similarities(gt: Floats, est: Floats, triplets: Indices) -> tuple[Floats, Floats, Floats]:
    """Similarities of triangles: frame to frame, scale and translation by least squares."""
    corners = [points.take(triplets, axis=1) for points in (gt, est)]  # (3 components, 3, H)
    a, b = (_frames(corner) for corner in corners)
    rotation: Floats = (b[:, :, None] * a[:, None]).sum(axis=0)  # (3, 3, H)
    centroids = [corner.mean(axis=1) for corner in corners]
    local_a, local_b = (c - m[:, None] for c, m in zip(corners, centroids, strict=True))
    rotated = np.einsum("ijh,jkh->ikh", rotation, local_a)
    scale: Floats = (local_b * rotated).sum(axis=(0, 1)) / (local_a**2).sum(axis=(0, 1))
    translation = centroids[1] - scale * np.einsum("ijh,jh->ih", rotation, centroids[0])
    return scale, np.ascontiguousarray(rotation.transpose(2, 0, 1)), translation.T


def _frames(corners: Floats) -> Floats:
    """Return the axes of triangles (3 axes, 3 components, H)."""
    edge_1, edge_2 = (corners[:, k] - corners[:, 0] for k in (1, 2))
    first = edge_1 / np.linalg.norm(edge_1, axis=0)
    normal = np.cross(first, edge_2, axis=0)
    normal = normal / np.linalg.norm(normal, axis=0)
    return np.stack([first, normal, np.cross(first, normal, axis=0)])
