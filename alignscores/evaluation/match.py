"""Match estimated to reference poses: by time, by image name or by row."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from os import PathLike
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..io import Trajectory, read_stamps
from ..translation import NEGLIGIBLE
from ..validation import finite_rows
from .reading import KEY_KINDS, check_duplicates, first_rows, warn
from .rigs import rig_frames as rig_frames_by_names
from .rigs import unit_of
from .settings import Settings
from .time import (
    chord_error,
    covered_frames,
    nearest_stamps,
    poses_at,
    reference_at,
    reference_gap,
    sampled_rows,
)

__all__ = [
    "Matches",
    "ReferenceFaultError",
    "check_reference",
    "check_scorable",
    "match",
    "no_clock",
    "poses_of_rows",
    "with_stamps_of_sparse",
]

SPARSE_STEP = 0.11  # seconds between poses: a reference slower than the default rate
MAX_CHORD = 0.02  # RMS error of straight lines between reference poses, in units of d
EVO_T_MAX_DIFF = 0.01  # seconds
MIN_STEP = 1e-4  # seconds; smaller ones are no camera's
MIN_POSES, MIN_SHARE = 4, 0.05  # with a reference, below which an estimate is refused


class ReferenceFaultError(ValueError):
    """A reference against which no estimate can be scored."""


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
    without_reference: Floats  # stamps of `Settings.frames` without a reference pose
    pose_rows: Indices  # every estimated pose that has a reference, each once
    pose_references: Floats  # the reference of each, by time stamps at the pose's own time
    n_rig_frames: int = 0  # which d counts as one camera each; 0 where each camera counts
    has_rotations: bool = True  # of both; otherwise they are the identity

    @property
    def timed(self) -> bool:
        """Whether poses were matched by their time stamps."""
        return self.keys.dtype.kind == "f"

    @property
    def matched(self) -> int:
        """Number of expected frames with an estimated pose, finite or not."""
        return int(np.sum(self.est_rows >= 0))

    @property
    def n_poses(self) -> int:
        """Number of estimated poses that these have."""
        return len(np.unique(self.est_rows[self.est_rows >= 0]))


def match(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    groups: Indices | None = None,
) -> Matches:
    """Return the estimated pose of each expected frame of a reference, as `read_reference` has it.

    The expected frames depend only on the reference and the settings. By time stamps each pose
    covers half of ``max_gap`` before and after its own time, and more while the reference stands
    still between two poses: it stays within d and 10 degrees of one of them. A covered frame takes
    the nearest pose, with the reference at the pose's own time; the other frames are lost. A row
    without any finite number is no pose.

    `groups` are labels of the reference's rows, the same for cameras of one rig frame; without them
    the names of images have them.

    Image names are equal. If no two are, they match by the longest ending of their paths that any
    two have in common and that is unique, whatever the case and the slashes; at last by the file
    name without its extension. Whole numbers (of frames, or stamps that are whole) must be equal;
    where both are mere row numbers, 0, 1, 2, ... as of KITTI, the number of rows must be the same.

    Warn where stamps are not in order, or images do not match by their names. Raise ValueError
    where nothing matches.
    """
    if reference.keys.dtype.kind == estimate.keys.dtype.kind == "f":
        matches = _by_time(reference, estimate, settings, groups)
    else:
        matches = _by_key(reference, estimate, settings, groups)
    n = len(estimate.keys)
    check_duplicates(n, n - matches.duplicate, matches.keys, "estimate")
    if settings.missing == "fail":
        return matches
    scored = (matches.est_rows >= 0) & _present(matches.est_poses)
    names = "keys", "gt_poses", "est_poses", "gt_rows", "est_rows"
    return replace(matches, **{name: getattr(matches, name)[scored] for name in names})


def check_scorable(
    reference: Trajectory, estimate: Trajectory, matches: Matches, settings: Settings, n: int
) -> None:
    """Raise a ValueError that says what to do where poses are too few, or d is undefined.

    The file of the estimate has n poses, those between the stamps of a sparse reference, too.
    """
    n_poses = matches.n_poses
    share = 1 - matches.unmatched / max(len(estimate.keys) - matches.duplicate, 1)
    covered = matches.matched / len(matches.expected_rows)
    too_few_poses = n_poses < min(MIN_POSES, len(matches.expected_rows))
    # Poses may be closer together than frames, not than the reference.
    if too_few_poses and matches.timed:
        nearest, _ = nearest_stamps(reference.keys, estimate.keys[matches.pose_rows])
        n_poses = len(np.unique(nearest))
        too_few_poses = n_poses < min(MIN_POSES, len(matches.expected_rows))
    if too_few_poses or (share < MIN_SHARE and covered < MIN_SHARE):
        options = f"--missing {settings.missing}"
        if matches.timed:
            options += f", --t_max_diff {settings.t_max_diff:g}, --max_gap {settings.max_gap:g}"
        needed = f"{MIN_POSES} poses are" if too_few_poses else f"{MIN_SHARE:.0%} of either is"
        raise ValueError(
            f"only {n_poses} of {n} poses could be matched to the reference, for {covered:.1%} of "
            f"the expected frames; at least {needed} needed ({options})"
        )
    if np.isnan(matches.unit):
        n, what = len(matches.expected_rows), "poses"
        if matches.n_rig_frames:
            n, what = matches.n_rig_frames, "rig frames"
        remedy = "--unit sets it"
        positions = reference.positions
        if n > 1 and (positions == positions[0]).all():
            text = f"the reference stands still: all of its {n} {what} have one position"
            raise ReferenceFaultError(text)
        if n < 4:
            verb = "is" if n == 1 else "are"
            reason = f"{n} of the reference's {what} {verb} expected; at least 4 are needed"
            if matches.timed:
                reason += f" (it lasts {np.ptp(reference.keys):.3g} s)"
        elif far := _far_pose(reference, matches.expected_rows):
            reason, remedy = f"{far} is far away from the others", f"leave it out, or {remedy}"
        else:
            reason = f"at least three quarters of the reference {what} coincide with another one"
            if matches.keys.dtype.kind == "U" and what == "poses":
                remedy += ", or --rig_frames says which are cameras of one rig"
        raise ReferenceFaultError(f"d cannot be derived: {reason}; {remedy}")


def _far_pose(reference: Trajectory, rows: Indices) -> str:
    """Return the farthest pose in words if it is too far away for d, or an empty string.

    Against its distance d of the nearest three quarters is negligible.
    """
    rows = rows[finite_rows(reference.positions[rows])]
    positions = reference.positions[rows]
    distances = np.linalg.norm(positions - np.median(positions, axis=0), axis=1)
    order = np.argsort(distances)
    unit = unit_of(positions[order[: -(-3 * len(rows) // 4)]], None)
    if not unit < NEGLIGIBLE * distances[order[-1]]:
        return ""
    key, position = reference.keys[rows[order[-1]]], positions[order[-1]]
    pose = f"at {key:.6f} s" if reference.keys.dtype.kind == "f" else f"{key!s}"
    return f"the reference's pose {pose}, ({', '.join(f'{x:.4g}' for x in position)}),"


def check_reference(
    reference: Trajectory, settings: Settings, groups: Indices | None = None
) -> None:
    """Raise a ValueError where not even the reference itself could be scored as an estimate."""
    poses = reference.with_rotations()
    matches = match(poses, poses, settings, groups)
    check_scorable(poses, poses, matches, settings, len(poses.keys))


def with_stamps_of_sparse(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    groups: Indices | None = None,
) -> tuple[Trajectory, Settings, float]:
    """Return an estimate at the stamps of a reference that is too sparse to be interpolated.

    The third value is the RMS error of straight lines between its poses, in units of d; zero where
    these are used. The rule depends on the reference and the settings only.
    """
    if settings.sync != "auto" or not reference.keys.dtype.kind == estimate.keys.dtype.kind == "f":
        return estimate, settings, 0.0
    if len(reference.keys) < MIN_POSES or np.median(np.diff(reference.keys)) < SPARSE_STEP:
        return estimate, settings, 0.0
    rows, _ = _expected_rows(reference.keys, settings)
    unit = _unit(reference.positions[rows], settings, _of_rows(groups, rows))
    gap = reference_gap(reference.keys, settings.frames_per_second)
    chord = chord_error(reference, gap) / unit
    if not chord > MAX_CHORD:
        return estimate, settings, 0.0
    present = first_rows(estimate.keys, _present(estimate.poses), "estimate")
    at_stamps = poses_at(
        reference.keys,
        Trajectory(estimate.keys[present], estimate.poses[present]),
        near=min(settings.t_max_diff, EVO_T_MAX_DIFF),
        t_max_diff=settings.t_max_diff,
    )
    return at_stamps if len(at_stamps.keys) else estimate, replace(settings, sync="nearest"), chord


def no_clock(ref_stamps: Floats, est_stamps: Floats) -> str:
    """Return the reason why the stamps of either file are no times, or an empty string."""
    for whose, stamps in (("the reference's", ref_stamps), ("its", est_stamps)):
        step = np.median(np.diff(np.sort(stamps))) if len(stamps) > 1 else np.inf
        if step < MIN_STEP:
            return (
                f"; {whose} stamps are {step:.2g} s apart, those of no camera: no --t_offset helps"
            )
    return ""


def poses_of_rows(estimate: Trajectory, rows: Indices) -> Floats:
    """Return the poses of an estimate in some rows; NaN for a row of -1."""
    return np.where((rows >= 0)[:, None, None], estimate.poses[rows], np.nan)


def _by_time(
    reference: Trajectory, estimate: Trajectory, settings: Settings, groups: Indices | None
) -> Matches:
    """Find the pose that covers each expected frame."""
    _check_seconds(reference.keys, estimate.keys, settings)
    rows, without_reference = _expected_rows(reference.keys, settings)
    frames = Trajectory(reference.keys[rows], reference.poses[rows])
    rig_frames = _of_rows(groups, rows)
    unit = _unit(frames.positions, settings, rig_frames)

    present = _present(estimate.poses)
    all_rows = first_rows(estimate.keys, present, "estimate")
    stamps = estimate.keys[all_rows]
    nearest_only, t_max_diff = settings.sync == "nearest", settings.t_max_diff
    gap = 0.0 if nearest_only else reference_gap(reference.keys, settings.frames_per_second)
    at_poses, has_reference = reference_at(reference, stamps, gap=gap, t_max_diff=t_max_diff)
    if not has_reference.any():
        raise _nothing_in_common(reference.keys, stamps, t_max_diff)
    est_rows, at_poses = all_rows[has_reference], at_poses[has_reference]
    nearest, covered = covered_frames(
        frames,
        Trajectory(estimate.keys[est_rows], at_poses),
        reach=max(t_max_diff, settings.max_gap / 2),
        unit=np.nan_to_num(unit) if settings.max_gap > 0 else -1.0,  # within which no frame is
    )
    if not covered.any():
        raise _nothing_in_common(frames.keys, stamps, t_max_diff)
    covering = np.where(covered, est_rows[nearest], -1)
    within = _is_expected(estimate.keys[est_rows], settings)
    if nearest_only and len(est_rows) > len(reference.keys):  # as evo: a pose a reference pose
        within &= _is_nearest(reference.keys, estimate.keys[est_rows])
    return Matches(
        keys=frames.keys,
        gt_poses=np.where(covered[:, None, None], at_poses[nearest], frames.poses),
        est_poses=poses_of_rows(estimate, covering),
        gt_rows=rows,
        est_rows=covering,
        expected_rows=rows,
        unit=unit,
        n_rig_frames=_n_rig_frames(rig_frames, settings),
        unmatched=len(all_rows) - len(est_rows),
        duplicate=int(present.sum()) - len(all_rows),
        without_reference=without_reference,
        pose_rows=est_rows[within],
        pose_references=at_poses[within],
    )


def _check_seconds(ref_stamps: Floats, est_stamps: Floats, settings: Settings) -> None:
    """Raise a ValueError for seconds that the recording has not, as those of another unit."""
    recording = float(max(np.ptp(ref_stamps), np.ptp(est_stamps)))
    for name in ("t_max_diff", "max_gap", "t_offset"):
        value = getattr(settings, name)
        if value in ("auto", getattr(Settings, name)) or abs(value) <= recording:
            continue
        if name == "t_offset" and max(ref_stamps[0], est_stamps.min()) <= min(
            ref_stamps[-1], est_stamps.max()
        ):  # another clock
            continue
        raise ValueError(
            f"{name} is in seconds, and {value:g} s are longer than the recording of "
            f"{recording:.6g} s"
        )


def _expected_rows(ref_stamps: Floats, settings: Settings) -> tuple[Indices, Floats]:
    """Return the rows of the reference that are expected, and the frames that have none."""
    if settings.frames is None:
        rows, without_reference = sampled_rows(ref_stamps, settings.frames_per_second), np.empty(0)
    else:
        rows, without_reference = _rows_of_frames(ref_stamps, settings)
    rows = rows[_is_expected(ref_stamps[rows], settings)]
    if len(rows) == 0:
        limits = {"t_start": settings.t_start, "t_end": settings.t_end}
        limits_text = " and ".join(
            f"{name} {at:.6f} s" for name, at in limits.items() if at is not None
        )
        raise ValueError(
            f"no reference pose is expected with {limits_text}: the reference goes from "
            f"{ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s"
        )
    return rows, without_reference


def _rows_of_frames(ref_stamps: Floats, settings: Settings) -> tuple[Indices, Floats]:
    """Return the rows of the reference nearest to the frames, and the frames that have none."""
    frames = settings.frames
    stamps = read_stamps(frames) if isinstance(frames, (str, PathLike)) else np.array(frames)
    stamps = np.unique(stamps + float(settings.t_offset))
    nearest, distance = nearest_stamps(ref_stamps, stamps)
    near = distance <= settings.t_max_diff
    if not near.any():
        raise ValueError(
            f"no expected frame has a reference pose: the frames go from {stamps[0]:.6f} to "
            f"{stamps[-1]:.6f} s, the reference from {ref_stamps[0]:.6f} to {ref_stamps[-1]:.6f} s "
            f"(t_max_diff {settings.t_max_diff:g} s)"
        )
    return np.unique(nearest[near]), stamps[~near]


def _is_expected(stamps: Floats, settings: Settings) -> Booleans:
    """Return which stamps are from the first to the last time that is expected."""
    low = -inf if settings.t_start is None else settings.t_start
    high = inf if settings.t_end is None else settings.t_end
    return np.asarray((stamps >= low) & (stamps <= high))


def _is_nearest(ref_stamps: Floats, stamps: Floats) -> Booleans:
    """Return which poses are, of those with the same nearest reference pose, the nearest to it."""
    partners, distance = nearest_stamps(ref_stamps, stamps)
    order = np.lexsort((distance, partners))
    nearest = np.zeros(len(stamps), dtype=bool)
    nearest[order[np.unique(partners[order], return_index=True)[1]]] = True
    return nearest


def _present(poses: Floats) -> Booleans:
    """Return which poses have any finite number; all poses if none has."""
    present = np.asarray(np.isfinite(poses[:, :3]).any(axis=(1, 2)))
    return present if present.any() else ~present


def _of_rows(groups: Indices | None, rows: Indices) -> Indices | None:
    return None if groups is None else groups[rows]


def _n_rig_frames(rig_frames: Indices | None, settings: Settings) -> int:
    """Return how many rig frames d counts as one camera each."""
    return 0 if rig_frames is None or settings.unit is not None else len(np.unique(rig_frames))


def _unit(positions: Floats, settings: Settings, rig_frames: Indices | None = None) -> float:
    """Return d of the positions unless it is set; NaN where it is undefined."""
    return unit_of(positions, rig_frames) if settings.unit is None else settings.unit


def _nothing_in_common(ref_stamps: Floats, est_stamps: Floats, t_max_diff: float) -> ValueError:
    """Return the error of an estimate without a pose near one of the reference."""
    inside = est_stamps[(est_stamps >= ref_stamps[0]) & (est_stamps <= ref_stamps[-1])]
    hint = no_clock(ref_stamps, est_stamps)
    if len(inside) and not hint:
        distance = float(np.median(nearest_stamps(ref_stamps, inside)[1]))
        hint = (
            f"; the nearest ones are usually {distance:.4f} s apart: --t_offset moves the "
            "stamps of the estimate, a larger --t_max_diff accepts them"
        )
    return ValueError(
        f"no time stamps in common: the reference goes from {ref_stamps[0]:.6f} to "
        f"{ref_stamps[-1]:.6f} s, the estimate from {est_stamps[0]:.6f} to {est_stamps[-1]:.6f} s "
        f"(t_max_diff {t_max_diff:g} s){hint or '; write the stamps of one clock'}"
    )


def _by_key(
    reference: Trajectory, estimate: Trajectory, settings: Settings, groups: Indices | None
) -> Matches:
    """Find the pose of the same image, frame or row."""
    ref_keys, est_keys = reference.keys, estimate.keys
    if {ref_keys.dtype.kind, est_keys.dtype.kind} == {"f", "i"}:
        ref_keys, est_keys = _numbers(ref_keys), _numbers(est_keys)
    ref_kind, est_kind = ref_keys.dtype.kind, est_keys.dtype.kind
    if ref_kind != est_kind:
        raise ValueError(
            f"the reference has {KEY_KINDS[ref_kind]}, the estimate {KEY_KINDS[est_kind]}; write "
            f"both with {KEY_KINDS[ref_kind]}, or both with {KEY_KINDS[est_kind]}"
        )
    rows = first_rows(est_keys, np.ones(len(est_keys), dtype=bool), "estimate")
    partners = _partners(ref_keys, est_keys[rows])
    est_rows = np.where(partners >= 0, rows[partners], -1)
    expected = np.flatnonzero(finite_rows(reference.poses))
    gt_poses, est_rows = reference.poses[expected], est_rows[expected]
    positions = gt_poses[:, :3, 3]
    rig_frames = _of_rows(groups, expected)
    if rig_frames is None and settings.unit is None:
        rig_frames = rig_frames_by_names(ref_keys[expected], positions, settings)
    return Matches(
        keys=ref_keys[expected],
        gt_poses=gt_poses,
        est_poses=poses_of_rows(estimate, est_rows),
        gt_rows=expected,
        est_rows=est_rows,
        expected_rows=expected,
        unit=_unit(positions, settings, rig_frames),
        n_rig_frames=_n_rig_frames(rig_frames, settings),
        unmatched=len(rows) - int(np.sum(partners >= 0)),
        duplicate=len(est_keys) - len(rows),
        without_reference=np.empty(0),
        pose_rows=est_rows[est_rows >= 0],
        pose_references=gt_poses[est_rows >= 0],
    )


def _numbers(keys: NDArray[Any]) -> NDArray[Any]:
    """Return the numbers of frames that time stamps are if they are whole."""
    numbers = np.round(keys)
    return numbers.astype(np.int64) if (numbers == keys).all() else keys


def _partners(ref_keys: NDArray[Any], est_keys: NDArray[Any]) -> Indices:
    """Return the index of the estimate's key for each of the reference; -1 where it has none."""
    n, names = len(ref_keys), ref_keys.dtype.kind == "U"
    if not names and all(
        np.array_equal(keys, np.arange(len(keys))) for keys in (ref_keys, est_keys)
    ):
        if n != len(est_keys):
            raise ValueError(
                f"the reference has {n} poses, the estimate {len(est_keys)}, and both count them "
                "from 0, so that pose i of both is the same frame: their number must be the same "
                "(write the number of its frame before each pose, or a row of nan for each frame "
                "that was lost)"
            )
        return np.arange(n)
    ref, est = ref_keys.tolist(), est_keys.tolist()
    pairs = _unique_pairs(ref, est)
    if names and not pairs and (pairs := _pairs_by_ending(ref, est)):
        first, second = pairs[0]
        warn(f"images are matched by the end of their path: {ref[first]!r} and {est[second]!r}")
    if not pairs:
        what, remedy = "frame numbers", "number the frames of both files alike"
        reason = f"the reference has {ref[0]!r}, the estimate {est[0]!r}, for example"
        if names:
            what, remedy = "image names", "name the images of both files alike"
            reason = _several_alike(ref, est) or reason
        raise ValueError(f"no {what} in common: {reason}; {remedy}")
    partners = np.full(n, -1)
    rows, partners_of_rows = np.transpose(pairs)
    partners[rows] = partners_of_rows
    return partners


def _pairs_by_ending(ref: Sequence[str], est: Sequence[str]) -> list[tuple[int, int]]:
    """Return pairs by the longest unique ending of paths, otherwise by name without extension."""
    paths = [[re.split(r"[\\/]", name.casefold()) for name in names] for names in (ref, est)]
    for length in range(max(len(path) for of in paths for path in of), 0, -1):
        if pairs := _unique_pairs(*([tuple(path[-length:]) for path in of] for of in paths)):
            return pairs
    return _unique_pairs(*([PurePosixPath(path[-1]).stem for path in of] for of in paths))


def _several_alike(ref: Sequence[str], est: Sequence[str]) -> str:
    """Return a file name that several images of either file have in words, or an empty string."""
    of_ref, of_est = (
        Counter(re.split(r"[\\/]", name.casefold())[-1] for name in names) for names in (ref, est)
    )
    for whose, counts, others in (("reference", of_ref, of_est), ("estimate", of_est, of_ref)):
        for name in others:
            if counts[name] > 1:
                return f"{counts[name]} images of the {whose} are {name!r}, in different folders"
    return ""


def _unique_pairs(ref_keys: Sequence[Any], est_keys: Sequence[Any]) -> list[tuple[int, int]]:
    """Return the positions of equal keys, of those that occur once."""
    once = [
        {key: row for row, key in enumerate(keys) if count[key] == 1}
        for keys, count in ((keys, Counter(keys)) for keys in (ref_keys, est_keys))
    ]
    return [(row, once[1][key]) for key, row in once[0].items() if key in once[1]]
