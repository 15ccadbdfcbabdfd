"""A constant offset between the clocks of a reference and an estimate.

With an offset each estimated pose is compared with where the camera was a moment earlier or later.
The reference's positions, interpolated at the estimate's stamps plus a trial offset, fit the
estimate best at the true one. Where the mirror image of the estimate or its inverse poses fit
better, at an offset of their own or at none, the misfit is one of convention.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..aligner import normalise
from ..arrays import Booleans, Floats
from ..validation import finite_rows
from .conventions import median_error
from .files import Trajectory, inverse_poses

__all__ = ["LEAST_GAIN", "TimeOffset", "find_offset"]

LEAST_GAIN = 1.2  # factor by which the positions must fit better; noise alone gains less
SAMPLE = 300  # poses looked at, evenly spread
MIN_POSES = 20  # fewer fit at some offset by chance
HYPOTHESES = 100
NEARBY = 1.0  # seconds; offsets up to this one are tried first
STEP, FAR_STEP = 0.05, 0.2  # seconds from one trial to the next, nearby and anywhere
REFINEMENTS = 5  # each divides the step by 4
MAX_TRIALS = 4000  # where nothing is known of the offset
MAX_MISFIT = 0.1  # at the offset, relative to the extent of the reference there
ROUNDING = 1e-4  # misfit, also relative, below which all fit alike
MIN_GAIN = 1.5  # factor by which the positions must fit better for an offset to be told
MIN_FAR_GAIN = 5.0  # the same beyond the nearby ones, where there are more to choose from
MIRROR = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class TimeOffset:
    """The offset in seconds, to be added to the estimate's stamps, at which its positions fit best.

    `gain` is the factor by which they fit better than without it; infinite where the stamps have
    too little time in common without it.
    """

    seconds: float
    gain: float

    @property
    def significant(self) -> bool:
        """Whether the offset explains more than noise does."""
        return self.gain >= (MIN_GAIN if abs(self.seconds) <= NEARBY else MIN_FAR_GAIN)


def find_offset(reference: Trajectory, estimate: Trajectory) -> TimeOffset | None:
    """Find the time offset of an estimate to a reference `in_order` by the fit of its positions.

    It is within 1 s if the positions fit there, else anywhere, as where one of the two counts from
    its start. Where they fit better in another convention of the estimate, it is the offset of
    those. None where there are fewer than `MIN_POSES`, or at no offset half of the poses lie within
    the reference and fit.
    """
    rows = np.flatnonzero(finite_rows(estimate.poses[:, :3, 3]))
    rows = rows[np.argsort(estimate.keys[rows], kind="stable")]
    if min(len(rows), len(reference.keys)) < MIN_POSES:
        return None
    rows = rows[np.linspace(0, len(rows) - 1, min(SAMPLE, len(rows))).astype(int)]
    fit = _ShiftedPositions(
        reference.keys,
        estimate.keys[rows],
        normalise(reference.poses[:, :3, 3])[0],
        normalise(estimate.poses[rows, :3, 3])[0],
    )
    others = [
        replace(fit, est_positions=normalise(positions)[0])
        for positions in _in_other_conventions(estimate.poses[rows])
    ]
    anywhere = (
        float(reference.keys[0] - estimate.keys[rows[-1]]),
        float(reference.keys[-1] - estimate.keys[rows[0]]),
    )
    apart = fit.misfit(0.0) == np.inf
    for span, rivals in (((-NEARBY, NEARBY), others), (anywhere, others if apart else [])):
        offset, misfit = fit.fitted(*span)
        found = None if misfit == np.inf else TimeOffset(offset, fit.gain(offset, misfit))
        if found and found.gain < LEAST_GAIN:
            return found
        for rival in rivals:
            offset, least = rival.fitted(*span)
            if least < misfit:
                misfit, gain = least, rival.gain(offset, least)
                found = TimeOffset(offset, gain) if gain >= LEAST_GAIN else TimeOffset(0.0, 1.0)
        if found:
            return found
    return None


def _in_other_conventions(est: Floats) -> list[Floats]:
    """Return the positions of the mirror image, of inverse poses, and of inverse positions."""
    est = np.nan_to_num(est)  # a position is there, but perhaps no rotation
    inverse = inverse_poses(est)[:, :3, 3]
    centres = -np.einsum(
        "nij,nj->ni", est[:, :3, :3], est[:, :3, 3]
    )  # of world-to-camera translations
    return [est[:, :3, 3] * MIRROR, inverse, inverse * MIRROR, centres]


@dataclass(frozen=True, eq=False)
class _ShiftedPositions:
    """Estimated positions beside those of a reference at any offset of the clocks."""

    ref_stamps: Floats
    est_stamps: Floats
    ref_positions: Floats
    est_positions: Floats

    def misfit(self, offset: float) -> float:
        """Return the median position error at an offset, after a robust alignment."""
        inside, gt = self._reference_at(offset)
        if len(gt) < max(MIN_POSES, len(inside) / 2):
            return np.inf
        return median_error(gt, self.est_positions[inside], n_hypotheses=HYPOTHESES)

    def fitted(self, least: float, most: float) -> tuple[float, float]:
        """Return the best offset within a range and its misfit; infinite if that is no fit."""
        best = self.best_offset(least, most)
        misfit = self.misfit(best)
        fits = misfit < np.inf and misfit < MAX_MISFIT * self.extent(best)
        return best, misfit if fits else np.inf

    def gain(self, offset: float, misfit: float) -> float:
        """Return the factor by which the positions fit better at an offset with that misfit."""
        floor = self.interpolation_error() + ROUNDING * self.extent(offset)
        return (self.misfit(0.0) + floor) / (misfit + floor)

    def best_offset(self, least: float, most: float) -> float:
        """Return the offset within a range at which the misfit is the smallest."""
        step = STEP if least >= -NEARBY and most <= NEARBY else FAR_STEP
        step = max(step, (most - least) / MAX_TRIALS)
        candidates = np.arange(least, most + step / 2, step)
        for _ in range(REFINEMENTS):
            best = min(candidates, key=self.misfit)
            step /= 4
            candidates = best + step * np.arange(-4, 5)
        return float(best)

    def interpolation_error(self) -> float:
        """Return the usual error of interpolated positions; what fits better does so by chance."""
        curvature = np.diff(self.ref_positions, n=2, axis=0)
        return float(np.median(np.linalg.norm(curvature, axis=1))) / 8

    def extent(self, offset: float) -> float:
        """Return the median distance of the reference from its middle at an offset."""
        _, gt = self._reference_at(offset)
        return float(np.median(np.linalg.norm(gt - np.median(gt, axis=0), axis=1)))

    def _reference_at(self, offset: float) -> tuple[Booleans, Floats]:
        """Tell which poses lie within the reference at an offset, and its positions there."""
        times = self.est_stamps + offset
        inside = (times >= self.ref_stamps[0]) & (times <= self.ref_stamps[-1])
        axes = [np.interp(times[inside], self.ref_stamps, axis) for axis in self.ref_positions.T]
        return inside, np.stack(axes, axis=1)
