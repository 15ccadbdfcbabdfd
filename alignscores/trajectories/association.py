"""Which estimated pose belongs to which reference pose: by time, by image name or by row."""

import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from numbers import Real
from pathlib import PurePosixPath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..validation import finite_rows
from .files import Trajectory, TrajectoryWarning
from .files.stamps import TIME_UNITS, time_unit

__all__ = ["MISSING", "Matches", "coverage", "in_order", "is_denser", "match", "unit_hint"]


MISSING = ("fail", "ignore")
KEY_KINDS = {"f": "time stamps in seconds (float)", "U": "names (str)", "i": "frame numbers (int)"}
NAME_PARTS: dict[str, Callable[[str], str]] = {  # what may be equal of names whose paths differ
    "file name": lambda name: PurePosixPath(name).name,
    "file name without its ending": lambda name: PurePosixPath(name).stem,
}
MIN_DENSITY = 1.1  # reference poses for each frame; with more, not every one was to be estimated
MIN_STEPS = 8  # fewer do not tell a rate
LONG_GAP = 10, 1.0  # in median gaps, and in seconds; a gap that exceeds both is a lost track
SAME_DURATION = 0.5, 2.0  # range of the ratio of two durations once they are in the same unit
EARLIEST_DATE = 1e8  # seconds; stamps since 1970 are later, those since a start earlier


@dataclass(frozen=True, eq=False)
class Matches:
    """Reference and estimated poses, row by row the same camera, ready to be scored.

    Parameters
    ----------
    keys : (n,) ndarray
        Time stamps, image names or row numbers of the reference.
    gt_poses, est_poses : (n, 4, 4) ndarray
        Camera-to-world poses; an estimated pose is not finite where the camera was not estimated.
    gt_rows, est_rows : (n,) ndarray of int
        Row of each camera in the reference, and of its pose in the estimate: -1 where it has none.
    matched : int
        Number of reference poses with an estimated pose, finite or not.
    missing : int
        Number of cameras without an estimated pose: those that count as failures, or, where missing
        cameras are left out, all reference poses without one.
    unmatched : int
        Number of estimated poses without a reference pose; they are left out.
    duplicate : int
        Number of estimated poses left out since another one with the same time stamp or name comes
        first, or is closer to their reference pose in time.
    non_finite : int
        Number of matched estimated poses that are not finite; each of them is a failure.
    without_reference : (k,) ndarray
        Time stamps of frames left out since they have neither an estimated nor a reference pose;
        with the offset, as the reference would have them.
    frame_step : float or None
        Time in seconds from one lost frame to the next, where the reference is denser than the
        estimate and frames were counted at the estimate's rate.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.association import match
    >>> from alignscores.trajectories.files import Trajectory
    >>> poses = np.tile(np.eye(4), (3, 1, 1))
    >>> reference = Trajectory(["a", "b", "c"], poses)
    >>> matches = match(reference, Trajectory(["c", "a"], poses[:2]), missing="fail")
    >>> matches.est_rows, matches.matched, matches.missing
    (array([ 1, -1,  0]), 2, 1)
    """

    keys: NDArray[Any]
    gt_poses: Floats
    est_poses: Floats
    gt_rows: Indices
    est_rows: Indices
    matched: int
    missing: int
    unmatched: int
    duplicate: int
    non_finite: int
    without_reference: Floats
    frame_step: float | None


def match(
    reference: Trajectory,
    estimate: Trajectory,
    *,
    missing: str = "ignore",
    t_max_diff: float = 0.01,
    t_offset: float = 0.0,
    frames: Floats | None = None,
) -> Matches:
    """Find the estimated pose of each reference pose.

    Each pose of the shorter trajectory gets the nearest one in time of the longer, as in evo. No
    pose is used twice: the closest pair wins. Image names must be
    equal, or, if none is, their file names, or these without their endings, where they are unique.
    Whole numbers (of frames, or stamps in nanoseconds) must be equal; where both are mere row
    numbers, 0, 1, 2, ... as of KITTI, the number of rows must be the same.

    Parameters
    ----------
    reference, estimate : Trajectory
        As returned by the readers of `alignscores.trajectories.files`; or any pair of keys and
        poses, (n, 4, 4) or (n, 3, 4), the keys in an array, a list or a column of pandas.
    missing : {"ignore", "fail"}
        Whether cameras without an estimated pose are left out, or count as failures. These are the
        reference poses without one; see the notes on a reference that is denser than the estimate.
    t_max_diff : float
        Largest difference of associated time stamps in seconds.
    t_offset : float
        Added to the time stamps of the estimate, and to those of `frames`, in seconds.
    frames : (k,) array, optional
        Time stamps of the frames that were to be estimated; with ``missing="fail"`` these, and no
        others, count as failures where the estimate has no pose within `t_max_diff`.

    Returns
    -------
    Matches
        The poses of both, and how many of them were matched, missing, left out.

    Raises
    ------
    ValueError
        Where the trajectories have no pose in common, or another kind of keys or, by row, another
        length; or keys, poses or a setting are impossible.

    Warns
    -----
    TrajectoryWarning
        Where the stamps are not in order, keys of the reference are repeated, or images are not
        matched by their paths.

    Notes
    -----
    A motion capture system records many poses between two frames of a camera, which no estimate
    can have. So where the reference's time step is smaller than the estimate's, the cameras that
    count as failures are those at the estimate's own rate: before its first pose, after its last
    and in gaps, one each median step, at the nearest reference pose. If the frames are known, as
    keyframes are, give `frames` instead.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.association import match
    >>> from alignscores.trajectories.files import Trajectory
    >>> reference = Trajectory(np.array(["a", "b", "c"]), np.tile(np.eye(4), (3, 1, 1)))
    >>> estimate = Trajectory(np.array(["c", "x", "a"]), np.tile(np.eye(4), (3, 1, 1)))
    >>> matches = match(reference, estimate, missing="fail")
    >>> matches.matched, matches.missing, matches.unmatched, len(matches.est_poses)
    (2, 1, 1, 3)
    """
    if missing not in MISSING:
        raise ValueError(f"missing must be one of {list(MISSING)}, not {missing!r}")
    for name, seconds, least in (("t_max_diff", t_max_diff, 0), ("t_offset", t_offset, -inf)):
        if not isinstance(seconds, Real) or not least <= seconds < inf:
            raise ValueError(f"{name} must be a finite number of seconds, not {seconds!r}")
    reference, estimate = _checked(reference, "reference"), _checked(estimate, "estimate")
    pairs = _pair(reference.keys, estimate.keys, t_max_diff, t_offset)
    kept = pairs.ref_kept
    matched = pairs.est_rows[kept] >= 0
    lost, without_reference, frame_step = ~matched, np.empty(0), None
    if missing == "fail" and reference.keys.dtype.kind == "f":
        ref, est = reference.keys[kept], np.unique(estimate.keys) + t_offset
        if frames is not None:
            at_frames, without_reference = _lost_frames(ref, est, frames, t_max_diff, t_offset)
            lost &= at_frames
        elif is_denser(ref, est):
            frame_step = float(np.median(np.diff(est)))
            lost &= _lost_in_gaps(ref, est, t_max_diff)

    rows = kept[matched | lost] if missing == "fail" else kept[matched]
    est_rows = pairs.est_rows[rows]
    est_poses = estimate.poses[est_rows]
    non_finite = int(np.sum(~finite_rows(est_poses[est_rows >= 0])))
    est_poses[est_rows < 0] = np.nan
    n_matched = int(np.sum(matched))
    return Matches(
        keys=reference.keys[rows],
        gt_poses=reference.poses[rows],
        est_poses=est_poses,
        gt_rows=rows,
        est_rows=est_rows,
        matched=n_matched,
        missing=int(np.sum(lost)),
        unmatched=len(estimate.keys) - pairs.duplicate - n_matched,
        duplicate=pairs.duplicate,
        non_finite=non_finite,
        without_reference=without_reference,
        frame_step=frame_step,
    )


def in_order(reference: Trajectory) -> Trajectory:
    """Return a reference as `match` uses it: without duplicates, in the order of its time stamps.

    After its warnings of duplicates and disorder `match` has nothing more to warn of.
    """
    reference = _checked(reference, "reference")
    rows = _first_rows(reference.keys, "reference")
    return Trajectory(reference.keys[rows], reference.poses[rows])


def coverage(reference: Trajectory, matches: Matches) -> float:
    """Return the share of a reference, from `in_order`, over which the track was not lost.

    Of images it is the share that is scored. By time it was lost in gaps between scored poses, and
    at the ends of the reference, that are longer than `LONG_GAP`. The share is one of the
    reference's poses, so that gaps in the reference itself do not count.
    """
    stamps, scored = reference.keys, matches.keys
    if stamps.dtype.kind != "f":
        return len(scored) / len(stamps)
    gaps = np.diff(scored, prepend=stamps[0], append=stamps[-1])
    times, seconds = LONG_GAP
    long = gaps > max(times * np.median(gaps), seconds)
    lost = long[np.searchsorted(scored, stamps)] & ~np.isin(stamps, scored)
    return float(np.mean(~lost))


def is_denser(ref_stamps: Floats, est_stamps: Floats) -> bool:
    """Tell whether a reference has more poses than an estimate can have, by the median step.

    Fewer than 10 stamps, which must be in order, are too few to tell.
    """
    return _median_step(ref_stamps, est_stamps) >= MIN_DENSITY


class _Pairs(NamedTuple):
    """Which pose of the estimate belongs to each of the reference, and what was left out."""

    est_rows: Indices  # a row of the estimate for each of the reference; -1 where it has none
    ref_kept: Indices  # rows of the reference without duplicates, stamps in order
    duplicate: int  # number of estimated poses left out as duplicates


def _pair(ref_keys: NDArray[Any], est_keys: NDArray[Any], max_diff: float, offset: float) -> _Pairs:
    """Pair the poses by what their keys are."""
    kinds = ref_keys.dtype.kind, est_keys.dtype.kind
    if kinds[0] != kinds[1]:
        raise ValueError(
            "the two trajectories are not of the same format: the keys of the reference are "
            f"{KEY_KINDS[kinds[0]]}, those of the estimate {KEY_KINDS[kinds[1]]}"
        )
    if kinds == ("f", "f"):
        return _pair_by_time(ref_keys, est_keys, max_diff, offset)
    if kinds == ("i", "i") and _are_row_numbers(ref_keys) and _are_row_numbers(est_keys):
        return _pair_by_row(ref_keys, est_keys)
    return _pair_by_key(ref_keys, est_keys)


def _pair_by_time(ref_stamps: Floats, est_stamps: Floats, max_diff: float, offset: float) -> _Pairs:
    ref_kept, est_kept = _first_rows(ref_stamps, "reference"), _first_rows(est_stamps, "estimate")
    ref, est = ref_stamps[ref_kept], est_stamps[est_kept]
    if len(est) > len(ref):
        i = np.arange(len(ref))
        j, near = _nearest(est + offset, ref, max_diff)
    else:
        j = np.arange(len(est))
        i, near = _nearest(ref - offset, est, max_diff)
    i, j = i[near], j[near]
    if len(i) == 0:
        raise ValueError(
            f"no time stamps in common: the reference goes from {ref[0]:.6f} to {ref[-1]:.6f} s, "
            f"the estimate from {est[0]:.6f} to {est[-1]:.6f} s (t_offset {offset:g} s, "
            f"t_max_diff {max_diff:g} s){_stamps_hint(ref, est)}"
        )
    by_distance = np.argsort(np.abs(est[j] + offset - ref[i]), kind="stable")
    i, j = i[by_distance], j[by_distance]
    closest = _is_first(i) & _is_first(j)
    est_rows = np.full(len(ref_stamps), -1)
    est_rows[ref_kept[i[closest]]] = est_kept[j[closest]]
    farther = len(np.unique(j)) - int(np.sum(closest))
    return _Pairs(est_rows, ref_kept, len(est_stamps) - len(est_kept) + farther)


def _lost_in_gaps(ref_stamps: Floats, est_stamps: Floats, max_diff: float) -> Booleans:
    """Tell at which poses of a denser reference the estimate must have lost a frame.

    The number of frames lost in a gap follows from its length in time and from the number of
    reference poses in it; the smaller one counts, since in gaps of the reference itself nothing can
    be said to be lost. Each reference pose in a gap is given to the nearest frame, and each frame
    keeps the nearest pose. (To go through the frames instead would take forever where one stamp is
    wrong by years.)
    """
    n, m = len(ref_stamps), len(est_stamps)
    step = np.median(np.diff(est_stamps))
    places = np.r_[0, _places(ref_stamps, est_stamps), n - 1]  # with the reference's ends
    times = np.maximum(np.diff(np.r_[ref_stamps[0], est_stamps, ref_stamps[-1]]), 0) / step
    steps = np.minimum(times, np.diff(places) / _median_step(ref_stamps, est_stamps))
    # A gap between poses ends with an estimated frame; what lacks to a whole step is jitter.
    most = np.maximum(np.rint(steps) - 1, 0)
    most[[0, -1]] = np.floor(steps[[0, -1]] + 0.01)

    gap = np.searchsorted(est_stamps, ref_stamps, side="right")
    start = est_stamps[np.maximum(gap - 1, 0)]
    n_steps = np.maximum(np.rint(times[gap]), 1)
    inside = (gap > 0) & (gap < m)
    length = np.where(inside, times[gap] / n_steps, 1.0) * step
    frame = np.rint((ref_stamps - start) / length)
    distance = np.abs(ref_stamps - start - frame * length)
    lost = (most[gap] > 0) & (frame != 0) & ~(inside & (frame == n_steps))
    lost &= distance <= max(max_diff, float(np.median(np.diff(ref_stamps))))
    rows = np.flatnonzero(lost)
    rows = rows[np.argsort(distance[rows], kind="stable")]
    _, nearest = np.unique(np.column_stack([gap, frame])[rows], axis=0, return_index=True)
    rows = np.sort(rows[nearest])

    # Of more than there can be in a gap, that many are kept, evenly spread.
    _, first, count = np.unique(gap[rows], return_index=True, return_counts=True)
    number = np.arange(len(rows)) - np.repeat(first, count)
    share = np.minimum(most[gap[rows]] / np.repeat(count, count), 1)
    spread = np.floor((number + 1) * share + 1e-9) > np.floor(number * share + 1e-9)
    return np.isin(np.arange(n), rows[spread])


def _median_step(ref_stamps: Floats, est_stamps: Floats) -> float:
    """Return how many poses of the reference the estimate usually advances; 0 if it has too few."""
    places = _places(ref_stamps, est_stamps)
    steps = np.diff(places[(places > 0) & (places < len(ref_stamps) - 1)])
    return float(np.median(steps)) if len(steps) >= MIN_STEPS else 0.0


def _places(ref_stamps: Floats, est_stamps: Floats) -> Floats:
    """Return where among the rows of the reference, counted in fractions, estimated poses lie."""
    return np.interp(est_stamps, ref_stamps, np.arange(len(ref_stamps)))


def _lost_frames(
    ref_stamps: Floats, est_stamps: Floats, frames: Floats, max_diff: float, offset: float
) -> tuple[Booleans, Floats]:
    """Tell the reference poses of frames without an estimated pose, and the frames without both."""
    frames = np.unique(frames)
    due = frames + offset
    rows, near = _nearest(ref_stamps, due, max_diff)
    if not near.any():
        raise ValueError(
            f"no due frame has a reference pose: the frames go from {frames[0]:.6f} to "
            f"{frames[-1]:.6f} s, the reference from {ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s "
            f"(t_offset {offset:g} s, t_max_diff {max_diff:g} s)"
            f"{unit_hint(ref_stamps, due, 'frames')}"
        )
    _, estimated = _nearest(est_stamps, due, max_diff)
    lost = np.isin(np.arange(len(ref_stamps)), rows[near & ~estimated])
    return lost, due[~near & ~estimated]


def _nearest(stamps: Floats, times: Floats, max_diff: float) -> tuple[Indices, Booleans]:
    """Return which of the stamps, in order, is nearest to each time, and whether it is near."""
    last = len(stamps) - 1
    after = np.minimum(np.searchsorted(stamps, times), last)
    before = np.maximum(after - 1, 0)
    nearest = np.where(times - stamps[before] <= stamps[after] - times, before, after)
    return nearest, np.abs(stamps[nearest] - times) <= max_diff


def unit_hint(ref_stamps: Floats, est_stamps: Floats, whose: str = "estimate") -> str:
    """Say whose stamps are not in seconds, if it shows in them or in how long both last.

    The end of a message that too few of a reference's stamps meet those of `whose`; else empty.
    """
    stamps = {"reference": ref_stamps, whose: est_stamps}
    units = {name: time_unit(values) for name, values in stamps.items()}
    if "seconds" not in units.values():
        return f"; both seem to be in {units[whose]}: write them in seconds"
    durations = {name: float(np.ptp(values)) for name, values in stamps.items()}
    low, high = SAME_DURATION
    for name, other in (("reference", whose), (whose, "reference")):
        for unit, factor in TIME_UNITS.items():
            as_long = factor * durations[other]
            same = factor > 1 and low * as_long < durations[name] < high * as_long
            if unit == units[name] != "seconds" or same:
                return f"; those of the {name} seem to be in {unit}: write them in seconds"
    return ""


def _stamps_hint(ref_stamps: Floats, est_stamps: Floats) -> str:
    """Say why stamps have nothing in common, if it can be told."""
    if hint := unit_hint(ref_stamps, est_stamps):
        return hint
    first = {"reference": ref_stamps[0], "estimate": est_stamps[0]}
    last = {"reference": ref_stamps[-1], "estimate": est_stamps[-1]}
    for whose, other in (("reference", "estimate"), ("estimate", "reference")):
        if abs(last[whose]) < EARLIEST_DATE < first[other]:
            return (
                f"; those of the {whose} seem to count from its start: --t_offset auto finds the "
                f"offset, --t_offset {first['reference'] - first['estimate']:.3f} lets both begin "
                "together"
            )
    return ""


def _checked(trajectory: Trajectory, whose: str) -> Trajectory:
    """Return a trajectory as of a reader, also of keys in a list and of poses (n, 3, 4)."""
    keys, poses = np.asarray(trajectory.keys), np.asarray(trajectory.poses)
    if keys.dtype == object and all(isinstance(key, str) for key in keys.flat):  # as of pandas
        keys = keys.astype(str)
    keys = keys.astype(np.int64) if keys.dtype.kind == "u" else keys
    if keys.ndim != 1 or keys.dtype.kind not in KEY_KINDS:
        raise ValueError(
            f"the keys of the {whose} must be a list of {', '.join(KEY_KINDS.values())}, not an "
            f"array of shape {keys.shape} and type {keys.dtype}"
        )
    if poses.shape not in ((len(keys), 4, 4), (len(keys), 3, 4)) or poses.dtype.kind not in "fiu":
        raise ValueError(
            f"the poses of the {whose} must be numbers of shape ({len(keys)}, 4, 4) or "
            f"({len(keys)}, 3, 4), one matrix a key, not of shape {poses.shape} and type "
            f"{poses.dtype}"
        )
    if len(keys) == 0:
        raise ValueError(f"the {whose} has no poses")
    if keys.dtype.kind == "f":
        keys = keys.astype(np.float64)
        if not np.isfinite(keys).all():
            row = int(np.argmin(np.isfinite(keys)))
            raise ValueError(f"the time stamp of pose {row + 1} of the {whose} is not finite")
    if poses.shape != (len(keys), 4, 4):
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(keys), 1, 4))
        poses = np.concatenate([poses, last], axis=1)
    return Trajectory(keys, poses.astype(np.float64, copy=False))


def _are_row_numbers(keys: NDArray[Any]) -> bool:
    return np.array_equal(keys, np.arange(len(keys)))


def _pair_by_key(ref_keys: NDArray[Any], est_keys: NDArray[Any]) -> _Pairs:
    ref_kept, est_kept = _first_rows(ref_keys, "reference"), _first_rows(est_keys, "estimate")
    ref, est = ref_keys[ref_kept].tolist(), est_keys[est_kept].tolist()
    pairs, part = _unique_pairs(ref, est), ""
    names = ref_keys.dtype.kind == "U"
    for part, shorten in NAME_PARTS.items() if names and not pairs else ():
        pairs = _unique_pairs(list(map(shorten, ref)), list(map(shorten, est)))
        if pairs:
            first, second = ref[pairs[0][0]], est[pairs[0][1]]
            _warn(f"no path in common, so images are matched by {part}: {first!r} and {second!r}")
            break
    if not pairs:
        what = "image names" if names else "frame numbers"
        hint = f", not even a {part} that is unique" if part else ""
        raise ValueError(
            f"no {what} in common: the reference has {ref[0]!r}, the estimate {est[0]!r}, for "
            f"example{hint}"
        )
    ref_rows, matching_rows = np.transpose(pairs)
    est_rows = np.full(len(ref_keys), -1)
    est_rows[ref_kept[ref_rows]] = est_kept[matching_rows]
    return _Pairs(est_rows, ref_kept, len(est_keys) - len(est_kept))


def _unique_pairs(ref_keys: list[Any], est_keys: list[Any]) -> list[tuple[int, int]]:
    """Return the positions of equal keys, of those that occur once."""
    once = [
        {key: row for row, key in enumerate(keys) if count[key] == 1}
        for keys, count in ((keys, Counter(keys)) for keys in (ref_keys, est_keys))
    ]
    return [(row, once[1][key]) for key, row in once[0].items() if key in once[1]]


def _pair_by_row(ref_rows: NDArray[Any], est_rows: NDArray[Any]) -> _Pairs:
    if len(ref_rows) != len(est_rows):
        raise ValueError(
            f"the reference has {len(ref_rows)} poses, the estimate {len(est_rows)}: without "
            "stamps or names they correspond row by row, so their number must be the same (write a "
            "row of nan for each frame that was lost)"
        )
    rows = np.arange(len(ref_rows))
    return _Pairs(rows, rows, 0)


def _first_rows(keys: NDArray[Any], whose: str) -> Indices:
    """Return the first row of each key; of time stamps, in their order."""
    rows = np.arange(len(keys))
    if keys.dtype.kind == "f":
        backwards = np.diff(keys) < 0
        if backwards.any():
            row = int(np.argmax(backwards)) + 1
            _warn(
                f"the time stamps of the {whose} are not in order (first at pose {row + 1}, "
                f"{keys[row]:.6f} s); sorted"
            )
        rows = np.argsort(keys, kind="stable")
    kept = rows[_is_first(keys[rows])]
    if whose == "reference" and len(kept) < len(rows):
        _warn(f"duplicates in the reference (of stamp or name), left out: {len(rows) - len(kept)}")
    return kept


def _is_first(values: NDArray[Any]) -> Booleans:
    first = np.zeros(len(values), dtype=bool)
    first[np.unique(values, return_index=True)[1]] = True
    return first


def _warn(message: str) -> None:
    warnings.warn(message, TrajectoryWarning, stacklevel=4)
