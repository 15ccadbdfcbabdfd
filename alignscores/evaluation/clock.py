"""A constant offset between the clocks of a reference and an estimate.

The angle by which a camera turns within some tenths of a second depends on no coordinate frame, no
scale and hardly on drift. At the true offset these angles agree best. Without rotations, or where
they leave it open, the logarithms of the distances that it moves take their place, up to a constant
for the scale; they are less sharp. Every offset at which the two have time in common is tried. One
that compares n motions and leaves the disagreement D, where unrelated motions have D0, has the
strength n log(D0 / D): a match on part of the motions does not beat one that is about as good on
all of them.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Booleans, Floats, Indices
from ..averaging import angles_and_axes
from ..io import Trajectory
from ..validation import finite_rows

__all__ = ["Clock", "find_clock"]

SPAN = 0.3  # seconds over which motions are compared, or the next longer span between two poses
LONGEST_SPAN = 2.0  # seconds
STEP, MAX_STEPS = 0.05, 50_000  # seconds between offsets, and the most of them in the reference
N_MOTIONS, MIN_MOTIONS = 300, 20  # compared, evenly spread; fewer agree somewhere by chance
BLOCKS = 10  # stretches of time, each left out for the standard error
TINY = 0.005  # seconds; a smaller offset is none
N_REFINED = 1000  # motions compared at the best offset
OUTLIER = 3.0  # median disagreements
MIN_GAIN = 1.5  # D0 / D of an offset that is certain
MAX_RIVAL = 0.6  # strength of the runner-up, relative to the best
MAX_ERROR = 0.05  # seconds, of an offset that is certain
NEAR = 0.5  # share of the strength down to which neighbouring offsets belong to the best one


@dataclass(frozen=True)
class Clock:
    """The offset in seconds to add to the stamps of an estimate, and how well it is known."""

    seconds: float
    error: float  # standard error in seconds
    gain: float  # D0 / D, of the search
    runner_up: float  # another offset, in seconds; NaN if there is none
    rival: float  # strength of the runner-up, relative to the best
    what: str  # "rotation rates" or "speeds"

    @property
    def certain(self) -> bool:
        """Whether no other offset fits nearly as well."""
        alone = self.rival <= MAX_RIVAL and self.gain >= MIN_GAIN
        return alone and self.error <= MAX_ERROR

    @property
    def agrees(self) -> bool:
        """Whether the stamps agree as they are."""
        return abs(self.seconds) <= max(TINY, 3 * self.error)


def find_clock(reference: Trajectory, estimate: Trajectory) -> Clock | None:
    """Return the offset at which the motions of an estimate agree best with the reference's.

    Where its rotations leave it open, as those of a car do, its speeds may show it. None where
    there are too few motions to compare, or they agree nowhere.
    """
    if not (_turns(reference) and _turns(estimate)):
        return _found(reference, estimate, rotations=False)
    clock = _found(reference, estimate, rotations=True)
    if clock is None or not clock.certain:
        of_speeds = _found(reference, estimate, rotations=False)
        clock = of_speeds if of_speeds and (clock is None or of_speeds.certain) else clock
    return clock


def _found(reference: Trajectory, estimate: Trajectory, *, rotations: bool) -> Clock | None:
    """Return the offset by rotation rates, or by speeds."""
    ref, est = _Path.of(reference, rotations), _Path.of(estimate, rotations)
    second = np.searchsorted(est.stamps, est.stamps + SPAN)
    first = np.flatnonzero(second < len(est.stamps))
    first = first[est.stamps[second[first]] - est.stamps[first] <= LONGEST_SPAN]
    if len(first) < MIN_MOTIONS or len(ref.stamps) < MIN_MOTIONS:
        return None
    all_first = first[np.linspace(0, len(first) - 1, min(N_REFINED, len(first))).astype(int)]
    first = first[np.linspace(0, len(first) - 1, min(N_MOTIONS, len(first))).astype(int)]
    all_second, second = second[all_first], second[first]
    starts, ends = est.stamps[first], est.stamps[second]
    motions = est.motions(est.points[first], est.points[second])

    step = max(STEP, (ref.stamps[-1] + est.stamps[-1]) / MAX_STEPS)
    offsets, strength, gain = _strengths(ref, starts, ends, motions, step)
    best = int(np.argmax(strength))
    if not strength[best] > 0:
        return None
    low, high = _slope(strength[best::-1]), _slope(strength[best:])
    others = np.append(offsets[: max(best - low, 0)], offsets[best + high + 1 :])
    apart = np.append(strength[: max(best - low, 0)], strength[best + high + 1 :])
    rival = float(np.max(apart, initial=0.0))
    seconds, error = _refined(ref, est, all_first, all_second, float(offsets[best]), step)
    moved = ref.start - est.start
    return Clock(
        seconds=moved + seconds,
        error=error,
        gain=float(gain[best]),
        runner_up=moved + float(others[np.argmax(apart)]) if rival > 0 else np.nan,
        rival=rival / float(strength[best]),
        what="rotation rates" if rotations else "speeds",
    )


def _turns(trajectory: Trajectory) -> bool:
    """Return whether the rotations of a trajectory differ; without rotations all are alike."""
    rotations = trajectory.poses[finite_rows(trajectory.poses), :3, :3]
    return bool((rotations != rotations[:1]).any())


@dataclass(frozen=True, eq=False)
class _Path:
    """Unit quaternions (n, 4), or positions (n, 3), in the order of time, from its first stamp."""

    start: float
    stamps: Floats
    points: Floats
    rotations: bool

    @classmethod
    def of(cls, trajectory: Trajectory, rotations: bool) -> "_Path":
        part = np.s_[:, :3, :3] if rotations else np.s_[:, :3, 3]
        rows = np.flatnonzero(finite_rows(trajectory.poses[part]))
        rows = rows[np.unique(trajectory.keys[rows], return_index=True)[1]]
        points, stamps = trajectory.poses[rows][part], trajectory.keys[rows]
        if rotations:
            angles, axes = angles_and_axes(points)
            points = np.vstack([np.sin(angles / 2) * axes, np.cos(angles / 2)]).T
            flips = np.where((points[1:] * points[:-1]).sum(axis=1) < 0, -1.0, 1.0)
            points[1:] *= np.cumprod(flips)[:, None]
        start = float(stamps[0]) if len(stamps) else 0.0
        return cls(start, stamps - start, points, rotations)

    def at(self, times: Floats) -> tuple[Floats, Booleans]:
        """Return the points at times, and where they are known: in no gap, and not outside."""
        after = np.clip(np.searchsorted(self.stamps, times), 1, len(self.stamps) - 1)
        before = after - 1
        length = self.stamps[after] - self.stamps[before]
        valid = (times >= 0) & (times <= self.stamps[-1]) & (length <= LONGEST_SPAN)
        share = np.clip((times - self.stamps[before]) / length, 0, 1)[..., None]
        points = (1 - share) * self.points[before] + share * self.points[after]
        if self.rotations:
            points /= np.linalg.norm(points, axis=-1, keepdims=True)
        return points, valid

    def smoothed(self, times: Floats) -> tuple[Floats, Booleans]:
        """Return points with about the same noise at and between stamps, as a cubic spline has.

        Otherwise offsets between two stamps would fit better, since interpolation averages noise.
        """
        half = np.median(np.diff(self.stamps)) / 2
        parts = [self.at(times + shift) for shift in (-half, 0.0, half)]
        points = np.sum([points for points, _ in parts], axis=0) / 3
        if self.rotations:
            points /= np.linalg.norm(points, axis=-1, keepdims=True)
        return points, parts[1][1]

    def motions(self, first: Floats, second: Floats) -> Floats:
        """Return the angles between points in radians, or the logarithms of their distances."""
        if self.rotations:
            chord = np.minimum(
                np.linalg.norm(second - first, axis=-1), np.linalg.norm(second + first, axis=-1)
            )
            return np.asarray(4 * np.arcsin(np.minimum(chord / 2, 1)))
        lengths = np.linalg.norm(second - first, axis=-1)
        floor = 0.1 * np.median(lengths[lengths > 0]) if (lengths > 0).any() else 1.0
        return np.asarray(np.log(lengths + floor))


def _slope(strength: Floats) -> int:
    """Return how many steps the strength falls from its peak: to NEAR of it, and to a valley."""
    below = int(np.argmax(np.append(strength < NEAR * strength[0], True)))
    return below + int(np.argmax(np.append(np.diff(strength[below:]) > 0, True)))


def _strengths(
    ref: _Path, starts: Floats, ends: Floats, motions: Floats, step: float
) -> tuple[Floats, Floats, Floats]:
    """Return evenly spaced offsets, with the strength and D0 / D of each; D0 is the median D."""
    grid = np.asarray(step * np.arange(int(ref.stamps[-1] / step) + 1), np.float64)
    points, valid = ref.at(grid)
    first = np.round(starts / step).astype(int)
    spans = np.maximum(np.round((ends - starts) / step).astype(int), 1)
    n_before = int(first.max())
    n = np.zeros(n_before + len(grid))
    total, squares = np.zeros_like(n), np.zeros_like(n)
    of_span = {}
    for span in np.unique(spans[spans < len(grid)]).tolist():
        both = valid[:-span] & valid[span:]
        of_span[span] = ref.motions(points[:-span], points[span:]), both
    everywhere = np.concatenate([sizes[both] for sizes, both in of_span.values()])
    if not everywhere.size:
        return np.zeros(1), np.zeros(1), np.ones(1)
    cap = float(
        np.abs(np.median(everywhere) - motions).mean()
        + np.abs(everywhere - np.median(everywhere)).mean()
    )
    for row, span, size in zip(first.tolist(), spans.tolist(), motions.tolist(), strict=True):
        if span in of_span:
            sizes, both = of_span[span]
            where = slice(n_before - row, n_before - row + len(sizes))
            difference = sizes - size
            if ref.rotations:
                difference = np.minimum(np.abs(difference), cap)
            n[where] += both
            total[where] += np.where(both, difference, 0)
            squares[where] += np.where(both, difference**2, 0)
    with np.errstate(all="ignore"):
        mean = total / n
        left = mean if ref.rotations else np.sqrt(np.maximum(squares / n - mean**2, 0))
    enough = n >= MIN_MOTIONS
    if not enough.any():
        return np.zeros(1), np.zeros(1), np.ones(1)
    usual = float(np.median(left[n >= min(len(motions) / 2, n.max())]))
    floor = 1e-6 * usual + 1e-12
    gain = np.where(enough, (usual + floor) / (np.where(enough, left, 1) + floor), 1)
    offsets = step * np.arange(-n_before, len(grid), dtype=np.float64)
    return offsets, n * np.log(gain), gain


def _refined(
    ref: _Path, est: _Path, first: Indices, second: Indices, offset: float, step: float
) -> tuple[float, float]:
    """Return an offset by least squares on the inliers, and its standard error.

    The standard error comes from a jackknife over stretches of time, since errors of neighbouring
    motions are alike. Displacements are compared as vectors, after the similarity that fits them.
    """
    starts, ends = est.stamps[first], est.stamps[second]
    motions = est.motions(est.points[first], est.points[second])
    moves = est.points[second] - est.points[first]

    def differences(at: float) -> tuple[Floats, Booleans]:
        (begin, begin_known), (end, end_known) = ref.smoothed(starts + at), ref.smoothed(ends + at)
        valid = begin_known & end_known
        if ref.rotations:
            return np.where(valid, ref.motions(begin, end) - motions, 0)[:, None], valid
        return np.where(valid[:, None], _fitted(moves, end - begin, valid) - moves, 0), valid

    def left(at: float) -> float:
        difference, valid = differences(at)
        return float(np.linalg.norm(difference[valid], axis=1).mean()) if valid.any() else np.inf

    near = offset + step * np.linspace(-1, 1, 11)
    offset, error = float(near[np.argmin([left(at) for at in near])]), np.inf
    h = 0.1 * step
    for _ in range(5):
        difference, usable = differences(offset)
        (later, also), (earlier, too) = differences(offset + h), differences(offset - h)
        sizes = np.linalg.norm(difference, axis=1)
        usable &= also & too
        rows = np.flatnonzero(usable & (sizes <= OUTLIER * np.median(sizes[usable])))
        slopes = (later - earlier)[rows] / (2 * h)
        blocks = np.arange(len(rows)) * BLOCKS // max(len(rows), 1)
        moments = np.bincount(blocks, (difference[rows] * slopes).sum(axis=1), BLOCKS)
        squares = np.bincount(blocks, (slopes**2).sum(axis=1), BLOCKS)
        if not (squares.sum() - squares > 0).all():
            return offset, np.inf
        offset -= float(np.clip(moments.sum() / squares.sum(), -step / 2, step / 2))
        others = (moments.sum() - moments) / (squares.sum() - squares)
        error = float(np.sqrt((BLOCKS - 1) * np.var(others)))
    return offset, error


def _fitted(moves: Floats, true: Floats, valid: Booleans) -> Floats:
    """Return true displacements, rotated and scaled to those of an estimate; without outliers."""
    rows = np.flatnonzero(valid)
    for _ in range(3):
        u, sizes, vt = np.linalg.svd(moves[rows].T @ true[rows])
        sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
        scale = (sizes * sign).sum() / max((true[rows] ** 2).sum(), np.finfo(float).tiny)
        fitted = scale * true @ (u * sign @ vt).T
        off = np.linalg.norm(fitted - moves, axis=1)
        rows = np.flatnonzero(valid & (off <= OUTLIER * np.median(off[valid])))
    return np.asarray(fitted)
