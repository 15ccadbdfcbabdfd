"""All pairs of cameras, in blocks: relative rotations and directions in two frames at once."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np

from .arrays import Booleans, Floats

__all__ = ["PairBlock", "pair_blocks"]


PAIRS_AT_ONCE = 1 << 13  # their temporaries stay in the cache


@dataclass(frozen=True, eq=False)
class PairBlock:
    """Quantities of some pairs (i, j) for their errors: cameras i in rows, j in columns.

    Only the entries where ``pairs`` is true, those of i < j, count. The quaternions, (rows, 4) and
    (4, columns), are those of the rotations between the frames; ``dots`` are the scalar products of
    the true and the estimated step from i to j, both in the axes of camera i.
    """

    pairs: Booleans
    i_quaternions: Floats
    j_quaternions: Floats
    dots: Floats
    gt_lengths: Floats
    est_lengths: Floats

    def half_cosines(self) -> Floats:
        """Return the cosine, of either sign, of half the angle between the relative rotations."""
        return np.asarray(self.i_quaternions @ self.j_quaternions)

    def rotation_angles(self) -> Floats:
        """Return the angles between the relative rotations in degrees, precise down to 0."""
        sign = np.where(self.half_cosines() < 0, -1.0, 1.0)
        chord = np.zeros(self.dots.shape)
        for k in range(4):
            a, b = self.i_quaternions[:, k, None], self.j_quaternions[k]
            chord += (a - sign * b) ** 2
        return np.asarray(np.degrees(4 * np.arcsin(np.minimum(np.sqrt(chord) / 2, 1.0))))


def pair_blocks(
    gt: Floats, est: Floats, quaternions: Floats, rotations: Floats
) -> Iterator[PairBlock]:
    """Go through all pairs i < j of cameras (n, 3) of moderate size, in O(n) memory.

    The rotation S_i, as quaternion (n, 4) and matrix (n, 3, 3), takes the true axes of camera i to
    its estimated ones. Both errors of a pair follow from it: the rotation from S_i^T S_j, the
    direction from (c_j - c_i)^T S_i^T (c^_j - c^_i). Both forms come from one `Rotation`: the
    rounding of files, which are orthonormal to 1e-6 only, must not enter the cosines.
    """
    others, gt_others, est_others = (np.ascontiguousarray(a.T) for a in (quaternions, gt, est))
    n, first = len(gt), 0
    while first < n - 1:
        # Cameras i = first, first + 1, ... in rows, j = first + 1, ..., n - 1 in columns.
        width = n - 1 - first
        # In equal shares, so that few entries are beyond the diagonal.
        height = ceil(width / ceil(width**2 / PAIRS_AT_ONCE))
        i, j = slice(first, first + height), slice(first + 1, n)
        gt_steps = gt_others[:, j] - gt[i, :, None]
        est_steps = est_others[:, j] - est[i, :, None]
        yield PairBlock(
            pairs=np.arange(height)[:, None] <= np.arange(width),
            i_quaternions=quaternions[i],
            j_quaternions=others[:, j],
            dots=np.einsum("nkj,nkj->nj", rotations[i] @ gt_steps, est_steps),
            gt_lengths=np.sqrt(np.einsum("nkj,nkj->nj", gt_steps, gt_steps)),
            est_lengths=np.sqrt(np.einsum("nkj,nkj->nj", est_steps, est_steps)),
        )
        first += height
