"""The compiled kernel, step by step, with the arguments of the steps in NumPy."""

from ctypes import c_double, c_int, c_size_t, c_void_p

import numpy as np
import pytest

from alignscores import similarity
from alignscores.registration import hypotheses, reweighting

POINTS = c_void_p, c_void_p, c_size_t
ROWS = c_void_p, c_size_t
SOLVER = c_int, c_double, c_int, c_double, c_double


class Steps:
    """What ``kernel.c`` exports beside whole scenes, of one build of it."""

    def __init__(self, library):
        self._library = library
        points, rows = POINTS, ROWS
        similarities = c_void_p, c_void_p, c_void_p, c_void_p
        library.similar_triplets.argtypes = *points, *rows, c_double, c_void_p
        group = c_int, c_double, c_double
        library.three_point_similarities.argtypes = *points, *rows, *group, *similarities
        ends = c_size_t, c_size_t, c_double
        library.cheapest.argtypes = *points, *similarities, *ends, c_void_p
        library.cheapest.restype = c_size_t
        library.truncated_costs.argtypes = *points, *rows, c_double, c_double, c_void_p
        library.weighted_fits.argtypes = *points, *rows, *SOLVER, c_void_p
        library.refine.argtypes = (
            *(*points, *rows, c_double, c_double, c_size_t, c_double),
            *(*SOLVER, c_void_p, c_void_p, c_void_p),
        )
        library.refine.restype = c_size_t

    def similar_triplets(self, gt, est, triplets, factor):
        gt, est, triplets = floats(gt), floats(est), np.ascontiguousarray(triplets, dtype=np.intp)
        similar = np.empty(triplets.shape[1], dtype=np.intp)
        self._library.similar_triplets(
            *(*addresses(gt, est), gt.shape[1], *addresses(triplets), triplets.shape[1]),
            *(factor, *addresses(similar)),
        )
        return np.flatnonzero(similar)

    def three_point_similarities(self, gt, est, triplets, alignment="similarity"):
        gt, est, triplets = floats(gt), floats(est), np.ascontiguousarray(triplets, dtype=np.intp)
        n = triplets.shape[1]
        similarities = np.empty(n), np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n, bool)
        self._library.three_point_similarities(
            *(*addresses(gt, est), gt.shape[1], *addresses(triplets), n),
            *(hypotheses.GROUPS.index(alignment), hypotheses.FLAT, similarity.PARALLEL),
            *addresses(*similarities),
        )
        return similarities

    def cheapest(self, gt, est, scale, rotation, translation, flat, rank, margin):
        gt, est = floats(gt), floats(est)
        arrays = floats(scale), floats(rotation), floats(translation), np.asarray(flat, bool)
        below = np.empty(gt.shape[1])
        return self._library.cheapest(
            *(*addresses(gt, est), gt.shape[1], *addresses(*arrays), len(flat)),
            *(rank, margin, *addresses(below)),
        )

    def truncated_costs(self, gt, est, rows, threshold, resolution):
        gt, est, rows, costs = floats(gt), floats(est), floats(rows), np.empty(len(rows))
        self._library.truncated_costs(
            *(*addresses(gt, est), gt.shape[1], *addresses(rows), len(rows)),
            *(threshold, resolution, *addresses(costs)),
        )
        return costs

    def weighted_fits(self, gt, est, weights, alignment="similarity"):
        gt, est, weights = floats(gt), floats(est), floats(weights)
        fits = np.empty((len(weights), 13))
        self._library.weighted_fits(
            *(*addresses(gt, est), gt.shape[1], *addresses(weights), len(weights)),
            *(*solver(alignment), *addresses(fits)),
        )
        return fits

    def refine(self, gt, est, rows, threshold, resolution, n_left, least_gain, alignment):
        gt, est, rows = floats(gt), floats(est), np.array(rows, order="C")
        n, count = gt.shape[1], len(rows)
        weights, costs, gains = np.empty(n), np.empty(count), np.empty(count)
        kept = self._library.refine(
            *(*addresses(gt, est), n, *addresses(rows), count),
            *(threshold, resolution, n_left, least_gain),
            *(*solver(alignment), *addresses(weights, costs, gains)),
        )
        return rows[:kept]


def solver(alignment):
    group, line, parallel = hypotheses.GROUPS.index(alignment), similarity.LINE, similarity.PARALLEL
    return group, similarity.SMALLEST, reweighting.SWEEPS, line, parallel


def floats(array):
    return np.ascontiguousarray(array, dtype=np.float64)


def addresses(*arrays):
    return [array.ctypes.data for array in arrays]


@pytest.fixture(scope="session")
def steps():
    """(library) -> its functions beside whole scenes."""
    return Steps
