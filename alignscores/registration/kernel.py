"""Registration of many scenes in one call: compiled where there was a C compiler, else in NumPy.

Results are those of `pcr99` and `refined` for one scene after the other, to the last bit; only the
time differs.
"""

import ctypes
from ctypes import c_bool, c_char, c_double, c_int, c_size_t, c_ssize_t, c_void_p
from functools import lru_cache
from hashlib import sha256
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, sizes
from ..similarity import FARTHEST_SQUARABLE, LINE, PARALLEL, SMALLEST, Similarity
from . import hypotheses, reweighting
from .pcr99 import (
    DRAWS_PER_HYPOTHESIS,
    MARGIN,
    MAX_BATCH,
    PRESCREEN_THRESHOLD,
    check_rank,
    check_shapes,
)
from .pcr99 import pcr99 as pcr99_in_numpy
from .refined import (
    FEW,
    FINE_TOLERANCE,
    MORE,
    N_FINALISTS,
    N_NEIGHBOURHOODS,
    N_STARTS,
    N_SUBSETS,
    RESOLUTION,
    SAMPLE,
    SEVERAL,
    SMALL_SAMPLE,
    TOLERANCE,
    Search,
    order_of,
)

__all__ = [
    "LIBRARY",
    "Scenes",
    "Seed",
    "closest_pair_quartiles",
    "load",
    "normalise_scenes",
    "pcr99",
    "refined",
    "state_of",
]

Seed = int | np.random.SeedSequence | np.random.Generator | None

NOT_DRAWN = 2**64 - 1
WORD = 2**64 - 1


class Settings(ctypes.Structure):
    """What is the same for all scenes, as in ``kernel.c``."""

    _fields_ = (
        *((name, c_size_t) for name in ("n_hypotheses", "draws_per_hypothesis", "most_at_once")),
        *((name, c_double) for name in ("factor", "margin", "flat_sine", "parallel_sine")),
        *((name, c_double) for name in ("line_ratio", "smallest", "farthest")),
        *((name, c_double) for name in ("resolution", "tolerance", "fine_tolerance", "more")),
        *((name, c_ssize_t) for name in ("alignment", "sweeps")),
        *((name, c_size_t) for name in ("n_starts", "few", "several", "n_subsets")),
        *((name, c_size_t) for name in ("n_neighbourhoods", "n_finalists")),
        *((name, c_size_t) for name in ("sample", "small_sample")),
    )


class Arguments(ctypes.Structure):
    """The scenes, and what is known and found of them, as in ``kernel.c``."""

    _fields_ = (
        ("n_scenes", c_size_t),
        *((name, c_void_p) for name in ("which", "starts", "ranks", "gt", "est", "thresholds")),
        *(("orders", c_void_p), ("generator", c_void_p), ("advance", c_bool)),
        *(("hypotheses", c_void_p), ("n_hypotheses", c_void_p), ("most_hypotheses", c_size_t)),
        *((name, c_void_p) for name in ("last", "has_last", "found", "is_found", "n_used")),
    )


def load(path: Path) -> ctypes.CDLL | None:
    """Load a compiled kernel; return None where it does not exist or is for another platform."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return None
    library.most_rows.argtypes = c_void_p, c_size_t
    library.most_rows.restype = c_size_t
    library.register_scenes.argtypes = c_void_p, c_void_p, c_size_t
    library.register_scenes.restype = c_int
    scenes = c_size_t, c_void_p, c_void_p
    library.normalise_scenes.argtypes = *scenes, c_double, *4 * (c_void_p,)
    library.normalise_scenes.restype = c_bool
    library.closest_pair_quartiles.argtypes = *scenes, c_void_p, c_size_t, c_void_p, c_void_p
    return library


def _installed() -> ctypes.CDLL | None:
    """Load what ``hatch_build.py`` compiled from this version of ``kernel.c``, as its name says."""
    source = Path(__file__).with_name("kernel.c")
    if not source.exists():  # only the Python files were copied, as some bundlers do
        return None
    digest = sha256(source.read_bytes()).hexdigest()[:16]
    return load(source.with_name(f"kernel-{digest}.so"))


LIBRARY = _installed()


@lru_cache(maxsize=64)
def _settings(n_hypotheses: int, alignment: str, prescreen: float) -> Settings:
    """Return the constants of both registrations."""
    return Settings(
        *(min(n_hypotheses, 2**40), DRAWS_PER_HYPOTHESIS, MAX_BATCH),
        *(float(np.exp(2 * prescreen)), MARGIN, hypotheses.FLAT, PARALLEL),
        *(LINE, SMALLEST, FARTHEST_SQUARABLE, RESOLUTION, TOLERANCE, FINE_TOLERANCE, MORE),
        *(hypotheses.GROUPS.index(alignment), reweighting.SWEEPS),
        *(N_STARTS, FEW, SEVERAL, N_SUBSETS, N_NEIGHBOURHOODS, N_FINALISTS, SAMPLE, SMALL_SAMPLE),
    )


def normalise_scenes(
    positions: Floats, starts: Indices, farthest: float
) -> tuple[Floats, Floats, Floats] | None:
    """See `aligner.normalise_scenes`; None without a kernel, or where coordinates are farther."""
    if LIBRARY is None:
        return None
    n = len(starts) - 1
    positions = np.ascontiguousarray(positions)
    local, centres, units = np.empty_like(positions), np.zeros((n, 3)), np.empty(n)
    values = np.empty(positions.size)
    done = LIBRARY.normalise_scenes(
        n, *_addresses(starts, positions), farthest, *_addresses(local, centres, units, values)
    )
    return (local, centres, units) if done else None


def closest_pair_quartiles(local: Floats, units: Floats, starts: Indices, most: int) -> Floats:
    """Return d of normalised scenes of 4 to `most` cameras; NaN of others, and where in NumPy."""
    n = len(starts) - 1
    quartiles, values = np.full(n, np.nan), np.empty(most)
    if LIBRARY is not None:
        LIBRARY.closest_pair_quartiles(
            n, *_addresses(starts, local, units), most, *_addresses(quartiles, values)
        )
    return quartiles


class Scenes:
    """Positions of scenes one behind the other, which are aligned at one or several thresholds.

    Scene s has the rows from ``starts[s]`` to ``starts[s + 1]`` of both worlds, all finite. With
    ranks they are aligned by `pcr99`, else by `refined`, whose hypotheses are kept for other
    thresholds if so asked for.

    Attributes
    ----------
    found : (B, 13) ndarray
        The alignments found last: scale, rotation, translation.
    is_found : (B,) ndarray of bool
        Whether there is one.
    n_used : (B,) ndarray of int
        Number of hypotheses they were chosen from.
    """

    def __init__(
        self,
        gt: Floats,
        est: Floats,
        starts: Indices,
        ranks: Indices | None,
        *,
        n_hypotheses: int,
        rng: Seed,
        alignment: str,
        prescreen: float = PRESCREEN_THRESHOLD,
        keep: bool = False,
        threads: int = 1,
    ) -> None:
        self._gt, self._est = (np.ascontiguousarray(p, dtype=np.float64) for p in (gt, est))
        self._starts, self._ranks = starts, ranks
        self._n_hypotheses, self._rng, self._alignment = n_hypotheses, rng, alignment
        self._prescreen, self._keep, self._threads = prescreen, keep, threads
        n = len(starts) - 1
        self.found, self.is_found = np.full((n, 13), np.nan), np.zeros(n, dtype=np.bool_)
        self.n_used = np.zeros(n, dtype=np.intp)
        self._searches: dict[int, Search] = {}
        self._arguments: Arguments | None = None

    def align(self, thresholds: Floats, which: Indices) -> None:
        """Align some of the scenes, each at its largest threshold; the others have no alignment."""
        self.is_found[:] = False
        state = None if LIBRARY is None else state_of(self._rng)
        if LIBRARY is None or state is None:
            for scene in which.tolist():
                self._align_one(scene, float(thresholds[scene]))
            return
        if self._arguments is None:
            self._arguments = self._prepared(LIBRARY)
        which, thresholds = np.ascontiguousarray(which), np.ascontiguousarray(thresholds)
        arguments = self._arguments
        arguments.n_scenes = len(which)
        arguments.which, arguments.thresholds, arguments.generator = _addresses(
            which, thresholds, state
        )
        if not LIBRARY.register_scenes(
            ctypes.byref(self._settings), ctypes.byref(arguments), self._threads
        ):
            raise MemoryError(f"there is no memory for {self._n_hypotheses} hypotheses")
        if isinstance(self._rng, np.random.Generator):
            _set_state(self._rng, state)

    def _prepared(self, library: ctypes.CDLL) -> Arguments:
        """Collect what the kernel is given; all arrays must be kept as long as it may be called."""
        n = len(self.found)
        self._settings = _settings(self._n_hypotheses, self._alignment, self._prescreen)
        orders = rows = n_rows = last = has_last = None
        most = 0
        if self._ranks is None:
            n_cameras = sizes(self._starts).tolist()
            orders = np.concatenate([order_of(size) for size in n_cameras])
            if self._keep:
                address = ctypes.byref(self._settings)
                most = max(library.most_rows(address, size) for size in set(n_cameras))
                rows, n_rows = np.empty((n, most, 13)), np.full(n, NOT_DRAWN, dtype=np.uint64)
                last, has_last = np.empty((n, 13)), np.zeros(n, dtype=np.bool_)
        advance = isinstance(self._rng, np.random.Generator)
        self._threads = 1 if advance else self._threads
        self._kept = (
            *(self._starts, self._ranks, self._gt, self._est, orders, rows, n_rows, last),
            *(has_last, self.found, self.is_found, self.n_used),
        )
        addresses = [None if array is None else _address(array) for array in self._kept]
        return Arguments(
            *(0, None, *addresses[:4], None, addresses[4], None, advance, *addresses[5:7], most),
            *addresses[7:],
        )

    def _align_one(self, scene: int, threshold: float) -> None:
        """Align one scene in NumPy."""
        rows = slice(*self._starts[scene : scene + 2])
        options: dict[str, Any] = {
            "n_hypotheses": self._n_hypotheses,
            "rng": np.random.default_rng(self._rng),
            "alignment": self._alignment,
        }
        if self._ranks is not None:
            options["prescreen"] = self._prescreen
            found, n_used = pcr99_in_numpy(
                self._gt[rows], self._est[rows], rank=int(self._ranks[scene]), **options
            )
        else:
            search = self._searches.get(scene) or Search(
                self._gt[rows], self._est[rows], several=self._keep, **options
            )
            if self._keep:
                self._searches[scene] = search
            found, n_used = search.best(threshold), search.n_used
        self.n_used[scene], self.is_found[scene] = n_used, found is not None
        if found is not None:
            self.found[scene] = found.scale, *found.rotation.ravel(), *found.translation

    def similarity(self, scene: int) -> Similarity | None:
        """Return the alignment of a scene that was found last; None where there is none."""
        return as_similarity(self.found[scene]) if self.is_found[scene] else None


def as_similarity(row: Floats) -> Similarity:
    """Return the alignment that a row holds: scale, rotation, translation."""
    return Similarity(float(row[0]), row[1:10].reshape(3, 3), row[10:])


def pcr99(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    rank: int,
    threshold: float = inf,
    n_hypotheses: int,
    rng: np.random.Generator,
    alignment: str = "similarity",
    prescreen: float = PRESCREEN_THRESHOLD,
) -> tuple[Similarity | None, int]:
    """See `pcr99.pcr99`."""
    n = check_shapes(gt_positions, est_positions)
    check_rank(rank, n)
    scene = Scenes(
        *(gt_positions, est_positions, np.array([0, n]), np.array([rank])),
        n_hypotheses=n_hypotheses,
        rng=rng,
        alignment=alignment,
        prescreen=prescreen,
    )
    scene.align(np.array([threshold]), np.array([0]))
    return scene.similarity(0), int(scene.n_used[0])


def refined(
    gt_positions: Floats,
    est_positions: Floats,
    *,
    rank: int = 0,
    threshold: float,
    n_hypotheses: int,
    rng: np.random.Generator,
    alignment: str = "similarity",
) -> tuple[Similarity | None, int]:
    """See `refined.refined`."""
    n = check_shapes(gt_positions, est_positions)
    scene = Scenes(
        *(gt_positions, est_positions, np.array([0, n]), None),
        n_hypotheses=n_hypotheses,
        rng=rng,
        alignment=alignment,
    )
    scene.align(np.array([threshold]), np.array([0]))
    return scene.similarity(0), int(scene.n_used[0])


@lru_cache(maxsize=64)
def _state_of_seed(seed: int) -> NDArray[np.uint64] | None:
    return state_of(np.random.default_rng(seed))


def state_of(rng: Seed) -> NDArray[np.uint64] | None:
    """Return the state of NumPy's default generator in words of 64 bits; None of another one."""
    if isinstance(rng, int):
        return _state_of_seed(rng)
    state: Any = np.random.default_rng(rng).bit_generator.state
    if state["bit_generator"] != "PCG64":
        return None
    numbers = [state["state"]["state"], state["state"]["inc"]]
    words = [word for number in numbers for word in (number >> 64, number & WORD)]
    return np.array([*words, state["has_uint32"], state["uinteger"]], dtype=np.uint64)


def _set_state(rng: np.random.Generator, words: NDArray[np.uint64]) -> None:
    high, low, _, _, has_half, half = words.tolist()
    state: Any = rng.bit_generator.state
    state["state"]["state"] = high << 64 | low
    rng.bit_generator.state = {**state, "has_uint32": has_half, "uinteger": half}


def _addresses(*arrays: NDArray[np.generic]) -> list[int]:
    """Return addresses of arrays, which the caller must keep alive while they are used."""
    return [_address(array) for array in arrays]


def _address(array: NDArray[np.generic]) -> int:
    try:  # `array.ctypes.data` takes three times as long
        return ctypes.addressof(c_char.from_buffer(array))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # nobody may write to it, or it is empty
        return int(array.ctypes.data)
