"""A constant offset between the clocks of a reference and an estimate.

The angle by which a camera turns within some tenths of a second depends on no coordinate frame, no
scale and hardly on drift. At the true offset these angles agree best. Without rotations, the
distances that it moves take their place; they are less sharp, as drift changes the scale.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Booleans, Floats
from ..averaging import rotation_angles
from ..validation import finite_rows
from .files import Trajectory
from .timeline import reference_at

__all__ = ["TimeOffset", "find_offset"]

SPAN, LONGEST_SPAN = 0.3, 2.0  # seconds over which motions are compared
SAMPLE, FAR_SAMPLE = 400, 100  # motions looked at, evenly spread
MIN_MOTIONS = 20  # fewer agree at some offset by chance
NEARBY = 1.0  # seconds; offsets up to this one are tried first
STEP, FAR_STEP, FINE_STEP = 0.05, 0.1, 0.005  # seconds from one trial to the next
MAX_TRIALS = 4000  # where nothing is known of the offset
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
    motions = _Motions.sampled(reference, estimate)
    if motions is None:
        return None
    offset = motions.best(np.arange(-NEARBY, NEARBY + STEP / 2, STEP))
    if anywhere and not (offset and offset.certain):
        least = float(reference.keys[0] - motions.ends.max())
        most = float(reference.keys[-1] - motions.starts.min())
        step = max(FAR_STEP, (most - least) / MAX_TRIALS)
        every = max(1, len(motions.starts) // FAR_SAMPLE)
        far = motions.best(np.arange(least, most + step / 2, step), every)
        offset = far if far and far.certain else offset
    return offset


@dataclass(frozen=True, eq=False)
class _Motions:
    """How far an estimate turns, or moves, between pairs of times; and the reference."""

    reference: Trajectory
    starts: Floats
    ends: Floats
    sizes: Floats
    rotations: bool

    @classmethod
    def sampled(cls, reference: Trajectory, estimate: Trajectory) -> "_Motions | None":
        """Return motions from all over an estimate; None where there are too few."""
        finite = finite_rows(estimate.poses[:, :3, :3])
        turned = estimate.poses[finite, :3, :3]  # all alike where a file has positions alone
        rotations = len(turned) > MIN_MOTIONS and bool((turned != turned[0]).any())
        rotations &= bool((reference.poses[1:, :3, :3] != reference.poses[0, :3, :3]).any())
        rows = np.flatnonzero(finite if rotations else finite_rows(estimate.poses[:, :3, 3]))
        rows = rows[np.argsort(estimate.keys[rows], kind="stable")]
        stamps = estimate.keys[rows]
        second = np.searchsorted(stamps, stamps + SPAN)
        first = np.flatnonzero(second < len(stamps))
        second = second[first]
        short = stamps[second] - stamps[first] <= LONGEST_SPAN
        first, second = first[short], second[short]
        if min(len(first), len(reference.keys)) < MIN_MOTIONS:
            return None
        some = np.linspace(0, len(first) - 1, min(SAMPLE, len(first))).astype(int)
        first, second = rows[first[some]], rows[second[some]]
        sizes = _sizes(estimate.poses[first], estimate.poses[second], rotations)
        return cls(reference, estimate.keys[first], estimate.keys[second], sizes, rotations)

    def disagreement(self, offset: float) -> float:
        """Return the mean difference of motions at an offset; infinite if most are unknown."""
        first, first_known = self._reference_at(self.starts + offset)
        second, second_known = self._reference_at(self.ends + offset)
        both = first_known & second_known
        if both.sum() < max(MIN_MOTIONS, len(both) / 2):
            return np.inf
        true, sizes = _sizes(first, second, self.rotations)[both], self.sizes[both]
        if not self.rotations:
            sizes = sizes * (np.median(true) / max(np.median(sizes), np.finfo(float).tiny))
        differences = np.abs(true - sizes)
        return float(np.minimum(differences, OUTLIER * np.median(differences)).mean())

    def _reference_at(self, times: Floats) -> tuple[Floats, Booleans]:
        return reference_at(self.reference, times, gap=LONGEST_SPAN, t_max_diff=0.0)

    def best(self, offsets: Floats, every: int = 1) -> TimeOffset | None:
        """Return the best offset, to a fraction of the fine step; None where none has motions.

        With `every` the offsets are tried with fewer motions.
        """
        starts, ends, sizes = self.starts[::every], self.ends[::every], self.sizes[::every]
        some = replace(self, starts=starts, ends=ends, sizes=sizes)
        coarse = np.array([some.disagreement(offset) for offset in offsets])
        if not np.isfinite(coarse).any():
            return None
        centre = offsets[np.argmin(coarse)]
        fine = centre + FINE_STEP * np.arange(-20, 21)
        values = np.array([self.disagreement(offset) for offset in fine])
        row = int(np.clip(np.argmin(values), 1, len(fine) - 2))
        before, least, after = values[row - 1 : row + 2]
        curvature = before - 2 * least + after
        share = 0.5 * (before - after) / curvature if 0 < curvature < np.inf else 0.0
        offset = float(fine[row] + FINE_STEP * share)
        now = self.disagreement(0.0)
        now = now if now < np.inf else float(np.median(coarse[np.isfinite(coarse)]))
        rounding = max(1e-6 * float(np.median(self.sizes)), np.finfo(float).tiny)
        gain = (now + rounding) / (self.disagreement(offset) + rounding)
        return TimeOffset(offset, gain, "rotation rates" if self.rotations else "speeds")


def _sizes(first: Floats, second: Floats, rotations: bool) -> Floats:
    """Return by how many degrees, or how far, poses move from the first to the second."""
    if rotations:
        return rotation_angles(first[:, :3, :3].swapaxes(1, 2) @ second[:, :3, :3])
    return np.asarray(np.linalg.norm(second[:, :3, 3] - first[:, :3, 3], axis=1))
