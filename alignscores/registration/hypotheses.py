"""Alignments guessed from three cameras each, and the choice among them (section 3, step 2).

The definition in NumPy; ``kernel.c`` computes the same, to the last bit, where it was compiled.
So there is no einsum and no matrix product: the order in which they sum depends on the processor.

Points are stored component first, ``(3, n)``, so that every operation runs over contiguous memory;
triplets are camera indices, ``(3, H)``. NaN and infinity fail every comparison, so triplets and
hypotheses with such numbers never win.
"""

from collections.abc import Callable
from math import inf
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..similarity import common_normal, cross, dot

__all__ = ["cheapest", "similar_triplets", "three_point_similarities", "turns"]


Number = TypeVar("Number", bound=np.generic)

GROUPS = "similarity", "rigid", "yaw"  # of alignments that are searched
FLAT = 1e-6  # sine of the angle at the first corner, below which a triangle has no usable normal
ERRORS_AT_ONCE = 1 << 14  # 128 KiB, which fit in the cache


def similar_triplets(gt: Floats, est: Floats, triplets: Indices, factor: float) -> Indices:
    """Return which triplets have squared edge ratios that differ pairwise by at most a factor.

    A squared ratio is ``|est_i - est_j|^2 / |gt_i - gt_j|^2``. Triplets with two coincident cameras
    never pass, whatever the factor.
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
    gt: Floats, est: Floats, triplets: Indices, alignment: str = "similarity"
) -> tuple[Floats, Floats, Floats, Booleans]:
    """Return alignments from ground truth to estimate, and which of their triangles are flat.

    The rotation takes the triangle's frame in the ground truth (first axis along the first edge,
    second along the normal) to its frame in the estimate; scale and translation are the
    least-squares ones about the two centroids. A triangle that is flat in either world has no
    normal: its rotation is the smallest that takes one first edge to the other. The spin about the
    line of the cameras is then arbitrary, but changes no position on that line.

    "rigid" has the same rotation and the scale 1. "yaw" turns about the third axis, by the
    least-squares angle; there flat are triangles whose cameras stand above each other.
    """
    # Both worlds side by side: (3 components, 2 worlds, H).
    corner, *others = np.stack([gt, est], axis=1).take(triplets, axis=2).transpose(2, 0, 1, 3)
    edge_1, edge_2 = (other - corner for other in others)
    frames, flat = _frames(edge_1, edge_2)
    rotation = dot(frames[:, :, None, 1], frames[:, None, :, 0])
    if alignment == "yaw":
        rotation, flat = _turns_between(edge_1, edge_2)

    def rotated(vectors: Floats) -> Floats:
        return dot(rotation.swapaxes(0, 1), vectors[:, None])

    # Sum of b . (R a) over sum of a . a, about the centroids. R takes first axis to first axis, so
    # that three of the four products of edges follow from their lengths along these.
    (a_1, b_1), (a_2, b_2) = dot(edge_1, frames[0]), dot(edge_2, frames[0])
    a_22 = dot(edge_2[:, 0], edge_2[:, 0])
    b_22 = dot(edge_2[:, 1], rotated(edge_2[:, 0]))
    scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1) / (2 * (a_1 * a_1 + a_22 - a_1 * a_2))
    if alignment != "similarity":
        scale = np.ones_like(scale)
    gt_centroid, est_centroid = ((corner + others[0] + others[1]) / 3).swapaxes(0, 1)
    translation = est_centroid - scale * rotated(gt_centroid)
    return scale, rotation.transpose(2, 0, 1), translation.T, flat


def _turns_between(edge_1: Floats, edge_2: Floats) -> tuple[Floats, Booleans]:
    """Return the best rotations (3, 3, H) about the third axis, and which of them are free.

    Triangles are given by two edges (3, 2 worlds, H). Sums of products over three cameras, relative
    to their centroid, follow from those of the edges.
    """

    def centred(product: Callable[[Floats, Floats], Floats], first: int, second: int) -> Floats:
        (a_1, a_2), (b_1, b_2) = ([e[:, i] for e in (edge_1, edge_2)] for i in (first, second))
        total = 2 * (product(a_1, b_1) + product(a_2, b_2))
        return total - product(a_1, b_2) - product(a_2, b_1)

    cosine = centred(lambda a, b: a[0] * b[0] + a[1] * b[1], 0, 1)
    sine = centred(lambda a, b: a[0] * b[1] - a[1] * b[0], 0, 1)
    shortest = FLAT * FLAT * np.sqrt(centred(dot, 0, 0) * centred(dot, 1, 1))
    return turns(cosine, sine, shortest), ~(np.sqrt(cosine * cosine + sine * sine) > shortest)


def turns(cosine: Floats, sine: Floats, shortest: Floats | float) -> Floats:
    """Return rotations (3, 3, H) about the third axis by their directions; none if too short."""
    length = np.sqrt(cosine * cosine + sine * sine)
    turned = length > shortest
    cosine, sine = np.where(turned, cosine / length, 1.0), np.where(turned, sine / length, 0.0)
    zero, one = np.zeros_like(length), np.ones_like(length)
    return np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, one]])


def _frames(edge_1: Floats, edge_2: Floats) -> tuple[Floats, Booleans]:
    """Return frames (3 axes, 3, 2, H) of triangles in both worlds, given by two edges (3, 2, H)."""
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
    margin: float,
) -> int:
    """Return the index of the similarity whose ``rank``-th smallest squared error is the smallest.

    A flat triangle says nothing about the spin around its line, so it must beat all others by more
    than a margin of rounding: on a partly straight path many similarities fit ``rank`` cameras
    exactly. It is the first of several equally cheap ones, 0 where no cost is finite.
    """
    best, best_cost = 0, inf
    for indices in (np.flatnonzero(~flat), np.flatnonzero(flat)):
        for chunk in chunks(indices, gt.shape[1]):
            errors = squared_errors(gt, est, scale[chunk], rotation[chunk], translation[chunk])
            cheaper = np.flatnonzero(np.count_nonzero(errors < best_cost, axis=1) >= rank)
            if cheaper.size:  # few, so the selection is done for these alone
                costs = np.partition(errors[cheaper], rank - 1, axis=1)[:, rank - 1]
                first = costs.argmin()
                best, best_cost = int(chunk[cheaper[first]]), float(costs[first])
        best_cost -= margin  # the flat triangles come next, and must be cheaper by more
    return best


def chunks(array: NDArray[Number], n: int) -> list[NDArray[Number]]:
    """Return the rows of an array, one a similarity, in parts whose errors fit in the cache."""
    size = max(1, ERRORS_AT_ONCE // n)
    return [array[start : start + size] for start in range(0, max(1, len(array)), size)]


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
