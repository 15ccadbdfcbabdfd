"""What is noted about an estimate: poses that do not match, units, mix-ups of convention."""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from ..arrays import Floats
from ..averaging import rotation_angles
from ..pose import PASResult
from ..texts import printable
from ..trajectories.association import Matches, unit_hint
from ..trajectories.conventions import Convention, describe_rotation, seem_swapped
from ..trajectories.files import Trajectory, TrajectoryWarning
from ..trajectories.timing import find_offset
from ..validation import AlignmentWarning
from .evaluation import Part
from .settings import Settings

__all__ = [
    "MUCH_LOST",
    "alignment_notes",
    "collected_warnings",
    "convention_notes",
    "matching_notes",
    "offset_notes",
    "parts_notes",
    "scale_note",
    "swap_notes",
    "why",
]

MUCH_LOST = 0.1  # share of the reference; if more is lost and not scored, there is a note
SCALE_OFF = 0.02  # by which a metric system's scale may be off without a note
APART_DEG = 5.0  # angle between the two alignments that takes a note


def why(error: Exception) -> str:
    """Return the message of an error in one line."""
    if isinstance(error, MemoryError):
        return "there is not enough memory for it"
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """Collect the library's own warnings as notes; others are issued as usual."""
    notes: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        for category in (AlignmentWarning, TrajectoryWarning):
            warnings.simplefilter("always", category)
        try:
            yield notes
        finally:
            others = []
            for warning in caught:
                if issubclass(warning.category, (AlignmentWarning, TrajectoryWarning)):
                    note = printable(str(warning.message))
                    if note not in notes:  # as the TAS warns once for each seed
                        notes.append(note)
                else:
                    others.append(warning)
    for warning in others:
        warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)


def matching_notes(
    matches: Matches, reference: Trajectory, estimate: Trajectory, settings: Settings
) -> list[str]:
    """Say which poses were left out, where these are more than a few, and what was lost unseen."""
    unmatched, n = matches.unmatched, len(estimate.keys)
    if not settings.form.timed:
        if not unmatched:
            return []
        note = f"{unmatched} of {n} images are not in the reference; left out"
        if matches.missing == 0:
            note += " (it has all of the reference's, too: the reference comes first)"
        return [note]
    notes = []
    if unmatched > n / 10:
        notes.append(
            f"{unmatched} of {n} poses have no reference pose near them in time"
            f"{unit_hint(reference.keys, estimate.keys)}"
        )
    if without_reference := len(matches.without_reference):
        notes.append(
            f"{without_reference} of the --frames have no reference pose within --t_max_diff; left "
            "out"
        )
    if matches.lost > MUCH_LOST and settings.missing_cameras == "ignore":
        notes.append(
            f"the track covers only {1 - matches.lost:.0%} of the time, the rest is not scored; "
            "--missing fail counts it as failures"
        )
    return notes


def alignment_notes(gt_positions: Floats, result: PASResult) -> list[str]:
    """Say that positions and rotations are aligned by different rotations, if both fit theirs."""
    tas, ras = result.tas, result.ras
    if tas.alignment is None or ras.alignment is None:
        return []
    turn = tas.alignment.rotation.T @ ras.alignment
    apart = float(rotation_angles(turn[None])[0])
    placed, turned = np.isfinite(tas.errors), np.isfinite(ras.errors)
    if (
        apart <= APART_DEG
        or np.median(ras.errors[turned]) > APART_DEG
        or not _fix_rotation(gt_positions[placed], tas.errors[placed])
    ):
        return []
    return [
        f"positions and rotations are aligned by rotations that differ by {apart:.1f} degrees, "
        "which neither score counts: look at the calibration between camera and body"
    ]


def scale_note(scales: Mapping[str, float | None], settings: Settings) -> str:
    """Say which scales of metric estimates were taken out, by their names, if any is off."""
    if settings.alignment != "similarity" or settings.form.unit != "m":
        return ""
    off = [
        f"{name} {scale:.3g}"
        for name, scale in scales.items()
        if scale is not None and abs(math.log(scale)) > math.log1p(SCALE_OFF)
    ]
    if not off:
        return ""
    return f"scale: {', '.join(off)} times the reference's, taken out; --alignment rigid counts it"


def _fix_rotation(positions: Floats, errors: Floats) -> bool:
    """Tell whether positions, by their distance from a line, fix a rotation beside their errors."""
    if len(positions) < 3:
        return False
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    distance = spread[1] / np.sqrt(len(positions))
    return bool(np.median(errors) < np.sin(np.radians(APART_DEG)) * distance)


def parts_notes(parts: Sequence[Part]) -> list[str]:
    """Say what it means that an estimate is in parts, and which of them count for nothing."""
    if not parts:
        return []
    notes = [
        f"in {len(parts)} parts, each aligned on its own: the scores are an upper bound of those "
        "of one model, and do not compare with those of fewer parts"
    ]
    if lost := [part.name for part in parts if part.alignment is None]:
        notes.append(f"cannot be aligned, so that their cameras fail: the parts {', '.join(lost)}")
    return notes


def offset_notes(reference: Trajectory, estimate: Trajectory, t_offset: float) -> list[str]:
    """Say that the clocks seem to differ, if they do."""
    found = find_offset(reference, estimate._replace(keys=estimate.keys + t_offset))
    if found is None or not found.significant:
        return []
    return [
        f"its time stamps seem to be off: {found.seconds:+.3f} s more and the positions fit "
        f"{found.gain:.1f} times as well; --t_offset {t_offset + found.seconds:.3f}, or auto"
    ]


def swap_notes(reference: Trajectory, estimate: Trajectory) -> list[str]:
    """Say that the two files seem to have been given in the wrong order, if they do."""
    if not seem_swapped(reference, estimate):
        return []
    return [
        "reference and estimate seem swapped: the first file starts at the origin and is the "
        "sparser one, as estimates are; the reference comes first"
    ]


def convention_notes(found: Convention, *, invert: bool, applied: bool) -> list[str]:
    """Say in a line each which convention would make the estimate fit, and how to set it.

    `invert` tells whether the poses of the file were inverted, `applied` whether the rotation of
    the camera's frame was taken out.
    """
    notes = []
    gain = f"RAS {found.ras:.2f} as it is, {found.corrected_ras:.2f} so"
    invert_option = "leave out --invert" if invert else "add --invert"
    another_frame = found.body_rotation is not None and (
        "the camera's frame is turned by a constant rotation against the reference's, "
        f"{describe_rotation(found.body_rotation)}"
    )
    if found.inverted:
        now = "camera-to-world, not world-to-camera" if invert else "world-to-camera"
        extra = f", and {another_frame}" if another_frame else ""
        option = f"{invert_option}, with --body_rotation auto" if another_frame else invert_option
        notes.append(f"the poses in the file seem to be {now}{extra} ({gain}); {option}")
    elif found.quaternions_shifted:
        notes.append(
            f"the quaternions seem to have w at the wrong end ({gain}); reorder them in the file"
        )
    elif found.rotations_inverted:
        extra = f", and {another_frame}" if another_frame else ""
        notes.append(
            "the rotations seem to be world-to-camera, but the positions are camera centres"
            f"{extra} ({gain}); transpose the rotations in the file"
        )
    elif another_frame:
        option = "taken out" if applied else "--body_rotation auto takes it out"
        notes.append(f"{another_frame} ({gain}); {option}")
    if found.positions_inverted:
        notes.append(
            "the positions seem to be world-to-camera translations t, but the rotations R are "
            "camera-to-world; write the camera centres -R t into the file"
        )
    if found.mirrored:
        notes.append(
            "the positions fit the mirror image of the reference: one axis is flipped or two are "
            "swapped, as in a left-handed world; no rotation mends that, correct the export"
        )
    return notes
