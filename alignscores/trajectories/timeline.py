"""Time: the frames that were due, the pose that stands for each of them, and what was lost.

An estimate answers for the time of the reference. Two of its poses that follow each other within
the largest gap cover the time between them, and each stands for the time around it. So an estimate
of keyframes is scored as that of all frames, while the time of a lost track counts as lost.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Booleans, Floats, Indices
from ..averaging import angles_and_axes, rotations_from_quaternions
from .files import Trajectory

__all__ = ["Standing", "due_rows", "nearest_stamps", "stand_in", "usual_step"]

DENSER = 1.1  # steps of the reference in one of the estimate; from it on, some are no frames
NEAR = 0.1  # seconds between two reference poses that are interpolated at any rate
LONG_GAP = 10, 1.0  # in usual steps, and in seconds: what exceeds both is a lost track
MIN_STEPS = 8  # fewer tell no usual step


class Standing(NamedTuple):
    """Which pose stands for each due frame, and the reference at the time of that pose."""

    est_rows: Indices  # (n,), of the estimate; -1 where none stands for the frame
    gt_poses: Floats  # (n, 4, 4), of the reference at the pose's own time, or at the frame's
    unmatched: int  # estimated poses that have no reference pose to be compared with


def usual_step(stamps: Floats) -> float:
    """Return the median time from one stamp to the next; infinite of a single one."""
    steps = np.diff(np.unique(stamps))
    return float(np.median(steps)) if len(steps) else np.inf


def due_rows(ref_stamps: Floats, step: float) -> Indices:
    """Return the rows of a reference, in order, at which an estimate of a step is due.

    These are all, or the first one of each step where the reference is denser, as one by motion
    capture is.
    """
    if not DENSER * usual_step(ref_stamps) <= step < np.inf:
        return np.arange(len(ref_stamps))
    _, first = np.unique(np.floor((ref_stamps - ref_stamps[0]) / step + 1e-6), return_index=True)
    return np.asarray(first)


def stand_in(
    reference: Trajectory,
    due: Indices,
    estimate: Trajectory,
    *,
    t_max_diff: float,
    max_gap: float | None,
    interpolate: bool,
) -> Standing:
    """Return the pose that stands for each due row of the reference.

    Stamps of both are in order, each once. With `interpolate` a pose is compared with the reference
    at its own time, between two poses that are near each other; else, and outside of these, with
    the nearest pose within `t_max_diff`.
    """
    step = usual_step(estimate.keys)
    gt_poses, comparable = _reference_at(reference, estimate.keys, step, t_max_diff, interpolate)
    rows = np.flatnonzero(comparable)
    est_rows, due_stamps = np.full(len(due), -1), reference.keys[due]
    if len(rows) and len(due):
        nearest, covered = _covered(estimate.keys[rows], due_stamps, t_max_diff, max_gap)
        est_rows[covered] = rows[nearest[covered]]
    standing = np.where((est_rows < 0)[:, None, None], reference.poses[due], gt_poses[est_rows])
    return Standing(est_rows, standing, int(np.sum(~comparable)))


def _covered(
    stamps: Floats, due: Floats, t_max_diff: float, max_gap: float | None
) -> tuple[Indices, Booleans]:
    """Return the nearest pose in time of each due frame, and whether it stands for it.

    It does within a gap that is not too long, the ones before the first pose and after the last one
    among them, and at the ends of a longer one for half a usual step.
    """
    step = usual_step(stamps)
    if max_gap is None:
        steps, seconds = LONG_GAP
        max_gap = max(steps * step, seconds) if len(stamps) > MIN_STEPS else seconds
    gaps = np.diff(stamps, prepend=due[0], append=due[-1])
    nearest, distance = nearest_stamps(stamps, due)
    reach = max(t_max_diff, min(step, max_gap) / 2 if step < np.inf else 0.0)
    return nearest, (gaps[np.searchsorted(stamps, due)] <= max_gap) | (distance <= reach)


def _reference_at(
    reference: Trajectory, times: Floats, step: float, t_max_diff: float, interpolate: bool
) -> tuple[Floats, Booleans]:
    """Return the reference at times, (m, 4, 4), and where it can be told."""
    stamps, poses = reference
    nearest, distance = nearest_stamps(stamps, times)
    found, known = poses[nearest], distance <= t_max_diff
    if not interpolate:
        return found, known
    after = np.clip(np.searchsorted(stamps, times), 1, len(stamps) - 1)
    before = after - 1
    inside = (times > stamps[0]) & (times < stamps[-1]) & (distance > 0)
    inside &= stamps[after] - stamps[before] <= max(DENSER * step, NEAR + t_max_diff)
    rows = np.flatnonzero(inside)
    first, second = before[rows], after[rows]
    share = (times[rows] - stamps[first]) / (stamps[second] - stamps[first])
    found[rows] = _between(poses[first], poses[second], share)
    return found, known | inside


def _between(first: Floats, second: Floats, share: Floats) -> Floats:
    """Interpolate poses: positions on a line, rotations about one axis at a constant speed."""
    poses = first.copy()
    poses[:, :3, 3] += share[:, None] * (second[:, :3, 3] - first[:, :3, 3])
    start = first[:, :3, :3]
    angles, axes = angles_and_axes(second[:, :3, :3] @ start.swapaxes(1, 2))
    half = share * angles / 2
    turns = rotations_from_quaternions(np.vstack([np.sin(half) * axes, np.cos(half)]).T)
    poses[:, :3, :3] = turns @ start
    return poses


def nearest_stamps(stamps: Floats, times: Floats) -> tuple[Indices, Floats]:
    """Return which of the stamps, in order, is nearest to each time, and how far it is."""
    last = len(stamps) - 1
    after = np.minimum(np.searchsorted(stamps, times), last)
    before = np.maximum(after - 1, 0)
    nearest = np.where(times - stamps[before] <= stamps[after] - times, before, after)
    return nearest, np.abs(stamps[nearest] - times)
