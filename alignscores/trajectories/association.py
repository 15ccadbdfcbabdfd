"""Which estimated pose belongs to which reference pose: by time, by image name or by row."""

import re
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from numbers import Real
from pathlib import PurePosixPath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..translation import closest_pair_quartile
from ..validation import finite_rows
from .files import Trajectory, TrajectoryWarning
from .files.stamps import TIME_UNITS, time_unit
from .timeline import covered_frames, nearest_stamps, reference_at, reference_gap, sampled_rows

__all__ = ["MISSING", "SYNCS", "Matches", "checked", "in_order", "match", "present", "unit_hint"]

MISSING = ("fail", "ignore")
SYNCS = ("interpolate", "nearest")
KEY_KINDS = {"f": "time stamps in seconds (float)", "U": "names (str)", "i": "frame numbers (int)"}
SAME_DURATION = 0.5, 2.0  # range of the ratio of two durations once they are in the same unit
EARLIEST_DATE = 1e8  # seconds; stamps since 1970 are later, those since a start earlier
MANY_DUPLICATES = 0.1  # share of the estimated poses; from it on the file is wrong


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
        Number of expected frames with an estimated pose, finite or not.
    missing : int
        Number of expected frames without an estimated pose, whether they count as failures or are
        left out.
    unmatched : int
        Number of estimated poses without a reference pose; they are left out.
    duplicate : int
        Number of estimated poses left out since another one with the same time stamp or name comes
        first.
    non_finite : int
        Number of matched cameras whose estimated pose is not finite; each of them is a failure.
    lost : float
        Share of the expected frames, by time stamps of the time, that is missing.
    expected_rows : (k,) ndarray of int
        Rows of the reference that are expected.
    unit : float
        d of the expected frames, or the given one; NaN where it is undefined.
    without_reference : (j,) ndarray
        Time stamps of `frames` left out since they have no reference pose; with the offset, as the
        reference would have them.
    pose_rows : (m,) ndarray of int
        Row of every estimated pose that has a reference, each once.
    pose_references : (m, 4, 4) ndarray
        The reference of each of these poses, by time stamps at the pose's own time.

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
    lost: float
    expected_rows: Indices
    unit: float
    without_reference: Floats
    pose_rows: Indices
    pose_references: Floats


def match(
    reference: Trajectory,
    estimate: Trajectory,
    *,
    missing: str = "ignore",
    t_max_diff: float = 0.01,
    t_offset: float = 0.0,
    sync: str = "interpolate",
    max_gap: float = 2.0,
    rate: float = 10.0,
    frames: Floats | None = None,
    t_start: float | None = None,
    t_end: float | None = None,
    unit: float | None = None,
) -> Matches:
    """Find the estimated pose that answers for each expected frame of a reference.

    The expected frames depend on the reference and the options alone. By time stamps each pose
    covers half of `max_gap` before and after its own time, and more while the reference stands
    still between two poses: it stays within d and 10 degrees of one of them. A covered frame takes
    the nearest pose, with the reference at the pose's own time; the other frames are lost. A pose
    of nan is none.

    Image names are equal, or have the longest end of their paths in common, where that is unique:
    of any case and slash, at last without the ending of the file. Whole numbers (of frames, or
    stamps in nanoseconds) must be equal; where both are mere row numbers, 0, 1, 2, ... as of KITTI,
    the number of rows must be the same.

    Parameters
    ----------
    reference, estimate : Trajectory
        As returned by the readers of `alignscores.trajectories.files`; or any pair of keys and
        poses, (n, 4, 4) or (n, 3, 4), the keys in an array, a list or a column of pandas.
    missing : {"ignore", "fail"}
        Whether cameras without an estimated pose are left out, or count as failures.
    t_max_diff : float
        Largest difference in seconds of time stamps that count as the same.
    t_offset : float
        Added to the time stamps of the estimate, and to those of `frames`, in seconds.
    sync : {"interpolate", "nearest"}
        Whether a pose is compared with the reference at its own time, interpolated where the
        reference has no gap; or always with the nearest reference pose, within `t_max_diff`.
    max_gap : float
        Largest gap in seconds between two poses that cover all the time between them; 0: each
        frame needs a pose within `t_max_diff`.
    rate : float
        Expected frames a second; the reference's own poses where it is not denser, or if infinite.
        The reference has a gap where two of its poses are more than two steps of the expected
        frames apart.
    frames : (k,) array, optional
        Time stamps of the expected frames, instead of `rate`.
    t_start, t_end : float, optional
        First and last time that is expected, in seconds of the reference.
    unit : float, optional
        d; by default that of the positions of the expected frames.

    Returns
    -------
    Matches
        The poses of both, and how many of them were matched, missing, left out.

    Raises
    ------
    ValueError
        Where the trajectories have no pose in common, or another kind of keys or, by row, another
        length; a tenth of the estimated poses are duplicates; or keys, poses or a setting are
        impossible.

    Warns
    -----
    TrajectoryWarning
        Where the stamps are not in order, keys of the reference are repeated, or images are not
        matched by their paths.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.association import match
    >>> from alignscores.trajectories.files import Trajectory
    >>> poses = np.tile(np.eye(4), (100, 1, 1))
    >>> poses[:, 0, 3] = stamps = np.arange(100) / 10
    >>> keyframes = Trajectory(stamps[5:80:5], poses[5:80:5])
    >>> matches = match(Trajectory(stamps, poses), keyframes, missing="fail", max_gap=1)
    >>> len(matches.keys), matches.missing, matches.lost
    (100, 19, 0.19)
    """
    if missing not in MISSING:
        raise ValueError(f"missing must be one of {list(MISSING)}, not {missing!r}")
    if sync not in SYNCS:
        raise ValueError(f"sync must be one of {list(SYNCS)}, not {sync!r}")
    for name, seconds, least in (
        ("t_max_diff", t_max_diff, 0),
        ("t_offset", t_offset, -inf),
        ("max_gap", max_gap, 0),
        ("t_start", t_start, -inf),
        ("t_end", t_end, -inf),
    ):
        if seconds is None and name in ("t_start", "t_end"):
            continue
        if not isinstance(seconds, Real) or not least <= seconds < inf:
            raise ValueError(f"{name} must be a finite number of seconds, not {seconds!r}")
    if not isinstance(rate, Real) or not rate > 0:
        raise ValueError(f"rate must be a number of frames a second, not {rate!r}")
    reference, estimate = checked(reference, "reference"), checked(estimate, "estimate")
    if reference.keys.dtype.kind == estimate.keys.dtype.kind == "f":
        timing = _Timing(t_max_diff, t_offset, sync, max_gap, rate, frames, t_start, t_end, unit)
        cameras = _cameras_by_time(reference, estimate, timing)
    else:
        cameras = _cameras_by_key(reference, estimate, unit)
    if cameras.duplicate >= MANY_DUPLICATES * len(estimate.keys):
        what = "time stamp" if estimate.keys.dtype.kind == "f" else "name"
        raise ValueError(
            f"{cameras.duplicate} of {len(estimate.keys)} poses of the estimate have the {what} of "
            "another one; write stamps with all their digits, and each pose once"
        )
    estimated = cameras.est_rows >= 0
    shown = estimated | (missing == "fail")
    gt_rows, est_rows = cameras.expected_rows[shown], cameras.est_rows[shown]
    est_poses = estimate.poses[est_rows]
    non_finite = int(np.sum(~finite_rows(est_poses[est_rows >= 0])))
    est_poses[est_rows < 0] = np.nan
    matched = int(estimated.sum())
    return Matches(
        keys=reference.keys[gt_rows],
        gt_poses=cameras.gt_poses[shown],
        est_poses=est_poses,
        gt_rows=gt_rows,
        est_rows=est_rows,
        matched=matched,
        missing=len(estimated) - matched,
        unmatched=cameras.unmatched,
        duplicate=cameras.duplicate,
        non_finite=non_finite,
        lost=1 - matched / len(estimated),
        expected_rows=cameras.expected_rows,
        unit=cameras.unit,
        without_reference=cameras.without_reference,
        pose_rows=cameras.pose_rows,
        pose_references=cameras.pose_references,
    )


def in_order(reference: Trajectory) -> Trajectory:
    """Return a reference as `match` uses it: each key once, finite and in order by time stamps.

    After its warnings of duplicates and disorder `match` has nothing more to warn of.
    """
    reference = checked(reference, "reference")
    finite = finite_rows(reference.poses)
    if not finite.any():
        raise ValueError("the reference has no pose that is finite")
    timed = reference.keys.dtype.kind == "f"  # rows and names keep their number
    rows = _first_rows(reference.keys, "reference", finite if timed else None)
    return Trajectory(reference.keys[rows], reference.poses[rows])


class _Timing(NamedTuple):
    """The arguments of `match` that are about time, and d."""

    t_max_diff: float
    t_offset: float
    sync: str
    max_gap: float
    rate: float
    frames: Floats | None
    t_start: float | None
    t_end: float | None
    unit: float | None


class _Cameras(NamedTuple):
    """The expected frames, by their rows in the reference and in the estimate (or -1)."""

    expected_rows: Indices
    est_rows: Indices
    gt_poses: Floats
    unit: float
    duplicate: int
    unmatched: int
    without_reference: Floats
    pose_rows: Indices
    pose_references: Floats


def _cameras_by_time(reference: Trajectory, estimate: Trajectory, timing: _Timing) -> _Cameras:
    """Find the pose that answers for each expected frame."""
    ref_rows = _first_rows(reference.keys, "reference", finite_rows(reference.poses))
    truth = Trajectory(reference.keys[ref_rows], reference.poses[ref_rows])
    there = present(estimate.poses)
    est_rows = _first_rows(estimate.keys, "estimate", there)
    stamps = estimate.keys[est_rows] + timing.t_offset
    rows, without_reference = _expected_rows(truth.keys, timing)
    frames = Trajectory(truth.keys[rows], truth.poses[rows])
    unit = _unit(frames.poses) if timing.unit is None else timing.unit

    gap = reference_gap(truth.keys, timing.rate) if timing.sync == "interpolate" else 0.0
    at_poses, known = reference_at(truth, stamps, gap=gap, t_max_diff=timing.t_max_diff)
    if not known.any():
        raise _nothing_in_common(truth.keys, estimate.keys[est_rows], timing)
    known_rows = np.flatnonzero(known)
    nearest, covered = covered_frames(
        frames,
        Trajectory(stamps[known], at_poses[known]),
        reach=max(timing.t_max_diff, timing.max_gap / 2),
        unit=np.nan_to_num(unit) if timing.max_gap > 0 else -1.0,  # within which no frame is
    )
    if not covered.any():
        raise _nothing_in_common(frames.keys, estimate.keys[est_rows], timing)
    answering = known_rows[nearest]
    asked = known & _within(stamps, timing)
    return _Cameras(
        expected_rows=ref_rows[rows],
        est_rows=np.where(covered, est_rows[answering], -1),
        gt_poses=np.where(covered[:, None, None], at_poses[answering], frames.poses),
        unit=unit,
        duplicate=int(there.sum()) - len(est_rows),
        unmatched=int(np.sum(~known)),
        without_reference=without_reference,
        pose_rows=est_rows[asked],
        pose_references=at_poses[asked],
    )


def _expected_rows(ref_stamps: Floats, timing: _Timing) -> tuple[Indices, Floats]:
    """Return the rows of the reference that are expected, and the frames that have none."""
    if timing.frames is None:
        rows, without_reference = sampled_rows(ref_stamps, timing.rate), np.empty(0)
    else:
        rows, without_reference = _rows_of_frames(ref_stamps, np.unique(timing.frames), timing)
    rows = rows[_within(ref_stamps[rows], timing)]
    if len(rows) == 0:
        limits = {"t_start": timing.t_start, "t_end": timing.t_end}
        said = " and ".join(f"{name} {at:.6f} s" for name, at in limits.items() if at is not None)
        raise ValueError(
            f"no reference pose is expected with {said}: the reference goes from "
            f"{ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s"
        )
    return rows, without_reference


def _within(stamps: Floats, timing: _Timing) -> Booleans:
    """Return which stamps are from the first to the last time that is expected."""
    low = -inf if timing.t_start is None else timing.t_start
    high = inf if timing.t_end is None else timing.t_end
    return np.asarray((stamps >= low) & (stamps <= high))


def _rows_of_frames(ref_stamps: Floats, frames: Floats, timing: _Timing) -> tuple[Indices, Floats]:
    """Return the rows of the reference nearest to the frames, and the frames that have none."""
    nearest, distance = nearest_stamps(ref_stamps, frames + timing.t_offset)
    near = distance <= timing.t_max_diff
    if not near.any():
        raise ValueError(
            f"no expected frame has a reference pose: the frames go from {frames[0]:.6f} to "
            f"{frames[-1]:.6f} s, the reference from {ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s "
            f"(t_offset {timing.t_offset:g} s, t_max_diff {timing.t_max_diff:g} s)"
            f"{unit_hint(ref_stamps, frames, 'frames')}"
        )
    return np.unique(nearest[near]), frames[~near] + timing.t_offset


def _cameras_by_key(reference: Trajectory, estimate: Trajectory, unit: float | None) -> _Cameras:
    """Find the pose of the same image, frame or row."""
    pairs = _pair(reference.keys, estimate.keys)
    expected = pairs.ref_kept[finite_rows(reference.poses[pairs.ref_kept])]
    est_rows = pairs.est_rows[expected]
    matched = est_rows >= 0
    gt_poses = reference.poses[expected]
    return _Cameras(
        expected_rows=expected,
        est_rows=est_rows,
        gt_poses=gt_poses,
        unit=_unit(gt_poses) if unit is None else unit,
        duplicate=pairs.duplicate,
        unmatched=len(estimate.keys) - pairs.duplicate - int(np.sum(pairs.est_rows >= 0)),
        without_reference=np.empty(0),
        pose_rows=est_rows[matched],
        pose_references=gt_poses[matched],
    )


def _unit(poses: Floats) -> float:
    """Return d of the positions of poses; NaN where it is undefined."""
    try:
        return closest_pair_quartile(poses[:, :3, 3])
    except ValueError:
        return np.nan


class _Pairs(NamedTuple):
    """Which pose of the estimate belongs to each of the reference, and what was left out."""

    est_rows: Indices  # a row of the estimate for each of the reference; -1 where it has none
    ref_kept: Indices  # rows of the reference without duplicates, stamps in order
    duplicate: int  # number of estimated poses left out as duplicates


def _pair(ref_keys: NDArray[Any], est_keys: NDArray[Any]) -> _Pairs:
    """Pair the poses by what their keys are."""
    kinds = ref_keys.dtype.kind, est_keys.dtype.kind
    if kinds[0] != kinds[1]:
        raise ValueError(
            "the two trajectories are not of the same format: the keys of the reference are "
            f"{KEY_KINDS[kinds[0]]}, those of the estimate {KEY_KINDS[kinds[1]]}"
        )
    if kinds == ("i", "i") and _are_row_numbers(ref_keys) and _are_row_numbers(est_keys):
        return _pair_by_row(ref_keys, est_keys)
    return _pair_by_key(ref_keys, est_keys)


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
            same = low * as_long < durations[name] < high * as_long
            if unit != "seconds" and (unit == units[name] or same):
                return f"; those of the {name} seem to be in {unit}: write them in seconds"
    return ""


def _nothing_in_common(ref_stamps: Floats, est_stamps: Floats, timing: _Timing) -> ValueError:
    """Return the error of an estimate without a pose near one of the reference."""
    return ValueError(
        f"no time stamps in common: the reference goes from {ref_stamps[0]:.6f} to "
        f"{ref_stamps[-1]:.6f} s, the estimate from {est_stamps[0]:.6f} to {est_stamps[-1]:.6f} s "
        f"(t_offset {timing.t_offset:g} s, t_max_diff {timing.t_max_diff:g} s)"
        f"{_stamps_hint(ref_stamps, est_stamps, timing.t_offset)}"
    )


def _stamps_hint(ref_stamps: Floats, est_stamps: Floats, offset: float) -> str:
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
    shifted = est_stamps + offset
    shifted = shifted[(shifted >= ref_stamps[0]) & (shifted <= ref_stamps[-1])]
    if len(shifted):
        distance = float(np.median(nearest_stamps(ref_stamps, shifted)[1]))
        return (
            f"; the nearest ones are usually {distance:.4f} s apart: --t_offset moves those of the "
            "estimate, a larger --t_max_diff takes them for the same"
        )
    return ""


def checked(trajectory: Trajectory, whose: str) -> Trajectory:
    """Return a trajectory as of a reader, also of keys in a list and of poses (n, 3, 4)."""
    try:
        keys, poses = np.asarray(trajectory.keys), np.asarray(trajectory.poses)
    except ValueError:
        raise ValueError(f"the keys or poses of the {whose} are not a regular array") from None
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
        if len(keys) > 1 and keys.min() == keys.max():
            raise ValueError(f"all {len(keys)} time stamps of the {whose} are the same")
    if poses.shape != (len(keys), 4, 4):
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(keys), 1, 4))
        poses = np.concatenate([poses, last], axis=1)
    return Trajectory(keys, np.asarray(poses, dtype=np.float64))


def _are_row_numbers(keys: NDArray[Any]) -> bool:
    return np.array_equal(keys, np.arange(len(keys)))


def _pair_by_key(ref_keys: NDArray[Any], est_keys: NDArray[Any]) -> _Pairs:
    ref_kept, est_kept = _first_rows(ref_keys, "reference"), _first_rows(est_keys, "estimate")
    ref, est = ref_keys[ref_kept].tolist(), est_keys[est_kept].tolist()
    names = ref_keys.dtype.kind == "U"
    pairs = _unique_pairs(ref, est)
    if names and (by_end := _pairs_by_end(ref, est, pairs)):
        first, second = ref[by_end[0][0]], est[by_end[0][1]]
        some = f"{len(by_end)} of {len(ref)} images" if pairs else "images"
        _warn(f"{some} are matched by the end of their path: {first!r} and {second!r}")
        pairs += by_end
    if not pairs:
        what = "image names" if names else "frame numbers"
        hint = ", not even a file name without its ending that is unique" if names else ""
        raise ValueError(
            f"no {what} in common: the reference has {ref[0]!r}, the estimate {est[0]!r}, for "
            f"example{hint}"
        )
    ref_rows, matching_rows = np.transpose(pairs)
    est_rows = np.full(len(ref_keys), -1)
    est_rows[ref_kept[ref_rows]] = est_kept[matching_rows]
    return _Pairs(est_rows, ref_kept, len(est_keys) - len(est_kept))


def _pairs_by_end(
    ref: Sequence[str], est: Sequence[str], pairs: Sequence[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Pair the other images by the longest end that their paths have in common.

    Case and kind of slash are no difference, nor, at last, is the ending of the file. Such an end
    must be unique. Where neither path is the end of the other one, two folders that differ are
    taken for one by more images than either shares with another folder.
    """
    paths = [[tuple(re.split(r"[\\/]", name.casefold())) for name in names] for names in (ref, est)]
    left = set(range(len(ref)))  # of two images that are a pair each is the other's at every end
    shared: Counter[tuple[int, tuple[str, ...]]] = Counter()
    found: list[tuple[int, int]] = []

    def take(taken: Sequence[tuple[int, int]]) -> None:
        for pair in taken:
            left.discard(pair[0])
            for side, row in enumerate(pair):
                shared[side, paths[side][row][:-1]] += 1

    take(pairs)
    longest = max(map(len, paths[1]))
    for ending, length in [(True, n) for n in range(longest, 0, -1)] + [(False, 1)]:
        ends = [
            {row: _end(path, length, ending) for row, path in enumerate(of) if len(path) >= length}
            for of in paths
        ]
        rows = [list(of) for of in ends]
        new = [
            (rows[0][i], rows[1][j])
            for i, j in _unique_pairs(*(list(of.values()) for of in ends))
            if rows[0][i] in left
        ]
        whole = [pair for pair in new if length in (len(paths[0][pair[0]]), len(paths[1][pair[1]]))]
        folders: dict[Any, list[tuple[int, int]]] = {}
        for pair in new:
            if pair not in whole:
                folder = tuple(paths[side][row][:-1] for side, row in enumerate(pair))
                folders.setdefault(folder, []).append(pair)
        take(whole)
        found += whole
        for folder, alike in sorted(folders.items(), key=lambda item: -len(item[1])):
            if len(alike) > max(shared[side, of] for side, of in enumerate(folder)):
                take(alike)
                found += alike
    return sorted(found)


def _end(path: tuple[str, ...], length: int, ending: bool) -> tuple[str, ...]:
    """Return the last parts of a path, with or without the ending of the file."""
    last = path[-1] if ending else PurePosixPath(path[-1]).stem
    return (*path[-length:-1], last)


def _unique_pairs(ref_keys: Sequence[Any], est_keys: Sequence[Any]) -> list[tuple[int, int]]:
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


def present(poses: Floats) -> Booleans:
    """Return which poses are there: a row of nan says no more than one that is left out.

    Where all are nan, all are there and fail.
    """
    there = ~np.asarray(np.isnan(poses[:, :3]).all(axis=(1, 2)))
    there |= not there.any()
    return there


def _first_rows(keys: NDArray[Any], whose: str, there: Booleans | None = None) -> Indices:
    """Return the first row of each key that is there; of time stamps, in their order."""
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
    if there is not None:
        rows = rows[there[rows]]
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
