"""The fast steps of the scores, compiled from the C files of this folder.

Points of n cameras are arrays (3, n), C-contiguous, centred and scaled by `normalise`. Alignments
are rows of 13 numbers: scale, rotation and translation from ground truth to estimate.
"""

import ctypes
from ctypes import addressof, c_bool, c_char, c_double, c_int, c_size_t, c_ssize_t, c_void_p
from hashlib import sha256
from pathlib import Path

import numpy as np

from ...arrays import Floats
from ...similarity import ALIGNMENTS

__all__ = [
    "closest_distances",
    "errors",
    "medoid",
    "normalise",
    "pcr99",
    "refine",
    "refined_hypotheses",
]

MAX_HYPOTHESES = 2**40  # more need more memory than there is


def _load() -> ctypes.CDLL:
    """Load what ``hatch_build.py`` compiled from these sources, as its name says."""
    folder = Path(__file__).parent
    digest = sha256()
    for source in sorted(folder.glob("*.[ch]")):
        digest.update(source.read_bytes())
    try:
        return ctypes.CDLL(str(folder / f"kernel.so.{digest.hexdigest()[:16]}"))
    except OSError:
        raise ImportError(
            "the registration of this version of alignscores is not compiled: install it again, in "
            "a checkout by `pip install --no-deps -e .`"
        ) from None


_LIBRARY = _load()
_ARRAY = c_void_p
_SCENE = c_size_t, _ARRAY, _ARRAY, c_int  # n, both points (3, n), alignment group
_LIBRARY.closest_distances.argtypes = c_size_t, _ARRAY, _ARRAY
_LIBRARY.closest_distances.restype = c_double
_LIBRARY.normalise.argtypes = c_size_t, _ARRAY, _ARRAY, _ARRAY
_LIBRARY.normalise.restype = c_bool
_LIBRARY.pcr99.argtypes = (
    c_size_t,
    _ARRAY,
    _ARRAY,
    c_int,
    c_size_t,
    c_size_t,
    c_double,
    _ARRAY,
    _ARRAY,
)
_LIBRARY.pcr99.restype = c_ssize_t
_LIBRARY.max_hypotheses.argtypes = c_size_t, c_size_t
_LIBRARY.max_hypotheses.restype = c_size_t
_LIBRARY.refined_hypotheses.argtypes = *_SCENE, c_size_t, _ARRAY, _ARRAY
_LIBRARY.refined_hypotheses.restype = c_ssize_t
_LIBRARY.refine.argtypes = (
    c_size_t,
    _ARRAY,
    _ARRAY,
    c_int,
    _ARRAY,
    c_size_t,
    c_bool,
    c_double,
    _ARRAY,
)
_LIBRARY.refine.restype = c_bool
_LIBRARY.position_errors.argtypes = c_size_t, _ARRAY, _ARRAY, _ARRAY, c_double, _ARRAY
_LIBRARY.position_errors.restype = None
_LIBRARY.medoid.argtypes = c_size_t, _ARRAY, c_double
_LIBRARY.medoid.restype = c_ssize_t
_address_of = ctypes.pythonapi.PyCapsule_GetPointer
_address_of.argtypes = ctypes.py_object, ctypes.c_char_p
_address_of.restype = c_void_p


def closest_distances(positions: Floats) -> tuple[Floats, float]:
    """Return the distances of positions (n, 3) to the closest other one each, in some order.

    And the extent of the positions: the largest distance from the median along an axis.
    """
    distances = np.empty(len(positions))
    arrays = _address(positions), _address(distances)
    extent: float = _LIBRARY.closest_distances(len(positions), *arrays)
    _check_memory(extent >= 0)
    return distances, extent


def normalise(positions: Floats, unit: float = np.nan) -> tuple[Floats, Floats]:
    """Return points (3, n) of positions (n, 3), and their frame: median (3,) and unit.

    The unit, a power of two near the spread, can be given.
    """
    points, frame = np.empty((3, len(positions))), np.array([0.0, 0.0, 0.0, unit])
    arrays = _address(positions), _address(frame), _address(points)
    _check_memory(_LIBRARY.normalise(len(positions), *arrays))
    return points, frame


def pcr99(
    gt: Floats,
    est: Floats,
    alignment: str,
    *,
    rank: int,
    n_hypotheses: int,
    prescreen: float,
    rng: np.random.Generator,
) -> tuple[Floats, int]:
    """Return the best alignment, NaN if there is none, and the number of hypotheses."""
    best = np.full(13, np.nan)
    count = _LIBRARY.pcr99(
        gt.shape[1],
        _address(gt),
        _address(est),
        ALIGNMENTS.index(alignment),
        rank,
        min(n_hypotheses, MAX_HYPOTHESES),
        prescreen,
        _bit_generator(rng),
        _address(best),
    )
    _check_memory(count >= 0, f"for {n_hypotheses} hypotheses")
    return best, count


def refined_hypotheses(
    gt: Floats, est: Floats, alignment: str, *, n_hypotheses: int, rng: np.random.Generator
) -> Floats:
    """Return the hypotheses (H, 13) that `refine` begins with."""
    n, n_wanted = gt.shape[1], min(n_hypotheses, MAX_HYPOTHESES)
    rows = np.empty((_LIBRARY.max_hypotheses(n, n_wanted), 13))
    count = _LIBRARY.refined_hypotheses(
        n,
        _address(gt),
        _address(est),
        ALIGNMENTS.index(alignment),
        n_wanted,
        _bit_generator(rng),
        _address(rows),
    )
    _check_memory(count >= 0, f"for {n_hypotheses} hypotheses")
    return rows[:count]


def refine(
    gt: Floats,
    est: Floats,
    alignment: str,
    hypotheses: Floats,
    *,
    threshold: float,
    best: Floats,
    is_first_of_several: bool,
) -> None:
    """Write the best alignment for a largest threshold to `best`, which is a start if it is one.

    The points are in random order; the hypotheses are those of the points in any order.
    """
    _check_memory(
        _LIBRARY.refine(
            gt.shape[1],
            _address(gt),
            _address(est),
            ALIGNMENTS.index(alignment),
            _address(hypotheses),
            len(hypotheses),
            is_first_of_several,
            threshold,
            _address(best),
        )
    )


def errors(gt: Floats, est: Floats, alignment: Floats, *, unit: float) -> Floats:
    """Return the errors (n,) of points under an alignment (13,); the unit is the ground truth's."""
    errors = np.empty(gt.shape[1])
    arrays = _address(gt), _address(est), _address(alignment)
    _LIBRARY.position_errors(len(errors), *arrays, unit, _address(errors))
    return errors


def medoid(rotations: Floats, threshold: float) -> int:
    """Return the row of the rotation (n, 3, 3) with the least sum of truncated distances."""
    row: int = _LIBRARY.medoid(len(rotations), _address(rotations), threshold)
    _check_memory(row >= 0)
    return row


def _address(array: Floats) -> int:
    """Return where an array begins: as ``array.ctypes.data`` does, in a third of the time."""
    try:
        return addressof(c_char.from_buffer(array))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # the array is read-only or empty
        address: int = array.ctypes.data
        return address


def _bit_generator(rng: np.random.Generator) -> int:
    """Return the address of the generator's random bits."""
    address: int = _address_of(rng.bit_generator.capsule, b"BitGenerator")
    return address


def _check_memory(done: bool, purpose: str = "") -> None:
    if not done:
        raise MemoryError(f"not enough memory {purpose}".rstrip())
