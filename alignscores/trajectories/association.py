"""Which estimated pose belongs to which reference pose: by time, by image name or by row."""

import re
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..translation import closest_pair_quartile
from ..validation import finite_rows
from .files import Trajectory, TrajectoryWarning
from .files.stamps import time_unit
from .timeline import covered_frames, nearest_stamps, reference_at, reference_gap, sampled_rows

__all__ = [
    "MISSING",
    "SYNCS",
    "Matches",
    "Timing",
    "checked",
    "in_order",
    "match",
    "unit_hint",
    "warn",
]

MISSING = ("fail", "ignore")
SYNCS = ("interpolate", "nearest")
KEY_KINDS = {"f": "time stamps in seconds (float)", "U": "names (str)", "i": "frame numbers (int)"}


@dataclass(frozen=True, eq=False)
class Timing:
    """How poses with time stamps are matched: the settings of the same names.

    Stamps are in seconds; a rate of inf expects every pose of the reference.
    """

    t_max_diff: float = 0.01
    sync: str = "interpolate"
    max_gap: float = 2.0
    rate: float = 10.0
    frames: Floats | None = None
    t_start: float | None = None
    t_end: float | None = None

    def includes(self, stamps: Floats) -> Booleans:
        """Return which stamps (n,) are from the first to the last time that is expected."""
        low = -inf if self.t_start is None else self.t_start
        high = inf if self.t_end is None else self.t_end
        return np.asarray((stamps >= low) & (stamps <= high))


@dataclass(frozen=True, eq=False)
class Matches:
    """Reference and estimated poses, row by row the same frame, ready to be scored."""

    keys: NDArray[Any]  # time stamps, image names or row numbers of the reference
    gt_poses: Floats
    est_poses: Floats  # not finite where there is none
    gt_rows: Indices
    est_rows: Indices  # -1 where there is none
    expected_rows: Indices  # of the reference, scored or not
    unit: float  # d of the expected frames, or the given one; NaN where it is undefined
    unmatched: int  # estimated poses without a reference pose
    duplicate: int  # estimated poses whose stamp or name another one has first
    without_reference: Floats  # stamps of `Timing.frames` without a reference pose
    pose_rows: Indices  # every estimated pose that has a reference, each once
    pose_references: Floats  # the reference of each, by time stamps at the pose's own time

    @property
    def matched(self) -> int:
        """Number of expected frames with an estimated pose, finite or not."""
        return int(np.sum(self.est_rows >= 0))

    @property
    def n_poses(self) -> int:
        """Number of estimated poses that these have."""
        return len(np.unique(self.est_rows[self.est_rows >= 0]))

    @property
    def non_finite(self) -> int:
        """Number of matched frames whose estimated pose is not finite."""
        return int(np.sum(~finite_rows(self.est_poses[self.est_rows >= 0])))


def match(
    reference: Trajectory,
    estimate: Trajectory,
    timing: Timing | None = None,
    *,
    missing: str = "ignore",
    unit: float | None = None,
) -> Matches:
    """Return the estimated pose of each expected frame of a reference.

    The expected frames depend on the reference and the options alone. By time stamps each pose
    covers half of ``Timing.max_gap`` before and after its own time, and more while the reference
    stands still between two poses: it stays within d and 10 degrees of one of them. A covered frame
    takes the nearest pose, with the reference at the pose's own time; the other frames are lost. A
    pose of NaN is none.

    Image names are equal. If no two are, they match by the longest ending of their paths that any
    two have in common and that is unique, whatever the case and the slashes; at last by the file
    name without its extension. Whole numbers (of frames, or stamps that are whole) must be equal;
    where both are mere row numbers, 0, 1, 2, ... as of KITTI, the number of rows must be the same.

    Warn where stamps are not in order, keys of the reference are repeated, or images do not match
    by their names. Raise ValueError where nothing matches, or keys or poses are malformed.
    """
    reference, estimate = checked(reference, "reference"), checked(estimate, "estimate")
    if reference.keys.dtype.kind == estimate.keys.dtype.kind == "f":
        matches = _by_time(reference, estimate, timing or Timing(), unit)
    else:
        matches = _by_key(reference, estimate, unit)
    if matches.duplicate >= len(estimate.keys) / 10:
        what = "time stamp" if estimate.keys.dtype.kind == "f" else "name"
        raise ValueError(
            f"{matches.duplicate} of {len(estimate.keys)} poses of the estimate have the {what} of "
            "another one; write stamps with all their digits, and each pose once"
        )
    if missing == "fail":
        return matches
    scored = matches.est_rows >= 0
    names = "keys", "gt_poses", "est_poses", "gt_rows", "est_rows"
    return replace(matches, **{name: getattr(matches, name)[scored] for name in names})


def in_order(reference: Trajectory) -> Trajectory:
    """Return a reference as `match` uses it: each key once, finite and in order by time stamps.

    After its warnings of duplicates and disorder `match` has nothing more to warn of.
    """
    reference = checked(reference, "reference")
    finite = finite_rows(reference.with_rotations().poses)
    if not finite.any():
        raise ValueError("the reference has no pose that is finite")
    timed = reference.keys.dtype.kind == "f"  # rows and names keep their number
    rows = _first_rows(reference.keys, "reference", finite if timed else None)
    return Trajectory(reference.keys[rows], reference.poses[rows])


def _by_time(
    reference: Trajectory, estimate: Trajectory, timing: Timing, unit: float | None
) -> Matches:
    """Find the pose that covers each expected frame."""
    ref_rows = _first_rows(reference.keys, "reference", finite_rows(reference.poses))
    truth = Trajectory(reference.keys[ref_rows], reference.poses[ref_rows])
    present = _present(estimate.poses)
    est_rows = _first_rows(estimate.keys, "estimate", present)
    stamps = estimate.keys[est_rows]
    rows, without_reference = _expected_rows(truth.keys, timing)
    frames = Trajectory(truth.keys[rows], truth.poses[rows])
    unit = _unit(frames.poses) if unit is None else unit

    gap = reference_gap(truth.keys, timing.rate) if timing.sync == "interpolate" else 0.0
    at_poses, has_reference = reference_at(truth, stamps, gap=gap, t_max_diff=timing.t_max_diff)
    if not has_reference.any():
        raise _nothing_in_common(truth.keys, stamps, timing)
    nearest, covered = covered_frames(
        frames,
        Trajectory(stamps[has_reference], at_poses[has_reference]),
        reach=max(timing.t_max_diff, timing.max_gap / 2),
        unit=np.nan_to_num(unit) if timing.max_gap > 0 else -1.0,  # within which no frame is
    )
    if not covered.any():
        raise _nothing_in_common(frames.keys, stamps, timing)
    covering = np.flatnonzero(has_reference)[nearest]
    within = has_reference & timing.includes(stamps)
    return Matches(
        keys=frames.keys,
        gt_poses=np.where(covered[:, None, None], at_poses[covering], frames.poses),
        est_poses=np.where(covered[:, None, None], estimate.poses[est_rows[covering]], np.nan),
        gt_rows=ref_rows[rows],
        est_rows=np.where(covered, est_rows[covering], -1),
        expected_rows=ref_rows[rows],
        unit=unit,
        unmatched=int(np.sum(~has_reference)),
        duplicate=int(present.sum()) - len(est_rows),
        without_reference=without_reference,
        pose_rows=est_rows[within],
        pose_references=at_poses[within],
    )


def _expected_rows(ref_stamps: Floats, timing: Timing) -> tuple[Indices, Floats]:
    """Return the rows of the reference that are expected, and the frames that have none."""
    if timing.frames is None:
        rows, without_reference = sampled_rows(ref_stamps, timing.rate), np.empty(0)
    else:
        rows, without_reference = _rows_of_frames(ref_stamps, np.unique(timing.frames), timing)
    rows = rows[timing.includes(ref_stamps[rows])]
    if len(rows) == 0:
        limits = {"t_start": timing.t_start, "t_end": timing.t_end}
        shown = " and ".join(f"{name} {at:.6f} s" for name, at in limits.items() if at is not None)
        raise ValueError(
            f"no reference pose is expected with {shown}: the reference goes from "
            f"{ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s"
        )
    return rows, without_reference


def _rows_of_frames(ref_stamps: Floats, frames: Floats, timing: Timing) -> tuple[Indices, Floats]:
    """Return the rows of the reference nearest to the frames, and the frames that have none."""
    nearest, distance = nearest_stamps(ref_stamps, frames)
    near = distance <= timing.t_max_diff
    if not near.any():
        raise ValueError(
            f"no expected frame has a reference pose: the frames go from {frames[0]:.6f} to "
            f"{frames[-1]:.6f} s, the reference from {ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s "
            f"(t_max_diff {timing.t_max_diff:g} s){unit_hint(ref_stamps, frames, 'frames')}"
        )
    return np.unique(nearest[near]), frames[~near]


def _by_key(reference: Trajectory, estimate: Trajectory, unit: float | None) -> Matches:
    """Find the pose of the same image, frame or row."""
    kinds = reference.keys.dtype.kind, estimate.keys.dtype.kind
    if {*kinds} == {"f", "i"}:
        reference, estimate = _with_numbers(reference), _with_numbers(estimate)
        kinds = reference.keys.dtype.kind, estimate.keys.dtype.kind
    if kinds[0] != kinds[1]:
        raise ValueError(
            f"the reference has {KEY_KINDS[kinds[0]]}, the estimate {KEY_KINDS[kinds[1]]}: write "
            "a column of the same kind into both (--columns names it)"
        )
    ref_rows = _first_rows(reference.keys, "reference")
    est_rows = _first_rows(estimate.keys, "estimate")
    partners = _partners(reference.keys[ref_rows], estimate.keys[est_rows])
    finite = finite_rows(reference.poses[ref_rows])
    expected, partners_expected = ref_rows[finite], partners[finite]
    matched = partners_expected >= 0
    rows = np.where(matched, est_rows[partners_expected], -1)
    gt_poses = reference.poses[expected]
    return Matches(
        keys=reference.keys[expected],
        gt_poses=gt_poses,
        est_poses=np.where(matched[:, None, None], estimate.poses[rows], np.nan),
        gt_rows=expected,
        est_rows=rows,
        expected_rows=expected,
        unit=_unit(gt_poses) if unit is None else unit,
        unmatched=len(est_rows) - int(np.sum(partners >= 0)),
        duplicate=len(estimate.keys) - len(est_rows),
        without_reference=np.empty(0),
        pose_rows=rows[matched],
        pose_references=gt_poses[matched],
    )


def _with_numbers(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory with numbers of frames where its stamps are whole numbers."""
    numbers = np.round(trajectory.keys)
    whole = (numbers == trajectory.keys).all()
    return trajectory._replace(keys=numbers.astype(np.int64)) if whole else trajectory


def _unit(poses: Floats) -> float:
    """Return d of the positions of poses; NaN where it is undefined."""
    try:
        return closest_pair_quartile(poses[:, :3, 3])
    except ValueError:
        return np.nan


def _partners(ref_keys: NDArray[Any], est_keys: NDArray[Any]) -> Indices:
    """Return the index of the estimate's key for each of the reference; -1 where it has none."""
    are_rows = [np.array_equal(keys, np.arange(len(keys))) for keys in (ref_keys, est_keys)]
    if ref_keys.dtype.kind == "i" and all(are_rows):
        if len(ref_keys) != len(est_keys):
            raise ValueError(
                f"the reference has {len(ref_keys)} poses, the estimate {len(est_keys)}: without "
                "stamps or names they correspond row by row, so their number must be the same "
                "(write a row of nan for each frame that was lost)"
            )
        return np.arange(len(ref_keys))
    ref, est = ref_keys.tolist(), est_keys.tolist()
    partners = np.full(len(ref), -1)
    names = ref_keys.dtype.kind == "U"
    for whole, ref_ends, est_ends in [(True, ref, est), *(_endings(ref, est) if names else ())]:
        if pairs := _unique_pairs(ref_ends, est_ends):
            rows, partners_of_rows = np.transpose(pairs)
            partners[rows] = partners_of_rows
            if not whole:
                first, second = ref[rows[0]], est[partners_of_rows[0]]
                warn(f"images are matched by the end of their path: {first!r} and {second!r}")
            return partners
    what = "image names" if names else "frame numbers"
    raise ValueError(
        f"no {what} in common: the reference has {ref[0]!r}, the estimate {est[0]!r}, for example"
    )


def _endings(ref: Sequence[str], est: Sequence[str]) -> Iterator[tuple[bool, list[Any], list[Any]]]:
    """Yield the ends of all paths, the longest first, at last the file names without extension."""
    paths = [[re.split(r"[\\/]", name.casefold()) for name in names] for names in (ref, est)]
    for length in range(max(len(path) for of in paths for path in of), 0, -1):
        ends = [[tuple(path[-length:]) for path in of] for of in paths]
        yield False, ends[0], ends[1]
    stems = [[PurePosixPath(path[-1]).stem for path in of] for of in paths]
    yield False, stems[0], stems[1]


def _unique_pairs(ref_keys: Sequence[Any], est_keys: Sequence[Any]) -> list[tuple[int, int]]:
    """Return the positions of equal keys, of those that occur once."""
    once = [
        {key: row for row, key in enumerate(keys) if count[key] == 1}
        for keys, count in ((keys, Counter(keys)) for keys in (ref_keys, est_keys))
    ]
    return [(row, once[1][key]) for key, row in once[0].items() if key in once[1]]


def unit_hint(ref_stamps: Floats, est_stamps: Floats, whose: str = "estimate") -> str:
    """Return the end of a message, which says whose stamps are not in seconds, if any are not."""
    for name, stamps in (("reference", ref_stamps), (whose, est_stamps)):
        if (unit := time_unit(stamps)) != "seconds":
            return f"; the stamps of the {name} seem to be in {unit}: write them in seconds"
    return ""


def _nothing_in_common(ref_stamps: Floats, est_stamps: Floats, timing: Timing) -> ValueError:
    """Return the error of an estimate without a pose near one of the reference."""
    return ValueError(
        f"no time stamps in common: the reference goes from {ref_stamps[0]:.6f} to "
        f"{ref_stamps[-1]:.6f} s, the estimate from {est_stamps[0]:.6f} to {est_stamps[-1]:.6f} s "
        f"(t_max_diff {timing.t_max_diff:g} s){_stamps_hint(ref_stamps, est_stamps)}"
    )


def _stamps_hint(ref_stamps: Floats, est_stamps: Floats) -> str:
    """Return the end of a message: what to do about stamps that have nothing in common."""
    if hint := unit_hint(ref_stamps, est_stamps):
        return hint
    inside = est_stamps[(est_stamps >= ref_stamps[0]) & (est_stamps <= ref_stamps[-1])]
    if not len(inside):
        return "; if their clocks differ, --t_offset auto finds the offset"
    distance = float(np.median(nearest_stamps(ref_stamps, inside)[1]))
    return (
        f"; the nearest ones are usually {distance:.4f} s apart: --t_offset moves the "
        "stamps of the estimate, a larger --t_max_diff accepts them"
    )


def checked(trajectory: Trajectory, whose: str) -> Trajectory:
    """Return a trajectory with arrays (n,) and (n, 4, 4); raise a ValueError where it has none."""
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


def _present(poses: Floats) -> Booleans:
    """Return which poses are not all NaN, which is no pose; all of them where all are NaN."""
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
            warn(
                f"the time stamps of the {whose} are not in order (first at pose {row + 1}, "
                f"{keys[row]:.6f} s); sorted"
            )
        rows = np.argsort(keys, kind="stable")
    if there is not None:
        rows = rows[there[rows]]
    first = rows[np.sort(np.unique(keys[rows], return_index=True)[1])]
    if whose == "reference" and len(first) < len(rows):
        warn(f"duplicate stamps or names in the reference, left out: {len(rows) - len(first)}")
    return first


def warn(message: str) -> None:
    """Warn of what is unusual in a trajectory."""
    warnings.warn(message, TrajectoryWarning, stacklevel=4)
