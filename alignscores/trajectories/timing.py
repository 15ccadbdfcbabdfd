"""A constant offset between the clocks of a reference and an estimate.

The angle by which a camera turns within some tenths of a second depends on no coordinate frame, no
scale and hardly on drift. At the true offset these angles agree best. Without rotations, the
distances that it moves take their place; they are less sharp, as drift changes the scale.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..averaging import rotation_angles
from ..io import Trajectory
from ..validation import finite_rows
from .timeline import reference_at

__all__ = ["TimeOffset", "find_offset"]

SPAN = 0.3  # seconds over which motions are compared, or the next longer span between two poses
LONGEST_SPAN = 2.0  # seconds
SAMPLE, FIRST_SAMPLE = 400, 100  # motions looked at, evenly spread; to find where to look closer
MIN_MOTIONS = 20  # fewer agree at some offset by chance
NEARBY = np.asarray(0.05 * np.arange(-20, 21), np.float64)  # seconds; tried first
STEP, MAX_TRIALS = 0.1, 4000  # of the offsets that are tried where nothing is known of them
MIN_GAIN = 2.0  # factor by which motions must agree better for an offset to be certain
OUTLIER = 3.0  # median disagreements at which a disagreement is capped


@dataclass(frozen=True)
class TimeOffset:
    """An offset in seconds, to be added to the stamps of an estimate.

    `gain` is the factor by which motions agree better than without it or, where the stamps have
    too little time in common without it, than at the median of all offsets.
    """

    seconds: float
    gain: float
    what: str  # "rotation rates" or "speeds"

    @property
    def certain(self) -> bool:
        """Whether the offset explains more than noise and drift do."""
        return self.gain >= MIN_GAIN


def find_offset(
    reference: Trajectory, estimate: Trajectory, *, anywhere: bool = False
) -> TimeOffset | None:
    """Return the offset at which the motions of an estimate agree best with the reference's.

    It tries offsets up to 1 s and, with `anywhere` and if none is certain, all offsets at which the
    two have time in common. None where there are too few motions to compare.
    """
    rotations = _turns(reference) and _turns(estimate)
    motions = _motions(estimate, rotations)
    if min(len(motions.T), len(reference.keys)) < MIN_MOTIONS:
        return None
    offset = _best(reference, motions, NEARBY, rotations)
    if anywhere and not (offset and offset.certain):
        starts, ends, _ = motions
        least = float(reference.keys[0] - ends.max())
        most = float(reference.keys[-1] - starts.min())
        n_trials = min(int((most - least) / STEP) + 1, MAX_TRIALS)
        offset = _best(reference, motions, np.linspace(least, most, n_trials), rotations) or offset
    return offset


def _motions(estimate: Trajectory, rotations: bool) -> Floats:
    """Return motions from all over an estimate: starts, ends and how far it turns, or moves."""
    part = np.s_[:, :3, :3] if rotations else np.s_[:, :3, 3]
    rows = np.flatnonzero(finite_rows(estimate.poses[part]))
    rows = rows[np.argsort(estimate.keys[rows], kind="stable")]
    stamps = estimate.keys[rows]
    second = np.searchsorted(stamps, stamps + SPAN)
    first = np.flatnonzero(second < len(stamps))
    second = second[first]
    short = np.flatnonzero(stamps[second] - stamps[first] <= LONGEST_SPAN)
    some = short[:: max(1, len(short) // SAMPLE)]
    first, second = rows[first[some]], rows[second[some]]
    sizes = _sizes(estimate.poses[first], estimate.poses[second], rotations)
    return np.array([estimate.keys[first], estimate.keys[second], sizes])


def _turns(trajectory: Trajectory) -> bool:
    """Return whether the rotations of a trajectory differ; all are alike of positions alone."""
    rotations = trajectory.poses[finite_rows(trajectory.poses), :3, :3]
    return bool((rotations != rotations[:1]).any())


def _best(
    reference: Trajectory, motions: Floats, offsets: Floats, rotations: bool
) -> TimeOffset | None:
    """Return the best of evenly spaced offsets, to a millisecond; None where none has motions."""
    some = motions[:, :: max(1, len(motions.T) // FIRST_SAMPLE)]
    values = np.array([_disagreement(reference, some, offset, rotations) for offset in offsets])
    if not np.isfinite(values).any():
        return None
    without = _disagreement(reference, motions, 0.0, rotations)
    without = without if without < np.inf else float(np.median(values[np.isfinite(values)]))
    step = offsets[1] - offsets[0]
    while step > 1e-3:
        step /= 10
        offsets = offsets[np.argmin(values)] + step * np.arange(-10, 11)
        values = np.array([_disagreement(reference, motions, at, rotations) for at in offsets])
    rounding = max(1e-6 * float(np.median(motions[2])), np.finfo(float).tiny)
    gain = (without + rounding) / (values.min() + rounding)
    what = "rotation rates" if rotations else "speeds"
    return TimeOffset(float(offsets[np.argmin(values)]), float(gain), what)


def _disagreement(reference: Trajectory, motions: Floats, offset: float, rotations: bool) -> float:
    """Return the mean difference of motions at an offset; infinite if most are unknown."""
    (first, first_known), (second, second_known) = (
        reference_at(reference, times + offset, gap=LONGEST_SPAN, t_max_diff=0.0)
        for times in motions[:2]
    )
    both = first_known & second_known
    if both.sum() < max(MIN_MOTIONS, len(both) / 2):
        return np.inf
    true, sizes = _sizes(first, second, rotations)[both], motions[2, both]
    if not rotations:
        sizes = sizes * (np.median(true) / max(np.median(sizes), np.finfo(float).tiny))
    differences = np.abs(true - sizes)
    return float(np.minimum(differences, OUTLIER * np.median(differences)).mean())


def _sizes(first: Floats, second: Floats, rotations: bool) -> Floats:
    """Return by how many degrees, or how far, poses move from the first to the second."""
    if rotations:
        return rotation_angles(first[:, :3, :3].swapaxes(1, 2) @ second[:, :3, :3])
    return np.asarray(np.linalg.norm(second[:, :3, 3] - first[:, :3, 3], axis=1))
