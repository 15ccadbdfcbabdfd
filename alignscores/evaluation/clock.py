"""A constant offset between the clocks of a reference and an estimate.

The angle by which a camera turns within a second depends on no coordinate frame, no scale and
hardly on drift. At the true offset these angles agree best. Without rotations, or where they leave
it open, the logarithms of the distances that it moves take their place, up to a constant for the
scale; they are less sharp. Every offset at which the two have time in common is tried. One that
compares n motions and leaves the disagreement D, where unrelated motions have D0, has the strength
n log(D0 / D): a match on part of the motions does not beat one that is about as good on all of
them.

The strongest offset is refined by least squares, which compares rotations and displacements as
vectors. It is certain if the motions agree far better there than elsewhere, by the standard error
of stretches of time, no other offset is nearly as strong, and its own standard error is small.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..arrays import Booleans, Floats, Indices
from ..averaging import quaternions_from_rotations
from ..io import Trajectory
from ..validation import finite_rows

__all__ = ["Clock", "align_vectors", "find_clock"]

SPAN = 1.0  # seconds over which motions are compared, or the next longer span between two poses
LONGEST_SPAN = 2.0  # seconds
STEP, MAX_STEPS = 0.05, 50_000  # seconds between offsets, and the maximum in the reference
N_MOTIONS, MIN_MOTIONS = 300, 20  # compared, evenly spread; fewer agree somewhere by chance
N_REFINED = 1000  # motions compared at the strongest offset
BLOCKS = 20  # stretches of time, for standard errors
MIN_BLOCKS = 5  # of a recording of a few seconds
TINY = 0.005  # seconds; a smaller offset is none
TINY_BY_SPEEDS = 0.04  # seconds; at 1 m/s a lever arm of 4 cm along the way looks the same
ALIGNMENTS = 5  # of stretches of time, if there are MIN_MOTIONS in each
OUTLIER = {1: 6.3, 3: 4.2}  # lower quartiles, by dimension: 3 medians of normal disagreements
# Maximum disagreement, relative to the sum of both mean deviations from the median.
CAP_OF_RATES, CAP_OF_SPEEDS = 0.25, 1.2
MAX_DIFFERENCE = 2.0  # standard errors, between offsets by displacements and by speeds
MIXED_UP = 2.0  # standard error of vectors that do not agree, relative to that of angles
# Slope of the variance of `smoothed` noise next to a stamp, relative to the variance at the stamp,
# for each step between stamps. The minimum is a quarter of a step away.
AVERAGING = 6 / 17
MAX_ITERATIONS, CONVERGED = 10, 0.1  # of least squares; its last change in standard errors
# Standard errors: Student's t by BLOCKS, which one of 1000 wrong offsets exceeds in 1 % of cases.
MIN_EVIDENCE = 5.6
MAX_RIVAL = 0.6  # strength of the runner-up, relative to the best
MAX_T = 4.0  # standard errors; the offset of stamps that agree exceeds it in 0.1 % of cases
MAX_ERROR = 0.05  # seconds, of an offset that is certain
ROUNDING = 1e-12
NEAR = 0.5  # share of the strength down to which neighbouring offsets belong to the best one


@dataclass(frozen=True)
class Clock:
    """The offset in seconds to add to the stamps of an estimate, and how well it is known."""

    seconds: float
    error: float  # standard error in seconds
    evidence: float  # standard errors by which motions agree better here than elsewhere
    runner_up: float  # another offset, in seconds; NaN if there is none
    rival: float  # strength of the runner-up, relative to the best
    motions: str  # "rotation rates" or "speeds"

    @property
    def certain(self) -> bool:
        """Whether the motions agree here, at no other offset nearly as well, and precisely."""
        return self.precise and self.rival <= MAX_RIVAL

    @property
    def precise(self) -> bool:
        """Whether the motions agree here far better than elsewhere, and the error is small."""
        return self.evidence >= MIN_EVIDENCE and self.error <= MAX_ERROR

    @property
    def agrees(self) -> bool:
        """Whether the stamps agree as they are."""
        tiny = TINY if self.motions == "rotation rates" else TINY_BY_SPEEDS
        return abs(self.seconds) <= max(tiny, MAX_T * self.error)


def find_clock(
    reference: Trajectory, estimate: Trajectory, *, within: float = np.inf
) -> Clock | None:
    """Return the offset at which the motions of an estimate agree best with the reference's.

    Where its rotations leave it open, as those of a car do, its speeds may show it. None where
    there are too few motions to compare, or they agree nowhere. Larger offsets than `within`
    seconds are not tried.
    """
    if not (_turns(reference) and _turns(estimate)):
        return _search(reference, estimate, within, rotations=False)
    clock = _search(reference, estimate, within, rotations=True)
    if clock is None or not clock.certain:
        of_speeds = _search(reference, estimate, within, rotations=False)
        clock = of_speeds if of_speeds and (clock is None or of_speeds.certain) else clock
    return clock


def _search(
    reference: Trajectory, estimate: Trajectory, within: float, *, rotations: bool
) -> Clock | None:
    """Return the offset by rotation rates, or by speeds."""
    ref, est = _Path.of(reference, rotations), _Path.of(estimate, rotations)
    if min(len(ref.stamps), len(est.stamps)) <= MIN_MOTIONS:
        return None
    ends = np.searchsorted(est.stamps, est.stamps + SPAN)
    starts = np.flatnonzero(ends < len(est.stamps))
    longest = max(LONGEST_SPAN, 4 * est.half)  # which keyframes may all exceed
    starts = starts[est.stamps[ends[starts]] - est.stamps[starts] <= longest]
    if len(starts) < MIN_MOTIONS:
        return None
    motions, to_refine = (
        _Motions.of(est, rows, ends[rows])
        for rows in (_spread(starts, N_MOTIONS), _spread(starts, N_REFINED))
    )
    step = max(STEP, (ref.stamps[-1] + est.stamps[-1]) / MAX_STEPS)
    moved = ref.start - est.start
    offsets, strength, elsewhere = _strengths(ref, motions, step)
    strength[np.abs(moved + offsets) > within] = 0
    best = int(np.argmax(strength))
    if not strength[best] > 0:
        return None
    low, high = _slope(strength[best::-1]), _slope(strength[best:])
    others = np.r_[: max(best - low, 0), best + high + 1 : len(offsets)]
    runner_up = others[np.argmax(strength[others])] if len(others) else best
    rival = float(strength[runner_up]) if runner_up != best else 0.0
    seconds, error = _refined(ref, to_refine, float(offsets[best]), step)
    other = float(offsets[runner_up])
    if rival > MAX_RIVAL * strength[best]:  # so that the scores of both can be compared
        other, _ = _refined(ref, to_refine, other, step)
    return Clock(
        seconds=moved + seconds,
        error=error,
        evidence=_evidence(ref, motions, float(offsets[best]), elsewhere),
        runner_up=moved + other if rival > 0 else np.nan,
        rival=rival / float(strength[best]),
        motions="rotation rates" if rotations else "speeds",
    )


def _spread(rows: Indices, n: int) -> Indices:
    """Return at most n rows, evenly spread."""
    return np.asarray(rows[np.linspace(0, len(rows) - 1, min(n, len(rows))).astype(int)])


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
            points = quaternions_from_rotations(points)
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
        first, second = (self.points.take(rows, axis=0) for rows in (before, after))
        return self.unit((1 - share) * first + share * second), valid

    def smoothed(self, times: Floats) -> tuple[Floats, Booleans]:
        """Return points with about the same noise at and between stamps, as a cubic spline has.

        Otherwise offsets between two stamps would fit better, since interpolation averages noise.
        """
        parts, known = self.at(np.stack([times + shift * self.half for shift in range(-2, 3)]))
        return self.unit(parts.mean(axis=0)), known[2]

    def unit(self, points: Floats) -> Floats:
        """Return quaternions of unit length; positions as they are."""
        if not self.rotations:
            return points
        return np.asarray(points / np.sqrt(np.einsum("...i,...i", points, points))[..., None])

    @cached_property
    def half(self) -> float:
        """Half of the usual time between two points."""
        return float(np.median(np.diff(self.stamps))) / 2

    def sizes(self, first: Floats, second: Floats) -> Floats:
        """Return the angles between points in radians, or the logarithms of their distances."""
        if self.rotations:
            return _angles(first, second)[:, 0]
        lengths = np.linalg.norm(second - first, axis=-1)
        floor = 0.1 * np.median(lengths[lengths > 0]) if (lengths > 0).any() else 1.0
        return np.asarray(np.log(lengths + floor))

    def logarithms(self, first: Floats, second: Floats) -> Floats:
        """Return the logarithms of distances as a column."""
        return self.sizes(first, second)[:, None]


class _Motions(NamedTuple):
    """Motions of an estimate: the times and points at which they start and end, and their sizes."""

    starts: Floats
    ends: Floats
    first: Floats
    second: Floats
    sizes: Floats

    @classmethod
    def of(cls, path: _Path, starts: Indices, ends: Indices) -> "_Motions":
        first, second = path.points[starts], path.points[ends]
        return cls(path.stamps[starts], path.stamps[ends], first, second, path.sizes(first, second))


def _slope(strength: Floats) -> int:
    """Return how many steps the strength falls from its peak: to NEAR of it, and to a valley."""
    below = int(np.argmax(np.append(strength < NEAR * strength[0], True)))
    return below + int(np.argmax(np.append(np.diff(strength[below:]) > 0, True)))


class _Elsewhere(NamedTuple):
    """The mean disagreement of each motion over all offsets, each up to a cap."""

    disagreements: Floats
    cap: float = 0.0


def _strengths(ref: _Path, motions: _Motions, step: float) -> tuple[Floats, Floats, _Elsewhere]:
    """Return evenly spaced offsets, the strength of each, and how motions agree over all of them.

    D0 is the median D.
    """
    starts, ends, sizes_of_est = motions.starts, motions.ends, motions.sizes
    grid = np.asarray(step * np.arange(int(ref.stamps[-1] / step) + 1), np.float64)
    points, valid = ref.at(grid)
    first = np.round(starts / step).astype(int)
    spans = np.maximum(np.round((ends - starts) / step).astype(int), 1)
    n_before = int(first.max())
    n = np.zeros(n_before + len(grid))
    total, squares = np.zeros_like(n), np.zeros_like(n)
    disagreements, of_span = np.zeros(len(starts)), {}
    for span in np.unique(spans[spans < len(grid)]).tolist():
        both = valid[:-span] & valid[span:]
        of_span[span] = ref.sizes(points[:-span], points[span:]), both
    sizes_of_ref = [sizes[both] for sizes, both in of_span.values() if both.any()]
    if not sizes_of_ref:
        return np.zeros(1), np.zeros(1), _Elsewhere(disagreements)
    everywhere = np.concatenate(sizes_of_ref)
    middle = np.median(everywhere)
    scale = 0.0 if ref.rotations else float(middle - np.median(sizes_of_est))
    spreads = [np.abs(sizes - np.median(sizes)).mean() for sizes in (sizes_of_est, everywhere)]
    cap = (CAP_OF_RATES if ref.rotations else CAP_OF_SPEEDS) * float(sum(spreads))
    rows = zip(first.tolist(), spans.tolist(), sizes_of_est.tolist(), strict=True)
    for motion, (row, span, size) in enumerate(rows):
        if span in of_span:
            sizes, both = of_span[span]
            where = slice(n_before - row, n_before - row + len(sizes))
            difference = np.clip(sizes - size - scale, -cap, cap)
            capped = np.abs(difference)
            disagreements[motion] = capped @ both / max(both.sum(), 1)
            if ref.rotations:
                difference = capped
            n[where] += both
            total[where] += np.where(both, difference, 0)
            squares[where] += np.where(both, difference**2, 0)
    with np.errstate(all="ignore"):
        mean = total / n
        left = mean if ref.rotations else np.sqrt(np.maximum(squares / n - mean**2, 0))
    enough = n >= MIN_MOTIONS
    if not enough.any():
        return np.zeros(1), np.zeros(1), _Elsewhere(disagreements)
    usual = float(np.median(left[n >= min(len(sizes_of_est) / 2, n.max())]))
    floor = 1e-6 * usual + 1e-12
    gain = np.where(enough, (usual + floor) / (np.where(enough, left, 1) + floor), 1)
    offsets = step * np.arange(-n_before, len(grid), dtype=np.float64)
    return offsets, n * np.log(gain), _Elsewhere(disagreements, cap)


def _evidence(ref: _Path, motions: _Motions, offset: float, elsewhere: _Elsewhere) -> float:
    """Return by how many standard errors motions agree better at an offset than elsewhere.

    Each motion is compared with itself at all offsets: outliers agree nowhere, and say nothing. The
    standard error is that of means over stretches of time, since neighbouring motions overlap.
    """
    (first, first_known), (second, second_known) = (
        ref.at(motions.starts + offset),
        ref.at(motions.ends + offset),
    )
    known = first_known & second_known
    if not known.any():
        return 0.0
    difference = ref.sizes(first, second) - motions.sizes
    if not ref.rotations:
        difference -= np.median(difference[known])
    disagreements = np.minimum(np.abs(difference), elsewhere.cap)
    gain = np.where(known, elsewhere.disagreements - disagreements, 0)
    n = int(np.clip((motions.ends[-1] - motions.starts[0]) / SPAN, MIN_BLOCKS, BLOCKS))
    means = np.array([part.mean() for part in np.array_split(gain, n)])
    return float(means.mean() / (means.std(ddof=1) / np.sqrt(n) + ROUNDING))


_Vectors = Callable[[Floats, Floats], Floats]  # of motions, from points (n, 4) or (n, 3) to others


def _refined(ref: _Path, motions: _Motions, offset: float, step: float) -> tuple[float, float]:
    """Return an offset by least squares on the inliers, and its standard error.

    Displacements and rotations are compared as vectors, after the similarity that fits them. The
    rotation from one pose to the next is that in the frame of the camera, for inverted poses that
    in the coordinate frame. Where poses are mixed up otherwise, only angles agree. These are larger
    by noise, and count only if they are far more precise. Where turns get tighter, the bias of a
    gyroscope would pass for an offset; the standard error allows for a constant bias.
    """
    if not ref.rotations:  # speeds leave a broad peak
        comparison = _Comparison(ref, motions, np.subtract, np.subtract)
        near = offset + np.arange(-SPAN, SPAN + step, step)
        start = min(near.tolist(), key=comparison.left)
        seconds, error = _least_squares(comparison, start, step)
        speeds = _Comparison(ref, motions, ref.logarithms, ref.logarithms, is_biased=True)
        by_speeds, error_of_speeds = _least_squares(speeds, start, step)
        # A lever arm along the way turns displacements early or late, but hardly changes speeds.
        differ = abs(by_speeds - seconds) > MAX_DIFFERENCE * error_of_speeds
        return seconds, max(error, abs(by_speeds - seconds)) if differ else error
    vectors = [
        _Comparison(ref, motions, *pair)
        for pair in ((_in_camera, _in_camera), (_in_camera, _in_frame), (_in_frame, _in_camera))
    ]
    best = min(vectors, key=lambda comparison: comparison.left(offset))
    angles = _Comparison(ref, motions, _angles, _angles)
    (seconds, error), by_angles = (_least_squares(each, offset, step) for each in (best, angles))
    if error > MIXED_UP * by_angles[1]:
        best, (seconds, error) = angles, by_angles
    _, error_if_biased = _least_squares(replace(best, is_biased=True), seconds, step)
    return seconds, max(error, error_if_biased)


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Motions of a reference and of an estimate, each as vectors of some kind."""

    ref: _Path
    motions: _Motions
    of_ref: _Vectors
    of_est: _Vectors
    is_biased: bool = False  # whether the estimate's vectors may be off by a constant

    def true(self, offset: float) -> tuple[Floats, Booleans]:
        """Return the motions of the reference at an offset, and which of them are known."""
        times = np.stack([self.motions.starts, self.motions.ends]) + offset
        (first, second), known = self.ref.smoothed(times)
        return self.of_ref(first, second), known[0] & known[1]

    @cached_property
    def moves(self) -> Floats:
        """The motions of the estimate."""
        return self.of_est(self.motions.first, self.motions.second)

    def left(self, offset: float) -> float:
        """Return the mean size of the differences at an offset."""
        (true, known), moves = self.true(offset), self.moves
        difference, rows = true - moves, np.flatnonzero(known)
        for stretch in _stretches(moves, true, rows):
            difference[stretch.rows] = true[stretch.rows] @ stretch.matrix - moves[stretch.rows]
        return float(np.linalg.norm(difference[rows], axis=1).mean()) if len(rows) else np.inf

    def unexplained(self, stretch: "_Stretch", aligned: Floats, *vectors: Floats) -> Floats:
        """Return vectors without what another rotation and scale, drift or a bias explain.

        On an orbit drift turns displacements as the clock does. Rotations are compared in the frame
        of the camera.
        """
        n, size = aligned.shape
        causes = [np.broadcast_to(np.eye(size), (n, size, size))] if self.is_biased else []
        if size > 1:
            alignment = np.stack([*np.cross(np.eye(3)[:, None], aligned), aligned], axis=-1)
            drift = np.linspace(-1, 1, n)[:, None, None] * alignment
            causes += [alignment] if self.ref.rotations else [alignment, drift]
        both = np.stack(vectors, axis=-1)
        if not causes:
            return np.moveaxis(both, -1, 0)
        explained = np.concatenate(causes, axis=-1)
        on, of = (array[stretch.fits].reshape(-1, array.shape[-1]) for array in (explained, both))
        return np.asarray(np.moveaxis(both - explained @ np.linalg.lstsq(on, of)[0], -1, 0))


def _angles(first: Floats, second: Floats) -> Floats:
    """Return the angles between unit quaternions in radians, (n, 1)."""
    chord = np.minimum(
        np.linalg.norm(second - first, axis=-1), np.linalg.norm(second + first, axis=-1)
    )
    return np.asarray(4 * np.arcsin(np.minimum(chord / 2, 1)))[:, None]


def _in_camera(first: Floats, second: Floats) -> Floats:
    """Return the axes of rotations in the frame of the first camera, 2 sin(angle / 2) long."""
    return _axes(first, second, -1.0)


def _in_frame(first: Floats, second: Floats) -> Floats:
    """Return the axes of rotations in the coordinate frame, 2 sin(angle / 2) long."""
    return _axes(first, second, 1.0)


def _axes(first: Floats, second: Floats, sign: float) -> Floats:
    """Return twice the imaginary part of q1* q2 for a sign of -1, and of q2 q1* for 1."""
    crossed = sign * np.cross(first[:, :3], second[:, :3])
    imaginary = first[:, 3:] * second[:, :3] - second[:, 3:] * first[:, :3] + crossed
    real = (first * second).sum(axis=1, keepdims=True)
    return np.where(real < 0, -2, 2) * imaginary


def _least_squares(comparison: _Comparison, start: float, step: float) -> tuple[float, float]:
    """Return the offset near another that minimises squared differences, and its standard error.

    The standard error comes from a jackknife over stretches of time, since errors of neighbouring
    motions are alike; longer stretches have a larger one if those of stretches are, too. It allows
    for a shift to either side by noise of the reference, which is averaged less at its stamps. It
    is infinite where there is no minimum within two steps.
    """
    offset, h, moves = start, 0.1 * step, comparison.moves
    for _ in range(MAX_ITERATIONS):
        (earlier, early), (now, known), (later, late) = (
            comparison.true(offset + shift) for shift in (-h, 0.0, h)
        )
        rows = np.flatnonzero(known & early & late)
        difference, slopes = now - moves, (later - earlier) / (2 * h)
        for stretch in _stretches(moves, now, rows):
            part, aligned = stretch.rows, now[stretch.rows] @ stretch.matrix
            vectors = aligned - moves[part], slopes[part] @ stretch.matrix
            difference[part], slopes[part] = comparison.unexplained(stretch, aligned, *vectors)
        sizes = np.linalg.norm(difference[rows], axis=1)
        rows = rows[_are_inliers(sizes, moves.shape[1])] if len(rows) else rows
        blocks = np.arange(len(rows)) * BLOCKS // max(len(rows), 1)
        moments = np.bincount(blocks, (difference * slopes)[rows].sum(axis=1), BLOCKS)
        squares = np.bincount(blocks, (slopes[rows] ** 2).sum(axis=1), BLOCKS)
        if not (squares.sum() - squares > 0).all():
            return offset, np.inf
        change = float(np.clip(moments.sum() / squares.sum(), -step / 2, step / 2))
        offset -= change
        others = (moments.sum() - moments) / (squares.sum() - squares)
        error = max(_jackknife(others, n) for n in (BLOCKS, BLOCKS // 2, BLOCKS // 4))
        noise = float((difference[rows] ** 2).sum() / squares.sum())
        half = comparison.ref.half
        by_averaging = min(AVERAGING / 2 * noise / (2 * half), half / 2)
        error = math.hypot(error, by_averaging / math.sqrt(3))  # anywhere within that
        if abs(offset - start) > 2 * step:
            return offset, np.inf
        if abs(change) <= CONVERGED * error:
            break
    return offset, max(error, abs(change))  # outliers that come and go leave the last change


def _jackknife(others: Floats, n: int) -> float:
    """Return the standard error by n equal groups of what is found without each stretch."""
    shares = (1 - 1 / len(others)) * (others - others.mean())
    return float(np.sqrt(n / (n - 1) * (shares.reshape(n, -1).sum(axis=1) ** 2).sum()))


def _are_inliers(sizes: Floats, dimension: int) -> Booleans:
    """Return which disagreements are no outliers.

    If a third of the poses are outliers, more than half of the motions are, and so is the median.
    """
    return np.asarray(sizes <= OUTLIER[dimension] * np.quantile(sizes, 0.25))


class _Stretch(NamedTuple):
    """A stretch of time: its motions, those that fit, and the similarity that aligns them."""

    rows: Indices
    fits: Booleans
    matrix: Floats


def _stretches(moves: Floats, true: Floats, rows: Indices) -> list[_Stretch]:
    """Return the stretches of some rows, in which vectors are aligned."""
    if not len(rows):
        return []
    n = int(np.clip(len(rows) // MIN_MOTIONS, 1, ALIGNMENTS))
    parts = np.array_split(rows, n)
    return [_Stretch(part, *align_vectors(true[part], moves[part])) for part in parts]


def align_vectors(true: Floats, moves: Floats) -> tuple[Booleans, Floats]:
    """Return the inliers, and the matrix that rotates and scales true vectors to an estimate's.

    Angles, in one column, need none: theirs is the identity.
    """
    if true.shape[1] == 1:
        off = np.abs(true - moves - np.median(true - moves))[:, 0]
        return _are_inliers(off, 1), np.eye(1)
    fits = np.ones(len(true), dtype=bool)
    for _ in range(3):
        u, sizes, vt = np.linalg.svd(moves[fits].T @ true[fits])
        sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
        scale = (sizes * sign).sum() / max((true[fits] ** 2).sum(), np.finfo(float).tiny)
        matrix = scale * (u * sign @ vt).T
        off = np.linalg.norm(true @ matrix - moves, axis=1)
        fits = _are_inliers(off, 3)
    return fits, matrix
