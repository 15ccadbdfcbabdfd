"""A constant offset between the clocks of a reference and an estimate.

With an offset each estimated pose is compared with where the camera was a moment earlier or later.
The reference's positions, interpolated at the estimate's stamps plus an offset, then fit the
estimate the better the nearer the offset is to the true one.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Booleans, Floats
from ..registration import pcr99
from ..translation import normalise
from ..validation import finite_rows
from .files import Trajectory

__all__ = ["TimeOffset", "find_offset"]


SAMPLE = 300  # poses looked at, evenly spread
MIN_POSES = 20  # fewer fit at some offset by chance
HYPOTHESES = 100
REACH, STEP = 1.0, 0.05  # seconds on either side that are tried, and from one trial to the next
REFINEMENTS = 5  # each divides the step by 4
MISFIT = 0.1  # largest misfit at the offset, relative to the extent of the reference there
ROUNDING = 1e-4  # misfit, so relative, below which all fit alike
GAIN = 1.5  # factor by which the positions must fit better for an offset to be told
FAR_GAIN = 5.0  # the same beyond that reach, where there are more to choose from
TRIALS = 4000  # most offsets tried where nothing is known of it


@dataclass(frozen=True)
class TimeOffset:
    """The offset at which the positions fit best.

    Parameters
    ----------
    seconds : float
        To be added to the estimate's time stamps.
    gain : float
        Factor by which the positions fit better than without an offset; infinite where the stamps
        have too little time in common without one.
    """

    seconds: float
    gain: float

    @property
    def significant(self) -> bool:
        """Whether the offset explains more than noise does."""
        return self.gain >= (GAIN if abs(self.seconds) <= REACH else FAR_GAIN)


def find_offset(reference: Trajectory, estimate: Trajectory) -> TimeOffset | None:
    """Find the time offset of an estimate by the fit of its positions.

    Parameters
    ----------
    reference, estimate : Trajectory
        With time stamps in seconds as keys, the reference's in order and without duplicates.

    Returns
    -------
    TimeOffset or None
        The offset, within 1 s if the positions fit there, else anywhere, as where one of the two
        counts from its start. None where there are fewer than 20 poses to tell it by, or at none do
        half of the poses lie within the reference and fit.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.files import Trajectory
    >>> from alignscores.trajectories.timing import find_offset
    >>> poses = np.tile(np.eye(4), (1000, 1, 1))
    >>> times = np.arange(1000) / 100
    >>> poses[:, :3, 3] = np.transpose([np.sin(3 * times), np.cos(2 * times), np.sin(times)])
    >>> round(find_offset(Trajectory(times, poses), Trajectory(times - 0.2, poses)).seconds, 3)
    0.2
    """
    rows = np.flatnonzero(finite_rows(estimate.poses[:, :3, 3]))
    rows = rows[np.argsort(estimate.keys[rows], kind="stable")]
    if min(len(rows), len(reference.keys)) < MIN_POSES:
        return None
    rows = rows[np.linspace(0, len(rows) - 1, min(SAMPLE, len(rows))).astype(int)]
    positions = (normalise(poses[:, :3, 3])[0] for poses in (reference.poses, estimate.poses[rows]))
    fit = _Fit(reference.keys, estimate.keys[rows], *positions)
    anywhere = (
        float(reference.keys[0] - estimate.keys[rows[-1]]),
        float(reference.keys[-1] - estimate.keys[rows[0]]),
    )
    for least, most in ((-REACH, REACH), anywhere):
        best = fit.best_offset(least, most)
        misfit = fit.misfit(best)
        extent = fit.extent(best) if misfit < np.inf else 0.0
        if misfit <= MISFIT * extent and extent > 0:
            floor = fit.interpolation_error() + ROUNDING * extent
            return TimeOffset(best, (fit.misfit(0.0) + floor) / (misfit + floor))
    return None


@dataclass(frozen=True)
class _Fit:
    """The fit of estimated positions to those of a reference at any offset."""

    ref_stamps: Floats
    est_stamps: Floats
    ref_positions: Floats
    est_positions: Floats

    def misfit(self, offset: float) -> float:
        """Return the median position error at an offset, after a robust alignment."""
        inside, gt = self._reference(offset)
        if len(gt) < max(MIN_POSES, len(inside) / 2):
            return np.inf
        est, rank, rng = self.est_positions[inside], len(gt) // 2 + 1, np.random.default_rng(0)
        alignment, _ = pcr99(gt, est, rank=rank, n_hypotheses=HYPOTHESES, rng=rng)
        if alignment is None:
            return np.inf
        return float(np.median(alignment.position_errors(gt, est)))

    def best_offset(self, least: float, most: float) -> float:
        """Return the offset within a range at which the misfit is the smallest."""
        step = max(STEP, (most - least) / TRIALS)
        candidates = np.arange(least, most + step / 2, step)
        best = 0.0
        for _ in range(REFINEMENTS):
            best = float(min(candidates, key=self.misfit))
            step /= 4
            candidates = best + step * np.arange(-4, 5)
        return best

    def interpolation_error(self) -> float:
        """Return by how much interpolated positions are off, as a rule; a better fit is chance."""
        curvature = np.diff(self.ref_positions, n=2, axis=0)
        return float(np.median(np.linalg.norm(curvature, axis=1))) / 8

    def extent(self, offset: float) -> float:
        """Return how far the reference reaches from its middle at an offset, as a rule."""
        _, gt = self._reference(offset)
        return float(np.median(np.linalg.norm(gt - np.median(gt, axis=0), axis=1)))

    def _reference(self, offset: float) -> tuple[Booleans, Floats]:
        """Tell which poses lie within the reference at an offset, and its positions there."""
        times = self.est_stamps + offset
        inside = (times >= self.ref_stamps[0]) & (times <= self.ref_stamps[-1])
        axes = (np.interp(times[inside], self.ref_stamps, axis) for axis in self.ref_positions.T)
        return inside, np.stack(list(axes), axis=1)
