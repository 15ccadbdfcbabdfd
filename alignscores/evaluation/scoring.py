"""`evaluate`: one estimate against its reference, from the files to the notes."""

import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..distance import N_THRESHOLDS, smallest_unit, tas_distance, too_few
from ..metrics import LEVELS, SCORES, metric
from ..pose import PASResult, pas
from ..registration import Registration, pcr99
from ..rotation import RASResult
from ..similarity import Similarity, least_squares_rmse
from ..texts import unique_names
from ..trajectories.association import Matches
from ..trajectories.conventions import find_convention, rotate_cameras
from ..trajectories.files import FilePath, Trajectory
from ..trajectories.lever import LeverArm, find_lever_arm, with_lever_arm
from ..translation import tas
from ..validation import AlignmentWarning, finite_rows
from .evaluation import Evaluation, Note
from .matching import (
    in_memory,
    match_estimate,
    read_estimate,
    read_reference,
    time_offset,
    with_format,
)
from .notes import collected_warnings, explain, reference_notes
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
        Settings that differ from these, such as ``alignment="rigid"``.

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
    settings = changed(settings or Settings(), changes)
    reference, estimate = in_memory(reference, estimate, times)
    settings = with_format(settings, reference, estimate)
    with collected_warnings() as warned:
        truth = read_reference(reference, settings)
    name = "estimate" if isinstance(estimate, Trajectory) else unique_names([str(estimate)])[0]
    evaluation = score(truth, estimate, settings, name=name)
    of_file = [Note("reference", text) for text in warned]
    notes = [*of_file, *reference_notes([evaluation]), *evaluation.notes]
    return replace(evaluation, notes=notes)


def score(
    reference: Trajectory,
    estimate: FilePath | Trajectory,
    settings: Settings,
    *,
    name: str,
    check: bool = True,
) -> Evaluation:
    """Read, match, score and explain one estimate.

    With `check` the notes look for mistakes of convention and clock, which takes most of the time.
    """
    with collected_warnings() as of_file:  # these name the file
        poses = read_estimate(reference, estimate, settings)
    if settings.lever_arm is not None and not poses.has_rotations:
        raise ValueError("--lever_arm needs rotations, which the estimate lacks")
    has_rotations = reference.has_rotations and poses.has_rotations
    notes = []
    if reference.has_rotations and not has_rotations:
        notes.append(Note("rotations", "it has no rotations: RAS and PAS have no value"))
    reference, poses = reference.with_rotations(), poses.with_rotations()
    with collected_warnings() as warned:
        poses, t_offset = time_offset(reference, poses, settings)
        poses, matches, lever_arm = _with_lever_arm(reference, poses, settings, t_offset)
        body_rotation = _body_rotation(poses, matches, settings, has_rotations=has_rotations)
        poses = poses._replace(poses=rotate_cameras(poses.poses, body_rotation))
        matches = replace(matches, est_poses=rotate_cameras(matches.est_poses, body_rotation))
        result, tas_seeds = _scores(matches, settings)
        result = result if has_rotations else _without_rotations(result)
        half_distance = _distance(matches, settings, 0.5)
        levels = _levels(matches, result, settings)
    pairs = _pairs(matches, poses)
    metrics, unvalued = _metrics(pairs, settings, has_rotations=has_rotations)
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
        metrics={**levels, **metrics},
        t_offset=t_offset,
        body_rotation=body_rotation,
        lever_arm=lever_arm,
        notes=[],
    )
    said = [Note("file", text) for text in of_file] + [Note("estimate", text) for text in warned]
    return replace(evaluation, notes=[*said, *explain(evaluation, check=check), *notes, *unvalued])


def _with_lever_arm(
    reference: Trajectory, estimate: Trajectory, settings: Settings, t_offset: float
) -> tuple[Trajectory, Matches, LeverArm | None]:
    """Match an estimate, with the positions of the reference's prism; and return the lever arm."""
    if settings.lever_arm is None:
        return estimate, match_estimate(reference, estimate, settings, t_offset), None
    if settings.lever_arm == "auto":
        matches = match_estimate(reference, estimate, settings, t_offset)
        matched = estimate.poses[matches.pose_rows]
        lever_arm = find_lever_arm(matches.pose_references[:, :3, 3], matched)
    else:
        lever_arm = LeverArm(np.array(settings.lever_arm), np.zeros(3))
    estimate = with_lever_arm(estimate, lever_arm.vector)
    return estimate, match_estimate(reference, estimate, settings, t_offset), lever_arm


def _body_rotation(
    estimate: Trajectory, matches: Matches, settings: Settings, *, has_rotations: bool
) -> Floats | None:
    """Return the rotation of the camera frame that is to be removed, if any."""
    if settings.body_rotation == "none" or not has_rotations:
        return None
    mistake = find_convention(matches.pose_references, estimate.poses[matches.pose_rows])
    return None if mistake.kind.startswith("inverted") else mistake.body_rotation


def _scores(matches: Matches, settings: Settings) -> tuple[PASResult, list[float]]:
    """Return the scores at the first seed, and the TAS of each seed."""
    gt, est = matches.gt_poses, matches.est_poses
    options: dict[str, Any] = {
        "unit": _known_unit(matches),
        "max_threshold": settings.max_threshold,
        "registration": _registration(matches, settings),
        "alignment": settings.alignment,
        "up": settings.up,
    }
    result = pas(
        gt,
        est,
        rng=settings.seed,
        weight=settings.weight,
        max_threshold_deg=settings.max_threshold_deg,
        **options,
    )
    others = [
        tas(gt[:, :3, 3], est[:, :3, 3], rng=seed, **options).score for seed in settings.seeds[1:]
    ]
    return result, [result.tas.score, *others]


def _without_rotations(result: PASResult) -> PASResult:
    """Return a result without a RAS, and so without a PAS: NaN."""
    errors = np.full_like(result.ras.errors, np.nan)
    ras = RASResult(errors=errors, thresholds=result.ras.thresholds, alignment=None)
    return replace(result, score=math.nan, ras=ras)


def _known_unit(matches: Matches) -> float:
    """Return d; raise a ValueError that says what to do where it is undefined."""
    if math.isfinite(matches.unit):
        return matches.unit
    n = len(matches.expected_rows)
    reason = (
        f"the reference has {n} of the 4 poses that it takes"
        if n < 4
        else "at least three quarters of the reference poses coincide with another one"
    )
    raise ValueError(f"d cannot be derived: {reason}; --unit sets it")


def _registration(matches: Matches, settings: Settings) -> str | Registration:
    """Return the registration: PCR-99 counts each pose once, since a repeated one fits itself."""
    if settings.registration == "pcr99" and matches.n_poses < matches.matched:
        return _pcr99_of_distinct
    return settings.registration


def _pcr99_of_distinct(
    gt: Floats, est: Floats, /, *, rank: int, **options: Any
) -> tuple[Similarity | None, int]:
    """Register by PCR-99 the cameras that differ from all before."""
    _, first = np.unique(np.hstack([gt, est]), axis=0, return_index=True)
    rows = np.sort(first)
    rank = max(4, round(rank * len(rows) / len(est)))
    return pcr99(gt[rows], est[rows], rank=min(rank, len(rows)), **options)


_pcr99_of_distinct.__name__ = "pcr99"  # as results name their registration


def _distance(matches: Matches, settings: Settings, level: float) -> float:
    """Return the smallest d at which the TAS reaches a level; NaN for too few cameras."""
    n = len(matches.keys) - matches.matched + matches.n_poses
    if reason := too_few(n, level, settings.alignment):
        warnings.warn(reason, AlignmentWarning, stacklevel=2)
        return math.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)  # the TAS has said it
        return tas_distance(
            matches.gt_poses[:, :3, 3],
            matches.est_poses[:, :3, 3],
            level,
            rng=settings.seed,
            alignment=settings.alignment,
            up=settings.up,
        )


Pairs = tuple[Floats, Floats, Floats | None]  # poses of reference and estimate, and stamps


def _pairs(matches: Matches, estimate: Trajectory) -> Pairs:
    """Return every pose that has a reference and, as not finite, what was lost, in its share."""
    if estimate.keys.dtype.kind != "f":
        return matches.gt_poses, matches.est_poses, None
    rows, lost = matches.pose_rows, np.flatnonzero(matches.est_rows < 0)
    n_lost = round(len(rows) * len(lost) / matches.matched) if len(lost) else 0
    lost = lost[np.linspace(0, len(lost) - 1, n_lost).astype(int)]
    stamps = np.concatenate([estimate.keys[rows], matches.keys[lost]])
    gt = np.concatenate([matches.pose_references, matches.gt_poses[lost]])
    est = np.concatenate([estimate.poses[rows], matches.est_poses[lost]])
    order = np.argsort(stamps, kind="stable")
    return gt[order], est[order], stamps[order]


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
    return rmse if math.isfinite(rmse) else None


def _levels(matches: Matches, result: PASResult, settings: Settings) -> dict[str, float]:
    """Return the distances and angles in the settings, such as distance@0.25."""
    angles = np.nan_to_num(np.sort(result.ras.errors), nan=np.inf)
    values = {}
    for name in settings.metrics:
        asked = metric(name)
        if asked.family in LEVELS:
            level = asked.arguments["score"]
            values[name] = (
                smallest_unit(angles, level, N_THRESHOLDS)
                if asked.family.rotations
                else _distance(matches, settings, level)
            )
    return values


def _metrics(
    pairs: Pairs, settings: Settings, *, has_rotations: bool
) -> tuple[dict[str, float], list[Note]]:
    """Return the metrics of other projects that have a value, and why others have none."""
    gt, est, stamps = pairs
    values, notes = {}, []
    for name in settings.metrics:
        if metric(name).family in (*SCORES, *LEVELS):
            continue
        try:
            value = metric(name)(
                gt[:, :3, 3],
                gt[:, :3, :3] if has_rotations else None,
                est[:, :3, 3],
                est[:, :3, :3] if has_rotations else None,
                rng=settings.seed,
                stamps=stamps,
            )
            if not math.isfinite(value):
                raise ValueError("it is not finite, with so many cameras lost")
            values[name] = value
        except ValueError as error:
            notes.append(Note("metric", f"no value of {name}: {error}"))
    return values, notes
