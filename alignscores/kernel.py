"""The functions of `alignscores.hypotheses`, compiled where the installation found a C compiler.

Arguments and results are the same, to the last bit; only the time differs.
"""

import ctypes
from ctypes import c_double, c_size_t
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.ctypeslib import ndpointer
from numpy.typing import NDArray

from . import hypotheses
from .similarity import PARALLEL

__all__ = ["LIBRARY", "cheapest", "similar_triplets", "three_point_similarities"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.intp]

FLOATS, INDICES, BOOLS = (
    ndpointer(dtype, flags="C_CONTIGUOUS") for dtype in (np.float64, np.intp, np.bool_)
)


def compiled(path: Path) -> ctypes.CDLL | None:
    """Load the compiled kernel; None where it is not there, or is one for another platform."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return None
    points = FLOATS, FLOATS, c_size_t
    triplets = INDICES, c_size_t
    similarities = FLOATS, FLOATS, FLOATS, BOOLS
    library.similar_triplets.argtypes = *points, *triplets, c_double, BOOLS
    library.three_point_similarities.argtypes = (
        *(*points, *triplets, c_double, c_double),
        *similarities,
    )
    library.cheapest.argtypes = *points, *similarities, c_size_t, c_size_t, c_double, FLOATS
    library.cheapest.restype = c_size_t
    return library


def _path() -> Path:
    """Where ``hatch_build.py`` puts what it compiles: the name says of which source it is."""
    source = Path(__file__).with_name("kernel.c")
    return source.with_name(f"kernel-{sha256(source.read_bytes()).hexdigest()[:16]}.so")


LIBRARY = compiled(_path())


def similar_triplets(gt: Floats, est: Floats, triplets: Indices, factor: float) -> Indices:
    """See `hypotheses.similar_triplets`."""
    if LIBRARY is None:
        return hypotheses.similar_triplets(gt, est, triplets, factor)
    gt, est = np.ascontiguousarray(gt), np.ascontiguousarray(est)
    triplets = np.ascontiguousarray(triplets)
    similar = np.empty(triplets.shape[1], dtype=np.bool_)
    LIBRARY.similar_triplets(
        *(gt, est, gt.shape[1]), *(triplets, triplets.shape[1]), factor, similar
    )
    return np.flatnonzero(similar)


def three_point_similarities(
    gt: Floats, est: Floats, triplets: Indices
) -> tuple[Floats, Floats, Floats, Bools]:
    """See `hypotheses.three_point_similarities`."""
    if LIBRARY is None:
        return hypotheses.three_point_similarities(gt, est, triplets)
    gt, est = np.ascontiguousarray(gt), np.ascontiguousarray(est)
    triplets = np.ascontiguousarray(triplets)
    n = triplets.shape[1]
    similarities = np.empty(n), np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n, dtype=np.bool_)
    LIBRARY.three_point_similarities(
        *(gt, est, gt.shape[1]), *(triplets, n), hypotheses.FLAT, PARALLEL, *similarities
    )
    return similarities


def cheapest(
    gt: Floats,
    est: Floats,
    scale: Floats,
    rotation: Floats,
    translation: Floats,
    flat: Bools,
    order: int,
    tie: float,
) -> int:
    """See `hypotheses.cheapest`."""
    if LIBRARY is None:
        return hypotheses.cheapest(gt, est, scale, rotation, translation, flat, order, tie)
    gt, est, scale, rotation, translation = (
        np.ascontiguousarray(array) for array in (gt, est, scale, rotation, translation)
    )
    n = gt.shape[1]
    best = LIBRARY.cheapest(
        *(gt, est, n), *(scale, rotation, translation, flat), len(scale), order, tie, np.empty(n)
    )
    return int(best)
