"""Alignments guessed from three cameras each, and the choice among them (section 3, step 2).

The definition in NumPy; ``kernel.c`` computes the same, to the last bit, where it was compiled.
So there is no einsum and no matrix product: the order in which they sum depends on the processor.

Points are stored component first, ``(3, n)``, so that every operation runs over contiguous memory.
NaN and infinity fail every comparison, so triplets and hypotheses with such numbers never win.
"""

from math import inf

import numpy as np

from ..arrays import Booleans, Floats, Indices
from ..similarity import common_normal, cross, dot

__all__ = ["cheapest", "similar_triplets", "three_point_similarities"]


FLAT = 1e-6  # sine of the angle at the first corner, below which a triangle has no usable normal
CHUNK = 1 << 14  # errors evaluated at once: 128 KiB, which fit in the cache


def similar_triplets(gt: Floats, est: Floats, triplets: Indices, factor: float) -> Indices:
    """Find the triplets whose squared edge ratios differ pairwise by at most a factor.

    Parameters
    ----------
    gt, est : (3, n) array
        Camera centres, component first.
    triplets : (3, H) array of int
        Camera indices.
    factor : float
        Largest quotient of two squared ratios ``|est_i - est_j|^2 / |gt_i - gt_j|^2``, at least 1.
        Triplets with two coincident cameras never pass, whatever the factor.

    Returns
    -------
    (K,) ndarray of int
        The columns of those triplets, ascending.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 3, step 2.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration.hypotheses import similar_triplets
    >>> gt = np.array([[0.0, 1.0, 0.0, 5.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    >>> est = 2 * gt
    >>> est[0, 3] = 0.3
    >>> similar_triplets(gt, est, np.array([[0, 0], [1, 1], [2, 3]]), factor=1.2)
    array([0])
    """

    def squared_ratios(i: Indices, j: Indices) -> Floats:
        a, b = (points.take(i, axis=1) - points.take(j, axis=1) for points in (gt, est))
        ratios = dot(b, b) / dot(a, a)
        ratios[~((ratios > 0) & (ratios < inf))] = np.nan
        return ratios

    def alike(a: Floats, b: Floats) -> Booleans:
        return (a <= factor * b) & (b <= factor * a)

    i, j, k = triplets
    ij, ik = squared_ratios(i, j), squared_ratios(i, k)
    similar = np.flatnonzero(alike(ij, ik))  # few, so the third ratio is computed for these alone
    jk = squared_ratios(j[similar], k[similar])
    return similar[alike(jk, ij[similar]) & alike(jk, ik[similar])]


def three_point_similarities(
    gt: Floats, est: Floats, triplets: Indices
) -> tuple[Floats, Floats, Floats, Booleans]:
    """Similarities from ground truth to estimate, each from three cameras.

    The rotation takes the triangle's frame in the ground truth (first axis along the first edge,
    second along the normal) to its frame in the estimate; scale and translation are the
    least-squares ones about the two centroids. A triangle that is flat in either world has no
    normal: its rotation is the smallest that takes one first edge to the other. The spin about the
    line of the cameras is then arbitrary, but changes no position on that line.

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
    >>> from alignscores.registration.hypotheses import three_point_similarities
    >>> gt = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    >>> triplets = np.array([[0], [1], [2]])
    >>> scale, _, translation, flat = three_point_similarities(gt, 2 * gt + 1, triplets)
    >>> scale, translation, flat
    (array([2.]), array([[1., 1., 1.]]), array([False]))
    """
    # Both worlds side by side: (3 components, 2 worlds, H).
    corner, *others = np.stack([gt, est], axis=1).take(triplets, axis=2).transpose(2, 0, 1, 3)
    edge_1, edge_2 = (other - corner for other in others)
    frames, flat = _frames(edge_1, edge_2)
    rotation = dot(frames[:, :, None, 1], frames[:, None, :, 0])

    def rotated(vectors: Floats) -> Floats:
        return dot(rotation.swapaxes(0, 1), vectors[:, None])

    # Sum of b . (R a) over sum of a . a, about the centroids. R takes first axis to first axis, so
    # that three of the four products of edges follow from their lengths along these.
    (a_1, b_1), (a_2, b_2) = dot(edge_1, frames[0]), dot(edge_2, frames[0])
    a_22 = dot(edge_2[:, 0], edge_2[:, 0])
    b_22 = dot(edge_2[:, 1], rotated(edge_2[:, 0]))
    scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1) / (2 * (a_1 * a_1 + a_22 - a_1 * a_2))
    gt_centroid, est_centroid = ((corner + others[0] + others[1]) / 3).swapaxes(0, 1)
    translation = est_centroid - scale * rotated(gt_centroid)
    return scale, rotation.transpose(2, 0, 1), translation.T, flat


def _frames(edge_1: Floats, edge_2: Floats) -> tuple[Floats, Booleans]:
    """Frames (3 axes, 3, 2, H) of triangles in both worlds, given by their two edges (3, 2, H)."""
    frames = np.empty((3, *edge_1.shape))
    first, normal, _ = frames
    first[:] = edge_1 / np.sqrt(dot(edge_1, edge_1))
    normal[:] = cross(first, edge_2)
    flat: Booleans = np.any(dot(normal, normal) <= FLAT * FLAT * dot(edge_2, edge_2), axis=0)
    if flat.any():
        np.copyto(normal, common_normal(first[:, 0], first[:, 1])[:, None], where=flat)
    complete_frames(frames)
    return frames, flat


def complete_frames(frames: Floats) -> None:
    """Complete frames (3 axes, 3, ...) of a unit axis and a second one roughly normal to it."""
    first, normal, _ = frames
    normal -= dot(normal, first) * first
    normal /= np.sqrt(dot(normal, normal))
    frames[2] = cross(first, normal)


def cheapest(
    gt: Floats,
    est: Floats,
    scale: Floats,
    rotation: Floats,
    translation: Floats,
    flat: Booleans,
    rank: int,
    tie: float,
) -> int:
    """Index of the similarity whose ``rank``-th smallest squared error is the smallest.

    A flat triangle says nothing about the spin around its line, so it must beat all others by more
    than rounding: on a partly straight path many similarities fit ``rank`` cameras exactly.

    Parameters
    ----------
    gt, est : (3, n) array
        Camera centres, component first.
    scale : (H,) array
    rotation : (H, 3, 3) array
    translation : (H, 3) array
        Similarities from ground truth to estimate.
    flat : (H,) array of bool
        Which of them come from flat triangles.
    rank : int
        m of the paper, from 1 to n.
    tie : float
        By how much a flat triangle's squared error, in ground-truth units, must be smaller than
        that of the others.

    Returns
    -------
    int
        The index; the first of several, 0 where no cost is finite.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 3, step 2.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.registration.hypotheses import cheapest
    >>> gt = np.array([[0.0, 1.0, 2.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    >>> similarities = np.array([1.0, 2.0]), np.array(2 * [np.eye(3)]), np.zeros((2, 3))
    >>> cheapest(gt, 2 * gt, *similarities, flat=np.zeros(2, bool), rank=3, tie=0.0)
    1
    """
    best, best_cost = 0, inf
    size = max(1, CHUNK // gt.shape[1])
    for group in (np.flatnonzero(~flat), np.flatnonzero(flat)):
        for start in range(0, len(group), size):
            chunk = group[start : start + size]
            errors = squared_errors(gt, est, scale[chunk], rotation[chunk], translation[chunk])
            cheaper = np.flatnonzero(np.count_nonzero(errors < best_cost, axis=1) >= rank)
            if cheaper.size:  # few, so the selection is done for these alone
                costs = np.partition(errors[cheaper], rank - 1, axis=1)[:, rank - 1]
                first = costs.argmin()
                best, best_cost = int(chunk[cheaper[first]]), float(costs[first])
        best_cost -= tie  # the flat triangles come next, and must be cheaper by more than the tie
    return best


def squared_errors(
    gt: Floats, est: Floats, scale: Floats, rotation: Floats, translation: Floats
) -> Floats:
    """Return the squared position errors in the ground truth, (H, n)."""
    shrink = 1 / scale
    residuals = (
        (est[i] - translation[:, i, None]) * shrink[:, None]
        - dot(rotation[:, i, :, None].swapaxes(0, 1), gt[:, None])
        for i in range(3)
    )
    x, y, z = (residual * residual for residual in residuals)
    errors: Floats = x + y + z
    return errors
