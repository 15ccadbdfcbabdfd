"""Time: the expected frames of a reference, the pose that answers for each, and what is lost.

The expected frames depend only on the reference and the options, never on the estimate. Each
estimated pose covers half the largest gap before and after its own time. So keyframes are scored
like all frames, and an interruption lowers the scores by its share of the time.
"""

import numpy as np

from ..arrays import Booleans, Floats, Indices
from ..averaging import angles_and_axes, rotation_angles, rotations_from_quaternions
from ..io import Trajectory

__all__ = [
    "breaks",
    "chord_error",
    "covered_frames",
    "is_near",
    "nearest_stamps",
    "poses_at",
    "reference_at",
    "reference_gap",
    "sampled_rows",
]

ROUNDING = 1e-6  # seconds, of time stamps
STILL_DEG = 10.0  # degrees; the largest threshold of the RAS, as d is of the TAS


def sampled_rows(stamps: Floats, rate: float) -> Indices:
    """Return the rows of stamps, in order, that sample them at a rate: the nearest to each step."""
    if rate == np.inf:
        return np.arange(len(stamps))
    elapsed = (stamps - stamps[0]) * rate
    steps = np.round(elapsed)
    order = np.lexsort((np.abs(elapsed - steps), steps))
    _, first = np.unique(steps[order], return_index=True)
    return np.asarray(order[first])


def breaks(times: Floats) -> Indices:
    """Return where frames follow a gap of the reference: nothing is expected in it."""
    steps = np.diff(times)
    return np.flatnonzero(steps > 3 * np.median(steps)) + 1 if len(steps) else steps.astype(np.intp)


def reference_gap(stamps: Floats, rate: float) -> float:
    """Return the seconds beyond which a reference has a gap: two steps of its expected frames."""
    steps = np.diff(stamps)
    usual = float(np.median(steps)) if len(steps) else 0.0
    return 2 * max(1 / rate, usual) + ROUNDING


def reference_at(
    reference: Trajectory, times: Floats, *, gap: float, t_max_diff: float
) -> tuple[Floats, Booleans]:
    """Return the reference at times, (m, 4, 4), and where it is known.

    It is interpolated between poses at most `gap` apart. Elsewhere the nearest pose within
    `t_max_diff` takes its place.
    """
    stamps, poses = reference
    nearest, distance = nearest_stamps(stamps, times)
    at_stamps, has_reference = poses[nearest], distance <= t_max_diff
    after = np.clip(np.searchsorted(stamps, times), 1, len(stamps) - 1)
    before = after - 1
    inside = (times > stamps[0]) & (times < stamps[-1]) & (distance > 0)
    inside &= stamps[after] - stamps[before] <= gap
    rows = np.flatnonzero(inside)
    first, second = before[rows], after[rows]
    share = (times[rows] - stamps[first]) / (stamps[second] - stamps[first])
    at_stamps[rows] = _between(poses[first], poses[second], share)
    return at_stamps, has_reference | inside


def covered_frames(
    frames: Trajectory, at_poses: Trajectory, *, reach: float, unit: float
) -> tuple[Indices, Booleans]:
    """Return the nearest pose of each frame, and whether the frame is covered.

    It is within `reach` seconds of a pose, and in a longer gap as long as the reference stays
    within `unit` and `STILL_DEG` of one of the two poses around it. `at_poses` has the stamps of
    the poses and the reference at these.
    """
    nearest, distance = nearest_stamps(at_poses.keys, frames.keys)
    covered = distance <= reach + ROUNDING
    gaps = np.searchsorted(frames.keys, at_poses.keys)
    for pose in np.flatnonzero(np.diff(at_poses.keys) > 2 * reach):
        rows = slice(gaps[pose], gaps[pose + 1])
        inside = frames.poses[rows]
        from_first = is_near(inside, at_poses.poses[pose], unit)
        from_second = is_near(inside, at_poses.poses[pose + 1], unit)[::-1]
        covered[rows] |= np.logical_and.accumulate(from_first)
        covered[rows] |= np.logical_and.accumulate(from_second)[::-1]
    return nearest, covered


def is_near(poses: Floats, others: Floats, unit: float) -> Booleans:
    """Return which poses are within `unit` and `STILL_DEG` of another pose, or of one each."""
    near = np.linalg.norm(poses[:, :3, 3] - others[..., :3, 3], axis=1) <= unit
    angles = rotation_angles(others[..., :3, :3].swapaxes(-1, -2) @ poses[:, :3, :3])
    return np.asarray(near & (angles <= STILL_DEG))


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


def chord_error(reference: Trajectory, gap: float) -> float:
    """Return the RMS distance of straight lines between reference poses from the true path.

    Lines over two and over four steps are off from the poses between them. Over one step they are
    less so by the same factor again: a quarter on a smooth path, more where it turns to and fro
    between two poses.
    """
    over_two, over_four = (_error_of_lines(reference, n, n * gap) for n in (2, 4))
    if not over_two > 0:
        return 0.0
    factor = 1 / 4 if np.isnan(over_four) else over_two / max(over_two, over_four)
    return factor * over_two


def _error_of_lines(reference: Trajectory, n_steps: int, longest: float) -> float:
    """Return the RMS distance of poses from lines over so many steps; NaN if all are too long."""
    stamps, positions = reference.keys, reference.poses[:, :3, 3]
    first = np.flatnonzero(stamps[n_steps:] - stamps[:-n_steps] <= longest)
    if len(first) == 0:
        return np.nan
    inside, last = first + n_steps // 2, first + n_steps
    share = (stamps[inside] - stamps[first]) / (stamps[last] - stamps[first])
    line = positions[first] + share[:, None] * (positions[last] - positions[first])
    return float(np.sqrt(np.mean(((positions[inside] - line) ** 2).sum(axis=1))))


def poses_at(stamps: Floats, estimate: Trajectory, *, near: float, t_max_diff: float) -> Trajectory:
    """Return an estimate at stamps, for a reference that is too sparse to be interpolated.

    Each stamp has the nearest pose within `near`, otherwise the estimate interpolated between poses
    at most a quarter of the median step apart, otherwise the nearest pose within `t_max_diff`.
    """
    rows, distance = nearest_stamps(estimate.keys, stamps)
    after = np.clip(np.searchsorted(estimate.keys, stamps), 1, len(estimate.keys) - 1)
    before = after - 1
    length = estimate.keys[after] - estimate.keys[before]
    between = (stamps > estimate.keys[before]) & (stamps < estimate.keys[after])
    between &= (distance > near) & (length <= np.median(np.diff(stamps)) / 4)
    keys, poses = estimate.keys[rows], estimate.poses[rows]
    first, last = before[between], after[between]
    share = (stamps[between] - estimate.keys[first]) / length[between]
    poses[between] = _between(estimate.poses[first], estimate.poses[last], share)
    keys[between] = stamps[between]
    matched = np.flatnonzero(between | (distance <= t_max_diff))
    matched = matched[np.unique(keys[matched], return_index=True)[1]]
    return Trajectory(keys[matched], poses[matched])


def nearest_stamps(stamps: Floats, times: Floats) -> tuple[Indices, Floats]:
    """Return which of the stamps, in order, is nearest to each time, and how far it is."""
    last = len(stamps) - 1
    after = np.minimum(np.searchsorted(stamps, times), last)
    before = np.maximum(after - 1, 0)
    nearest = np.where(times - stamps[before] <= stamps[after] - times, before, after)
    return nearest, np.abs(stamps[nearest] - times)
