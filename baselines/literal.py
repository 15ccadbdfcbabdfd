"""PCR-99 with the frames of triangles taken literally: a reading of the paper, not a registration.

Three cameras on a line have no normal. Computed all the same, it is a rounding error scaled to unit
length: it need not be normal to the line, and the "rotation" between two such frames is none.
"""

from typing import Any

import numpy as np

from alignscores.arrays import Floats, Indices
from alignscores.registration.hypotheses import cheapest
from alignscores.registration.pcr99 import component_first, prescreened_triplets
from alignscores.similarity import Similarity, cross, dot

__all__ = ["literal_frames"]


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
        What else a registration is told; not used.

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
    gt, est = component_first(gt_positions, est_positions)
    with np.errstate(all="ignore"):  # NaN and infinity never win a comparison
        triplets = prescreened_triplets(gt, est, n_hypotheses, rng)
        n_used = triplets.shape[1]
        if n_used == 0:
            return None, 0
        scale, rotation, translation = _similarities(gt, est, triplets)
        flat = np.zeros(n_used, dtype=np.bool_)
        best = cheapest(gt, est, scale, rotation, translation, flat, rank, margin=0.0)
    return Similarity(float(scale[best]), rotation[best], translation[best]), n_used


def _similarities(gt: Floats, est: Floats, triplets: Indices) -> tuple[Floats, Floats, Floats]:
    """Similarities of triangles: frame to frame, scale and translation by least squares."""
    corners = [points.take(triplets, axis=1) for points in (gt, est)]  # (3 components, 3, H)
    a, b = (_frames(corner) for corner in corners)
    rotation: Floats = dot(b[:, :, None], a[:, None, :])  # (3, 3, H)
    centroids = [corner.mean(axis=1) for corner in corners]
    local_a, local_b = (c - m[:, None] for c, m in zip(corners, centroids, strict=True))
    rotated = np.einsum("ijh,jkh->ikh", rotation, local_a)
    scale: Floats = (local_b * rotated).sum(axis=(0, 1)) / (local_a**2).sum(axis=(0, 1))
    translation = centroids[1] - scale * np.einsum("ijh,jh->ih", rotation, centroids[0])
    return scale, np.ascontiguousarray(rotation.transpose(2, 0, 1)), translation.T


def _frames(corners: Floats) -> Floats:
    """Return the axes of triangles (3 axes, 3 components, H)."""
    edge_1, edge_2 = (corners[:, k] - corners[:, 0] for k in (1, 2))
    first = edge_1 / np.sqrt(dot(edge_1, edge_1))
    normal = cross(first, edge_2)
    normal = normal / np.sqrt(dot(normal, normal))
    return np.stack([first, normal, cross(first, normal)])
