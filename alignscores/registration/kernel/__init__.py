"""The registration, compiled from the C files of this folder, called with NumPy's arrays."""

import ctypes
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, c_bool, c_double, c_int, c_size_t, c_void_p
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Booleans, Floats, Indices
from ...similarity import ALIGNMENTS, check_alignment
from ...validation import check_positive

__all__ = [
    "PRESCREEN",
    "Aligned",
    "Options",
    "Seed",
    "align_scenes",
    "close_scenes",
    "closest_pairs",
    "normalise",
    "options",
]

Seed = int | np.random.SeedSequence | np.random.Generator | None

REGISTRATIONS = "pcr99", "refined", "user"  # in the order of kernel.h, as ALIGNMENTS
PRESCREEN = 0.1  # of the paper
OUTCOMES = "done", "no memory", "failed"  # in the order of scenes.c

NUMBERS = POINTER(c_double)
UserRegistration = CFUNCTYPE(
    c_int, c_size_t, NUMBERS, NUMBERS, c_size_t, c_double, NUMBERS, POINTER(c_size_t)
)


class Options(ctypes.Structure):
    """What is the same for all scenes, as in ``kernel.h``."""

    _fields_ = (
        ("registration", c_int),
        ("alignment", c_int),
        ("vertical", c_int),
        ("n_hypotheses", c_size_t),
        ("rank", c_size_t),
        ("prescreen", c_double),
        ("max_threshold", c_double),
        ("user", UserRegistration),
    )


def options(
    registration: str,
    alignment: str,
    *,
    n_hypotheses: int,
    up: str = "z",
    rank: int = 0,
    prescreen: float = PRESCREEN,
    user: Callable[..., int] | None = None,
) -> Options:
    """Return the options of a registration; that of a user is a function."""
    check_positive(n_hypotheses, "n_hypotheses", integer=True)
    check_alignment(alignment, up)
    return Options(
        registration=REGISTRATIONS.index(registration if user is None else "user"),
        alignment=ALIGNMENTS.index(alignment),
        vertical="xyz".index(up[-1]),
        n_hypotheses=min(int(n_hypotheses), 2**40),
        rank=rank,
        prescreen=prescreen,
        max_threshold=1.0,
        user=UserRegistration(0 if user is None else user),
    )


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
assert c_size_t.in_dll(_LIBRARY, "options_size").value == ctypes.sizeof(Options)
_LIBRARY.align_scenes.argtypes = c_void_p, c_size_t, *4 * (c_void_p,), c_bool, *5 * (c_void_p,)
_LIBRARY.close_scenes.argtypes = c_size_t, c_void_p
_LIBRARY.closest_pairs.argtypes = c_size_t, c_void_p, c_void_p
_LIBRARY.closest_pairs.restype = c_bool
_LIBRARY.normalise_positions.argtypes = c_size_t, *4 * (c_void_p,)


class Aligned(NamedTuple):
    """Alignments of scenes, and errors of all their cameras.

    Attributes
    ----------
    rows : (B, 13) ndarray
        Scale, rotation and translation from ground truth to estimate; NaN where there are none.
    errors : (N,) ndarray
        In ground-truth units; infinite for a camera that was not estimated or not aligned.
    units : (B,) ndarray
        Those that were given, or d; NaN where it does not exist.
    n_hypotheses : (B,) ndarray of int
        Number of hypotheses that each alignment was chosen from.
    """

    rows: Floats
    errors: Floats
    units: Floats
    n_hypotheses: Indices

    @property
    def found(self) -> Booleans:
        """Which scenes have an alignment."""
        return np.asarray(~np.isnan(self.rows[:, 0]))


def align_scenes(
    options: Options,
    starts: Indices,
    gt: Floats,
    est: Floats,
    rng: Seed,
    units: Floats,
    kept: NDArray[np.uintp] | None = None,
) -> Aligned | None:
    """Align scenes, as ``scenes.c`` says; return None where a user's registration failed.

    Scene s has the rows from ``starts[s]`` to ``starts[s + 1]`` of ``gt`` and ``est``, (N, 3) and
    contiguous. Each is registered with the same seed; a Generator goes on from scene to scene.
    """
    n, generator = len(units), _generator(rng)
    random = _state(generator)
    aligned = Aligned(np.empty((n, 13)), np.empty(len(gt)), units.copy(), np.empty(n, np.intp))
    start, truth, estimate, words, keep, *found = [
        None if array is None else array.__array_interface__["data"][0]
        for array in (starts, gt, est, random, kept, *aligned)
    ]
    goes_on = isinstance(rng, np.random.Generator)
    outcome = _LIBRARY.align_scenes(
        ctypes.byref(options), n, start, truth, estimate, words, goes_on, keep, *found
    )
    if goes_on and options.registration != REGISTRATIONS.index("user"):
        _set_state(generator, random)
    if OUTCOMES[outcome] == "no memory":
        raise MemoryError(f"there is no memory for {options.n_hypotheses} hypotheses")
    return aligned if OUTCOMES[outcome] == "done" else None


def _generator(rng: Seed) -> np.random.Generator:
    """Return a Generator of PCG64; one of another kind gives it a seed."""
    try:
        generator = np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rng must be a seed or a Generator, not {rng!r}: {error}") from None
    if isinstance(generator.bit_generator, np.random.PCG64):
        return generator
    return np.random.default_rng(int(generator.integers(2**63)))


def _state(generator: np.random.Generator) -> NDArray[np.uint64]:
    """Return the state of PCG64 as ``kernel.h`` declares it."""
    state: Any = generator.bit_generator.state
    numbers = state["state"]["state"], state["state"]["inc"]
    halves = [half for number in numbers for half in divmod(number, 2**64)]
    return np.array([*halves, state["has_uint32"], state["uinteger"]], dtype=np.uint64)


def _set_state(generator: np.random.Generator, words: NDArray[np.uint64]) -> None:
    """Let a generator go on from a state."""
    high, low, inc_high, inc_low, has_half, half = words.tolist()
    generator.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": high << 64 | low, "inc": inc_high << 64 | inc_low},
        "has_uint32": has_half,
        "uinteger": half,
    }


def close_scenes(kept: NDArray[np.uintp]) -> None:
    """Free scenes that were kept."""
    _LIBRARY.close_scenes(len(kept), kept.ctypes.data)


def normalise(positions: Floats) -> tuple[Floats, Floats, float]:
    """Return positions (n, 3) centred on their median and divided by their spread, and both.

    The spread is a power of two near the median distance from the median along an axis.
    """
    rows = np.ascontiguousarray(positions)
    points, centre, unit = np.empty(rows.shape[::-1]), np.empty(3), np.empty(1)
    arrays: tuple[Any, ...] = rows, points, centre, unit
    _LIBRARY.normalise_positions(len(rows), *(array.ctypes.data for array in arrays))
    return points.T, centre, float(unit[0])


def closest_pairs(positions: Floats) -> Floats:
    """Return the distances (n,) of normalised positions to the closest other one, in some order."""
    points = np.ascontiguousarray(positions.T)
    distances = np.empty(len(positions))
    if not _LIBRARY.closest_pairs(len(positions), points.ctypes.data, distances.ctypes.data):
        raise MemoryError(f"there is no memory for the closest pairs of {len(positions)} cameras")
    return distances
