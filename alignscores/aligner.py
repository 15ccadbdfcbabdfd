"""Alignment of estimated camera positions with the ground truth, at any largest threshold."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Booleans, Floats, Indices, sizes
from .registration import REGISTRATIONS, Registration, kernel, pcr99, refined
from .registration.kernel import Seed
from .similarity import FARTHEST_SUMMABLE, Similarity, check_alignment
from .validation import check_positions, check_positive, check_same_length, finite_rows

__all__ = [
    "Aligned",
    "Aligner",
    "Normalised",
    "Seed",
    "Worlds",
    "normalise",
    "normalise_scenes",
    "one_scene",
]

ROUNDING = 1e-6  # by which a scale may differ from 1
SHRINK = 2.0**-40  # of coordinates whose sums overflow; it rounds nothing
IDENTITY = np.array([1.0, *np.eye(3).ravel(), 0.0, 0.0, 0.0])


def _vertical_last(axis: str) -> tuple[Indices, Indices]:
    """Return an order of the axes, and that of a row of an alignment to undo it."""
    axes = np.roll(range(3), -1 - "xyz".index(axis))
    back = np.argsort(axes)
    return axes, np.concatenate([[0], 1 + (3 * back[:, None] + back).ravel(), 10 + back])


VERTICAL_LAST = {axis: _vertical_last(axis) for axis in "xyz"}


class Normalised(NamedTuple):
    """Positions of scenes (N, 3), and origin (B, 3) and unit (B,) of each; see `normalise`."""

    local: Floats
    centres: Floats
    units: Floats


class Worlds(NamedTuple):
    """Normalised positions of the estimated cameras of scenes, and which of all cameras they are.

    Both worlds have one unit where the scale is kept.
    """

    estimated: Booleans
    starts: Indices
    gt: Normalised
    est: Normalised

    def errors(self, rows: Floats, found: Booleans) -> Floats:
        """Return the errors of all cameras under alignments of scenes, (B, 13), as `Aligned`."""
        errors = np.full(len(self.estimated), np.inf)
        errors[self.estimated] = _errors(rows, found, self.starts, self.gt, self.est)
        return errors


class Aligned(NamedTuple):
    """Alignments of scenes: scale, rotation, translation (B, 13), which there are, errors (N,).

    And the alignments of the normalised positions, and how many they were chosen from, (B,). Errors
    of scenes that were not asked for, or have no alignment, and of lost cameras are infinite.
    """

    rows: Floats
    found: Booleans
    errors: Floats
    normalised: Floats
    n_hypotheses: Indices

    def similarity(self, scene: int) -> Similarity | None:
        """Return the alignment of a scene, None where there is none."""
        return kernel.as_similarity(self.rows[scene]) if self.found[scene] else None


class Aligner:
    """Aligns checked positions of scenes, one behind the other, at one or several thresholds.

    Scene s has the rows from ``starts[s]`` to ``starts[s + 1]``; the other arguments are those of
    `tas`. With `keep` the refined registration draws its hypotheses once, and what it finds at one
    threshold is a start at the next.
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
        self.gt, self.est, self.starts = gt, est, starts
        check_positive(n_hypotheses, "n_hypotheses", integer=True)
        check_alignment(alignment, up)
        self._register, self.registration = _registration(registration)
        try:
            kernel.state_of(rng)
        except (TypeError, ValueError) as error:
            raise ValueError(f"rng must be a seed or a Generator, not {rng!r}: {error}") from None
        self._alignment = alignment
        self._settings: dict[str, Any] = {
            "n_hypotheses": int(n_hypotheses),
            "rng": rng,
            "alignment": alignment,
        }
        self._batch: dict[str, Any] = {"keep": keep, "threads": threads}
        self.normalised_gt = normalise_scenes(gt, starts)
        self.estimated = finite_rows(est)
        self._axes, self._back = VERTICAL_LAST[up[-1]]
        self._worlds: Worlds | None = None
        self._scenes: kernel.Scenes | None = None

    @property
    def has_one_alignment(self) -> bool:
        """Whether the alignment is the same at all thresholds."""
        return self._alignment == "none" or self.registration == "pcr99"

    @np.errstate(over="ignore", invalid="ignore")  # beyond the largest number: infinitely far
    def align(self, thresholds: Floats, which: Indices | None = None) -> Aligned:
        """Align scenes for errors up to a threshold each, (B,); by default all scenes."""
        worlds = self.worlds
        alignable = sizes(worlds.starts) >= (3 if self._alignment == "similarity" else 1)
        if which is None:
            which = np.arange(len(alignable))
        relative = thresholds / worlds.gt.units
        normalised, found, n_used = self._registered(relative, which[alignable[which]])
        errors = worlds.errors(normalised, found)
        rows = normalised
        if self._alignment != "none":
            rows = _between_worlds(normalised, worlds.gt, worlds.est)
        return Aligned(rows, found, errors, normalised, n_used)

    @property
    def worlds(self) -> Worlds:
        """What is aligned."""
        if self._worlds is None:
            self._worlds = self._normalised()
        return self._worlds

    def _normalised(self) -> Worlds:
        estimated, gt_positions, est_positions = self.estimated, self.gt, self.est
        starts, gt = self.starts, self.normalised_gt
        if not estimated.all():
            starts = np.append(0, np.cumsum(estimated))[starts]
            gt_positions, est_positions = gt_positions[estimated], est_positions[estimated]
        counts = sizes(starts)
        if self._alignment == "none":  # divided so that squares neither overflow nor vanish
            units = _each(gt.units, counts)[:, None]
            est = Normalised(est_positions / units, gt.centres, gt.units)
            gt = Normalised(gt_positions / units, gt.centres, gt.units)
            return Worlds(estimated, starts, gt, est)
        if gt_positions is not self.gt:
            gt = normalise_scenes(gt_positions, starts)
        est = normalise_scenes(est_positions, starts)
        if self._alignment != "similarity":
            ratios = _each(est.units / gt.units, counts)[:, None]
            est = Normalised(est.local * ratios, est.centres, gt.units)
        return Worlds(estimated, starts, gt, est)

    def _registered(self, thresholds: Floats, which: Indices) -> tuple[Floats, Booleans, Indices]:
        """Register normalised positions of some scenes."""
        n = len(thresholds)
        if self._alignment != "none" and self._register in (pcr99, refined):
            scenes = self._all_scenes()
            scenes.align(thresholds, which)
            rows = scenes.found.take(self._back, axis=1)  # by rows, on which the last bits depend
            return rows, scenes.is_found.copy(), scenes.n_used.copy()
        rows, found, n_used = np.full((n, 13), np.nan), np.zeros(n, bool), np.zeros(n, np.intp)
        if self._alignment == "none":
            rows[which], found[which], n_used[which] = IDENTITY, True, 1
        else:
            for scene in which.tolist():
                alignment, n_used[scene] = self._by_function(scene, float(thresholds[scene]))
                found[scene] = alignment is not None
                if alignment is not None:
                    rows[scene] = _as_row(alignment)[self._back]
        return rows, found, n_used

    def _all_scenes(self) -> kernel.Scenes:
        """Return the scenes for the kernel, made once, so that it can keep hypotheses."""
        if self._scenes is None:
            starts, gt, est = self._vertical_last()
            ranks = self._ranks(sizes(starts)) if self._register is pcr99 else None
            self._scenes = kernel.Scenes(gt, est, starts, ranks, **self._settings, **self._batch)
        return self._scenes

    def _vertical_last(self) -> tuple[Indices, Floats, Floats]:
        _, starts, gt, est = self.worlds
        if self._axes[2] == 2:
            return starts, gt.local, est.local
        return starts, gt.local[:, self._axes], est.local[:, self._axes]

    def _ranks(self, n_estimated: Indices) -> Indices:
        """Return m of the paper, of all cameras, lost ones included."""
        return np.minimum(np.maximum(4, (sizes(self.starts) + 5) // 10), n_estimated)

    def _by_function(self, scene: int, threshold: float) -> tuple[Similarity | None, int]:
        """Register one scene by a function of somebody's own."""
        starts, gt, est = self._vertical_last()
        rows = slice(*starts[scene : scene + 2])
        rank = int(self._ranks(sizes(starts))[scene])
        settings = {**self._settings, "rng": np.random.default_rng(self._settings["rng"])}
        registered: Any = self._register(
            gt[rows], est[rows], rank=rank, threshold=threshold, **settings
        )
        match registered:
            case (None, int() | np.integer() as n_used):
                return None, int(n_used)
            case (Similarity() as found, int() | np.integer() as n_used):
                self._check(found)
                return found, int(n_used)
            case _:
                raise TypeError(
                    "registration must return a Similarity or None and the number of hypotheses, "
                    f"not {registered!r}"
                )

    def _check(self, found: Similarity) -> None:
        """Refuse what is not in the group, from a registration of one's own."""
        if self._alignment == "similarity":
            return
        turned = self._alignment == "yaw" and abs(found.rotation[2, 2] - 1) > ROUNDING
        if turned or abs(found.scale - 1) > ROUNDING:
            raise TypeError(
                f"registration must return a {self._alignment} alignment, as its argument "
                f"`alignment` says, not one of scale {found.scale:g} and rotation {found.rotation}"
            )


def _registration(registration: str | Registration) -> tuple[Registration, str]:
    """Return a registration with its name."""
    if isinstance(registration, str) and registration in REGISTRATIONS:
        return REGISTRATIONS[registration], registration
    if isinstance(registration, str) or not callable(registration):
        raise ValueError(
            f"registration must be one of {sorted(REGISTRATIONS)} or a function, "
            f"not {registration!r}"
        )
    return registration, getattr(registration, "__name__", repr(registration))


def _as_row(alignment: Similarity) -> Floats:
    return np.concatenate(
        [[alignment.scale], np.ravel(alignment.rotation), np.ravel(alignment.translation)]
    )


def _errors(
    rows: Floats, found: Booleans, starts: Indices, gt: Normalised, est: Normalised
) -> Floats:
    """Return the position errors of normalised cameras, as `Similarity.position_errors`."""
    counts = sizes(starts)
    rotations = rows[:, 1:10].reshape(-1, 3, 3)
    residuals = est.local - _each(rows[:, 10:], counts)
    residuals /= _each(rows[:, :1], counts)
    for rotation, (start, end) in zip(rotations, pairwise(starts.tolist()), strict=True):
        residuals[start:end] -= gt.local[start:end] @ rotation.T  # by itself, for the same bits
    residuals *= residuals
    errors: Floats = _each(gt.units, counts) * np.sqrt(residuals.sum(axis=1))
    errors[~found.repeat(counts)] = np.inf
    return errors


def _each(values: Floats, counts: Indices) -> Floats:
    """Repeat what scenes have for each of their cameras; of one scene NumPy does it by itself."""
    return values if len(values) == 1 else values.repeat(counts, axis=0)


def _between_worlds(rows: Floats, gt: Normalised, est: Normalised) -> Floats:
    """Return alignments of normalised positions as those of the positions themselves."""
    between = rows.copy()
    between[:, 0] = scale = rows[:, 0] * est.units / gt.units
    turned = (scale[:, None, None] * rows[:, 1:10].reshape(-1, 3, 3)) @ gt.centres[:, :, None]
    between[:, 10:] = est.centres + est.units[:, None] * rows[:, 10:] - turned[:, :, 0]
    return between


def one_scene(gt_positions: ArrayLike, est_positions: ArrayLike) -> tuple[Floats, Floats, Indices]:
    """Check the positions of one scene; return them, and where scenes start."""
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=False)
    check_same_length(gt, est, "gt_positions", "est_positions")
    return gt, est, np.array([0, len(gt)])


def normalise_scenes(positions: Floats, starts: Indices) -> Normalised:
    """Return positions of scenes centred on their median and divided by their spread.

    Then neither a far-off origin nor squares of very large or small numbers cost any digits. Median
    and spread are robust: an outlier moves neither. The spread is about the median distance from
    the median along an axis, 1 where all positions coincide. It is a power of two, so that dividing
    by it rounds nothing.
    """
    if normalised := kernel.normalise_scenes(positions, starts, FARTHEST_SUMMABLE):
        return Normalised(*normalised)
    if _largest(positions) > FARTHEST_SUMMABLE:
        return _shrunk(positions, starts)
    parts = [_normalise(positions[start:end]) for start, end in pairwise(starts.tolist())]
    local, centres, units = zip(*parts, strict=True)
    return Normalised(np.concatenate(local), np.array(centres), np.array(units))


def _largest(positions: Floats) -> float:
    return float(np.abs(positions).max(initial=0.0))


def _shrunk(positions: Floats, starts: Indices) -> Normalised:
    """Normalise scenes of which some have coordinates whose sums overflow: these as if smaller."""
    parts = [positions[start:end] for start, end in pairwise(starts.tolist())]
    factors = np.array([SHRINK if _largest(part) > FARTHEST_SUMMABLE else 1.0 for part in parts])
    smaller = positions * factors.repeat(sizes(starts))[:, None]
    local, centres, units = normalise_scenes(smaller, starts)
    return Normalised(local, centres / factors[:, None], units / factors)


def _normalise(positions: Floats) -> tuple[Floats, Floats, float]:
    """Return the positions of one scene, centred and divided, with median and spread."""
    if len(positions) == 0:
        return positions, np.zeros(3), 1.0
    centre = _upper_median(positions) + 0.0  # the zero without a sign
    local = positions - centre
    distances = np.abs(local)
    moved = distances[distances > 0]
    unit = np.ldexp(1.0, np.frexp(_upper_median(moved))[1] - 1) if moved.size else 1.0
    with np.errstate(over="ignore"):  # beyond the largest number: infinitely far
        return local / unit, centre, float(unit)


def normalise(positions: Floats) -> Normalised:
    """Return the positions of one scene as `normalise_scenes` does."""
    return normalise_scenes(positions, np.array([0, len(positions)]))


def _upper_median(values: Floats) -> Any:
    """Return the median of each column; of two middle values the upper one, not their mean."""
    half = len(values) // 2
    return np.partition(values, half, axis=0)[half]
