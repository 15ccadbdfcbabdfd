"""Types of the arrays that the whole project works with, and scenes in one array."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["Booleans", "Floats", "Indices", "of_equal_size"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Booleans = NDArray[np.bool_]


def of_equal_size(starts: Indices) -> Iterator[tuple[Indices, Indices]]:
    """Yield scenes (G,) of equal size with their rows (G, m), from where each scene starts (B + 1).

    Scenes without a row are left out.
    """
    counts = np.diff(starts)
    for size in sorted(set(counts[counts > 0].tolist())):  # np.unique takes longer for few
        scenes = np.flatnonzero(counts == size)
        yield scenes, starts[scenes, None] + np.arange(size)
