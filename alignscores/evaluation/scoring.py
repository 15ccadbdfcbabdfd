"""`evaluate`: one estimate against its reference, from the files to the notes."""

import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Indices
from ..io import FilePath, Trajectory
from ..metrics import SCORES, Metric, metric
from ..pose import PASResult, pas
from ..registration import Registration
from ..registration import pcr99 as pcr99_of_all
from ..similarity import Similarity, least_squares_rmse
from ..texts import printable, unique_names
from ..thresholds import tas_distance, too_few
from ..translation import tas
from ..validation import AlignmentWarning, finite_rows
from .clock import Clock, find_clock
from .evaluation import Evaluation, Note, finite_or_none
from .hints import Files, Scored, find_convention, look, rescue, rotate_cameras
from .lever import LeverArm, find_lever_arm, with_lever_arm
from .match import Matches, check_scorable, match, no_clock, poses_of_rows, with_stamps_of_sparse
from .models import ModelPoses, in_order, poses_of_models, read_models
from .notes import collected_warnings, explain, reference_notes
from .reading import (
    has_constant_rotations,
    in_memory,
    read_reference,
    with_formats,
)
from .rigs import by_keys, of_groups, of_model
from .settings import Settings, changed

__all__ = ["evaluate", "score"]

SMALL_OFFSET = 0.02  # seconds, below which an offset of the clocks must raise the score
CLEAR_OFFSET = 0.005  # by which it must; a larger one must not lower the score by as much


def evaluate(
    reference: Any,
    estimate: Any,
    settings: Settings | None = None,
    *,
    times: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
    groups: ArrayLike | None = None,
    **changes: Any,
) -> Evaluation:
    """Score an estimate against its reference, as the command ``alignscores`` does.

    Parameters
    ----------
    reference, estimate : path, (n, 4, 4) array, Trajectory or pycolmap.Reconstruction
        Files, whose formats are recognised, camera-to-world poses, or COLMAP models. The reference
        is the ground truth. Row i of two arrays is the same camera, unless there are `times`. The
        estimate may have several models: a folder of COLMAP's, or a dict as of pycolmap's mappers.
    settings : Settings, optional
        How they are matched and scored; by default ``Settings()``.
    times : (n,) array or two of them, optional
        Time stamps of the arrays in seconds: of both, or of the reference and of the estimate.
    groups : (n,) array_like, optional
        Labels of the rows of a reference in memory, the same for cameras of one rig frame: d counts
        them as one camera. Otherwise a COLMAP model or the names of images say it (see the setting
        ``rig_frames``).
    **changes : object
        Settings that differ from these, such as ``alignment="rigid"``. Of ``metrics`` some may be
        functions of ground-truth and estimated poses, both (n, 4, 4), or `Metric` objects; the
        estimated rows of lost frames are NaN.

    Returns
    -------
    Evaluation
        Scores, errors, alignment and notes.

    Raises
    ------
    ValueError
        Where a file cannot be read, too few poses can be matched, or a setting is impossible. The
        message says what to do.
    TypeError
        Where there is no setting of a name; the message has the nearest one.
    ModuleNotFoundError
        Where the format needs a package that is not installed.

    Examples
    --------
    >>> from alignscores import evaluate
    >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
    >>> evaluation.tas, evaluation.ras, evaluation.pas
    (0.8805, 0.86125, 0.8709)
    >>> evaluation.to_dict()["matched"]
    40
    """
    asked = changes.get("metrics", ())
    several = isinstance(asked, (list, tuple))
    functions = [entry for entry in asked if not isinstance(entry, str)] if several else []
    if functions:
        changes["metrics"] = [entry for entry in asked if isinstance(entry, str)]
    settings = changed(settings or Settings(), changes)
    ref_times, est_times = times if isinstance(times, tuple) and len(times) == 2 else (times, times)
    given = reference
    reference = in_memory(reference, "reference", ref_times)
    estimate = in_memory(estimate, "estimate", est_times)
    settings = with_formats(settings, reference, estimate)
    frames = of_model(given, settings) if groups is None else of_groups(reference, groups)
    with collected_warnings() as warned:
        truth = read_reference(reference, settings)
    in_file = isinstance(estimate, (str, PathLike))
    name = unique_names([str(estimate)])[0] if in_file else "estimate"
    path = "" if isinstance(reference, Trajectory) else str(reference)
    evaluation = score(
        truth,
        estimate,
        settings,
        name=name,
        ref_file=path,
        rig_frames=frames,
        functions=functions,
    )
    of_reference = [Note("reference", text) for text in warned]
    evaluation.notes[:0] = of_reference + reference_notes([evaluation])
    return evaluation


def score(
    reference: Trajectory,
    estimate: FilePath | Trajectory | Mapping[str, Trajectory],
    settings: Settings,
    *,
    name: str,
    ref_file: str = "",
    rig_frames: Mapping[Any, int] = MappingProxyType({}),
    check: bool = True,
    functions: Iterable[Metric | Callable[..., Any]] = (),
) -> Evaluation:
    """Read, match, score and explain one estimate; of several models the best one has the scores.

    With `check` the notes look for mistakes in both files, which takes most of the time. `ref_file`
    is where the reference was read from; `rig_frames` are those of the reference's keys, if not
    their names say them; `functions` are metrics next to those in the settings.
    """
    file = str(estimate) if isinstance(estimate, (str, PathLike)) else ""
    files = Files(
        printable(Path(ref_file).name) or "the reference",
        (file and name) or "the estimate",
        ref_file,
        file,
    )
    with collected_warnings() as of_file:  # these name the file
        models = read_models(estimate, settings)
    notes = [Note("file", text) for text in of_file]
    groups = by_keys(rig_frames, reference.keys)
    if len(models) == 1:
        (poses,) = models.values()
        return _score_one(
            reference,
            poses,
            settings,
            name,
            files,
            notes,
            groups=groups,
            check=check,
            functions=functions,
        )

    scored = _each_model(reference, models, settings, groups)
    with collected_warnings():  # those of the best model are notes
        of_models = poses_of_models(reference.with_rotations(), models, settings)
    rows = in_order(models, of_models, scored)
    best = rows[0].name
    text = f"it has {len(rows)} models; scored is {best}, and all images that it lacks are missing"
    notes.append(Note("models", text, "--model chooses another one"))
    evaluation = _score_one(
        reference,
        models[best],
        settings,
        name,
        files,
        notes,
        groups=groups,
        check=check,
        functions=functions,
        of_models=of_models,
    )
    return replace(evaluation, models=rows)


def _each_model(
    reference: Trajectory,
    models: Mapping[str, Trajectory],
    settings: Settings,
    groups: Indices | None,
) -> dict[str, Evaluation]:
    """Score each model of a set by its name; those with too few images are left out."""
    if settings.missing == "ignore":
        raise ValueError(
            f"missing=ignore would leave out all images but those of one of {len(models)} models; "
            f"choose one with --model, such as {next(iter(models))}"
        )
    scored, files = {}, Files("the reference", "the estimate", "", "")
    for name, poses in models.items():
        with suppress(ValueError):
            scored[name] = _score_one(
                reference,
                poses,
                replace(settings, metrics=()),
                name,
                files,
                [],
                groups=groups,
                check=False,
            )
    if not scored:
        largest = max(models, key=lambda name: len(models[name].keys))
        raise ValueError(
            f"none of its {len(models)} models can be scored; the largest one, {largest}, has "
            f"{len(models[largest].keys)} images"
        )
    return scored


def _score_one(
    reference: Trajectory,
    poses: Trajectory,
    settings: Settings,
    name: str,
    files: Files,
    notes: list[Note],
    *,
    groups: Indices | None,
    check: bool,
    functions: Iterable[Metric | Callable[..., Any]] = (),
    of_models: ModelPoses | None = None,
) -> Evaluation:
    """Match, score and explain the poses of an estimate; see `score`. `notes` are those so far."""
    has_rotations = reference.has_rotations and poses.has_rotations
    if reference.has_rotations and not has_rotations:
        notes.append(Note("rotations", "it has no rotations: RAS and PAS have no value"))
    constant, poses = _constant(poses, settings, has_rotations)
    notes += constant
    reference, poses = reference.with_rotations(), poses.with_rotations()

    def attempt(ref: Trajectory, est: Trajectory, tried: Settings) -> Scored:
        return _compared(ref, est, tried, has_rotations, groups).scored

    with collected_warnings() as of_estimate:
        try:
            compared = _compared(reference, poses, settings, has_rotations, groups)
        except ValueError as error:
            remedy = check and rescue(
                reference, poses, settings, attempt, files, has_rotations=has_rotations
            )
            raise ValueError(f"{error}; {remedy}" if remedy else str(error)) from None
        half_distance = _half_distance(compared.matches, settings)
    if not np.isnan(poses.poses).all():  # of a run that failed all else follows
        notes += [Note("estimate", text) for text in of_estimate]
    matches, result = compared.matches, compared.result
    pairs = _every_pose(matches, compared.estimate)
    metrics, without_value = _metrics(matches, pairs, settings, functions, of_models)
    evaluation = Evaluation(
        name=name,
        file=files.est_path,
        settings=settings,
        reference=reference,
        estimate=compared.estimate,
        read=poses,
        matches=matches,
        result=result,
        tas_seeds=[result.tas.score, *_other_seeds(matches, settings)],
        half_distance=half_distance,
        ate=_ate(pairs, settings),
        metrics=metrics,
        t_offset=compared.t_offset,
        body_rotation=compared.body_rotation,
        lever_arm=compared.lever_arm,
        notes=notes,
    )
    notes += _of_matching(compared, settings)
    hints = []
    if check:
        hints = look(
            reference,
            poses,
            settings,
            compared.scored,
            attempt,
            files,
            has_rotations=has_rotations,
        )
    notes += explain(evaluation, hints, check=check)
    notes += without_value
    return evaluation


def _constant(
    estimate: Trajectory, settings: Settings, has_rotations: bool
) -> tuple[list[Note], Trajectory]:
    """Return notes on an estimate that does not move or rotate, and the poses that count.

    One pose throughout is none: the run has failed.
    """
    if has_rotations and not has_constant_rotations(estimate):
        return [], estimate
    positions = estimate.poses[finite_rows(estimate.poses[:, :3, 3]), :3, 3]
    if len(positions) > 1 and (positions == positions[0]).all():
        text = "it has one pose throughout: a run that failed, without a pose that counts"
        nothing = np.full_like(estimate.poses, np.nan)
        return [Note("constant", text)], estimate._replace(poses=nothing)
    if not has_rotations:
        return [], estimate
    text = "its rotations are all the same, and are scored as they are"
    timed = settings.est_form.tables and estimate.keys.dtype.kind == "f"
    remedy = "if it has none, --est_columns 't x y z' scores the positions" if timed else ""
    return [Note("constant", text, remedy)], estimate


@dataclass(frozen=True, eq=False)
class _Compared:
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
        value = result.score if matches.has_rotations else result.tas.score
        return Scored(value, matches.pose_references, self.estimate.poses[matches.pose_rows])


def _compared(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    has_rotations: bool,
    groups: Indices | None,
) -> _Compared:
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
    check_scorable(reference, poses, matches, settings)
    poses, lever_arm, body_rotation = _corrected(poses, matches, settings)
    matches = replace(matches, est_poses=poses_of_rows(poses, matches.est_rows))
    result = _scores(matches, settings)
    return _Compared(poses, matches, result, t_offset, clock, chord, lever_arm, body_rotation)


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
                f"{_rival(clock)}{no_clock(estimate.keys) or '; --t_offset X sets one'}"
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
                found = _compared(reference, estimate, tried, has_rotations, groups)
            scores.append(found.scored.score)
        except ValueError:
            scores.append(-math.inf)
    bound = CLEAR_OFFSET if abs(clock.seconds) < SMALL_OFFSET else -CLEAR_OFFSET
    return clock.seconds if scores[1] > scores[0] + bound else 0.0


def _rival(clock: Clock | None) -> str:
    """Return the best offsets that are not certain, in words."""
    if clock is None:
        return ""
    best = f"{clock.seconds:.3f} s (standard error {clock.error:.3f} s)"
    if math.isnan(clock.runner_up):
        return f": the best is {best}"
    return f": the best are {best} and {clock.runner_up:.3f} s"


def _of_matching(compared: _Compared, settings: Settings) -> list[Note]:
    """Return notes on the clock that was looked for, and on a reference that is too sparse."""
    notes = []
    if settings.t_offset == "auto" and compared.matches.timed:
        clock, seconds = compared.clock, compared.t_offset
        if seconds and clock:
            text = f"time offset of {seconds:.4f} s (standard error {clock.error:.4f} s) added"
        elif clock and clock.certain:
            text = "no time offset added: its motions fit with its stamps as they are"
        else:
            text = f"no time offset added: none is certain{_rival(clock)}"
        notes.append(Note("clock", text))
    if compared.chord:
        text = (
            "the reference is too sparse to be interpolated: straight lines between its poses are "
            f"off by {compared.chord:.1%} of d; poses are compared at its own stamps"
        )
        notes.append(Note("sparse", text))
    if n_rig_frames := compared.matches.n_rig_frames:
        text = f"d counts the cameras of each of {n_rig_frames} rig frames as one, at their mean"
        named = compared.matches.keys.dtype.kind == "U"
        remedy = "--rig_frames none counts each camera" if named else ""
        notes.append(Note("rig", f"{text} position", remedy))
    return notes


def _corrected(
    estimate: Trajectory, matches: Matches, settings: Settings
) -> tuple[Trajectory, LeverArm | None, Floats | None]:
    """Return an estimate of the reference's prism with its camera axes, and what was corrected."""
    lever_arm, body_rotation = None, None
    if settings.lever_arm == "auto":
        positions = matches.pose_references[:, :3, 3]
        matched = estimate.poses[matches.pose_rows]
        lever_arm = find_lever_arm(positions, matched, matches.unit)
    elif settings.lever_arm is not None:
        lever_arm = LeverArm(np.array(settings.lever_arm), np.zeros(3))
    if lever_arm is not None:
        estimate = with_lever_arm(estimate, lever_arm.vector)
    if settings.body_rotation == "auto" and matches.has_rotations:
        convention = find_convention(matches.pose_references, estimate.poses[matches.pose_rows])
        if not convention.kind:
            body_rotation = convention.body_rotation
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


def _other_seeds(matches: Matches, settings: Settings) -> list[float]:
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


def _half_distance(matches: Matches, settings: Settings) -> float:
    """Return the half-score distance, by the refined registration; NaN for too few poses."""
    lost = len(matches.keys) - matches.matched
    if reason := too_few(lost + matches.n_poses, 0.5, settings.alignment):  # each of many frames
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


Pairs = tuple[Floats, Floats]  # poses of reference and estimate


def _every_pose(matches: Matches, estimate: Trajectory) -> Pairs:
    """Return every pose that has a reference and, as not finite, what was lost, in its share."""
    if not matches.timed:
        return matches.gt_poses, matches.est_poses
    rows, lost = matches.pose_rows, np.flatnonzero(matches.est_rows < 0)
    n_lost = round(len(rows) * len(lost) / matches.matched) if len(lost) else 0
    lost = lost[np.linspace(0, len(lost) - 1, n_lost).astype(int)]
    stamps = np.concatenate([estimate.keys[rows], matches.keys[lost]])
    gt = np.concatenate([matches.pose_references, matches.gt_poses[lost]])
    est = np.concatenate([estimate.poses[rows], matches.est_poses[lost]])
    order = np.argsort(stamps, kind="stable")
    return gt[order], est[order]


def _ate(pairs: Pairs, settings: Settings) -> float | None:
    """Return the ATE of the estimated cameras, in the same alignment; None where there is none."""
    gt, est = pairs[0][:, :3, 3], pairs[1][:, :3, 3]
    estimated = finite_rows(est)
    try:
        rmse = least_squares_rmse(
            gt[estimated], est[estimated], alignment=settings.alignment, up=settings.up
        )
    except ValueError:  # no camera was estimated, or no similarity fits
        return None
    return finite_or_none(rmse)


def _metrics(
    matches: Matches,
    pairs: Pairs,
    settings: Settings,
    functions: Iterable[Metric | Callable[..., Any]],
    of_models: ModelPoses | None,
) -> tuple[dict[str, float], list[Note]]:
    """Return the other metrics that have a value, and why others have none."""
    values, notes = {}, []
    names = [name for name in settings.metrics if name not in SCORES]
    for entry in map(metric, [*names, *functions]):
        name = entry.name
        if "metres" in entry.needs and settings.form.unit != "m":
            notes.append(Note("metric", f"the reference's unit counts as a metre in {name}"))
        try:
            if "rotations" in entry.needs and not matches.has_rotations:
                raise ValueError(f"{name} needs the rotations of the cameras")
            if entry.sets and matches.keys.dtype.kind == "U":
                of_model = of_models or ModelPoses(pairs[1], np.array(matches.unmatched))
                value = float(
                    entry.function(pairs[0], of_model.est_poses, outliers=of_model.outliers)
                )
            else:
                value = entry(*pairs)
            if not math.isfinite(value):
                raise ValueError("it is not finite, with so many cameras lost")
            values[name] = value
        except ValueError as error:
            notes.append(Note("metric", f"no value of {name}: {error}"))
    return values, notes
