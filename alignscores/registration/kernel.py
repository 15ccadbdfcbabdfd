"""The functions of `hypotheses` and `reweighting`, compiled where there was a C compiler.

Arguments and results are the same, to the last bit; only the time differs.
"""

import ctypes
from ctypes import c_double, c_int, c_size_t, c_void_p
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..similarity import LINE, PARALLEL, SMALLEST
from . import hypotheses, reweighting

__all__ = [
    "LIBRARY",
    "cheapest",
    "load",
    "refine",
    "similar_triplets",
    "three_point_similarities",
    "truncated_costs",
    "weighted_fits",
]


def load(path: Path) -> ctypes.CDLL | None:
    """Load a compiled kernel; return None where it does not exist or is for another platform."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return None
    points = c_void_p, c_void_p, c_size_t
    triplets = c_void_p, c_size_t
    sines = c_double, c_double
    similarities = c_void_p, c_void_p, c_void_p, c_void_p
    library.similar_triplets.argtypes = *points, *triplets, c_double, c_void_p
    library.three_point_similarities.argtypes = *points, *triplets, c_int, *sines, *similarities
    library.cheapest.argtypes = *points, *similarities, c_size_t, c_size_t, c_double, c_void_p
    library.cheapest.restype = c_size_t
    rows = c_void_p, c_size_t
    solver = c_int, c_double, c_int, *sines
    library.truncated_costs.argtypes = *points, *rows, c_double, c_double, c_void_p
    library.weighted_fits.argtypes = *points, *rows, *solver, c_void_p
    library.refine.argtypes = (
        *(*points, *rows, c_double, c_double, c_size_t, c_double),
        *(*solver, c_void_p, c_void_p, c_void_p),
    )
    library.refine.restype = c_size_t
    return library


def _installed() -> ctypes.CDLL | None:
    """Load what ``hatch_build.py`` compiled from this version of ``kernel.c``, as its name says."""
    source = Path(__file__).with_name("kernel.c")
    if not source.exists():  # only the Python files were copied, as some bundlers do
        return None
    digest = sha256(source.read_bytes()).hexdigest()[:16]
    return load(source.with_name(f"kernel-{digest}.so"))


LIBRARY = _installed()


def similar_triplets(gt: Floats, est: Floats, triplets: Indices, factor: float) -> Indices:
    """See `hypotheses.similar_triplets`."""
    if LIBRARY is None:
        return hypotheses.similar_triplets(gt, est, triplets, factor)
    gt, est, triplets = _floats(gt), _floats(est), np.ascontiguousarray(triplets, dtype=np.intp)
    n = triplets.shape[1]
    similar = np.empty(n, dtype=np.intp)
    LIBRARY.similar_triplets(
        *_addresses(gt, est), gt.shape[1], *_addresses(triplets), n, factor, *_addresses(similar)
    )
    return np.flatnonzero(similar)


def three_point_similarities(
    gt: Floats, est: Floats, triplets: Indices, alignment: str = "similarity"
) -> tuple[Floats, Floats, Floats, Booleans]:
    """See `hypotheses.three_point_similarities`."""
    if LIBRARY is None:
        return hypotheses.three_point_similarities(gt, est, triplets, alignment)
    gt, est, triplets = _floats(gt), _floats(est), np.ascontiguousarray(triplets, dtype=np.intp)
    n = triplets.shape[1]
    similarities = np.empty(n), np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n, dtype=np.bool_)
    LIBRARY.three_point_similarities(
        *(*_addresses(gt, est), gt.shape[1], *_addresses(triplets), n),
        *(hypotheses.GROUPS.index(alignment), hypotheses.FLAT, PARALLEL),
        *_addresses(*similarities),
    )
    return similarities


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
    """See `hypotheses.cheapest`."""
    if LIBRARY is None:
        return hypotheses.cheapest(gt, est, scale, rotation, translation, flat, rank, margin)
    gt, est = _floats(gt), _floats(est)
    n = gt.shape[1]
    similarities = _floats(scale), _floats(rotation), _floats(translation)
    flat = np.ascontiguousarray(flat, dtype=np.bool_)
    below = np.empty(n)
    best = LIBRARY.cheapest(
        *(*_addresses(gt, est), n, *_addresses(*similarities, flat), len(flat)),
        *(rank, margin, *_addresses(below)),
    )
    return int(best)


def truncated_costs(
    gt: Floats, est: Floats, similarities: Floats, threshold: float, resolution: float
) -> Floats:
    """See `reweighting.truncated_costs`."""
    if LIBRARY is None:
        return reweighting.truncated_costs(gt, est, similarities, threshold, resolution)
    gt, est, similarities = _floats(gt), _floats(est), _floats(similarities)
    costs = np.empty(len(similarities))
    LIBRARY.truncated_costs(
        *(*_addresses(gt, est), gt.shape[1], *_addresses(similarities), len(similarities)),
        *(threshold, resolution, *_addresses(costs)),
    )
    return costs


def weighted_fits(
    gt: Floats, est: Floats, weights: Floats, alignment: str = "similarity"
) -> Floats:
    """See `reweighting.weighted_fits`."""
    if LIBRARY is None:
        return reweighting.weighted_fits(gt, est, weights, alignment)
    gt, est, weights = _floats(gt), _floats(est), _floats(weights)
    fits = np.empty((len(weights), 13))
    LIBRARY.weighted_fits(
        *(*_addresses(gt, est), gt.shape[1], *_addresses(weights), len(weights)),
        *(*_solver(alignment), *_addresses(fits)),
    )
    return fits


def refine(
    gt: Floats,
    est: Floats,
    similarities: Floats,
    threshold: float,
    resolution: float,
    n_left: int,
    least_gain: float,
    alignment: str = "similarity",
) -> Floats:
    """See `reweighting.refine`."""
    ends = threshold, resolution, n_left, least_gain
    if LIBRARY is None:
        return reweighting.refine(gt, est, similarities, *ends, alignment)
    gt, est = _floats(gt), _floats(est)
    refined = np.array(similarities, dtype=np.float64, order="C")
    n, n_similarities = gt.shape[1], len(refined)
    weights, costs, gains = np.empty(n), np.empty(n_similarities), np.empty(n_similarities)
    n_kept = LIBRARY.refine(
        *(*_addresses(gt, est), n, *_addresses(refined), n_similarities),
        *(*ends, *_solver(alignment), *_addresses(weights, costs, gains)),
    )
    return refined[:n_kept]


def _solver(alignment: str) -> tuple[int, float, int, float, float]:
    group = hypotheses.GROUPS.index(alignment)
    return group, SMALLEST, reweighting.SWEEPS, LINE, PARALLEL


def _floats(array: Floats) -> Floats:
    return np.ascontiguousarray(array, dtype=np.float64)


def _addresses(*arrays: NDArray[np.generic]) -> list[int]:
    """Return addresses of arrays, which the caller must keep alive while they are used."""
    # `array.ctypes.data` takes several times as long.
    return [array.__array_interface__["data"][0] for array in arrays]
