"""One look at both files: units, clocks and conventions that are mixed up in one of them.

`look` tries the same candidates on the reference and on the estimate: units of time, counted poses,
frame-to-frame motions, the offset of the clocks, the convention of the poses, mirrored axes, the
vertical axis, units of length. A cheap test on the trajectories selects candidates; each is then
scored like any other estimate. A hint is given only if that raises the score clearly, and names the
file, the option and both scores.
"""

import math
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import chain, product
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats, Indices
from ..averaging import project_to_rotation, rotation_angles
from ..io import FAILURES, Trajectory, inverse_poses
from ..io.columns import UNITS, name_columns
from ..io.tables import Table, open_table
from ..io.trajectory import TIME_UNITS
from ..similarity import UP, Similarity
from ..validation import finite_rows
from .clock import Clock, align_vectors, find_clock
from .conventions import (
    BOTH,
    EST,
    INVERTED,
    INVERTED_POSITIONS,
    INVERTED_ROTATIONS,
    INVERTED_W,
    MAX_MISFIT,
    MAX_MISFIT_OF_RELATED,
    MIN_CAMERAS,
    REF,
    W_FIRST,
    W_LAST,
    Convention,
    PositionFit,
    corrected,
    describe_rotation,
    find_conventions,
    fit_positions,
    is_common,
    moving_cameras,
    rotations_fit_mirrored,
)
from .evaluation import Hint, Note
from .lever import find_lever_arm, with_lever_arm
from .settings import Settings
from .time import nearest_stamps

__all__ = ["Files", "Scored", "look", "rescue"]

CLEAR = 0.1  # gain of a remedy
SMALL, MIN_T = 0.01, 2.0  # or so small a one, of so many standard errors
ALMOST_PERFECT = 1 - SMALL  # score above which no remedy is looked for
OUTLIER = 3.0  # median errors
EQUAL = 0.02  # difference between remedies that are equally good
MAX_SHIFT = 0.25  # of the frames of an estimate
SPAN_OF_FRAMES = 60  # over which motions are compared, or BLOCKS in a file
BLOCKS = 20  # stretches of time, for standard errors
MAX_TURN, MAX_SPEED = 90.0, 40.0  # of a camera, in the median: deg/s and m/s
SLOW, BACK_AND_FORTH = 0.3, 15.0  # m/s, and the length of a path relative to its extent
MIN_TILT = 30.0  # deg, of a vertical axis that is another one
FRAME = 0.1  # seconds between frames without stamps
STEPS_OF_CAMERAS = 1e-3, 5.0  # seconds between the poses of a trajectory
MIN_DURATION = 5.0  # seconds of a recording, as a rule
MAX_RATIO = 30  # of the durations of two files in the same unit
# Between the unit of stamps and the one they were read in; larger units pass for seconds.
LARGE_UNITS = {unit: UNITS[unit] for unit in ("minutes", "hours", "days")}
TIME_FACTORS = 1e-3, 1e-6, 1e-9, 1e3, 1e6, *LARGE_UNITS.values()
# How many times larger numbers are in the first of two units.
LENGTHS = {
    1e3: "mm, those of {other} in m (or in m and km)",
    1e2: "cm, those of {other} in m",
    1e1: "mm, those of {other} in cm",
    3.28084: "feet, those of {other} in m",
    39.3701: "inches, those of {other} in m",
}
MIRRORS = {
    "z negated": np.diag([1.0, 1.0, -1.0]),
    "y negated": np.diag([1.0, -1.0, 1.0]),
    "x negated": np.diag([-1.0, 1.0, 1.0]),
    "x and y swapped": np.eye(3)[[1, 0, 2]],
    "y and z swapped": np.eye(3)[[0, 2, 1]],
    "x and z swapped": np.eye(3)[[2, 1, 0]],
}


class Scored(NamedTuple):
    """What scoring returns for a candidate: the score, and the poses that were compared."""

    score: float
    frames: Floats  # the part of each expected frame, whose mean is the score, in order of time
    gt_poses: Floats
    est_poses: Floats


@dataclass(frozen=True)
class Files:
    """Names of both files in messages, and their paths; empty for trajectories in memory."""

    reference: str = "the reference"
    estimate: str = "the estimate"
    ref_path: str = ""
    est_path: str = ""

    def name(self, side: str) -> str:
        """Return the name of a file, or of both."""
        both = f"both {self.reference} and {self.estimate}"
        return {REF: self.reference, EST: self.estimate, BOTH: both}[side]


Attempt = Callable[[Trajectory, Trajectory, Settings], Scored]


@dataclass(frozen=True, eq=False)
class _State:
    """Both trajectories and the settings after the remedies so far, with their score."""

    reference: Trajectory
    estimate: Trajectory
    settings: Settings
    scored: Scored | None
    attempt: Attempt
    has_rotations: bool
    notes: tuple[Note, ...] = ()

    @property
    def score(self) -> float:
        return self.scored.score if self.scored else 0.0

    def after(self, remedy: "_Remedy") -> "_State | None":
        """Return the state after a remedy; None if it cannot be scored."""
        settings = replace(self.settings, **remedy.changes)
        with suppress(*FAILURES), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return replace(
                self,
                reference=remedy.reference,
                estimate=remedy.estimate,
                settings=settings,
                scored=self.attempt(remedy.reference, remedy.estimate, settings),
            )
        return None


@dataclass(frozen=True, eq=False)
class _Remedy:
    """A change that may raise the score: what to say, what to do, and both trajectories then."""

    kind: str
    text: str
    option: str
    reference: Trajectory
    estimate: Trajectory
    changes: dict[str, Any] = field(default_factory=dict)
    min_t: float = MIN_T  # 0 for what steps, motions or a scale show on their own
    margin: float = EQUAL  # by which it must be better than a likelier one
    alike: str = ""  # names remedies that are as likely, whatever their scores


def look(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    scored: Scored,
    attempt: Attempt,
    files: Files,
    *,
    has_rotations: bool,
) -> list[Note]:
    """Return the hints on mistakes in either file; those found first are corrected for the others.

    The score is the PAS, without rotations the TAS.
    """
    state = _State(reference, estimate, settings, scored, attempt, has_rotations)
    state = _tried(state, _wrong_stamps(state, files))
    state = _tried(state, _increments(state, files))  # which would pass for late poses
    state = _on_time(state, files)
    state = _tried(state, _conventions(state, files))
    state = _tried(state, _mirrored(state, files))
    state = _tried(state, _vertical(state, files))
    state = _tried(state, _units_of_length(state, files))
    return list(state.notes)


def rescue(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    attempt: Attempt,
    files: Files,
    *,
    has_rotations: bool,
) -> str:
    """Return what lets an estimate be scored that is refused, an empty string if nothing does."""
    state = _State(reference, estimate, settings, None, attempt, has_rotations)
    for find in (
        _wrong_stamps,
        _clocks,
        _units_and_clocks,
        _shifts,
        _increments,
        _inverses,
        _between_stamps,
    ):
        tried = _tried(state, find(state, files))
        if tried.notes:
            return str(tried.notes[0])
    return ""


def _tried(state: _State, remedies: Iterable[_Remedy]) -> _State:
    """Return the state with the best remedy and a hint on it, if that raises the score clearly.

    The likeliest remedies come first. None is looked for where there is nothing to gain.
    """
    if state.score > ALMOST_PERFECT:
        return state
    tried = [(remedy, after) for remedy in remedies if (after := state.after(remedy))]
    remedy, best = None, state
    for other, after in tried:
        margin = 0.0
        if remedy:
            margin = EQUAL if other.kind == remedy.kind else other.margin
        if after.score > best.score + margin:
            remedy, best = other, after
    if remedy is None or not _is_clear(state, best, remedy.min_t):
        return state
    name = "PAS" if state.has_rotations else "TAS"
    before = f"{name} {state.score:.3f} as it is, " if state.scored else f"{name} "
    possibilities = {remedy.text: remedy.option}
    for other, after in sorted(tried, key=lambda pair: -pair[1].score):
        is_alike = other.alike != "" and other.alike == remedy.alike
        is_equal = after.score > best.score - EQUAL or not _is_clear(after, best, MIN_T)
        if (is_alike or is_equal) and _is_clear(state, after, other.min_t):
            advice = f"{other.text} ({name} {after.score:.3f} corrected); {other.option}"
            possibilities.setdefault(other.text, advice)
    text = f"{remedy.text} ({before}{best.score:.3f} corrected)"
    hint = Hint(remedy.kind, text, "; or ".join(possibilities.values()))
    return replace(best, notes=(*state.notes, hint))


def _is_clear(before: _State, after: _State, min_t: float) -> bool:
    """Return whether a score is better by much, or by so many standard errors.

    The standard error comes from the means over stretches of time, if the frames are the same.
    """
    gain = after.score - before.score
    if not (before.scored and after.scored and SMALL <= gain < CLEAR):
        return gain >= CLEAR
    if len(before.scored.frames) != len(after.scored.frames):
        return True
    return _t(after.scored.frames - before.scored.frames) >= min_t


def _t(gains: Floats, stretches: int = BLOCKS) -> float:
    """Return the mean in standard errors, from the means over stretches of time."""
    means = np.array([part.mean() for part in np.array_split(gains, stretches) if len(part)])
    error = np.std(means, ddof=1) / np.sqrt(len(means))
    return float(means.mean() / max(error, np.finfo(float).tiny))


def _wrong_stamps(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield other units of the stamps, or stamps of poses that are counted."""
    yield from _units_of_time(state, files)
    yield from _counters(state, files)


def _units_of_time(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield units of the stamps of either file, where their steps or durations are no camera's."""
    reference, estimate = state.reference, state.estimate
    if not reference.keys.dtype.kind == estimate.keys.dtype.kind == "f":
        return
    durations = [np.ptp(reference.keys), np.ptp(estimate.keys)]
    if min(durations) == 0:  # of a single pose
        return
    differ = max(durations) > MAX_RATIO * min(durations)
    steps = [_positive_step(poses.keys) for poses in (reference, estimate)]
    is_usual = [STEPS_OF_CAMERAS[0] <= step <= STEPS_OF_CAMERAS[1] for step in steps]
    factors = [
        _time_factors(step, duration, differ or not usual)
        for step, duration, usual in zip(steps, durations, is_usual, strict=True)
    ]
    for of_ref, of_est in product(*factors):
        if of_ref == of_est == 1:
            continue
        ref, est = (
            trajectory._replace(keys=trajectory.keys * factor)
            for trajectory, factor in ((reference, of_ref), (estimate, of_est))
        )
        units = {
            side: _unit(state, files, side, factor)
            for side, factor in ((REF, of_ref), (EST, of_est))
            if factor != 1
        }
        are_of_one_unit = len({*units.values()}) == 1
        if "" in units.values() or (any(is_usual) and not are_of_one_unit):
            continue
        text = " and ".join(f"{unit} in {files.name(side)}" for side, unit in units.items())
        if len(units) == 2 and are_of_one_unit:
            text = f"{units[REF]} in {files.name(BOTH)}"
        columns = {side: f"t_{unit}" for side, unit in units.items()}
        option = _columns(state, files, columns)
        new_steps = [np.median(np.diff(np.sort(poses.keys))) for poses in (ref, est)]
        yield _Remedy(
            "units",
            f"time stamps seem to be {text}, with steps of {new_steps[0]:.3g} s in "
            f"{files.reference} and {new_steps[1]:.3g} s in {files.estimate}",
            f"{option} names the unit" if option else "write seconds",
            ref,
            est,
            min_t=0.0,
        )


def _time_factors(step: float, duration: float, is_wrong: bool) -> list[float]:
    """Return 1 and, if a step of stamps is or may be wrong, factors that make it a camera's.

    Those under which a recording is short count only if there are no others.
    """
    low, high = STEPS_OF_CAMERAS
    others = TIME_FACTORS if is_wrong else ()
    factors = [factor for factor in others if low <= step * factor <= high]
    long = [factor for factor in factors if duration * factor >= MIN_DURATION]
    return [1.0, *(long or factors)]


def _positive_step(stamps: Floats) -> float:
    """Return the median difference between stamps that follow each other; 0 if all are equal."""
    steps = np.diff(np.sort(stamps))
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0


def _unit(state: _State, files: Files, side: str, factor: float) -> str:
    """Return the unit of the stamps in a file that were read too small by a factor, if any.

    They may have been taken for another one by their size.
    """
    keys = (state.reference if side == REF else state.estimate).keys
    is_smaller = factor > 1 and factor not in LARGE_UNITS.values()
    per_second = TIME_UNITS["ns"] / factor if is_smaller else 1 / factor
    table, names = _table(state, files, side)
    if table and sum(name[0] == "t" for name in names) == 1:
        column = [i for i, name in enumerate(names) if name[0] == "t"]
        per_second = np.ptp(table.numbers(column)) / (np.ptp(keys) * factor)
    all_units = TIME_UNITS | {unit: 1 / seconds for unit, seconds in LARGE_UNITS.items()}
    units = (unit for unit, n in all_units.items() if np.isclose(n, per_second, rtol=1e-3))
    return next(units, "")


def _table(state: _State, files: Files, side: str) -> tuple[Table | None, list[str]]:
    """Return the text table of a side, and what its columns hold; None for other files."""
    settings = state.settings
    path, named, file_format = (
        (files.ref_path, settings.columns_of_reference, settings.file_format)
        if side == REF
        else (files.est_path, settings.columns_of_estimates, settings.est_file_format)
    )
    with suppress(*FAILURES):
        # Columns that are named hold camera-to-world poses.
        if path and file_format.tables and not file_format.inverted:
            table = open_table(path)
            return table, name_columns(table, named)
    return None, []


def _columns(state: _State, files: Files, names: dict[str, str]) -> str | None:
    """Return the options that change what columns hold; an empty string for other files.

    None where they hold that already. `names` has what stands for the time, the quaternion, or x
    and y, in the file of each side.
    """
    options = {}
    for side, name in names.items():
        (_, columns), new = _table(state, files, side), name.split()
        rows = [i for i, old in enumerate(columns) if old[0] in {word[0] for word in new}]
        if len(rows) != len(new):
            return ""
        if [columns[row] for row in rows] == new:
            return None
        for row, word in zip(rows, new, strict=True):
            columns[row] = word
        options[side] = " ".join(columns).rstrip(" -")
    if len(options) == 2 and len({*options.values()}) == 1:
        return f"--columns '{options[REF]}'"
    return " ".join(f"--{side[:3]}_columns '{columns}'" for side, columns in options.items())


def _clocks(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the offset of the clocks if it is certain, or if its score is clearly the highest."""
    settings = state.settings
    timed = state.reference.keys.dtype.kind == state.estimate.keys.dtype.kind == "f"
    if not timed or settings.t_offset == "auto" or settings.frames is not None:
        return
    offset = float(settings.t_offset)
    estimate = state.estimate._replace(keys=state.estimate.keys + offset)
    clock = find_clock(state.reference, estimate)
    if clock is None or not clock.precise or clock.agrees:
        return
    remedy = _of_clock(state, files, clock, offset)
    if clock.certain:
        yield remedy
        return
    rival = _of_clock(state, files, replace(clock, seconds=clock.runner_up), offset)
    best, other = (after.score if after else 0.0 for after in map(state.after, (remedy, rival)))
    if best >= max(other, state.score) + CLEAR:
        seconds = remedy.changes["t_offset"]
        text = f"{remedy.text}, and with one of {rival.changes['t_offset']:.3f} s nearly as well"
        yield replace(remedy, text=text, option=f"--t_offset {seconds:.4f} raises the score")


def _of_clock(state: _State, files: Files, clock: Clock, offset: float) -> _Remedy:
    """Return the remedy that adds the offset of the clocks to the one in the settings."""
    seconds = offset + clock.seconds
    given = f" instead of {offset:.3f} s" if offset else ""
    return _Remedy(
        "clock",
        f"its clock is off: its {clock.motions} fit those of {files.reference} best with an offset "
        f"of {seconds:.3f} s{given}, standard error {clock.error:.4f} s",
        "--t_offset auto adds it",
        state.reference,
        state.estimate,
        {"t_offset": seconds},
        MIN_T if clock.motions == "speeds" else 0.0,
    )


def _shifts(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the shift of frame numbers or rows, if it is certain."""
    reference, estimate = state.reference, state.estimate
    if not reference.keys.dtype.kind == estimate.keys.dtype.kind == "i":
        return
    if not state.settings.file_format.ordered:
        return
    # So many frames pass for a second of a clock.
    span = min(SPAN_OF_FRAMES, np.ptp(estimate.keys) / BLOCKS)
    if span == 0:
        return
    paths = (poses._replace(keys=poses.keys / span) for poses in (reference, estimate))
    are_rows = reference.keys[0] == estimate.keys[0] == 0
    within = MAX_SHIFT * np.ptp(estimate.keys) / span if are_rows else np.inf
    clock = find_clock(*paths, within=within)
    if clock is None or not clock.certain:
        first = int(reference.keys[0] - estimate.keys[0])
        if first:  # no other shift than to the same first frame is likely; the score decides
            yield _of_shift(state, files, first, "the first frames are the same", min_t=np.inf)
        return
    shift = clock.seconds * span
    low, high = shift - 2 * clock.error * span, shift + 2 * clock.error * span
    if round(low) <= 0 <= round(high):
        return
    shifts = range(math.floor(low), math.ceil(high) + 1)
    if are_rows and not state.scored:  # their number differs: some are missing at the ends
        missing = len(reference.keys) - len(estimate.keys)
        shifts = range(max(shifts.start, min(missing, 0)), min(shifts.stop, max(missing, 0) + 1))
    min_t = MIN_T if clock.motions == "speeds" else 0.0
    for frames in sorted({*shifts} - {0}, key=lambda n: abs(n - shift)):
        yield _of_shift(state, files, frames, "motions fit best", min_t)


def _of_shift(state: _State, files: Files, frames: int, why: str, min_t: float) -> _Remedy:
    """Return the remedy that adds so many frames to the numbers of the estimate."""
    estimate = state.estimate
    return _Remedy(
        "clock",
        f"its frames are off by {abs(frames)} against those of {files.reference}: {why} if its "
        f"frame 0 is frame {frames}",
        "write the number of its frame before each pose",
        state.reference,
        estimate._replace(keys=estimate.keys + frames),
        min_t=min_t,
    )


def _counters(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the stamps or numbers of frames where one file counts its poses, and the other not.

    Both may hold the same frames, or the one that counts has lost some at its end.
    """
    reference, estimate = state.reference, state.estimate
    if "U" in (reference.keys.dtype.kind, estimate.keys.dtype.kind):
        return
    counts = {
        side: bool((np.diff(poses.keys) == 1).all())
        for side, poses in ((REF, reference), (EST, estimate))
    }
    side = REF if counts[REF] else EST
    counted, other = (reference, estimate) if counts[REF] else (estimate, reference)
    if counts[REF] == counts[EST] or counted.keys[0] not in (0, 1):
        return
    stamps, n = np.sort(other.keys), len(counted.keys)
    step = np.median(np.diff(stamps)) if len(stamps) > 1 else 0
    same = [stamps] if len(stamps) == n else []
    evenly = [stamps[0] + step * np.arange(n)] if step != 1 else []
    for keys in same + evenly:
        keys = keys.astype(stamps.dtype)
        changed = {REF: reference, EST: estimate, side: counted._replace(keys=keys)}
        what = "time stamps" if stamps.dtype.kind == "f" else "numbers"
        remedy = _Remedy(
            "clock",
            f"the {what} of {files.name(side)} seem to count its poses, unlike those of "
            f"{files.name(EST if side == REF else REF)}, which differ by {step:.3g}",
            f"write the {what[:-1]} of its frame before each pose",
            changed[REF],
            changed[EST],
        )
        # Of a path at another speed, some score by chance.
        if _fit_after(state, remedy).misfit <= MAX_MISFIT:
            yield remedy


def _units_and_clocks(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield units of time under which the offset of the clocks is certain."""
    for units in _units_of_time(state, files):
        corrected = replace(state, reference=units.reference, estimate=units.estimate)
        for clock in _clocks(corrected, files):
            text, option = f"{units.text}; then {clock.text}", f"{units.option}; {clock.option}"
            yield replace(clock, kind=units.kind, text=text, option=option)


def _on_time(state: _State, files: Files) -> _State:
    """Return the state with the clocks corrected, and a convention where neither is enough."""
    if state.score > ALMOST_PERFECT:
        return state
    clocks = [*_clocks(state, files), *_shifts(state, files)]
    on_time = _tried(state, clocks)
    if on_time is not state or not clocks:
        return on_time
    late = _tried(state, chain(_conventions(state, files), _mirrored(state, files)))
    remedies = []
    for clock in clocks:
        after = state.after(clock)
        if after is None:
            continue
        for other in chain(_conventions(after, files), _mirrored(after, files)):
            both = after.after(other)
            if both and _is_clear(late, both, clock.min_t):
                text, option = f"{clock.text}; and {other.text}", f"{clock.option}; {other.option}"
                changes = {**clock.changes, **other.changes}
                remedies.append(replace(other, text=text, option=option, changes=changes))
    return _tried(state, remedies)


def _conventions(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the convention of either file, with what corrects it, and mirrored axes."""
    if not state.scored:
        return
    found: list[Convention] = []
    mirrors: list[_Remedy] = []
    if state.has_rotations:
        gt, est = state.scored.gt_poses, state.scored.est_poses
        how = {"alignment": state.settings.alignment, "up": state.settings.up}
        orders = {side: _order(state, files, side) for side in (REF, EST)}
        found = find_conventions(gt, est, inverted=_inverted(state.settings), orders=orders, **how)
        # On a plane, another convention and a mirror have much the same effect.
        if found or rotations_fit_mirrored(gt, est, MIRRORS.values(), **how):
            mirrors = list(_mirrors(state, files))
    if mirrors and _fits_mirrored(state.scored, state.settings):
        yield from mirrors
    for convention in found:
        frame, body_rotation = "", convention.body_rotation
        if body_rotation is not None:
            frame = (
                f"the camera frame of {files.estimate} is rotated against that of "
                f"{files.reference}, {describe_rotation(body_rotation)}"
            )
        changes = {"body_rotation": "auto"} if frame else {}
        if convention.mistakes:
            for remedy in _of_convention(state, files, convention, frame, changes):
                yield replace(
                    remedy,
                    alike=BOTH if len(convention.mistakes) == 2 else remedy.alike,
                    margin=CLEAR if convention.is_unlikely else remedy.margin,
                )
        elif body_rotation is not None:
            yield _Remedy(
                "frame",
                frame,
                "--body_rotation auto removes it",
                state.reference,
                state.estimate,
                changes,
                # A frame that is fitted also fits rotations with other mistakes.
                margin=EQUAL if is_common(body_rotation) else CLEAR,
                alike=BOTH,  # rotations are alike if those of both files are mixed up
            )
    yield from (replace(mirror, margin=CLEAR) for mirror in mirrors)


def _may_have_lever_arm(scored: Scored) -> bool:
    """Return whether a lever arm explains positions, as the inversion of both files would.

    Between two coordinate frames of the same axes, it is what their offset is in inverse poses.
    """
    rows = _sample(scored)
    gt, est = scored.gt_poses[rows], scored.est_poses[rows]
    now = fit_positions(gt, est)
    with suppress(ValueError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        arm = find_lever_arm(gt[:, :3, 3], est, now.error)
        moved = with_lever_arm(Trajectory(rows, est), arm.vector)
        return fit_positions(gt, moved.poses).misfit < now.misfit / 2
    return False


def _inverted(settings: Settings) -> set[str]:
    """Return the files whose poses were inverted when they were read."""
    by = {
        REF: (settings.file_format, settings.ref_invert),
        EST: (settings.est_file_format, settings.invert),
    }
    return {side for side, (written, invert) in by.items() if written.inverted != invert}


def _of_convention(
    state: _State, files: Files, convention: Convention, frame: str, changes: dict[str, Any]
) -> Iterator[_Remedy]:
    """Yield what corrects the convention of poses or rotations, unless the file says otherwise."""
    reference, estimate, settings = state.reference, state.estimate, state.settings
    mistakes = convention.mistakes
    sides, kinds = [*mistakes], {*mistakes.values()}
    inverted = _inverted(settings)
    ref, est = (
        trajectory._replace(
            poses=corrected(trajectory.poses, mistakes[side], inverted=side in inverted)
        )
        if side in mistakes
        else trajectory
        for side, trajectory in ((REF, reference), (EST, estimate))
    )
    names = files.name(BOTH if len(sides) == 2 else sides[0])
    texts, options = [], []
    orders = {side: INVERTED_W.get(mistake, mistake) for side, mistake in mistakes.items()}
    if kinds.isdisjoint({INVERTED, INVERTED_ROTATIONS, INVERTED_POSITIONS}):
        texts.append(f"the quaternions of {names} seem to have w at the wrong end")
        columns = _columns(state, files, orders)
        true_orders = " and ".join(dict.fromkeys(orders.values()))
        options.append(
            f"name their order with {columns}"
            if columns
            else f"reorder them, since they are {true_orders}"
        )
    if INVERTED_ROTATIONS in kinds:
        texts.append(f"the rotations of {names} seem to be world-to-camera, positions not")
        options.append("transpose them in the file")
    if INVERTED_POSITIONS in kinds:
        of_inverses, of_poses = "world-to-camera translations", "camera centres"
        seem = _by_side(sides, inverted, of_poses, of_inverses)
        true = _by_side(sides, inverted, of_inverses, of_poses)
        texts.append(f"the positions of {names} seem to be {seem}, rotations not")
        options.append(f"write {true}, -R t, in their place")
    is_inverted_w = kinds <= {*INVERTED_W}
    if INVERTED in kinds or is_inverted_w:
        text, option = _of_inverted(state, files, sides, "--body_rotation auto" if frame else "")
        texts.append(text)
        options.append(option)
    option = (", then " if is_inverted_w else "; ").join(options)
    if frame:
        texts.append(frame)
        option += ", and add --body_rotation auto" if "--body_rotation" not in option else ""
    text = ", and ".join(texts)
    (kind,) = kinds & {INVERTED, INVERTED_ROTATIONS, INVERTED_POSITIONS} or {"quaternions"}
    yield _Remedy(kind, text, option, ref, est, changes, alike=kind)


def _order(state: _State, files: Files, side: str) -> str:
    """Return the order in which quaternions were read; an empty string if there are none."""
    settings = state.settings
    file_format = settings.file_format if side == REF else settings.est_file_format
    if file_format.w_first:
        return W_FIRST
    _, names = _table(state, files, side)
    order = " ".join(name for name in names if name[0] == "q")
    return order if order in (W_FIRST, W_LAST) else ""


def _of_inverted(
    state: _State, files: Files, sides: list[str], extra_option: str
) -> tuple[str, str]:
    """Return what seems to be wrong with files of one convention, and what corrects it."""
    settings = state.settings
    is_inverted = {REF: settings.ref_invert, EST: settings.invert}
    add, leave = (
        " ".join(f"--{side[:3]}_invert" for side in sides if is_inverted[side] == inverted)
        for inverted in (False, True)
    )
    if add and leave:
        text = f"the wrong one of {files.reference} and {files.estimate} is inverted"
        return text, f"{add} corrects it; leave out {leave}"
    names = files.name(BOTH if len(sides) == 2 else sides[0])
    if leave:
        return f"the poses of {names} seem to be camera-to-world", f"leave out {leave}"
    option = f"{' '.join([add, extra_option]).strip()} corrects it"
    seem = _by_side(sides, _inverted(settings), "camera-to-world", "world-to-camera")
    if len(sides) == 2 and state.scored and _may_have_lever_arm(state.scored):
        option += (
            f"; if the positions of {files.estimate} are those of another point of its rig, "
            "--lever_arm auto instead"
        )
    return f"the poses of {names} seem to be {seem}", option


def _inverses(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the inverse poses of the reference, if the estimate's positions fit those.

    World-to-camera poses of cameras that look at one point have one position.
    """
    _, option = _of_inverted(state, files, [REF], "")
    remedy = _Remedy(
        INVERTED,
        f"the poses of {files.reference} may be world-to-camera, of cameras that look at one point",
        option,
        state.reference._replace(poses=inverse_poses(state.reference.poses)),
        state.estimate,
    )
    if _fit_after(state, remedy).misfit <= MAX_MISFIT:
        yield remedy


def _by_side(sides: list[str], inverted: set[str], if_inverted: str, otherwise: str) -> str:
    """Return words for files that were inverted when they were read, and for others."""
    words = [if_inverted if side in inverted else otherwise for side in sides]
    return " and ".join(dict.fromkeys(words))


def _sample(scored: Scored) -> Indices:
    """Return the rows of some poses that were compared, of moving cameras."""
    return moving_cameras(scored.gt_poses, scored.est_poses)


def _mirrored(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield mirrored axes, where mirrored positions fit better, or that depends on the mirror."""
    kinds = {note.kind for note in state.notes}
    if state.scored and "mirrored" not in kinds and _fits_mirrored(state.scored, state.settings):
        yield from (replace(remedy, min_t=0.0) for remedy in _mirrors(state, files))


def _fits_mirrored(scored: Scored, settings: Settings) -> bool:
    """Return whether mirrored positions move more like the reference's, by so many standard errors.

    Drift may well mirror a path, such as the height of a road, but hardly its motions. Those of
    longer stretches have larger errors if it is alike in neighbouring ones.
    """
    rows = _sample(scored)
    if len(rows) < MIN_CAMERAS:
        return False
    gt, est = scored.gt_poses[rows], scored.est_poses[rows]
    fits = [fit_positions(gt, poses) for poses in (est, np.diag([1.0, 1.0, -1.0, 1.0]) @ est)]
    if fits[1].misfit > MAX_MISFIT:  # as of unrelated paths, which chance makes more alike
        return False
    if settings.alignment in ("yaw", "none"):  # which leave a mirror of a plane
        how = {"alignment": settings.alignment, "up": settings.up}
        gt, est = gt[:, :3, 3], est[:, :3, 3]
        errors = [
            Similarity.fit(gt, positions, **how).inverse().apply(positions) - gt
            for positions in (est, *(est @ mirror for mirror in MIRRORS.values()))
        ]
        return any(_move_more_alike(errors[0], mirrored) for mirrored in errors[1:])
    if fits[1].misfit < fits[0].misfit / 3:
        return True
    is_better = fits[1].misfit < fits[0].misfit
    return is_better and _move_more_alike(fits[0].errors, fits[1].errors)


def _move_more_alike(errors: Floats, others: Floats) -> bool:
    """Return whether the others of two errors of positions change less from pose to pose."""
    step = -(-len(errors) // (3 * BLOCKS))
    return _are_smaller(errors[step:] - errors[:-step], others[step:] - others[:-step])


def _are_smaller(errors: Floats, others: Floats) -> bool:
    """Return whether the others of two errors (n, 3) are smaller by MIN_T standard errors."""
    before, after = ((each**2).sum(axis=1) for each in (errors, others))
    cap = OUTLIER**2 * min(np.median(before), np.median(after))
    gains = np.minimum(before, cap) - np.minimum(after, cap)
    return all(_t(gains, n) >= MIN_T for n in (BLOCKS, BLOCKS // 2, BLOCKS // 4))


def _mirrors(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield swapped columns of a file without rotations, and a mirrored reference."""
    reference, estimate = state.reference, state.estimate
    text = (
        f"{files.reference} and {files.estimate} are mirror images: the reference, or the "
        "estimate, is left-handed, as Unity's and Unreal's frames are, or has two axes swapped, "
        "such as north and east"
    )
    for side, trajectory in ((REF, reference), (EST, estimate)):
        if not _has_constant(trajectory):
            continue
        poses = trajectory.poses.copy()
        poses[:, :2, 3] = poses[:, 1::-1, 3]
        swapped = {REF: reference, EST: estimate, side: trajectory._replace(poses=poses)}
        option = _columns(state, files, {side: "y x"})
        if option:
            swap = f"{option} swaps two axes"
            yield _Remedy("mirrored", text, swap, swapped[REF], swapped[EST])
    # An alignment that rotates freely takes each of these mirrors of positions to any other.
    rotates_freely = state.settings.alignment not in ("yaw", "none")
    any_mirror = {"one axis negated, or two swapped,": [*MIRRORS.values()]}
    single_mirrors = {change: [mirror] for change, mirror in MIRRORS.items()}
    mirrors_of_positions = any_mirror if rotates_freely else single_mirrors
    candidates = [(False, *item) for item in mirrors_of_positions.items()]
    candidates += [(True, *item) for item in single_mirrors.items() if state.has_rotations]
    scored = state.scored if state.has_rotations else None
    for with_rotations, change, mirrors in candidates:
        if scored and all(_move_less_alike(scored, mirror, with_rotations) for mirror in mirrors):
            continue
        parts = "positions and rotations" if with_rotations else "positions"
        option = f"correct the export: with {change} in its {parts}, {files.reference} fits"
        poses = _mirror(reference.poses, mirrors[0], with_rotations)
        yield _Remedy("mirrored", text, option, reference._replace(poses=poses), estimate)


def _mirror(poses: Floats, mirror: Floats, with_rotations: bool) -> Floats:
    """Return poses with mirrored positions, and rotations if these are mirrored, too."""
    mirrored = poses.copy()
    mirrored[:, :3, 3] = poses[:, :3, 3] @ mirror
    if with_rotations:
        mirrored[:, :3, :3] = mirror @ poses[:, :3, :3] @ mirror
    return mirrored


def _move_less_alike(scored: Scored, mirror: Floats, with_rotations: bool) -> bool:
    """Return whether a mirror makes motions in the frames of the cameras less alike.

    Heights of a road that drift may fit better mirrored, but then a camera that moves ahead does
    not.
    """
    rows = _sample(scored)
    if len(rows) < MIN_CAMERAS:
        return False
    step = -(-len(rows) // (3 * BLOCKS))
    errors = []
    for reference in (scored.gt_poses, _mirror(scored.gt_poses, mirror, with_rotations)):
        gt, est = (
            (inverse_poses(poses[rows[:-step]]) @ poses[rows[step:]])[:, :3, 3]
            for poses in (reference, scored.est_poses)
        )
        errors.append(gt @ align_vectors(gt, est)[1] - est)
    now, then = errors
    error, size = (np.median(np.linalg.norm(vectors, axis=1)) for vectors in (now, est))
    return bool(error < MAX_MISFIT_OF_RELATED * size) and _are_smaller(then, now)


def _vertical(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield other vertical axes of both files, or of the estimate, where the alignment keeps it."""
    settings = state.settings
    if not state.scored or settings.alignment != "yaw":
        return
    up = _unit_vector(settings.up)
    rows = _sample(state.scored)
    rotation = fit_positions(state.scored.gt_poses[rows], state.scored.est_poses[rows]).rotation
    if rotation is None or up @ rotation @ up > np.cos(np.radians(MIN_TILT)):
        return
    for axis in UP:
        turn = np.eye(4)
        turn[:3, :3] = project_to_rotation(np.outer(up, _unit_vector(axis)))  # and any yaw
        yield _Remedy(
            "vertical",
            f"the vertical axis of {files.estimate} seems to be {axis}, that of {files.reference} "
            f"{settings.up}",
            f"write {files.estimate} with {settings.up} up; --alignment rigid removes any rotation",
            state.reference,
            state.estimate._replace(poses=turn @ state.estimate.poses),
        )
    for axis in "xyz".replace(settings.up[-1], ""):
        yield _Remedy(
            "vertical",
            f"the vertical axis of {files.name(BOTH)} seems to be {axis}",
            f"--up {axis} names it",
            state.reference,
            state.estimate,
            {"up": axis},
        )


def _unit_vector(axis: str) -> Floats:
    """Return the unit vector of an axis, such as -z."""
    return np.asarray(np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0))


def _has_constant(trajectory: Trajectory) -> bool:
    """Return whether a trajectory has positions only, whose rotations are nan or all alike."""
    rotations = trajectory.poses[:, :3, :3]
    rotations = rotations[finite_rows(rotations)]
    return bool((rotations == rotations[:1]).all())


def _increments(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield rows that are motions from frame to frame, multiplied to poses.

    Their positions fit much better then. A motion leads to the pose of its row, or away from it.
    """
    reference, estimate = state.reference, state.estimate
    if not state.has_rotations:
        return
    is_named = reference.keys.dtype.kind == "U"  # poses in no order, which only scoring matches
    now, sides = None, []
    if state.scored:
        rows = _sample(state.scored)
        if len(rows) < MIN_CAMERAS:
            return
        now = fit_positions(state.scored.gt_poses[rows], state.scored.est_poses[rows])
        sides = [EST, REF] if now.misfit > MAX_MISFIT else []
        # Products of poses in one frame hide their noise.
        if not is_named and not _has_constant(estimate) and _are_rather_motions(reference):
            sides.append(BOTH)
    else:
        missing = len(reference.keys) - len(estimate.keys)  # n poses have n - 1 motions
        if abs(missing) != 1 or not reference.keys.dtype.kind == estimate.keys.dtype.kind == "i":
            return
        sides = [EST if missing == 1 else REF]
    for side, inverse, leads_away in product(sides, (False, True), (False, True)):
        ref, est = (
            _multiplied(trajectory, inverse, leads_away) if side in (changed, BOTH) else trajectory
            for changed, trajectory in ((REF, reference), (EST, estimate))
        )
        if not state.scored and side == EST:
            est = _from_identity(est, reference)
        elif not state.scored and side == REF:
            ref = _from_identity(ref, estimate)
        motions = "inverse motions" if inverse else "motions"
        text = f"the rows of {files.name(side)} seem to be {motions} from frame to frame"
        factors = "the product of their inverses" if inverse else "their product"
        option = f"write {factors}, pose by pose"
        option += ", starting from the identity" if leads_away or not state.scored else ""
        alike = "increments" if side == BOTH else ""  # inverse ones multiply to paths, too
        remedy = _Remedy("increments", text, option, ref, est, alike=alike)
        fit = _fit_after(state, remedy) if is_named else _fit(ref, est)
        fits = fit.is_much_better_than(now) if now else fit.misfit <= MAX_MISFIT
        # Straight paths are all alike, unless the times along them agree, which names do not have.
        if fits and (not is_named or fit.misfit <= fit.certain):
            yield remedy


def _fit_after(state: _State, remedy: _Remedy) -> PositionFit:
    """Return how well positions fit after a remedy, as scoring matches them."""
    after = state.after(remedy)
    if after is None or after.scored is None:
        return PositionFit(np.zeros((0, 3)))
    rows = _sample(after.scored)
    return fit_positions(after.scored.gt_poses[rows], after.scored.est_poses[rows])


def _fit(reference: Trajectory, estimate: Trajectory) -> PositionFit:
    """Return how well some positions fit whose keys are the same, or the nearest stamps."""
    estimated = np.flatnonzero(finite_rows(estimate.poses))
    nearest, distance = nearest_stamps(reference.keys, estimate.keys[estimated])
    gt, est = reference.poses[nearest], estimate.poses[estimated]
    near = finite_rows(gt) & (distance <= np.median(np.diff(reference.keys)) / 2)
    rows = moving_cameras(gt[near], est[near])
    if len(rows) < MIN_CAMERAS:
        return PositionFit(np.zeros((0, 3)))
    return fit_positions(gt[near][rows], est[near][rows])


def _from_identity(products: Trajectory, other: Trajectory) -> Trajectory:
    """Return the identity and products of motions, which are one fewer than the other's poses."""
    return Trajectory(other.keys, np.concatenate([np.eye(4)[None], products.poses]))


def _are_rather_motions(trajectory: Trajectory) -> bool:
    """Return whether rows are motions of a camera rather than poses.

    As motions, it turns and moves no faster than a camera, but does turn. As poses, it moves more
    slowly, and back and forth within a small space, as velocities change.
    """
    rows = finite_rows(trajectory.poses)
    poses = trajectory.poses[rows]
    if not len(poses) or _has_constant(trajectory):
        return False
    is_timed = trajectory.keys.dtype.kind == "f"
    step = float(np.median(np.diff(np.sort(trajectory.keys[rows])))) if is_timed else FRAME
    turns, lengths = rotation_angles(poses[:, :3, :3]), np.linalg.norm(poses[:, :3, 3], axis=1)
    if np.median(turns) > MAX_TURN * step or np.median(lengths) > MAX_SPEED * step:
        return False
    every = max(round(1 / step), 1) if step > 0 else 1  # a row in a second, to see no noise
    positions = poses[::every, :3, 3]
    moves = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    extent = np.median(np.linalg.norm(positions - np.median(positions, axis=0), axis=1))
    is_slow = len(moves) > 0 and np.median(moves) <= SLOW * every * step
    return bool(is_slow and moves.sum() >= BACK_AND_FORTH * extent)


def _multiplied(trajectory: Trajectory, inverse: bool, leads_away: bool) -> Trajectory:
    """Return the poses to which motions from frame to frame multiply; lost ones stay lost."""
    rows = np.flatnonzero(finite_rows(trajectory.poses))
    steps = inverse_poses(trajectory.poses[rows]) if inverse else trajectory.poses[rows]
    products, before = np.full_like(trajectory.poses, np.nan), np.eye(4)
    for n, (row, step) in enumerate(zip(rows, steps, strict=True)):
        after = before @ step
        after[:3, :3] = project_to_rotation(after[:3, :3]) if n % 100 == 99 else after[:3, :3]
        products[row] = before if leads_away else after
        before = after
    return trajectory._replace(poses=products)


def _between_stamps(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield interpolation, where all poses miss the stamps of a sparse reference."""
    stamps, settings = state.reference.keys, state.settings
    timed = stamps.dtype.kind == state.estimate.keys.dtype.kind == "f"
    if not timed or settings.sync != "auto":  # which interpolates any other reference
        return
    offset = 0.0 if settings.t_offset == "auto" else float(settings.t_offset)
    keys = np.sort(state.estimate.keys) + offset
    inside = (stamps >= keys[0]) & (stamps <= keys[-1])
    _, distance = nearest_stamps(keys, stamps[inside])
    if not len(distance) or np.median(distance) > settings.t_max_diff:
        yield _Remedy(
            "sparse",
            f"its poses miss the stamps of {files.reference}, which is sparse",
            "--sync interpolate compares them with straight lines between its poses",
            state.reference,
            state.estimate,
            {"sync": "interpolate"},
        )


def _units_of_length(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield other units of length, where the alignment keeps the scale."""
    if not state.scored or state.settings.alignment == "similarity":
        return
    rows = _sample(state.scored)
    if len(rows) < MIN_CAMERAS:
        return
    fit = fit_positions(state.scored.gt_poses[rows], state.scored.est_poses[rows])
    min_t = 0.0 if fit.misfit <= MAX_MISFIT else MIN_T
    for factor, units in LENGTHS.items():
        for side, other, ratio in ((EST, REF, factor), (REF, EST, 1 / factor)):
            if abs(np.log(fit.scale / ratio)) < 0.1:
                poses = state.estimate.poses.copy()
                poses[:, :3, 3] /= ratio
                seem = units.format(other=files.name(other))
                yield _Remedy(
                    "units",
                    f"the positions of {files.name(side)} seem to be in {seem}, with an estimate "
                    f"of {fit.scale:.4g}x the reference",
                    "write both in one unit, or --alignment similarity removes the scale",
                    state.reference,
                    state.estimate._replace(poses=poses),
                    min_t=min_t,
                )
