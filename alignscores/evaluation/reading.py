"""Reference and estimate on their way in: from files and from memory, each checked once."""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..io import (
    FAILURES,
    FORMATS,
    FileError,
    FilePath,
    Trajectory,
    TrajectoryWarning,
    in_seconds,
    inverse_poses,
    is_model,
    read_colmap,
    recognise,
)
from ..validation import finite_rows, real_array
from .settings import Settings
from .time import reference_gap

__all__ = [
    "KEY_KINDS",
    "check_duplicates",
    "files_below",
    "first_rows",
    "format_of",
    "format_of_file",
    "has_constant_rotations",
    "in_memory",
    "read_estimate",
    "read_reference",
    "warn",
    "with_formats",
    "without_rotations",
]

KEY_KINDS = {"f": "time stamps in seconds", "U": "image names", "i": "frame numbers"}
FORMAT_OF_KEYS = {"f": "tum", "i": "kitti", "U": "nerf"}  # that trajectories in memory are like


def files_below(path: str | Path) -> Iterator[Path]:
    """Yield a file, or the files in a folder and in its sub-folders, sorted."""
    root = Path(path)
    if root.is_dir():
        yield from sorted(file for file in [*root.glob("*"), *root.glob("*/*")] if file.is_file())
    else:
        yield root


def in_memory(value: Any, whose: str, times: Any = None) -> Any:
    """Return poses in an array or a COLMAP model as a checked trajectory, and a path as it is.

    A dict of models is one of trajectories by the models' names.
    """
    if isinstance(value, dict) and value:
        return {str(name): in_memory(model, whose, times) for name, model in value.items()}
    if isinstance(value, (str, PathLike, Trajectory)) or is_model(value):
        if times is not None:
            raise ValueError(
                "times need two arrays of poses; files and Trajectory have their own stamps"
            )
    else:
        poses = real_array(value, whose)
        poses = poses[0] if poses.ndim == 4 and len(poses) == 1 else poses  # a batch of one
        rows = np.arange(len(poses))
        stamps = None if times is None else in_seconds(real_array(times, "times"), "times")
        value = Trajectory(rows if stamps is None else stamps, poses)
    if is_model(value):
        return read_colmap(value)
    return _checked(value, whose) if isinstance(value, Trajectory) else value


def with_formats(settings: Settings, reference: Any, estimate: Any) -> Settings:
    """Return the settings with the formats of reference and estimate, as far as they are open."""
    if settings.format is not None:
        return settings
    ref_format = format_of(reference, settings, "ref")
    est_format = settings.est_format or format_of(estimate, settings, "est")
    return replace(
        settings, format=ref_format, est_format=None if est_format == ref_format else est_format
    )


def format_of(trajectory: Any, settings: Settings, side: str) -> str:
    """Return the format of a file, or the one that a trajectory in memory is like."""
    if isinstance(trajectory, dict):
        trajectory = next(iter(trajectory.values()))
    if isinstance(trajectory, Trajectory):
        return FORMAT_OF_KEYS[trajectory.keys.dtype.kind]
    return format_of_file(trajectory, _columns(settings, side), side)


def format_of_file(path: FilePath, columns: str | None, side: str) -> str:
    """Return the format of a file; an error names the option of its side."""
    with _columns_named_for(side):
        return recognise(path, columns)


def _columns(settings: Settings, side: str) -> str | None:
    return settings.columns_of_reference if side == "ref" else settings.columns_of_estimates


@contextmanager
def _columns_named_for(side: str) -> Iterator[None]:
    """Name the options for one side in errors that say --columns: the other file may differ."""
    try:
        yield
    except FileError as error:
        reason = re.sub("--(columns|invert)", rf"--{side}_\1", error.reason)
        raise FileError(error.path, reason, place=error.place) from None


def read_reference(reference: FilePath | Trajectory, settings: Settings) -> Trajectory:
    """Return the reference, each key once; with time stamps only finite poses, in their order.

    Rotations that are the same throughout a file are ignored. Warn where the reference has no
    pose for more than one percent, since nothing is expected there.
    """
    if not isinstance(reference, Trajectory):
        reference = _checked(_read(reference, settings, "ref"), "reference")
        if has_constant_rotations(reference):
            warn("all rotations of the reference are the same; they are ignored")
            reference = reference._replace(poses=without_rotations(reference.poses))
    if settings.ref_invert:
        if not reference.has_rotations:
            raise ValueError("--ref_invert needs rotations, which the reference lacks")
        reference = reference._replace(poses=inverse_poses(reference.poses))
    finite = finite_rows(reference.with_rotations().poses)
    if not finite.any():
        raise ValueError("the reference has no pose that is finite")
    timed = reference.keys.dtype.kind == "f"
    present = finite if timed else np.ones_like(finite)  # rows and names keep their number
    rows = first_rows(reference.keys, present, "reference")
    check_duplicates(int(present.sum()), len(rows), reference.keys, "reference")
    if not reference.has_rotations:
        warn("the reference has no rotations: RAS and PAS have no value")
    truth = Trajectory(reference.keys[rows], reference.poses[rows])
    if timed:
        gaps = np.diff(truth.keys)
        gap = reference_gap(truth.keys, settings.frames_per_second)
        absent = float(gaps[gaps > gap].sum() / gaps.sum()) if len(gaps) else 0.0
        what = f"time, in gaps above {gap:.3g} s"
    else:
        absent, what = float(1 - np.mean(finite[rows])), "cameras"
    if absent > 0.01:
        warn(f"the reference has no pose for {absent:.1%} of the {what}; nothing is expected there")
    return truth


def read_estimate(estimate: FilePath | Trajectory, settings: Settings) -> Trajectory:
    """Return an estimate, camera-to-world."""
    poses = estimate
    if not isinstance(poses, Trajectory):
        poses = _checked(_read(poses, settings, "est"), "estimate")
    for option in ("invert", "lever_arm"):
        if getattr(settings, option) and not poses.has_rotations:
            raise ValueError(f"--{option} needs rotations, which the estimate lacks")
    if settings.lever_arm:  # a position without a rotation says nothing about the reference's prism
        has_rotation = finite_rows(poses.poses[:, :3, :3])
        poses = poses._replace(poses=np.where(has_rotation[:, None, None], poses.poses, np.nan))
    return poses._replace(poses=inverse_poses(poses.poses)) if settings.invert else poses


def _read(path: FilePath, settings: Settings, side: str) -> Trajectory:
    """Read a file; where its format does not fit, the error names the one that does."""
    name = (side == "est" and settings.est_format) or settings.format
    file_format = settings.file_format if side == "ref" else settings.est_file_format
    side_columns: str | None = getattr(settings, f"{side}_columns")
    if side_columns and not file_format.tables:
        remedy = "name its format with --est_format" if side == "est" else "leave it out"
        raise FileError(
            path,
            f"is not a text table but read as {name}: --{side}_columns does not apply; {remedy}",
        )
    columns = _columns(settings, side)
    try:
        with _columns_named_for(side):
            return file_format.read(
                path, **file_format.options(getattr(settings, f"{side}_topic"), columns)
            )
    except FileError as error:
        if (other := _other_format(path, columns)) in ("", name):
            raise
        if error.reason.endswith(f"give {other} instead"):
            raise
        reason = f"{error.reason}; its format seems to be {other}"
        raise FileError(path, reason, place=error.place) from None


def _other_format(path: FilePath, columns: str | None) -> str:
    """Return the format by which a file can be read; an empty string if there is none."""
    with suppress(*FAILURES), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if Path(path).exists() and not Path(path).is_fifo():
            name = recognise(path, columns)
            FORMATS[name].read(path)
            return name
    return ""


def has_constant_rotations(trajectory: Trajectory) -> bool:
    """Return whether all finite rotations are the same, of two poses or more."""
    rotations = trajectory.poses[:, :3, :3]
    rotations = rotations[finite_rows(rotations)]
    return len(rotations) > 1 and bool((rotations == rotations[0]).all())


def without_rotations(poses: Floats) -> Floats:
    """Return poses whose rotations are NaN."""
    positions = poses.copy()
    positions[:, :3, :3] = np.nan
    return positions


def check_duplicates(n: int, n_different: int, keys: NDArray[Any], whose: str) -> None:
    """Warn of poses whose key another one has; raise a ValueError from a tenth of them on."""
    duplicate = n - n_different
    if duplicate >= n / 10:
        what = "time stamp" if keys.dtype.kind == "f" else "name"
        raise ValueError(
            f"{duplicate} of {n} poses of the {whose} have the {what} of another one; write stamps "
            "with all their digits, and each pose once"
        )
    if duplicate and whose == "reference":
        warn(f"duplicate stamps or names in the reference, left out: {duplicate}")


def first_rows(keys: NDArray[Any], present: Booleans, whose: str) -> Indices:
    """Return the first row of each key whose pose is present; of time stamps, in their order."""
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
    rows = rows[present[rows]]
    return rows[np.sort(np.unique(keys[rows], return_index=True)[1])]


def warn(message: str) -> None:
    """Warn of what is unusual in a trajectory."""
    warnings.warn(message, TrajectoryWarning, stacklevel=4)


def _checked(trajectory: Trajectory, whose: str) -> Trajectory:
    """Return a trajectory with arrays (n,) and (n, 4, 4); raise a ValueError where it has none."""
    poses, keys = real_array(trajectory.poses, f"{whose}.poses"), np.asarray(trajectory.keys)
    if keys.dtype == object and all(isinstance(key, str) for key in keys.flat):  # as of pandas
        keys = keys.astype(str)
    keys = keys.astype(np.int64) if keys.dtype.kind == "u" else keys
    if keys.ndim != 1 or keys.dtype.kind not in KEY_KINDS:
        raise ValueError(
            f"the keys of the {whose} must be a list of {', '.join(KEY_KINDS.values())}, not an "
            f"array of shape {keys.shape} and type {keys.dtype}"
        )
    n = len(keys)
    if n == 0:
        raise ValueError(f"the {whose} has no poses")
    if poses.shape not in ((n, 4, 4), (n, 3, 4)):
        positions = "; for positions only, give rotations of NaN" if poses.shape == (n, 3) else ""
        raise ValueError(
            f"the poses of the {whose} must have shape ({n}, 4, 4) or ({n}, 3, 4), not "
            f"{poses.shape}{positions}"
        )
    if keys.dtype.kind == "f":
        keys = keys.astype(np.float64)
        if not np.isfinite(keys).all():
            row = int(np.argmin(np.isfinite(keys)))
            raise ValueError(f"the time stamp of pose {row + 1} of the {whose} is not finite")
        if n > 1 and keys.min() == keys.max():
            raise ValueError(f"all {n} time stamps of the {whose} are the same")
    if len(poses[0]) == 3:
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (n, 1, 4))
        poses = np.concatenate([poses, last], axis=1)
    return Trajectory(keys, poses)
