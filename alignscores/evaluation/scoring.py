"""One estimate against its reference: read, matched, checked and scored, the same for everybody."""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats, Indices
from ..distance import N_THRESHOLDS, ErrorsAt, extent, search_unit, smallest_unit, too_few
from ..metrics import LEVELS, SCORES, metric
from ..pose import PASResult, pas
from ..registration import Registration, pcr99
from ..similarity import Similarity, least_squares_rmse
from ..texts import unique_names
from ..trajectories.association import Matches
from ..trajectories.conventions import Convention, find_convention, rotate_cameras
from ..trajectories.files import FilePath, Trajectory, read_colmap
from ..trajectories.files.colmap import is_model
from ..trajectories.parts import (
    all_cameras,
    assign_cameras,
    combine,
    combine_tas,
    errors_of_parts,
    in_one_world,
    poses_by_name,
)
from ..translation import tas
from ..validation import AlignmentWarning, finite_rows
from .chance import chance_level
from .evaluation import Evaluation, Part, rotation_profile
from .matching import match_estimate, read_parts, read_reference, time_offset
from .notes import (
    alignment_notes,
    chance_notes,
    collected_warnings,
    convention_notes,
    ends_notes,
    matching_notes,
    offset_notes,
    parts_notes,
    swap_notes,
)
from .settings import Settings

__all__ = ["evaluate", "notes_of_all", "score"]

FORMAT_OF_KEYS = {"f": "tum", "i": "kitti", "U": "nerf"}  # that trajectories in memory are like


def evaluate(
    reference: Any,
    estimate: Any,
    settings: Settings | None = None,
    **changes: Any,
) -> Evaluation:
    """Score an estimate against its reference, as the command ``alignscores`` does.

    Parameters
    ----------
    reference, estimate : path, Trajectory or pycolmap.Reconstruction
        Files in the format of the settings, or trajectories in memory: keys and camera-to-world
        poses, (n, 4, 4), or COLMAP models. The reference is the ground truth.
    settings : Settings, optional
        How they are matched and scored; by default `Settings()`.
    **changes : object
        Settings that differ from these, such as ``format="tum"``.

    Returns
    -------
    Evaluation
        Scores, errors, alignment and notes.

    Raises
    ------
    ValueError
        Where a file cannot be read, too few poses can be matched, or a setting is impossible. The
        message says what to do.
    ModuleNotFoundError
        Where the format needs a package that is not installed.

    Examples
    --------
    >>> from alignscores import evaluate
    >>> folder = "tests/data/tum"
    >>> evaluation = evaluate(f"{folder}/reference.txt", f"{folder}/estimate.txt", format="tum")
    >>> evaluation.tas, evaluation.ras, evaluation.pas
    (0.8805, 0.86125, 0.8709)
    >>> evaluation.to_dict()["matched"]
    40
    """
    settings = replace(settings or Settings(), **changes)
    reference, estimate = (read_colmap(m) if is_model(m) else m for m in (reference, estimate))
    if settings.format is None and isinstance(reference, Trajectory):
        kind = np.asarray(reference.keys).dtype.kind
        settings = replace(settings, format=FORMAT_OF_KEYS.get(kind))
    with collected_warnings() as notes:
        truth = read_reference(reference, settings)
    in_memory = isinstance(estimate, Trajectory)
    name = "estimate" if in_memory else unique_names([str(estimate)])[0]
    evaluation = score(truth, estimate, settings, name=name)
    notes += notes_of_all([evaluation])
    return replace(evaluation, notes=[*notes, *evaluation.notes])


def notes_of_all(evaluations: Sequence[Evaluation]) -> list[str]:
    """Return the notes on a reference: the time that no estimate covers, and its chance level."""
    timed = [found for found in evaluations if found.matches.keys.dtype.kind == "f"]
    matches = [found.matches for found in timed]
    ends = ends_notes([found.keys for found in matches], [found.est_rows >= 0 for found in matches])
    return [*ends, *chance_notes([found.chance for found in timed])]


class _Scores(NamedTuple):
    """The scores of each part over all cameras, and those of the whole."""

    of_parts: list[PASResult]
    part_of: Indices  # the part that counts each camera, -1 where none does
    result: PASResult
    tas_seeds: list[float]
    half_distance: float
    new_search: Callable[[], ErrorsAt]  # of errors at any unit


def score(
    reference: Trajectory,
    estimate: FilePath | Trajectory,
    settings: Settings,
    *,
    name: str,
    check: bool = True,
) -> Evaluation:
    """Read, match, check and score one estimate.

    With `check` the conventions and the clock of the estimate are looked at, which takes longer
    than all else.
    """
    with collected_warnings() as file_notes:  # these name the file already
        parts = _without_reference(read_parts(estimate, settings), reference)
    whole = all_cameras(list(parts.values()))
    with collected_warnings() as warned:
        offset, found = time_offset(reference, whole, settings)
        matches = match_estimate(reference, whole, settings, offset)
        poses = _poses_of_parts(list(parts.values()), whole, matches)
        convention = _convention(matches, whole, poses, settings, check)
        body_rotation = _body_rotation(convention, settings)
        poses = [rotate_cameras(part, body_rotation) for part in poses]
        scores = _scores(matches, poses, settings)
    described = _described_parts(list(parts), scores)
    aligned_clock = _as_scored(whole, offset, body_rotation, settings)
    notes = [*warned, *matching_notes(matches, reference, aligned_clock, settings)]
    if check:
        if settings.form.timed and reference.keys.dtype.kind == "f":
            auto = settings.t_offset == "auto"
            notes[:0] = offset_notes(reference, whole, offset, found, auto=auto)
        notes += swap_notes(reference, whole)
        notes += _convention_notes(matches, convention, scores, settings)
    matches = replace(matches, est_poses=in_one_world(poses, scores.of_parts, scores.part_of))
    pairs = _pairs(matches, aligned_clock)
    metrics, reasons = _metric_values(pairs, settings, n_parts=len(parts))
    unit = scores.result.tas.unit * settings.max_threshold
    chance = chance_level(reference.poses[matches.expected_rows, :3, 3], unit)
    notes += [*parts_notes(described), *reasons]
    return Evaluation(
        name=name,
        file="" if isinstance(estimate, Trajectory) else str(estimate),
        settings=settings,
        reference=reference,
        estimate=aligned_clock,
        matches=matches,
        result=scores.result,
        tas_seeds=scores.tas_seeds,
        half_distance=scores.half_distance,
        half_angle=rotation_profile(scores.result.ras).half,
        ate=None if described else _ate(pairs, settings),  # that of a single world
        metrics={**metrics, **_levels(matches, scores, settings)},
        lost=1 - float(np.sum(finite_rows(matches.est_poses))) / len(matches.expected_rows),
        chance=chance,
        body_rotation=body_rotation,
        parts=described,
        notes=[*file_notes, *(f"{name}: {note}" if name else note for note in notes)],
        part_positions=[part[:, :3, 3] for part in poses],
        part_of_camera=scores.part_of,
    )


def _without_reference(
    parts: dict[str, Trajectory], reference: Trajectory
) -> dict[str, Trajectory]:
    """Return the parts without the reference, which lies beside them in the folder of `.`."""
    others = {
        name: part for name, part in parts.items() if not all(map(np.array_equal, part, reference))
    }
    return others or parts


def _convention_notes(
    matches: Matches, convention: Convention, scores: _Scores, settings: Settings
) -> list[str]:
    """Say which convention, or which alignment, would make the estimate fit."""
    taken_out = _body_rotation(convention, settings) is not None
    notes = convention_notes(convention, invert=settings.invert, applied=taken_out)
    if notes or len(scores.of_parts) > 1:
        return notes
    return alignment_notes(matches.gt_poses[:, :3, 3], scores.result)


def _poses_of_parts(
    parts: Sequence[Trajectory], whole: Trajectory, matches: Matches
) -> list[Floats]:
    """Return the poses of the matched cameras in each part of an estimate."""
    if len(parts) == 1:
        return [matches.est_poses]
    rows = matches.est_rows.tolist()
    names = [str(whole.keys[row]) if row >= 0 else None for row in rows]
    return [poses_by_name(part, names) for part in parts]


def _convention(
    matches: Matches,
    whole: Trajectory,
    poses: Sequence[Floats],
    settings: Settings,
    check: bool,
) -> Convention:
    """Return the convention of the largest part, if it is to be checked or taken out."""
    if not check and settings.body_rotation == "none":
        return Convention()
    gt, est = matches.pose_references, whole.poses[matches.pose_rows]
    if len(poses) > 1:
        gt, est = matches.gt_poses, max(poses, key=lambda part: int(np.sum(finite_rows(part))))
    return find_convention(gt, est, quaternions=settings.est_form.quaternions)


def _body_rotation(convention: Convention, settings: Settings) -> Floats | None:
    """Return the rotation of the camera's frame that is to be taken out, if any."""
    if settings.body_rotation != "auto" or convention.inverted or convention.rotations_inverted:
        return None  # that of an inverted estimate holds for the inverted poses, not for these
    return convention.body_rotation


def _scores(matches: Matches, poses: Sequence[Floats], settings: Settings) -> _Scores:
    """Return the scores of an estimate, of its poses in each part."""
    gt = matches.gt_poses[:, :3, 3]
    part_of = assign_cameras(poses)
    options: dict[str, Any] = {
        "unit": _known_unit(matches),
        "max_threshold": settings.max_threshold,
        "registration": _registration(matches, settings),
    }
    group: dict[str, Any] = {"alignment": settings.alignment, "up": settings.up}
    degrees, weight = settings.max_threshold_deg, settings.weight
    with warnings.catch_warnings():
        if len(poses) > 1:  # what is said of a part would be taken for the whole
            warnings.simplefilter("ignore", AlignmentWarning)
        of_parts = [
            pas(
                matches.gt_poses,
                part,
                rng=settings.seed,
                max_threshold_deg=degrees,
                weight=weight,
                **options,
                **group,
            )
            for part in poses
        ]
        result = combine(of_parts, part_of)
        tas_seeds = [result.tas.score]
        for seed in settings.seeds[1:]:
            of_seed = [tas(gt, part[:, :3, 3], rng=seed, **options, **group) for part in poses]
            tas_seeds.append(combine_tas(of_seed, part_of).score)
    positions = [part[:, :3, 3] for part in poses]
    new_search = partial(errors_of_parts, gt, positions, part_of, rng=settings.seed, **group)
    half, _ = search_unit(new_search(), extent(gt), 0.5, N_THRESHOLDS)
    repeated = matches.matched - len(np.unique(matches.est_rows[matches.est_rows >= 0]))
    if reason := too_few(len(gt) - repeated, 0.5, settings.alignment, len(poses)):
        warnings.warn(reason, AlignmentWarning, stacklevel=2)
        half = math.nan
    return _Scores(of_parts, part_of, result, tas_seeds, half, new_search)


def _registration(matches: Matches, settings: Settings) -> str | Registration:
    """Return the registration: of PCR-99 with each pose once, since a repeated one fits itself."""
    matched = matches.est_rows[matches.est_rows >= 0]
    repeated = len(np.unique(matched)) < len(matched)
    if settings.registration != "pcr99" or not repeated:
        return settings.registration

    def pcr99_once(
        gt: Floats, est: Floats, /, *, rank: int, **options: Any
    ) -> tuple[Similarity | None, int]:
        _, first = np.unique(np.hstack([gt, est]), axis=0, return_index=True)
        rows = np.sort(first)
        once = max(4, round(rank * len(rows) / len(est)))
        return pcr99(gt[rows], est[rows], rank=min(once, len(rows)), **options)

    return pcr99_once


def _known_unit(matches: Matches) -> float:
    """Return d; where it is undefined, the error says what to do."""
    if math.isfinite(matches.unit):
        return matches.unit
    n = len(matches.expected_rows)
    reason = (
        f"the reference has {n} of the 4 poses that it takes"
        if n < 4
        else "at least three quarters of the reference poses coincide with another one"
    )
    raise ValueError(f"d cannot be derived: {reason}; --unit sets it")


def _described_parts(names: Sequence[str], scores: _Scores) -> list[Part]:
    """Return the parts of an estimate; none where it is a whole."""
    if len(names) == 1:
        return []
    return [
        Part(name, int(np.sum(scores.part_of == index)), result.tas.alignment)
        for index, (name, result) in enumerate(zip(names, scores.of_parts, strict=True))
    ]


def _as_scored(
    estimate: Trajectory, offset: float, body_rotation: Floats | None, settings: Settings
) -> Trajectory:
    """Return an estimate with the time and the camera's frame of the reference."""
    if estimate.keys.dtype.kind == "f":
        estimate = estimate._replace(keys=estimate.keys + offset)
    return estimate._replace(poses=rotate_cameras(estimate.poses, body_rotation))


class _Pairs(NamedTuple):
    """Poses with their reference, for the ATE and other projects' metrics."""

    gt: Floats
    est: Floats
    stamps: Floats | None


def _pairs(matches: Matches, estimate: Trajectory) -> _Pairs:
    """Return every pose that has a reference and, as not finite, what was lost, in its share."""
    if estimate.keys.dtype.kind != "f":
        return _Pairs(matches.gt_poses, matches.est_poses, None)
    rows, lost = matches.pose_rows, np.flatnonzero(matches.est_rows < 0)
    n_lost = round(len(rows) * len(lost) / matches.matched) if len(lost) else 0
    lost = lost[np.linspace(0, len(lost) - 1, n_lost).astype(int)]
    stamps = np.concatenate([estimate.keys[rows], matches.keys[lost]])
    gt = np.concatenate([matches.pose_references, matches.gt_poses[lost]])
    est = np.concatenate([estimate.poses[rows], matches.est_poses[lost]])
    order = np.argsort(stamps, kind="stable")
    return _Pairs(gt[order], est[order], stamps[order])


def _ate(pairs: _Pairs, settings: Settings) -> float | None:
    """Return the ATE of the estimated cameras, in the same alignment; None where there is none."""
    gt, est = pairs.gt[:, :3, 3], pairs.est[:, :3, 3]
    estimated = finite_rows(est)
    try:
        rmse = least_squares_rmse(
            gt[estimated], est[estimated], alignment=settings.alignment, up=settings.up
        )
    except ValueError:  # no camera was estimated, or no similarity fits
        return None
    return rmse if math.isfinite(rmse) else None


def _levels(matches: Matches, scores: _Scores, settings: Settings) -> dict[str, float]:
    """Return the distances and angles that were asked for, aligned as the half-score distance."""
    start = extent(matches.gt_poses[:, :3, 3])
    angles = np.sort(scores.result.ras.errors)
    found = {}
    for name in settings.metrics:
        asked = metric(name)
        if asked.family in LEVELS:
            level = asked.arguments["score"]
            if asked.family.rotations:
                found[name] = smallest_unit(angles, level, N_THRESHOLDS)
            elif not too_few(len(angles), level, settings.alignment, len(scores.of_parts)):
                found[name], _ = search_unit(scores.new_search(), start, level, N_THRESHOLDS)
    return found


def _metric_values(
    pairs: _Pairs, settings: Settings, *, n_parts: int
) -> tuple[dict[str, float], list[str]]:
    """Return the metrics that have a value, and why others have none.

    Those of an estimate in parts would be of no single world.
    """
    own = (*SCORES, *LEVELS)
    names = [name for name in settings.metrics if metric(name).family not in own]
    if n_parts > 1 and names:
        return {}, [f"no value of {', '.join(names)}: they need one world, not {n_parts} parts"]
    found, reasons = {}, []
    gt, est = pairs.gt, pairs.est
    for name in names:
        try:
            value = metric(name)(
                *(gt[:, :3, 3], gt[:, :3, :3], est[:, :3, 3], est[:, :3, :3]),
                rng=settings.seed,
                stamps=pairs.stamps,
            )
        except ValueError as error:
            reasons.append(f"no value of {name}: {error}")
            continue
        if math.isfinite(value):
            found[name] = value
        else:
            reasons.append(f"no value of {name}: it is not finite, with so many cameras lost")
    return found, reasons
