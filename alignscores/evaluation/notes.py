"""What is noted about an estimate: poses that do not match, units, mix-ups of convention."""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from ..arrays import Booleans, Floats
from ..averaging import rotation_angles
from ..pose import PASResult
from ..texts import printable
from ..trajectories.association import Matches, unit_hint
from ..trajectories.conventions import Convention, describe_rotation, seem_swapped
from ..trajectories.files import Trajectory, TrajectoryWarning
from ..trajectories.timing import TimeOffset, find_offset
from ..validation import AlignmentWarning
from .evaluation import Part
from .settings import Settings

__all__ = [
    "MUCH_LOST",
    "alignment_notes",
    "chance_notes",
    "collected_warnings",
    "convention_notes",
    "ends_notes",
    "matching_notes",
    "offset_notes",
    "parts_notes",
    "scale_note",
    "swap_notes",
    "why",
]

MUCH_LOST = 0.1  # share of the reference; if more is lost and not scored, there is a note
SOME_DUPLICATES = 0.01  # share of an estimate's poses from which there is a note
FEW_POSES = 20  # fewer take a note
MUCH_IN_GAPS = 0.05  # share of the time in gaps of one to three largest gaps that takes a note
LONG_END = 1.0  # seconds that no estimate covers, likewise
HIGH_CHANCE = 0.05  # TAS of a camera that never moves, likewise
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
    if estimate.keys.dtype.kind != "f":
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
    if matches.duplicate > SOME_DUPLICATES * n:
        notes.append(
            f"{matches.duplicate} of {n} poses have the time stamp of another one; left out"
        )
    answering = len(np.unique(matches.est_rows[matches.est_rows >= 0]))
    if answering < FEW_POSES:
        notes.append(f"only {answering} of its poses are scored, so few can fit by chance")
    if note := _gaps_note(matches, estimate, settings.max_gap):
        notes.append(note)
    if matches.lost > MUCH_LOST and settings.missing_cameras == "ignore":
        notes.append(
            f"the track covers only {1 - matches.lost:.0%} of the time, the rest is not scored; "
            "--missing fail counts it as failures"
        )
    return notes


def _gaps_note(matches: Matches, estimate: Trajectory, max_gap: float) -> str:
    """Say that gaps somewhat longer than the largest one are lost, if they are a good part."""
    stamps = np.sort(estimate.keys[matches.pose_rows])
    expected = matches.keys[[0, -1]]
    lost_at = matches.keys[matches.est_rows < 0]
    gaps = np.diff(stamps)
    is_lost = np.isin(np.arange(len(gaps)), np.searchsorted(stamps, lost_at) - 1)
    longer = gaps[is_lost & (gaps > max_gap) & (gaps <= 3 * max_gap)]
    share = longer.sum() / max(expected[1] - expected[0], np.finfo(float).tiny)
    if share <= MUCH_IN_GAPS:
        return ""
    most = math.ceil(10 * longer.max()) / 10
    return (
        f"{share:.0%} of the time lies in gaps of {max_gap:g} to {most:g} s between its poses; "
        f"--max_gap {most:g} covers them, for all estimates"
    )


def ends_notes(expected: Sequence[Floats], covered: Sequence[Booleans]) -> list[str]:
    """Say that no estimate covers the beginning or the end of the expected time, if so.

    Each estimate has the stamps of its expected frames, and tells which of them it covers.
    """
    if not expected:
        return []
    frames = np.concatenate(expected)
    with_pose = frames[np.concatenate(covered)]
    first, last = with_pose.min(), with_pose.max()
    ends = (
        ("first", first - frames.min(), f"--t_start {first:.3f}"),
        ("last", frames.max() - last, f"--t_end {last:.3f}"),
    )
    return [
        f"no estimate covers the {which} {seconds:.1f} s of the reference; {option} leaves them out"
        for which, seconds, option in ends
        if seconds > LONG_END
    ]


def chance_notes(chances: Sequence[float]) -> list[str]:
    """Say that a camera that never moves would score, if it would; chances are of one reference."""
    if max(chances, default=0.0) <= HIGH_CHANCE:
        return []
    return [
        f"a camera that never moves would have a TAS of {max(chances):.2f}: the reference stands "
        "still for much of the time, or has few frames"
    ]


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
    """Return a note on the scales of metric estimates that the alignment removed."""
    if settings.alignment != "similarity" or settings.form.unit != "m":
        return ""
    off = [
        f"{name} is {scale:.3g}x"
        for name, scale in scales.items()
        if scale is not None and abs(math.log(scale)) > math.log1p(SCALE_OFF)
    ]
    if not off:
        return ""
    names = ", ".join(off)
    return f"scale: {names} the reference (removed; --alignment rigid penalises it)"


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


def offset_notes(
    reference: Trajectory,
    estimate: Trajectory,
    t_offset: float,
    found: TimeOffset | None,
    *,
    auto: bool,
) -> list[str]:
    """Say which offset of the clocks was found, or that there seems to be one."""
    if not auto:
        found = find_offset(reference, estimate._replace(keys=estimate.keys + t_offset))
        if found is None or not found.certain:
            return []
        return [
            f"its clock seems to be off: with --t_offset {t_offset + found.seconds:.3f} its "
            f"{found.what} fit {found.gain:.1f} times as well"
        ]
    if found is None or not found.certain:
        return ["no time offset added: none makes its motions fit clearly better"]
    return [
        f"time offset of {found.seconds:.4f} s added to its stamps: its {found.what} fit "
        f"{found.gain:.1f} times as well"
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
