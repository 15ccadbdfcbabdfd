"""Notes on an evaluation: what may be wrong with the estimate, and what to do about it."""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from ..arrays import Booleans, Floats
from ..averaging import rotation_angles
from ..io import TrajectoryWarning
from ..texts import printable
from ..validation import AlignmentWarning
from .conventions import NEAR_DEG, describe_rotation
from .evaluation import Evaluation, Hint, Note
from .rigs import clumps
from .settings import Settings
from .time import is_near

__all__ = [
    "collected_warnings",
    "ends_notes",
    "explain",
    "reference_notes",
    "scale_note",
    "why",
]

LIBRARY_WARNINGS = AlignmentWarning, TrajectoryWarning
NOTABLE_SHARE = 0.1  # of the frames
APART_DEG = 30.0  # between the alignments of positions and rotations that is noted
MIN_POSES = 20  # so few can fit by chance


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
        for category in LIBRARY_WARNINGS:
            warnings.simplefilter("always", category)
        try:
            yield notes
        finally:
            texts = [
                str(warning.message)
                for warning in caught
                if issubclass(warning.category, LIBRARY_WARNINGS)
            ]
            notes += dict.fromkeys(map(printable, texts))
    for warning in caught:
        if not issubclass(warning.category, LIBRARY_WARNINGS):
            warnings.warn_explicit(
                warning.message, warning.category, warning.filename, warning.lineno
            )


def explain(
    evaluation: Evaluation, hints: Sequence[Note] = (), *, check: bool = True
) -> list[Note]:
    """Return the notes on scores, with the hints on mistakes; with `check` those on low scores."""
    functions = [unmatched, duplicates]
    if evaluation.matches.timed:
        functions += [left_out_frames, few_poses, chance]
    functions += [ignored, frozen, lever_arm, indistinguishable, body_rotation, alignments]
    if check and not hints:  # which may explain it
        functions.append(small_unit)
    notes = [note for function in functions if (note := function(evaluation))] + list(hints)
    if check and (low := low_score(evaluation)):
        notes.append(low)
    return notes


def body_rotation(evaluation: Evaluation) -> Note | None:
    """Note a rotation of the camera frame that was removed, or that none was found."""
    if evaluation.body_rotation is None:
        if evaluation.settings.body_rotation != "auto" or not evaluation.has_rotations:
            return None
        text = "no rotation of the camera frame was removed"
        return Note(
            "frame", f"{text}: none of more than {NEAR_DEG:g} degrees raises the RAS clearly"
        )
    frame = describe_rotation(evaluation.body_rotation)
    return Note("frame", f"a constant rotation of the camera frame was removed: {frame}")


def lever_arm(evaluation: Evaluation) -> Note | None:
    """Note a lever arm that was found."""
    arm = evaluation.lever_arm
    if arm is None or evaluation.settings.lever_arm != "auto":
        return None
    vector, errors = (", ".join(f"{x:.3f}" for x in values) for values in (arm.vector, arm.errors))
    return Note("lever_arm", f"lever arm {vector} (standard errors {errors}) found and applied")


def unmatched(evaluation: Evaluation) -> Note | None:
    """Note images that the reference does not have, or more than a few poses by time stamps."""
    matches, keys = evaluation.matches, evaluation.estimate.keys
    if matches.unmatched <= (len(keys) / 10 if matches.timed else 0):
        return None
    if matches.timed:
        where = "poses have no reference pose near them in time"
    else:
        where = f"{_frames(evaluation)} are not in the reference; left out"
    return Note("unmatched", f"{matches.unmatched} of {len(keys)} {where}")


def small_unit(evaluation: Evaluation) -> Note | None:
    """Note that d is far below the spacing of the path, as where it is the baseline of a rig."""
    matches, settings = evaluation.matches, evaluation.settings
    if settings.unit is not None or matches.n_rig_frames:
        return None
    positions, d = evaluation.reference.poses[matches.expected_rows, :3, 3], matches.unit
    n, spacing = clumps(positions, d)
    if not n:
        return None
    unit = settings.file_format.unit
    text = (
        f"d = {d:.3g} {unit} is far below the spacing of the path: most reference poses lie in "
        f"clumps of {n}, about {spacing:.3g} {unit} apart"
    )
    has_names = matches.keys.dtype.kind == "U"
    remedy = (
        "--rig_frames takes rig frames from the names" if has_names else f"--unit {spacing:.3g}"
    )
    return Hint("spacing", text, f"if these are cameras of one rig, {remedy}, in Python groups=")


def left_out_frames(evaluation: Evaluation) -> Note | None:
    """Note frames of --frames that the reference does not have."""
    n = len(evaluation.matches.without_reference)
    text = f"{n} of the --frames have no reference pose within --t_max_diff; left out"
    return Note("frames", text) if n else None


def duplicates(evaluation: Evaluation) -> Note | None:
    """Note poses with the key of another one if they differ from it, or are more than 1 %.

    Readers of files note those without time stamps. From 10 % on they are refused.
    """
    if evaluation.file and not evaluation.matches.timed:
        return None
    keys, poses = evaluation.read
    present = np.isfinite(poses[:, :3]).any(axis=(1, 2))
    keys, poses = keys[present], poses[present]
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    same = (poses == poses[first][inverse]) | np.isnan(poses)
    n, n_differ = len(keys) - len(first), int((~same.all(axis=(1, 2))).sum())
    what = "time stamp" if evaluation.matches.timed else "key"
    differ = f", {n_differ} with another pose" if n_differ else ""
    text = f"{n} of {len(keys)} poses have the {what} of another one{differ}; the first one counts"
    return Note("duplicates", text) if n_differ or n > len(keys) / 100 else None


def few_poses(evaluation: Evaluation) -> Note | None:
    """Note that few poses can fit by chance."""
    n = evaluation.matches.n_poses
    text = f"only {n} of its poses are scored; so few poses can fit by chance"
    return Note("few", text) if n < MIN_POSES else None


def frozen(evaluation: Evaluation) -> Note | None:
    """Note more than one percent of poses that stand still while the reference moves away.

    Each is the same number by number as the one before. The reference has moved by more than d or
    10 degrees since the first of them.
    """
    matches = evaluation.matches
    poses, references = evaluation.estimate.poses[matches.pose_rows], matches.pose_references
    repeated = (poses[1:] == poses[:-1]).all(axis=(1, 2))
    rows = np.arange(len(poses))
    first = np.maximum.accumulate(np.where(np.append(False, repeated), 0, rows))
    moved = ~is_near(references, references[first], evaluation.result.tas.unit)
    n, n_all = int(moved.sum()), len(poses)
    text = (
        f"{n} of {n_all} poses repeat an earlier one, although the reference has moved by more "
        "than d or 10 degrees since: tracking seems to have failed; such poses count as wrong"
    )
    return Note("frozen", text) if n > n_all / 100 else None


def _frames(evaluation: Evaluation) -> str:
    return "frames" if evaluation.settings.file_format.ordered else "images"


def ignored(evaluation: Evaluation) -> Note | None:
    """Note a notable share of lost frames that --missing ignore leaves out."""
    if evaluation.lost <= NOTABLE_SHARE or evaluation.settings.missing != "ignore":
        return None
    what = "time is" if evaluation.matches.timed else f"{_frames(evaluation)} are"
    text = f"only {1 - evaluation.lost:.0%} of the {what} scored, since the rest is lost"
    return Note("ignored", text, "--missing fail counts it as failures")


def chance(evaluation: Evaluation) -> Note | None:
    """Note a TAS below twice the chance level, the TAS of a camera that never moves."""
    if evaluation.chance <= 0.05 or evaluation.tas >= 2 * evaluation.chance:
        return None
    text = f"the TAS is less than twice that of a camera that never moves, {evaluation.chance:.2f}"
    why_so = "the reference stays near one place for part of the time, or has few frames"
    return Note("chance", f"{text}: {why_so}", "the half distance tells more")


def indistinguishable(evaluation: Evaluation) -> Note | None:
    """Note the scores that errors of the reference would explain on their own."""
    perfect, settings = evaluation.perfect or {}, evaluation.settings
    scores = {"TAS": evaluation.tas, "RAS": evaluation.ras, "PAS": evaluation.pas}
    means = {name: mean for name, (mean, lowest) in perfect.items() if scores[name] >= lowest}
    if not means or not isinstance(settings.reference_sigma, tuple):
        return None
    sigma, sigma_deg = settings.reference_sigma
    return Note(
        "perfect",
        f"not distinguishable from a perfect estimate by {', '.join(means)}: with errors of "
        f"{sigma:g} {settings.file_format.unit} and {sigma_deg:g} deg in the reference, that would "
        f"have {', '.join(f'{mean:.3f}' for mean in means.values())}",
    )


def alignments(evaluation: Evaluation) -> Note | None:
    """Note positions and rotations that fit well, but under alignments that differ.

    Where the positions are almost on a line, the spin about it is free.
    """
    tas, ras = evaluation.result.tas, evaluation.result.ras
    if tas.alignment is None or ras.alignment is None or evaluation.settings.alignment == "none":
        return None
    if not (evaluation.has_rotations and min(tas.score, ras.score) > 0.5):
        return None
    positions = evaluation.matches.gt_poses[:, :3, 3]
    if len(positions) < 2:
        return None
    _, widths, axes = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=False)
    between = tas.alignment.rotation.T @ ras.alignment
    angle = float(rotation_angles(between[None])[0])
    if widths[1] < 0.1 * widths[0]:
        angle = math.degrees(math.acos(np.clip(axes[0] @ between @ axes[0], -1, 1)))
    if angle < APART_DEG:
        return None
    text = (
        f"positions and rotations fit under alignments {angle:.0f} deg apart; TAS and RAS align "
        "separately and do not show it: coordinate frames or camera axes differ"
    )
    return Note("apart", text)


def low_score(evaluation: Evaluation) -> Note | None:
    """Note why a PAS, or a TAS without rotations, is below one half."""
    name = "PAS" if evaluation.has_rotations else "TAS"
    score = evaluation.pas if evaluation.has_rotations else evaluation.tas
    if score >= 0.5:
        return None
    tas, ras, matches = evaluation.result.tas, evaluation.result.ras, evaluation.matches
    far = np.isfinite(tas.errors) & (tas.errors >= tas.unit)
    angles = ras.errors[np.isfinite(ras.errors)]  # of cameras that were estimated
    rotated = np.mean(angles >= ras.thresholds[-1]) if len(angles) else 0.0
    reasons = []
    if evaluation.lost > NOTABLE_SHARE:
        of = "time" if matches.timed else "frames"
        reasons.append(f"{evaluation.lost:.0%} of the {of} lost")
    if np.mean(far) > NOTABLE_SHARE:
        where = _stretch(matches.keys - evaluation.reference.keys[0], far) if matches.timed else ""
        reasons.append(f"{np.mean(far):.0%} of the frames further off than d{where}")
    bad = f"{rotated:.0%} of the rotations off by more than {ras.thresholds[-1]:g} degrees"
    if len(angles):
        reasons.append(bad if rotated > NOTABLE_SHARE else "rotations fine")
    return Note("low", f"{name} {score:.2f}: {', '.join(reasons)}") if reasons else None


def _stretch(seconds: Floats, far: Booleans) -> str:
    """Return the shortest stretch with three quarters of some frames, if it is a small one."""
    times = np.sort(seconds[far])
    n = math.ceil(0.75 * len(times))
    lengths = times[n - 1 :] - times[: len(times) - n + 1]
    first = int(np.argmin(lengths))
    if lengths[first] > np.ptp(seconds) / 2:
        return ""
    return f" (most of them between {times[first]:.0f} and {times[first + n - 1]:.0f} s)"


def reference_notes(evaluations: Sequence[Evaluation]) -> list[Note]:
    """Return the notes on a reference: time at its ends that no estimate covers.

    Stamps in a wrong unit say nothing of it, nor do poses that miss those of a sparse one.
    """
    matches = [
        evaluation.matches
        for evaluation in evaluations
        if evaluation.matches.timed
        and not any(note.kind in ("units", "sparse") for note in evaluation.notes)
    ]
    return ends_notes(
        [evaluation.keys for evaluation in matches],
        [evaluation.est_rows >= 0 for evaluation in matches],
    )


def ends_notes(
    expected: Sequence[Floats], covered: Sequence[Booleans], sequence: str = ""
) -> list[Note]:
    """Note that no estimate covers the first or the last second of the expected time.

    Each estimate has the stamps of its expected frames, and whether it covers each. With the name
    of a sequence the remedy is its entry in a YAML file, since an option would cut all sequences.
    """
    if not any(map(np.any, covered)):
        return []
    frames = np.concatenate(expected)
    with_pose = frames[np.concatenate(covered)]
    first, last = with_pose.min(), with_pose.max()
    ends = (
        ("first", first - frames.min(), "t_start", first),
        ("last", frames.max() - last, "t_end", last),
    )
    notes = []
    for which, seconds, setting, stamp in ends:
        if seconds > 1:
            option = f"--{setting} {stamp:.3f}"
            if sequence:
                option = f"sequences: {sequence}: {setting}: {stamp:.3f} in a YAML file"
            text = f"no estimate covers the {which} {seconds:.1f} s of the reference"
            remedy = f"they count as lost; if no system was run there, {option} leaves them out"
            notes.append(Note("ends", text, remedy))
    return notes


def scale_note(scales: Mapping[str, float | None], settings: Settings) -> str:
    """Return a note on the scales of metric estimates that the alignment removed."""
    if settings.alignment != "similarity" or settings.file_format.unit != "m":
        return ""
    off = [
        f"{name} is {scale:.3g}x"
        for name, scale in scales.items()
        if scale is not None and abs(math.log(scale)) > math.log1p(0.02)
    ]
    if not off:
        return ""
    names = ", ".join(off)
    return f"scale: {names} the reference (removed; --alignment rigid penalises it)"
