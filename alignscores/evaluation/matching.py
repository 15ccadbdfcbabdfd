"""A reference and an estimate: their files, read, and the poses that belong together."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
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
    present,
    unit_hint,
)
from ..trajectories.files import FAILURES, FilePath, Trajectory, inverse_poses, read_stamps
from ..trajectories.timeline import usual_step
from ..trajectories.timing import LEAST_GAIN, find_offset
from ..validation import finite_rows
from .notes import collected_warnings
from .settings import Settings

__all__ = [
    "files_below",
    "match_estimate",
    "read_parts",
    "read_reference",
    "step_of_frames",
]

SMALL_OFFSET = 0.03  # seconds; with a larger one the positions must fit better by `LEAST_GAIN`


def files_below(path: str | Path) -> Iterator[Path]:
    """Yield the file, or those of a COLMAP model, or of the models in a folder, sorted."""
    root = Path(path)
    if root.is_dir():
        yield from sorted(file for file in [*root.glob("*"), *root.glob("*/*")] if file.is_file())
    else:
        yield root


def read_reference(reference: FilePath | Trajectory, settings: Settings) -> Trajectory:
    """Return the reference in the order of time, without duplicates."""
    if not isinstance(reference, Trajectory):
        topic = {"topic": settings.ref_topic} if settings.form.topics else {}
        return in_order(settings.form.read(reference, complete=True, **topic))
    finite = finite_rows(checked(reference, "reference").poses)
    if not finite.all():
        raise ValueError(f"pose {np.argmin(finite) + 1} of the reference is not finite")
    return in_order(reference)


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


def step_of_frames(estimates: Iterable[FilePath], settings: Settings) -> float | None:
    """Return the median step of the densest estimate in time; None where there is none.

    All estimates of a reference answer for the frames at that step. What is wrong with a file is
    said where it is scored.
    """
    if not settings.form.timed or settings.frames is not None:
        return None
    steps = []
    for estimate in estimates:
        with collected_warnings(), suppress(*FAILURES):
            (part,) = read_parts(estimate, settings).values()
            steps.append(usual_step(part.keys[present(part.poses)]))
    return min(steps, default=None)


def match_estimate(
    reference: Trajectory, estimate: Trajectory, settings: Settings, step: float | None = None
) -> tuple[Matches, float]:
    """Match an estimate; return the matches and the time offset that was added.

    `step` is of the frames that are due where the reference is denser, by default the estimate's.
    Where too few poses are matched, the error says by which options it was done.
    """
    estimate = checked(estimate, "estimate")
    timed, offset = settings.form.timed, 0.0
    if timed and reference.keys.dtype.kind == estimate.keys.dtype.kind == "U":
        raise ValueError(f"format={settings.format} has time stamps, not names: leave it out")
    options: dict[str, Any] = {}
    if timed:
        offset = _time_offset(reference, estimate, settings.t_offset)
        options = {
            "t_max_diff": settings.t_max_diff,
            "t_offset": offset,
            **{name: getattr(settings, name) for name in ("max_gap", "t_start", "t_end")},
        }
    frames = None if settings.frames is None else _stamps(settings.frames)
    matches = match(
        reference,
        estimate,
        missing=settings.missing,
        frames=frames,
        sync=settings.sync,
        step=step,
        **options,
    )
    if len(matches.keys) < min(4, len(reference.keys)):
        shown = {"missing": settings.missing_cameras, **options}
        given = ", ".join(f"--{key} {value}" for key, value in shown.items() if value is not None)
        hint = unit_hint(reference.keys, estimate.keys) if timed else ""
        raise ValueError(
            f"only {matches.matched} of {len(estimate.keys)} poses could be matched to the "
            f"reference, and it takes 4{given and f' ({given})'}{hint}"
        )
    return matches, offset


def _stamps(frames: FilePath | Floats | tuple[float, ...]) -> Floats:
    """Return the stamps of the frames that were due, from a file or as they are."""
    return read_stamps(frames) if isinstance(frames, (str, PathLike)) else np.array(frames)


def _time_offset(reference: Trajectory, estimate: Trajectory, option: float | str) -> float:
    """Return the time offset to be used: the one given, or for "auto" the one found.

    On an orbit, a helix or a straight road all offsets fit alike, and noise chooses: it is 0 then.
    """
    if option != "auto":
        return float(option)
    if estimate.keys.dtype.kind != "f":
        return 0.0  # nothing matches then
    found = find_offset(reference, estimate)
    if found is None:
        raise ValueError(
            "no time offset makes its positions fit those of the reference; --t_offset X sets one"
            f"{unit_hint(reference.keys, estimate.keys)}"
        )
    sure = abs(found.seconds) <= SMALL_OFFSET or found.gain >= LEAST_GAIN
    return found.seconds if sure else 0.0
