"""Alignment of estimated camera positions with the ground truth, at any largest threshold."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats, Indices
from .registration import REGISTRATIONS, Registration, kernel
from .registration.kernel import Aligned, Seed
from .similarity import Similarity
from .validation import check_positions, check_positive, check_same_length

__all__ = ["Aligned", "Aligner", "Seed", "map_threads", "one_scene"]

Item = TypeVar("Item")
Result = TypeVar("Result")

ROUNDING = 1e-6  # by which a scale may differ from 1
SCENES_AT_ONCE = 16  # that are aligned in one call


class Aligner:
    """Aligns checked positions of concatenated scenes at one or several thresholds.

    Scene s has the rows from ``starts[s]`` to ``starts[s + 1]``; the other arguments are those of
    `tas`. With `keep` the refined registration draws the hypotheses of a single scene once, and the
    alignment of one threshold is a start at the next.
    """

    def __init__(
        self,
        gt: Floats,
        est: Floats,
        starts: Indices,
        *,
        registration: str | Registration,
        rng: Seed,
        n_hypotheses: int,
        alignment: str,
        up: str,
        keep: bool = False,
        threads: int = 1,
    ) -> None:
        self.gt, self.est, self.starts = np.ascontiguousarray(gt), np.ascontiguousarray(est), starts
        self.registration = _name(registration)
        self._alignment, self._rng = alignment, rng
        self._user: Any = registration
        self._threads = 1 if isinstance(rng, np.random.Generator) else threads
        register = registration if isinstance(registration, str) else self._by_function
        self._options = kernel.Options(register, alignment, n_hypotheses, up=up)
        self._error: BaseException | None = None  # of a user-supplied registration
        self._scene = kernel.Scene() if keep else None

    @property
    def has_one_alignment(self) -> bool:
        """Whether the alignment is the same at all thresholds."""
        return self._alignment == "none" or self.registration == "pcr99"

    def align(self, unit: float | None, max_threshold: float = 1.0) -> Aligned:
        """Align each scene for errors up to a threshold in a unit, by default d.

        A scene whose d is not positive and finite is left without an alignment.
        """
        if unit is not None:
            check_positive(unit, "unit")
        units = np.full(len(self.starts) - 1, np.nan if unit is None else float(unit))
        self._options.max_threshold = max_threshold

        def align(first: int) -> Aligned:
            return self._align(units, first)

        if len(units) <= SCENES_AT_ONCE:
            return align(0)
        # In parts, so that an interruption need not wait for all.
        parts = map_threads(align, range(0, len(units), SCENES_AT_ONCE), self._threads)
        return Aligned(*map(np.concatenate, zip(*parts, strict=True)))

    def _align(self, units: Floats, first: int) -> Aligned:
        """Align some of the scenes, from the first one on."""
        starts = self.starts[first : first + SCENES_AT_ONCE + 1]
        rows = slice(starts[0], starts[-1])
        aligned = kernel.align_scenes(
            self._options,
            starts - starts[0],
            self.gt[rows],
            self.est[rows],
            self._rng,
            units[first : first + SCENES_AT_ONCE],
            self._scene,
        )
        if self._error is not None:
            raise self._error
        return aligned

    def _by_function(
        self, n: int, gt: Any, est: Any, rank: int, threshold: float, row: Any, n_used: Any
    ) -> None:
        """Register one scene by a user-supplied function; store the exception that it raises."""
        if self._error is not None:
            return
        try:
            positions = (np.ctypeslib.as_array(points, (3, n)).T.copy() for points in (gt, est))
            registered = self._user(
                *positions,
                rank=rank,
                threshold=threshold,
                n_hypotheses=self._options.n_hypotheses,
                rng=np.random.default_rng(self._rng),
                alignment=self._alignment,
            )
            similarity, n_used[0] = _checked(registered, self._alignment)
            if similarity is not None:
                numbers = similarity.scale, *similarity.rotation.flat, *similarity.translation
                np.ctypeslib.as_array(row, (13,))[:] = numbers
        except BaseException as error:
            self._error = error


def _name(registration: str | Registration) -> str:
    """Return the name of a registration."""
    if callable(registration):
        return getattr(registration, "__name__", repr(registration))
    if registration not in REGISTRATIONS:
        choices = f"one of {sorted(REGISTRATIONS)} or a function"
        raise ValueError(f"registration must be {choices}, not {registration!r}")
    return registration


def _checked(registered: Any, alignment: str) -> tuple[Similarity | None, int]:
    """Return the result of a user-supplied registration, or raise TypeError."""
    match registered:
        case (None | Similarity() as similarity, int() | np.integer() as n_used):
            pass
        case _:
            raise TypeError(
                "registration must return a Similarity or None and the number of hypotheses, "
                f"not {registered!r}"
            )
    if similarity is not None and alignment != "similarity":
        turned = alignment == "yaw" and abs(similarity.rotation[2, 2] - 1) > ROUNDING
        if turned or abs(similarity.scale - 1) > ROUNDING:
            raise TypeError(
                f"registration must return a {alignment} alignment, as its argument `alignment` "
                f"says, not one of scale {similarity.scale:g} and rotation {similarity.rotation}"
            )
    return similarity, int(n_used)


def one_scene(gt_positions: ArrayLike, est_positions: ArrayLike) -> tuple[Floats, Floats, Indices]:
    """Check the positions of one scene; return them, and where scenes start."""
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=False)
    check_same_length(gt, est, "gt_positions", "est_positions")
    return gt, est, np.array([0, len(gt)])


def map_threads(function: Callable[[Item], Result], items: Iterable[Item], n: int) -> list[Result]:
    """Return the results of calls on n threads."""
    if n == 1:
        return list(map(function, items))
    with ThreadPoolExecutor(n) as pool:
        return list(pool.map(function, items))
