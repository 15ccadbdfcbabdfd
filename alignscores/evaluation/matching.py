"""A reference and an estimate: their files, read, and the poses that belong together."""

import warnings
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats
from ..trajectories.association import (
    Matches,
    checked,
    in_order,
    match,
    unit_hint,
)
from ..trajectories.files import (
    FilePath,
    Trajectory,
    TrajectoryWarning,
    inverse_poses,
    read_stamps,
)
from ..trajectories.timeline import reference_gap
from ..trajectories.timing import TimeOffset, find_offset
from ..validation import finite_rows
from .settings import Settings

__all__ = [
    "files_below",
    "match_estimate",
    "read_parts",
    "read_reference",
    "time_offset",
]

MUCH_ABSENT = 0.01  # share of the reference without a pose from which there is a note


def files_below(path: str | Path) -> Iterator[Path]:
    """Yield the file, or those of a COLMAP model, or of the models in a folder, sorted."""
    root = Path(path)
    if root.is_dir():
        yield from sorted(file for file in [*root.glob("*"), *root.glob("*/*")] if file.is_file())
    else:
        yield root


def read_reference(reference: FilePath | Trajectory, settings: Settings) -> Trajectory:
    """Return the finite poses of the reference in the order of time, without duplicates.

    Warn of the share in which it has no pose, since nothing is expected there.
    """
    if not isinstance(reference, Trajectory):
        topic = {"topic": settings.ref_topic} if settings.form.topics else {}
        reference = settings.form.read(reference, **topic)
    truth = in_order(reference)
    if truth.keys.dtype.kind == "f":
        gaps = np.diff(truth.keys)
        gap = reference_gap(truth.keys, settings.frames_per_second)
        absent = float(gaps[gaps > gap].sum() / gaps.sum()) if len(gaps) else 0.0
    else:
        absent = float(1 - np.mean(finite_rows(np.asarray(reference.poses))))
    if absent > MUCH_ABSENT:
        what = "of the time" if truth.keys.dtype.kind == "f" else "of its cameras"
        warnings.warn(
            f"the reference has no pose for {absent:.1%} {what}; nothing is expected there",
            TrajectoryWarning,
            stacklevel=2,
        )
    return truth


def read_parts(estimate: FilePath | Trajectory, settings: Settings) -> dict[str, Trajectory]:
    """Return the parts of an estimate, as a rule a single one, camera-to-world."""
    if isinstance(estimate, Trajectory):
        parts = {"": checked(estimate, "estimate")}
    else:
        form = settings.est_form
        topic = {"topic": settings.est_topic} if form.topics else {}
        parts = form.read_parts(estimate) if form.read_parts else {"": form.read(estimate, **topic)}
    if not settings.invert:
        return parts
    return {name: part._replace(poses=inverse_poses(part.poses)) for name, part in parts.items()}


def match_estimate(
    reference: Trajectory, estimate: Trajectory, settings: Settings, t_offset: float
) -> Matches:
    """Match an estimate, with an offset added to its stamps.

    Where too few poses are matched, the error says by which options it was done.
    """
    estimate = checked(estimate, "estimate")
    timed = settings.form.timed
    if timed and reference.keys.dtype.kind == estimate.keys.dtype.kind == "U":
        raise ValueError(f"format={settings.format} has time stamps, not names: leave it out")
    options: dict[str, Any] = {}
    if timed:
        options = {"t_max_diff": settings.t_max_diff, "t_offset": t_offset}
        options |= {name: getattr(settings, name) for name in ("max_gap", "t_start", "t_end")}
    matches = match(
        reference,
        estimate,
        missing=settings.missing,
        frames=None if settings.frames is None else _stamps(settings.frames),
        rate=settings.frames_per_second,
        sync=settings.sync,
        unit=settings.unit,
        **options,
    )
    n_poses = len(np.unique(matches.est_rows[matches.est_rows >= 0]))
    n_scored = n_poses if settings.missing == "ignore" else len(matches.keys)
    if n_scored < min(4, len(reference.keys)):
        shown = {"missing": settings.missing_cameras, **options}
        given = ", ".join(f"--{key} {value}" for key, value in shown.items() if value is not None)
        hint = unit_hint(reference.keys, estimate.keys) if timed else ""
        raise ValueError(
            f"only {n_poses} of {len(estimate.keys)} poses could be matched to the "
            f"reference, and it takes 4{given and f' ({given})'}{hint}"
        )
    return matches


def _stamps(frames: FilePath | Floats | tuple[float, ...]) -> Floats:
    """Return the stamps of the expected frames, from a file or as they are."""
    return read_stamps(frames) if isinstance(frames, (str, PathLike)) else np.array(frames)


def time_offset(
    reference: Trajectory, estimate: Trajectory, settings: Settings
) -> tuple[float, TimeOffset | None]:
    """Return the time offset to be used, and for "auto" what was found: 0 unless it is certain."""
    if settings.t_offset != "auto":
        return float(settings.t_offset), None
    estimate = checked(estimate, "estimate")
    if estimate.keys.dtype.kind != "f":
        return 0.0, None  # nothing matches then
    found = find_offset(reference, estimate, anywhere=True)
    if found and found.certain:
        return found.seconds, found
    if estimate.keys.min() > reference.keys[-1] or estimate.keys.max() < reference.keys[0]:
        raise ValueError(
            "no time offset makes its motions fit those of the reference; --t_offset X sets one"
            f"{unit_hint(reference.keys, estimate.keys)}"
        )
    return 0.0, found
