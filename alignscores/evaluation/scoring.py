"""`evaluate`: one estimate against its reference, from the files to the notes."""

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Indices
from ..io import FileError, FilePath, Trajectory
from ..metrics import SCORES, Metric, metric
from ..similarity import least_squares_rmse
from ..texts import printable, unique_names
from ..validation import finite_rows
from .compared import half_distance_of, match_and_score, notes_on_matching, tas_of_other_seeds
from .evaluation import FAILED, Evaluation, Model, Note, finite_or_none
from .hints import Files, Scored, look, rescue
from .match import Matches, ReferenceFaultError
from .models import ModelPoses, in_order, poses_of_models, read_models
from .notes import collected_warnings, explain, reference_notes
from .reading import (
    has_constant_rotations,
    in_memory,
    read_reference,
    with_formats,
)
from .rigs import of_groups, of_model, of_reference
from .settings import Settings, changed

__all__ = ["evaluate", "score"]


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
    requested = changes.get("metrics", ())
    is_list = isinstance(requested, (list, tuple))
    functions = [entry for entry in requested if not isinstance(entry, str)] if is_list else []
    if functions:
        changes["metrics"] = [entry for entry in requested if isinstance(entry, str)]
    settings = changed(settings or Settings(), changes)
    ref_times, est_times = times if isinstance(times, tuple) and len(times) == 2 else (times, times)
    ref_source = reference
    reference = in_memory(reference, "reference", ref_times)
    estimate = in_memory(estimate, "estimate", est_times)
    settings = with_formats(settings, reference, estimate)
    frames = of_model(ref_source, settings) if groups is None else of_groups(reference, groups)
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
    names = [printable(Path(ref_file).name) or "the reference", (file and name) or "the estimate"]
    if names[0] == names[1]:  # such as COLMAP's images.txt
        names = unique_names([ref_file, file])
    files = Files(names[0], names[1], ref_file, file)
    with collected_warnings() as of_file:  # these name the file
        models = read_models(estimate, settings)
    notes = [Note("file", text) for text in of_file]
    groups = of_reference(reference, rig_frames, settings)
    rows: tuple[Model, ...] = ()
    of_models = None
    if len(models) == 1:
        (poses,) = models.values()
    else:
        scored = _each_model(reference, models, settings, groups)
        with collected_warnings():  # those of the best model are notes
            of_models = poses_of_models(reference.with_rotations(), models, settings)
        rows = in_order(models, of_models, scored)
        best = rows[0].name
        poses = models[best]
        text = (
            f"it has {len(rows)} models; scored is {best}, and all images that it lacks are missing"
        )
        notes.append(Note("models", text, "--model chooses another one"))
    return _score_trajectory(
        reference,
        poses,
        settings,
        name,
        files,
        notes,
        groups=groups,
        check=check,
        functions=functions,
        models=rows,
        of_models=of_models,
    )


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
            scored[name] = _score_trajectory(
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


@np.errstate(over="ignore", invalid="ignore")  # positions of 1e200 are far off, however far
def _score_trajectory(
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
    models: tuple[Model, ...] = (),
    of_models: ModelPoses | None = None,
) -> Evaluation:
    """Match, score and explain the poses of an estimate; see `score`. `notes` are those so far."""
    has_rotations = reference.has_rotations and poses.has_rotations
    constant, poses = _constant(poses, settings, has_rotations)
    failed = [note for note in constant if note.kind == FAILED]  # it needs no further notes
    if failed:
        notes.clear()
    elif reference.has_rotations and not has_rotations:
        notes.append(Note("rotations", "it has no rotations: RAS and PAS have no value"))
    notes += constant
    reference, poses = reference.with_rotations(), poses.with_rotations()

    files_to_reopen = _without_pipes(files)

    def attempt(ref: Trajectory, est: Trajectory, tried: Settings) -> Scored:
        return match_and_score(ref, est, tried, has_rotations, groups).scored

    with collected_warnings() as of_estimate:
        try:
            outcome = match_and_score(reference, poses, settings, has_rotations, groups)
        except ValueError as error:
            remedy = check and rescue(
                reference, poses, settings, attempt, files_to_reopen, has_rotations=has_rotations
            )
            reason = f"{error}; {remedy}" if remedy else str(error)
            if files.ref_path and isinstance(error, ReferenceFaultError):
                raise FileError(files.ref_path, reason) from None
            raise ValueError(reason) from None
        half_distance = half_distance_of(outcome.matches, settings)
        other_seeds = tas_of_other_seeds(outcome.matches, settings)
    if not failed:
        notes += [Note("estimate", text) for text in of_estimate]
    matches, result = outcome.matches, outcome.result
    pairs = _every_pose(matches, outcome.estimate)
    metrics, without_value = _metrics(matches, pairs, settings, functions, of_models)
    evaluation = Evaluation(
        name=name,
        file=files.est_path,
        settings=settings,
        reference=reference,
        estimate=outcome.estimate,
        read=poses,
        matches=matches,
        result=result,
        tas_seeds=[result.tas.score, *other_seeds],
        half_distance=half_distance,
        ate=_ate(pairs, settings),
        metrics=metrics,
        t_offset=outcome.t_offset,
        body_rotation=outcome.body_rotation,
        lever_arm=outcome.lever_arm,
        notes=notes,
        models=models,
    )
    notes += notes_on_matching(outcome, reference, poses, settings, groups, files.reference)
    hints = []
    if check:
        hints = look(
            reference,
            poses,
            settings,
            outcome.scored,
            attempt,
            files_to_reopen,
            has_rotations=has_rotations,
        )
    notes += explain(evaluation, hints, check=check)
    notes += without_value
    return evaluation


def _without_pipes(files: Files) -> Files:
    """Return files without the paths of pipes, which cannot be read again."""
    paths = files.ref_path, files.est_path
    ref_path, est_path = ("" if Path(path).is_fifo() else path for path in paths)
    return replace(files, ref_path=ref_path, est_path=est_path)


def _constant(
    estimate: Trajectory, settings: Settings, has_rotations: bool
) -> tuple[list[Note], Trajectory]:
    """Return notes on an estimate that does not move or rotate, and the poses that count.

    One pose throughout is none: the run has failed, as it has without any finite pose.
    """
    positions = estimate.poses[finite_rows(estimate.poses[:, :3, 3]), :3, 3]
    if not len(positions):
        return [Note(FAILED, "it has no finite pose")], estimate
    if has_rotations and not has_constant_rotations(estimate):
        return [], estimate
    if len(positions) > 1 and (positions == positions[0]).all():
        nothing = np.full_like(estimate.poses, np.nan)
        return [Note(FAILED, "all poses are identical; none counts")], estimate._replace(
            poses=nothing
        )
    if not has_rotations:
        return [], estimate
    text = "its rotations are all the same, and are scored as they are"
    timed = settings.est_file_format.tables and estimate.keys.dtype.kind == "f"
    remedy = "if it has none, --est_columns 't x y z' scores the positions" if timed else ""
    return [Note("constant", text, remedy)], estimate


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
        if "metres" in entry.needs and settings.file_format.unit != "m":
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
