"""`evaluate`: one estimate against its reference, from the files to the notes."""

import math
import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..io import FilePath, Trajectory
from ..metrics import SCORES, Metric, metric
from ..pose import PASResult, pas
from ..registration import Registration
from ..registration import pcr99 as pcr99_of_all
from ..similarity import Similarity, least_squares_rmse
from ..texts import unique_names
from ..thresholds import tas_distance, too_few
from ..trajectories.conventions import find_convention, rotate_cameras
from ..trajectories.lever import LeverArm, find_lever_arm, with_lever_arm
from ..translation import tas
from ..validation import AlignmentWarning, finite_rows
from .evaluation import Evaluation, Note, finite_or_none
from .matching import Matches, check_scorable, match, poses_of_rows, with_time_offset
from .notes import collected_warnings, explain, reference_notes
from .reading import in_memory, read_estimate, read_reference, with_formats
from .settings import Settings, changed

__all__ = ["evaluate", "score"]


def evaluate(
    reference: Any,
    estimate: Any,
    settings: Settings | None = None,
    *,
    times: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
    **changes: Any,
) -> Evaluation:
    """Score an estimate against its reference, as the command ``alignscores`` does.

    Parameters
    ----------
    reference, estimate : path, (n, 4, 4) array, Trajectory or pycolmap.Reconstruction
        Files, whose formats are recognised, camera-to-world poses, or COLMAP models. The reference
        is the ground truth. Row i of two arrays is the same camera, unless there are `times`.
    settings : Settings, optional
        How they are matched and scored; by default ``Settings()``.
    times : (n,) array or two of them, optional
        Time stamps of the arrays in seconds: of both, or of the reference and of the estimate.
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
    functions = [] if isinstance(asked, str) else [one for one in asked if not isinstance(one, str)]
    if functions:
        changes["metrics"] = [one for one in asked if isinstance(one, str)]
    settings = changed(settings or Settings(), changes)
    ref_times, est_times = times if isinstance(times, tuple) and len(times) == 2 else (times, times)
    reference = in_memory(reference, "reference", ref_times)
    estimate = in_memory(estimate, "estimate", est_times)
    settings = with_formats(settings, reference, estimate)
    with collected_warnings() as warned:
        truth = read_reference(reference, settings)
    name = "estimate" if isinstance(estimate, Trajectory) else unique_names([str(estimate)])[0]
    evaluation = score(truth, estimate, settings, name=name, functions=functions)
    of_reference = [Note("reference", text) for text in warned]
    evaluation.notes[:0] = of_reference + reference_notes([evaluation])
    return evaluation


def score(
    reference: Trajectory,
    estimate: FilePath | Trajectory,
    settings: Settings,
    *,
    name: str,
    check: bool = True,
    functions: Iterable[Metric | Callable[..., Any]] = (),
) -> Evaluation:
    """Read, match, score and explain one estimate.

    With `check` the notes look for mistakes of convention and clock, which takes most of the time.
    `functions` are metrics next to those in the settings.
    """
    with collected_warnings() as of_file:  # these name the file
        poses = read_estimate(estimate, settings)
    has_rotations = reference.has_rotations and poses.has_rotations
    notes = [Note("file", text) for text in of_file]
    if reference.has_rotations and not has_rotations:
        notes.append(Note("rotations", "it has no rotations: RAS and PAS have no value"))
    reference, poses = reference.with_rotations(), poses.with_rotations()
    with collected_warnings() as of_estimate:
        poses, t_offset = with_time_offset(reference, poses, settings)
        matches = replace(match(reference, poses, settings), has_rotations=has_rotations)
        check_scorable(reference, poses, matches, settings)
        poses, lever_arm, body_rotation = _corrected(poses, matches, settings)
        matches = replace(matches, est_poses=poses_of_rows(poses, matches.est_rows))
        result, tas_seeds = _scores(matches, settings)
        half_distance = _half_distance(matches, settings)
    notes += [Note("estimate", text) for text in of_estimate]
    pairs = _every_pose(matches, poses)
    metrics, without_value = _metrics(matches, pairs, settings, functions)
    evaluation = Evaluation(
        name=name,
        file="" if isinstance(estimate, Trajectory) else str(estimate),
        settings=settings,
        reference=reference,
        estimate=poses,
        matches=matches,
        result=result,
        tas_seeds=tas_seeds,
        half_distance=half_distance,
        ate=_ate(pairs, settings),
        metrics=metrics,
        t_offset=t_offset,
        body_rotation=body_rotation,
        lever_arm=lever_arm,
        notes=notes,
    )
    notes += explain(evaluation, check=check)
    notes += without_value
    return evaluation


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
        mistake = find_convention(matches.pose_references, estimate.poses[matches.pose_rows])
        if not mistake.kind.startswith("inverted"):
            body_rotation = mistake.body_rotation
    poses = rotate_cameras(estimate.poses, body_rotation)
    return estimate._replace(poses=poses), lever_arm, body_rotation


def _scores(matches: Matches, settings: Settings) -> tuple[PASResult, list[float]]:
    """Return the scores at the first seed, NaN without rotations, and the TAS of each seed."""
    registration: str | Registration = settings.registration
    if registration == "pcr99" and matches.n_poses < matches.matched:  # a pose of several frames
        registration = pcr99
    gt, est = matches.gt_poses, matches.est_poses
    options = {"unit": matches.unit, "registration": registration, **settings.tas_options}
    first, *others = settings.seeds
    weight, degrees = settings.weight, settings.max_threshold_deg
    result = pas(gt, est, rng=first, weight=weight, max_threshold_deg=degrees, **options)
    if not matches.has_rotations:
        errors = np.full_like(result.ras.errors, np.nan)
        frequency = np.zeros_like(result.ras.cumulative_frequency)
        ras = replace(
            result.ras,
            score=math.nan,
            errors=errors,
            cumulative_frequency=frequency,
            alignment=None,
        )
        result = replace(result, score=math.nan, ras=ras)
    more = [tas(gt[:, :3, 3], est[:, :3, 3], rng=seed, **options).score for seed in others]
    return result, [result.tas.score, *more]


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
) -> tuple[dict[str, float], list[Note]]:
    """Return the other metrics that have a value, and why others have none."""
    values, notes = {}, []
    names = [name for name in settings.metrics if name not in SCORES]
    for one in map(metric, [*names, *functions]):
        name = one.name
        if "metres" in one.needs and settings.form.unit != "m":
            notes.append(Note("metric", f"the reference's unit counts as a metre in {name}"))
        try:
            if "rotations" in one.needs and not matches.has_rotations:
                raise ValueError(f"{name} needs the rotations of the cameras")
            value = one(*pairs)
            if not math.isfinite(value):
                raise ValueError("it is not finite, with so many cameras lost")
            values[name] = value
        except ValueError as error:
            notes.append(Note("metric", f"no value of {name}: {error}"))
    return values, notes
