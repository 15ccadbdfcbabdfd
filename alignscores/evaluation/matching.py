"""Reading a reference and an estimate, and matching their poses."""

from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats
from ..trajectories.association import Matches, Timing, checked, in_order, match, unit_hint, warn
from ..trajectories.files import (
    FileError,
    FilePath,
    Trajectory,
    inverse_poses,
    read_colmap,
    read_stamps,
)
from ..trajectories.files.colmap import is_model
from ..trajectories.recognition import recognise
from ..trajectories.timeline import reference_gap
from ..trajectories.timing import find_offset
from ..validation import finite_rows, real_array
from .settings import Settings

__all__ = [
    "files_below",
    "in_memory",
    "match_estimate",
    "read_estimate",
    "read_reference",
    "time_offset",
    "with_format",
]

FORMAT_OF_KEYS = {"f": "tum", "i": "kitti", "U": "nerf"}  # that trajectories in memory are like


def files_below(path: str | Path) -> Iterator[Path]:
    """Yield a file, or the files in a folder and in its sub-folders, sorted."""
    root = Path(path)
    if root.is_dir():
        yield from sorted(file for file in [*root.glob("*"), *root.glob("*/*")] if file.is_file())
    else:
        yield root


def in_memory(reference: Any, estimate: Any, times: Any = None) -> tuple[Any, Any]:
    """Return arrays and COLMAP models as trajectories, and paths as they are."""
    both = {"reference": reference, "estimate": estimate}
    arrays = {
        name: real_array(value, name)
        for name, value in both.items()
        if not (isinstance(value, (str, PathLike, Trajectory)) or is_model(value))
    }
    if times is not None and len(arrays) < 2:
        raise ValueError(
            "times need two arrays of poses; files and Trajectory have their own stamps"
        )
    stamps = times if isinstance(times, tuple) and len(times) == 2 else (times, times)
    for (name, poses), own in zip(arrays.items(), stamps, strict=False):
        keys = np.arange(len(poses)) if own is None else real_array(own, "times")
        both[name] = Trajectory(keys, poses)
    for name, value in both.items():
        if isinstance(value, Trajectory):
            both[name] = checked(value, name)
        elif is_model(value):
            both[name] = read_colmap(value)
    return both["reference"], both["estimate"]


def with_format(settings: Settings, reference: Any, *estimates: Any) -> Settings:
    """Return the settings with the formats of reference and estimates, as far as they are open."""
    if settings.format is not None:
        return settings
    form = _format_of(reference, settings.ref_columns or settings.columns)
    if settings.est_format is not None:
        return replace(settings, format=form)
    first, *others = estimates
    est_columns = settings.est_columns or settings.columns
    est_form = _format_of(first, est_columns)
    for file in others:
        if _format_of(file, est_columns) != est_form:
            raise FileError(file, f"is not in the format of {first}, {est_form}; score it apart")
    return replace(settings, format=form, est_format=None if est_form == form else est_form)


def _format_of(trajectory: Any, columns: str | None) -> str:
    """Return the format of a file, or the one that a trajectory in memory is like."""
    if isinstance(trajectory, Trajectory):
        return FORMAT_OF_KEYS[trajectory.keys.dtype.kind]
    return recognise(trajectory, columns)


def read_reference(reference: FilePath | Trajectory, settings: Settings) -> Trajectory:
    """Return the finite poses of the reference in the order of time, without duplicates.

    Warn where it has no pose for more than one percent, since nothing is expected there.
    """
    if not isinstance(reference, Trajectory):
        reference = settings.form.read(reference, **settings.ref_options)
    truth = in_order(reference)
    if not truth.has_rotations:
        warn("the reference has no rotations: RAS and PAS have no value")
    if timed := truth.keys.dtype.kind == "f":
        gaps = np.diff(truth.keys)
        gap = reference_gap(truth.keys, settings.frames_per_second)
        absent = float(gaps[gaps > gap].sum() / gaps.sum()) if len(gaps) else 0.0
    else:
        absent = float(1 - np.mean(finite_rows(truth.with_rotations().poses)))
    if absent > 0.01:
        what = "time" if timed else "cameras"
        warn(f"the reference has no pose for {absent:.1%} of the {what}; nothing is expected there")
    return truth


def read_estimate(
    reference: Trajectory, estimate: FilePath | Trajectory, settings: Settings
) -> Trajectory:
    """Return an estimate, camera-to-world; of several models in a folder the largest one.

    A model with the poses of the reference is the reference itself.
    """
    form = settings.est_form
    if isinstance(estimate, Trajectory):
        poses = checked(estimate, "estimate")
    elif form.read_parts:
        models = form.read_parts(estimate)
        others = [
            name for name, one in models.items() if not np.array_equal(one.poses, reference.poses)
        ]
        name = max(others or models, key=lambda name: len(models[name].keys))
        poses = models[name]
        if len(models) > 1:
            largest = "the largest" if len(others) in (0, len(models)) else "not the reference"
            warn(f"{estimate}: has {len(models)} models; {name}, {largest}, is scored")
    else:
        poses = form.read(estimate, **settings.est_options)
    if settings.invert and not poses.has_rotations:
        raise ValueError("--invert needs rotations, which the estimate lacks")
    return poses._replace(poses=inverse_poses(poses.poses)) if settings.invert else poses


def match_estimate(
    reference: Trajectory, estimate: Trajectory, settings: Settings, t_offset: float
) -> Matches:
    """Match an estimate whose stamps have the offset, which is added to `frames` alone.

    Where too few poses are matched, the error has the options that matter.
    """
    timed = settings.form.timed
    if timed and reference.keys.dtype.kind == estimate.keys.dtype.kind == "U":
        raise ValueError(f"format={settings.format} has time stamps, not names: leave it out")
    timing = Timing(
        t_max_diff=settings.t_max_diff,
        sync=settings.sync,
        max_gap=settings.max_gap,
        rate=settings.frames_per_second,
        frames=None if settings.frames is None else _stamps(settings.frames) + t_offset,
        t_start=settings.t_start,
        t_end=settings.t_end,
    )
    matches = match(reference, estimate, timing, missing=settings.missing, unit=settings.unit)
    n_scored = matches.n_poses if settings.missing == "ignore" else len(matches.keys)
    if n_scored < min(4, len(reference.keys)):
        shown = ["missing"]
        shown += ["t_max_diff", "t_offset", "max_gap", "t_start", "t_end"] if timed else []
        options = {name: getattr(settings, name) for name in shown}
        words = ", ".join(f"--{key} {value}" for key, value in options.items() if value is not None)
        hint = unit_hint(reference.keys, estimate.keys) if timed else ""
        raise ValueError(
            f"only {matches.n_poses} of {len(estimate.keys)} poses could be matched to the "
            f"reference, and it takes 4{words and f' ({words})'}{hint}"
        )
    return matches


def _stamps(frames: FilePath | Floats | tuple[float, ...]) -> Floats:
    """Return the stamps of the expected frames, from a file or as they are."""
    return read_stamps(frames) if isinstance(frames, (str, PathLike)) else np.array(frames)


def time_offset(
    reference: Trajectory, estimate: Trajectory, settings: Settings
) -> tuple[Trajectory, float]:
    """Return an estimate with the offset added to its stamps, and the offset."""
    estimate = checked(estimate, "estimate")
    if estimate.keys.dtype.kind != "f":
        return estimate, 0.0
    offset = settings.t_offset
    if offset == "auto":
        offset = _found_offset(reference, estimate)
    return estimate._replace(keys=estimate.keys + float(offset)), float(offset)


def _found_offset(reference: Trajectory, estimate: Trajectory) -> float:
    """Return the offset at which the motions fit; 0 where none is certain."""
    offset = find_offset(reference, estimate, anywhere=True)
    if offset and offset.certain:
        return offset.seconds
    if estimate.keys.min() > reference.keys[-1] or estimate.keys.max() < reference.keys[0]:
        raise ValueError(
            "no time offset makes its motions fit the reference's; --t_offset X sets one"
            f"{unit_hint(reference.keys, estimate.keys)}"
        )
    return 0.0
