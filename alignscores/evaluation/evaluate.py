"""One estimate against its reference: read, matched, checked and scored, the same for everybody."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from ..arrays import Floats, Indices
from ..metrics import SCORES, metric
from ..pose import PASResult, pas
from ..profile import HALF_UNITS
from ..similarity import least_squares_rmse
from ..trajectories.association import Matches, coverage, in_order, match, unit_hint
from ..trajectories.conventions import Convention, find_convention, rotate_cameras
from ..trajectories.files import Trajectory, inverse_poses, read_stamps
from ..trajectories.files.text import FilePath
from ..trajectories.formats import FORMATS
from ..trajectories.parts import (
    combine,
    combine_tas,
    holders,
    in_one_world,
    joined,
    poses_of,
    profile_of_parts,
)
from ..trajectories.timing import find_offset
from ..translation import closest_pair_quartile, tas
from ..validation import AlignmentWarning, finite_rows
from .evaluation import Evaluation, Part, rotation_profile
from .names import unique_names
from .notes import (
    collected_warnings,
    convention_notes,
    matching_notes,
    offset_notes,
    parts_notes,
    swap_notes,
)
from .settings import Settings

__all__ = ["evaluate", "match_estimate", "read_parts", "read_reference", "score"]

SMALL_OFFSET = 0.03  # seconds; with a larger one the positions must fit `LEAST_GAIN` times as well
LEAST_GAIN = 1.2  # noise alone gains less
FORMAT_OF_KEYS = {"f": "tum", "i": "kitti", "U": "nerf"}  # that trajectories in memory are like


def evaluate(
    reference: FilePath | Trajectory,
    estimate: FilePath | Trajectory,
    settings: Settings | None = None,
    **changes: Any,
) -> Evaluation:
    """Score an estimate against its reference, as the command ``alignscores`` does.

    Parameters
    ----------
    reference, estimate : path or Trajectory
        Files in the format of the settings, or trajectories in memory: keys and camera-to-world
        poses, (n, 4, 4). The reference is the ground truth.
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
    (0.8097, 0.7993, 0.8045)
    >>> evaluation.to_dict()["matched"]
    38
    """
    settings = replace(settings or Settings(), **changes)
    if settings.format is None and isinstance(reference, Trajectory):
        kind = np.asarray(reference.keys).dtype.kind
        settings = replace(settings, format=FORMAT_OF_KEYS.get(kind))
    with collected_warnings() as notes:
        truth = read_reference(reference, settings)
    if isinstance(estimate, Trajectory):
        name, file = "estimate", ""
    else:
        name, file = unique_names([str(estimate)])[0], str(estimate)
    evaluation = score(truth, estimate, settings, name=name, file=file)
    return replace(evaluation, notes=[*notes, *evaluation.notes])


def read_reference(reference: FilePath | Trajectory, settings: Settings) -> Trajectory:
    """Return the reference in the order of time, without duplicates."""
    if isinstance(reference, Trajectory):
        return in_order(reference)
    return in_order(settings.form.read(reference, complete=True))


def read_parts(estimate: FilePath | Trajectory, settings: Settings) -> dict[str, Trajectory]:
    """Return the parts of an estimate, of which there is one as a rule, camera-to-world."""
    if isinstance(estimate, Trajectory):
        parts = {"": estimate}
    else:
        form = FORMATS[settings.est_format] if settings.est_format else settings.form
        parts = form.read_parts(estimate) if form.read_parts else {"": form.read(estimate)}
    if not settings.invert:
        return parts
    return {name: part._replace(poses=inverse_poses(part.poses)) for name, part in parts.items()}


def score(
    reference: Trajectory,
    estimate_source: FilePath | Trajectory,
    settings: Settings,
    *,
    name: str,
    file: str,
    check: bool = True,
) -> Evaluation:
    """Read, match, check and score one estimate.

    With `check` its conventions and its clock are looked at, which takes longer than all else.
    """
    with collected_warnings() as file_notes:  # these name the file already
        parts = read_parts(estimate_source, settings)
    estimate = joined(list(parts.values()))
    with collected_warnings() as notes:
        matches, offset = match_estimate(reference, estimate, settings)
        if check and settings.form.timed:
            notes += _clock_notes(reference, estimate, offset, settings)
        poses = _poses_of_parts(list(parts.values()), estimate, matches)
        convention, body_rotation = Convention(), None
        if check or settings.body_rotation == "auto":
            convention, body_rotation = _convention(matches, poses, settings)
        if body_rotation is not None:
            poses = [rotate_cameras(part, body_rotation) for part in poses]
            estimate = estimate._replace(poses=rotate_cameras(estimate.poses, body_rotation))
        holder = holders(poses)
        with warnings.catch_warnings():
            if len(parts) > 1:  # what is said of a part would be taken for the whole
                warnings.simplefilter("ignore", AlignmentWarning)
            results = _pas_of_parts(matches, poses, settings)
            result = combine(results, holder)
            tas_seeds = _tas_of_seeds(matches, poses, holder, result, settings)
    notes += matching_notes(matches, reference, estimate, settings.form)
    if check:
        notes += swap_notes(reference, estimate)
        notes += convention_notes(
            convention, invert=settings.invert, applied=body_rotation is not None
        )
    if settings.form.timed:
        estimate = estimate._replace(keys=estimate.keys + offset)
    described = []
    if len(parts) > 1:
        described = [
            Part(part, int(np.sum(holder == index)), part_result.tas.alignment)
            for index, (part, part_result) in enumerate(zip(parts, results, strict=True))
        ]
        notes += parts_notes(described)
        matches = replace(matches, est_poses=in_one_world(poses, results, holder))
    else:
        matches = replace(matches, est_poses=poses[0])
    metrics, reasons = _metric_values(matches, settings, n_parts=len(parts))
    positions = [part[:, :3, 3] for part in poses]
    prefix = f"{name}: " if name else ""
    return Evaluation(
        name=name,
        file=file,
        settings=settings,
        reference=reference,
        estimate=estimate,
        matches=matches,
        result=result,
        tas_seeds=tas_seeds,
        half_distance=_half_distance(matches, positions, holder, result, settings),
        half_angle=rotation_profile(result.ras).half,
        ate=None if described else _ate(matches),  # that of a single world
        metrics=metrics,
        lost=1 - coverage(reference, matches),
        body_rotation=body_rotation,
        parts=described,
        notes=[*file_notes, *(f"{prefix}{note}" for note in [*notes, *reasons])],
        part_positions=positions,
        part_of_camera=holder,
    )


def match_estimate(
    reference: Trajectory, estimate: Trajectory, settings: Settings
) -> tuple[Matches, float]:
    """Match an estimate; return the matches and the time offset that was added.

    Where too few poses are matched, the error says by which options it was done.
    """
    timed, offset = settings.form.timed, 0.0
    options: dict[str, Any] = {}
    if timed:
        offset = _time_offset(reference, estimate, settings.t_offset)
        options = {"t_max_diff": settings.t_max_diff, "t_offset": offset}
        if settings.frames is not None:
            options["frames"] = _frames(settings.frames)
    missing = settings.missing_cameras or "fail"
    matches = match(reference, estimate, missing=missing, **options)
    if len(matches.keys) < min(4, len(reference.keys)):
        shown = {"missing": settings.missing_cameras, **options}
        shown.pop("frames", None)
        given = ", ".join(f"--{key} {value}" for key, value in shown.items() if value is not None)
        hint = unit_hint(reference.keys, estimate.keys) if timed else ""
        raise ValueError(
            f"only {matches.matched} of {len(estimate.keys)} poses could be matched to the "
            f"reference, and it takes 4{given and f' ({given})'}{hint}"
        )
    return matches, offset


def derived_unit(matches: Matches) -> float:
    """Return d of the reference poses; where there is none, the error says what to do."""
    gt = matches.gt_poses[:, :3, 3]
    try:
        return closest_pair_quartile(gt)
    except ValueError:
        reason = (
            f"the reference has {len(gt)} of the 4 poses that it takes"
            if len(gt) < 4
            else "at least three quarters of the reference poses coincide with another one"
        )
        raise ValueError(f"d cannot be derived: {reason}; --unit sets it") from None


def _frames(frames: FilePath | Floats) -> Floats:
    """Return the stamps of the frames that were due, from a file or as they are."""
    if isinstance(frames, (str, PathLike)):
        return read_stamps(frames)
    return np.asarray(frames, dtype=float)


def _time_offset(reference: Trajectory, estimate: Trajectory, option: float | str) -> float:
    """Return the time offset to be used: the one given, or for "auto" the one found.

    On an orbit, a helix or a straight road all offsets fit alike, and noise chooses: it is 0 then.
    """
    if option != "auto":
        return float(option)
    found = find_offset(reference, estimate)
    if found is None:
        raise ValueError(
            "no time offset makes its positions fit those of the reference; --t_offset X sets one"
            f"{unit_hint(reference.keys, estimate.keys)}"
        )
    sure = abs(found.seconds) <= SMALL_OFFSET or found.gain >= LEAST_GAIN
    return found.seconds if sure else 0.0


def _clock_notes(
    reference: Trajectory, estimate: Trajectory, offset: float, settings: Settings
) -> list[str]:
    """Say which time offset was found, or that there seems to be one."""
    if settings.t_offset != "auto":
        return offset_notes(reference, estimate, offset)
    if offset:
        return [f"time offset of {offset:.4f} s found, and added to its stamps"]
    return [f"no time offset at which its positions fit {LEAST_GAIN:g} times as well"]


def _poses_of_parts(
    parts: Sequence[Trajectory], estimate: Trajectory, matches: Matches
) -> list[Floats]:
    """Return the poses of the matched cameras in each part, of an estimate joined from them."""
    if len(parts) == 1:
        return [matches.est_poses]
    rows = matches.est_rows.tolist()
    names = [str(estimate.keys[row]) if row >= 0 else None for row in rows]
    return [poses_of(part, names) for part in parts]


def _convention(
    matches: Matches, poses: Sequence[Floats], settings: Settings
) -> tuple[Convention, Floats | None]:
    """Return the convention of the largest part, and the camera's rotation to be taken out."""
    largest = max(poses, key=lambda part: int(np.sum(finite_rows(part))))
    convention = find_convention(matches.gt_poses, largest)
    inverted = convention.inverted or convention.rotations_inverted
    # B of an inverted estimate holds for the inverted poses, not for these.
    automatic = settings.body_rotation == "auto" and not inverted
    return convention, convention.body_rotation if automatic else None


def _pas_of_parts(matches: Matches, poses: Sequence[Floats], settings: Settings) -> list[PASResult]:
    """Return the scores of each part at the first seed, over all cameras."""
    unit = settings.unit or derived_unit(matches)
    return [
        pas(
            matches.gt_poses,
            part,
            rng=settings.seed,
            unit=unit,
            weight=settings.weight,
            max_threshold=settings.max_threshold,
            max_threshold_deg=settings.max_threshold_deg,
            registration=settings.registration,
        )
        for part in poses
    ]


def _tas_of_seeds(
    matches: Matches,
    poses: Sequence[Floats],
    holder: Indices,
    result: PASResult,
    settings: Settings,
) -> list[float]:
    """Return the TAS of each seed, the first of which is that of the result."""
    gt = matches.gt_poses[:, :3, 3]
    options: dict[str, Any] = {
        "unit": result.tas.unit,
        "max_threshold": settings.max_threshold,
        "registration": settings.registration,
    }
    scores = [result.tas.score]
    for seed in settings.seeds[1:]:
        results = [tas(gt, part[:, :3, 3], rng=seed, **options) for part in poses]
        scores.append(combine_tas(results, holder).score)
    return scores


def _half_distance(
    matches: Matches,
    positions: Sequence[Floats],
    holder: Indices,
    result: PASResult,
    settings: Settings,
) -> float:
    """Return the unit at which the TAS is one half, whatever registration the TAS has."""
    gt, units = matches.gt_poses[:, :3, 3], result.tas.unit * HALF_UNITS
    return profile_of_parts(gt, positions, holder, units, rng=settings.seed).half


def _ate(matches: Matches) -> float | None:
    """Return the ATE of the estimated cameras; None where there is none."""
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    estimated = finite_rows(est)
    try:
        rmse = least_squares_rmse(gt[estimated], est[estimated])
    except ValueError:  # no camera was estimated, or no similarity fits
        return None
    return rmse if math.isfinite(rmse) else None


def _metric_values(
    matches: Matches, settings: Settings, *, n_parts: int
) -> tuple[Mapping[str, float], list[str]]:
    """Return the metrics that have a value, and why others have none.

    Those of an estimate in parts would be of no single world.
    """
    scores = {family.example for family in SCORES}
    names = [name for name in settings.metrics if name not in scores]
    if n_parts > 1 and names:
        return {}, [f"no value of {', '.join(names)}: they need one world, not {n_parts} parts"]
    found, reasons = {}, []
    gt, est = matches.gt_poses, matches.est_poses
    for name in names:
        try:
            value = metric(name)(
                gt[:, :3, 3], gt[:, :3, :3], est[:, :3, 3], est[:, :3, :3], rng=settings.seed
            )
        except ValueError as error:
            reasons.append(f"no value of {name}: {error}")
            continue
        if math.isfinite(value):
            found[name] = value
        else:
            reasons.append(f"no value of {name}: it is not finite, with so many cameras lost")
    return found, reasons
