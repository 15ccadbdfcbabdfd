"""The registration, compiled from the C files of this folder, called with NumPy's arrays."""

import ctypes
from collections.abc import Callable
from ctypes import POINTER, c_bool, c_double, c_int, c_size_t, c_void_p
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Floats, Indices
from ...similarity import ALIGNMENTS, check_alignment
from ...validation import check_positive

__all__ = [
    "PRESCREEN",
    "Aligned",
    "Options",
    "Scene",
    "Seed",
    "align_scenes",
]

Seed = int | np.random.SeedSequence | np.random.Generator | None

REGISTRATIONS = "pcr99", "refined", "user"  # in the order of kernel.h, as ALIGNMENTS
PRESCREEN = 0.1  # of the paper
SAMPLER = np.random.SeedSequence(0)  # of the samples of cameras

NUMBERS = POINTER(c_double)
UserRegistration = ctypes.CFUNCTYPE(
    None, c_size_t, NUMBERS, NUMBERS, c_size_t, c_double, NUMBERS, POINTER(c_size_t)
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

    def __init__(
        self,
        registration: str | Callable[..., None],
        alignment: str,
        n_hypotheses: int,
        *,
        up: str = "z",
        rank: int = 0,
        prescreen: float = PRESCREEN,
    ) -> None:
        check_positive(n_hypotheses, "n_hypotheses", integer=True)
        check_alignment(alignment, up)
        name, user = ("user", registration) if callable(registration) else (registration, 0)
        super().__init__(
            registration=REGISTRATIONS.index(name),
            alignment=ALIGNMENTS.index(alignment),
            vertical="xyz".index(up[-1]),
            n_hypotheses=min(int(n_hypotheses), 2**40),
            rank=rank,
            prescreen=prescreen,
            max_threshold=1.0,
            user=UserRegistration(user),
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
_LIBRARY.align_scenes.argtypes = c_void_p, c_size_t, *9 * (c_void_p,)
_LIBRARY.align_scenes.restype = c_bool
_LIBRARY.new_scene.restype = c_void_p
_LIBRARY.delete_scene.argtypes = (c_void_p,)
_LIBRARY.delete_scene.restype = None
_address_of = ctypes.pythonapi.PyCapsule_GetPointer
_address_of.argtypes = ctypes.py_object, ctypes.c_char_p
_address_of.restype = c_void_p


class Scene:
    """What the search of one scene goes on from at the next threshold."""

    def __init__(self) -> None:
        self.address: int = _LIBRARY.new_scene()

    def __del__(self) -> None:
        _LIBRARY.delete_scene(self.address)


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


def align_scenes(
    options: Options,
    starts: Indices,
    gt: Floats,
    est: Floats,
    rng: Seed,
    units: Floats,
    scene: Scene | None = None,
) -> Aligned:
    """Return alignments and errors of scenes; see ``scenes.c``.

    Scene s has the rows from ``starts[s]`` to ``starts[s + 1]`` of ``gt`` and ``est``, (N, 3) and
    contiguous. Each is registered with the same seed; a Generator goes on from scene to scene. A
    single scene may go on from the call before.
    """
    n = len(units)
    first = generator(rng)
    again: Any = rng if isinstance(rng, np.random.Generator) else first.bit_generator.seed_seq
    generators = [first, *(np.random.default_rng(again) for _ in range(n - 1))]
    if options.registration == REGISTRATIONS.index("refined"):
        generators += [np.random.default_rng(SAMPLER) for _ in range(n)]
    random = [_address_of(one.bit_generator.capsule, b"BitGenerator") for one in generators]
    rows, errors = np.full((n, 13), np.nan), np.full(len(gt), np.inf)
    aligned = Aligned(rows, errors, units.copy(), np.zeros(n, np.intp))
    start, truth, estimate, *results = (array.ctypes.data for array in (starts, gt, est, *aligned))
    if not _LIBRARY.align_scenes(
        ctypes.byref(options),
        n,
        start,
        truth,
        estimate,
        (c_void_p * len(random))(*random),
        scene and scene.address,
        *results,
    ):
        raise MemoryError(f"there is no memory for {options.n_hypotheses} hypotheses")
    return aligned


def generator(rng: Seed) -> np.random.Generator:
    """Return the Generator itself, or one of a seed."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rng must be a seed or a Generator, not {rng!r}: {error}") from None
