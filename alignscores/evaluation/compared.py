"""An estimate matched with its reference, corrected as the settings say, and scored."""

import math
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Booleans, Floats, Indices
from ..io import Trajectory
from ..pose import PASResult, pas
from ..registration import Registration
from ..registration import pcr99 as pcr99_of_all
from ..rotation import RASResult
from ..similarity import Similarity
from ..thresholds import tas_distance, too_few_cameras
from ..translation import TASResult, tas
from ..validation import AlignmentWarning, finite_rows
from .clock import Clock, find_clock
from .conventions import find_conventions, rotate_cameras
from .evaluation import Note
from .hints import Scored
from .lever import LeverArm, find_lever_arm, with_lever_arm
from .match import Matches, check_scorable, match, no_clock, poses_of_rows, with_stamps_of_sparse
from .settings import Settings
from .time import is_near

__all__ = ["Compared", "half_distance_of", "match_and_score", "notes_on_matching", "pcr99"]
__all__ += ["tas_of_other_seeds"]

SMALL_OFFSET = 0.02  # seconds; a smaller offset of the clocks must raise the score
CLEAR_OFFSET = 0.005  # by so much; a larger one must not lower the score by as much
MIN_GAIN_BY_INTERPOLATION = 0.03  # of the score, between the poses of a sparse reference
MIN_HELD = 0.01  # share of the frames in which the reference stops, but not the estimate


@dataclass(frozen=True, eq=False)
class Compared:
    """An estimate that was matched, corrected as the settings say, and scored."""

    estimate: Trajectory
    matches: Matches
    result: PASResult
    t_offset: float
    clock: Clock | None  # that was looked for
    chord: float  # error of straight lines between the poses of a sparse reference, in units of d
    lever_arm: LeverArm | None
    body_rotation: Floats | None

    @property
    def scored(self) -> Scored:
        """The PAS, or the TAS without rotations, with every pose that has a reference."""
        result, matches = self.result, self.matches
        value, frames = result.tas.score, _of_frames(result.tas)
        if matches.has_rotations:
            value = result.score
            frames = result.weight * frames + (1 - result.weight) * _of_frames(result.ras)
        poses = self.estimate.poses[matches.pose_rows]
        return Scored(value, frames, matches.pose_references, poses)


def _of_frames(result: TASResult | RASResult) -> Floats:
    """Return the share of the thresholds that each frame is below: their mean is the score."""
    reached = np.searchsorted(result.thresholds, result.errors, side="right")
    return np.asarray(1 - reached / len(result.thresholds))


def match_and_score(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    has_rotations: bool,
    groups: Indices | None,
) -> Compared:
    """Match, correct and score an estimate."""
    clock, t_offset = None, 0.0
    timed = reference.keys.dtype.kind == estimate.keys.dtype.kind == "f"
    if timed and settings.t_offset == "auto":
        clock = find_clock(reference, estimate)
        t_offset = _offset(reference, estimate, settings, clock, has_rotations, groups)
    elif timed:
        t_offset = float(settings.t_offset)
    poses = estimate._replace(keys=estimate.keys + t_offset) if timed else estimate
    poses, how, chord = with_stamps_of_sparse(reference, poses, settings, groups)
    matches = replace(match(reference, poses, how, groups), has_rotations=has_rotations)
    check_scorable(reference, poses, matches, settings, len(estimate.keys))
    poses, lever_arm, body_rotation = _corrected(poses, matches, settings)
    matches = replace(matches, est_poses=poses_of_rows(poses, matches.est_rows))
    result = _scores(matches, settings)
    return Compared(poses, matches, result, t_offset, clock, chord, lever_arm, body_rotation)


def _offset(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    clock: Clock | None,
    has_rotations: bool,
    groups: Indices | None,
) -> float:
    """Return the offset of the clocks if it is certain and does not cost score, otherwise 0.

    Raise a ValueError where it is not certain, and the stamps as they are have no time in common.
    """
    if clock is None or not clock.certain:
        if estimate.keys.min() > reference.keys[-1] or estimate.keys.max() < reference.keys[0]:
            raise ValueError(
                "no time offset makes its motions fit the reference's with certainty"
                f"{_rival(clock)}"
                f"{no_clock(reference.keys, estimate.keys) or '; --t_offset X sets one'}"
            )
        return 0.0
    if clock.agrees:
        return 0.0
    scores = []
    for seconds in (0.0, clock.seconds):
        try:
            tried = replace(settings, t_offset=seconds)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                attempt = match_and_score(reference, estimate, tried, has_rotations, groups)
            scores.append(attempt.scored.score)
        except ValueError:
            scores.append(-math.inf)
    bound = CLEAR_OFFSET if abs(clock.seconds) < SMALL_OFFSET else -CLEAR_OFFSET
    return clock.seconds if scores[1] > scores[0] + bound else 0.0


def _rival(clock: Clock | None) -> str:
    """Return the best offsets that are not certain, in words."""
    if clock is None:
        return ""
    best = f"{clock.seconds:.3f} s"
    if math.isfinite(clock.error):
        best += f" (standard error {clock.error:.3f} s)"
    if math.isnan(clock.runner_up):
        return f": the best is {best}"
    return f": the best are {best} and {clock.runner_up:.3f} s"


def notes_on_matching(
    outcome: Compared,
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    groups: Indices | None,
    ref_name: str,
) -> list[Note]:
    """Return notes on the clock that was looked for, and on a sparse or interrupted reference."""
    notes = []
    if settings.t_offset == "auto" and outcome.matches.timed:
        clock, seconds = outcome.clock, outcome.t_offset
        if seconds and clock:
            text = f"time offset of {seconds:.4f} s (standard error {clock.error:.4f} s) added"
        elif clock and clock.certain and not clock.agrees:
            text = (
                f"no time offset added: {clock.seconds:.4f} s (standard error {clock.error:.4f} s) "
                "fits its motions best, but does not raise the score clearly"
            )
        elif clock and clock.certain:
            text = "no time offset added: its motions fit with its stamps as they are"
        else:
            text = f"no time offset added: none is certain{_rival(clock)}"
        notes.append(Note("clock", text))
    if outcome.chord:
        text = (
            "the reference is too sparse to be interpolated: straight lines between its poses are "
            f"off by about {outcome.chord:.1%} of d; poses are compared at its own stamps"
        )
        remedy = _by_interpolation(outcome, reference, estimate, settings, groups)
        notes.append(Note("sparse", text, remedy))
    if held := _of_held(outcome, reference, estimate, settings, groups, ref_name):
        notes.append(held)
    if n_rig_frames := outcome.matches.n_rig_frames:
        text = f"d counts the cameras of each of {n_rig_frames} rig frames as one, at their mean"
        has_names = outcome.matches.keys.dtype.kind == "U"
        remedy = "--rig_frames none counts each camera" if has_names else ""
        notes.append(Note("rig", f"{text} position", remedy))
    return notes


def _by_interpolation(
    outcome: Compared,
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    groups: Indices | None,
) -> str:
    """Return the advice to interpolate a sparse reference, if that raises the score clearly."""
    interpolated = replace(settings, t_offset=outcome.t_offset, sync="interpolate")
    before, after = _before_and_after(outcome, reference, estimate, interpolated, groups)
    if not after >= before + MIN_GAIN_BY_INTERPOLATION:
        return ""
    name = "PAS" if outcome.matches.has_rotations else "TAS"
    return (
        f"--sync interpolate raises the {name} from {before:.3f} to {after:.3f}; its errors then "
        "include the straight lines"
    )


def _of_held(
    outcome: Compared,
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    groups: Indices | None,
    ref_name: str,
) -> Note | None:
    """Return a note on a reference that holds a pose while it has none, if leaving it out helps."""
    held = np.flatnonzero(_is_held(outcome, reference))
    if not len(held):
        return None
    others = np.delete(np.arange(len(reference.keys)), held)
    rest = Trajectory(reference.keys[others], reference.poses[others])
    tried = replace(settings, t_offset=outcome.t_offset)
    of_rest = None if groups is None else groups[others]
    before, after = _before_and_after(outcome, rest, estimate, tried, of_rest)
    if not after > before:
        return None
    name = "PAS" if outcome.matches.has_rotations else "TAS"
    first, last = reference.keys[held[[0, -1]]].tolist()
    where = f"{first:.3f} and {last:.3f} s" if outcome.matches.timed else f"{first} and {last}"
    text = (
        f"{len(held)} of {len(reference.keys)} poses of {ref_name} repeat the one before between "
        f"{where}, although the estimate moves by more than d or 10 degrees meanwhile"
    )
    remedy = f"without them the {name} is {after:.3f} instead of {before:.3f}: leave these rows out"
    return Note("held", text, remedy)


def _is_held(outcome: Compared, reference: Trajectory) -> Booleans:
    """Return which rows of a reference have one pose throughout, while the estimate moves away.

    From the rows before them or to those behind them it jumps: by more than d and its usual step,
    or by 10 degrees. Otherwise it rests, and the estimate drifts. They are more than one percent.
    """
    matches, tas_result, poses = outcome.matches, outcome.result.tas, reference.poses
    nothing = np.zeros(len(poses), dtype=bool)
    frames = np.flatnonzero(finite_rows(matches.est_poses))
    if tas_result.alignment is None or not len(frames):
        return nothing
    changes = np.append(True, (poses[1:] != poses[:-1]).any(axis=(1, 2)))
    starts, stretch = np.flatnonzero(changes), np.cumsum(changes) - 1
    steps = np.linalg.norm(np.diff(reference.positions, axis=0), axis=1)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    jumps = np.append(False, ~is_near(poses[1:], poses[:-1], max(tas_result.unit, usual)))
    jumps = np.append(jumps[starts], False)
    may_hold = jumps[:-1] | jumps[1:]
    est, of_frame = matches.est_poses[frames], stretch[matches.gt_rows[frames]]
    _, first, inverse = np.unique(of_frame, return_index=True, return_inverse=True)
    unit = tas_result.unit * tas_result.alignment.scale
    moved = may_hold[of_frame] & ~is_near(est, est[first][inverse], unit)
    if np.mean(moved) <= MIN_HELD:
        return nothing
    return np.isin(stretch, of_frame[moved])


def _before_and_after(
    outcome: Compared,
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    groups: Indices | None,
) -> tuple[float, float]:
    """Return the score, and that of other files or settings; NaN where they cannot be scored."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tried = match_and_score(
                reference, estimate, settings, outcome.matches.has_rotations, groups
            )
    except ValueError:
        return outcome.scored.score, math.nan
    return outcome.scored.score, tried.scored.score


def _corrected(
    estimate: Trajectory, matches: Matches, settings: Settings
) -> tuple[Trajectory, LeverArm | None, Floats | None]:
    """Return an estimate of the reference's prism with its camera axes, and what was corrected."""
    lever_arm, body_rotation = None, None
    matched = estimate.poses[matches.pose_rows]
    if settings.lever_arm == "auto" and finite_rows(matched).any():  # otherwise the run has failed
        positions = matches.pose_references[:, :3, 3]
        lever_arm = find_lever_arm(positions, matched, matches.unit)
    elif isinstance(settings.lever_arm, tuple):
        lever_arm = LeverArm(np.array(settings.lever_arm), np.zeros(3))
    if lever_arm is not None:
        estimate = with_lever_arm(estimate, lever_arm.vector)
    if settings.body_rotation == "auto" and matches.has_rotations:
        found = find_conventions(
            matches.pose_references,
            estimate.poses[matches.pose_rows],
            alignment=settings.alignment,
            up=settings.up,
        )
        frames = [convention.body_rotation for convention in found if not convention.mistakes]
        body_rotation = frames[0] if frames else None
    poses = rotate_cameras(estimate.poses, body_rotation)
    return estimate._replace(poses=poses), lever_arm, body_rotation


def _scores(matches: Matches, settings: Settings) -> PASResult:
    """Return the scores at the first seed; RAS and PAS are NaN without rotations."""
    weight, degrees = settings.weight, settings.max_threshold_deg
    result = pas(
        matches.gt_poses,
        matches.est_poses,
        rng=settings.seed,
        weight=weight,
        max_threshold_deg=degrees,
        **_tas_options(matches, settings),
    )
    if matches.has_rotations:
        return result
    errors = np.full_like(result.ras.errors, np.nan)
    ras = replace(
        result.ras,
        score=math.nan,
        errors=errors,
        cumulative_frequency=np.zeros_like(result.ras.cumulative_frequency),
        alignment=None,
    )
    return replace(result, score=math.nan, ras=ras)


def tas_of_other_seeds(matches: Matches, settings: Settings) -> list[float]:
    """Return the TAS of the other seeds."""
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    options = _tas_options(matches, settings)
    return [tas(gt, est, rng=seed, **options).score for seed in settings.seeds[1:]]


def _tas_options(matches: Matches, settings: Settings) -> dict[str, Any]:
    """Return the options of `tas`."""
    registration: str | Registration = settings.registration
    if registration == "pcr99" and matches.n_poses < matches.matched:  # a pose of several frames
        registration = pcr99
    return {"unit": matches.unit, "registration": registration, **settings.tas_options}


def half_distance_of(matches: Matches, settings: Settings) -> float:
    """Return the half-score distance, by the refined registration; NaN for too few poses."""
    lost = len(matches.keys) - matches.matched
    if reason := too_few_cameras(
        lost + matches.n_poses, 0.5, settings.alignment
    ):  # each of many frames
        warnings.warn(reason, AlignmentWarning, stacklevel=2)
        return math.nan
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    return tas_distance(gt, est, rng=settings.seed, alignment=settings.alignment, up=settings.up)


def pcr99(
    gt: Floats, est: Floats, /, *, rank: int, **options: Any
) -> tuple[Similarity | None, int]:
    """Register the different cameras by PCR-99: a pose of many frames would fit itself."""
    _, first = np.unique(np.hstack([gt, est]), axis=0, return_index=True)
    rows = np.sort(first)
    rank = max(4, round(rank * len(rows) / len(est)))
    return pcr99_of_all(gt[rows], est[rows], rank=min(rank, len(rows)), **options)
