"""One estimate against its reference: read, matched, checked and scored."""

import argparse
import math
import statistics
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Floats, Indices
from ..pose import PASResult, pas
from ..profile import DEGREES, HALF_UNITS, ScoreProfile, extent_units
from ..similarity import Similarity, least_squares_rmse
from ..trajectories.association import Matches, coverage, match, unit_hint
from ..trajectories.conventions import Convention, find_convention, rotate_cameras
from ..trajectories.files import Trajectory, inverse_poses
from ..trajectories.formats import FORMATS
from ..trajectories.parts import (
    all_cameras,
    assign_cameras,
    combine,
    combine_tas,
    in_one_world,
    poses_by_name,
    profile_of_parts,
)
from ..trajectories.timing import find_offset
from ..translation import closest_pair_quartile, tas
from ..validation import AlignmentWarning, finite_rows
from .metrics import protocol_values
from .notes import (
    collected_warnings,
    convention_notes,
    matching_notes,
    offset_notes,
    parts_notes,
    swap_notes,
)

__all__ = ["Part", "Profiles", "Scored", "aligned_positions", "score", "seeds"]

SMALL = 0.03  # seconds: with a larger time offset the positions must fit
LEAST_GAIN = 1.2  # times as well, as noise alone gains less


@dataclass(frozen=True, eq=False)
class Part:
    """A part of an estimate: its name, how many cameras it counts for, and its alignment."""

    name: str
    n: int
    alignment: Similarity | None


@dataclass(frozen=True, eq=False)
class Profiles:
    """The scores of an estimate over all units, which are the same for all estimates.

    Units of the TAS, by the refined registration, are in the reference's unit.
    """

    units: Floats
    tas: Floats
    degrees: Floats
    ras: Floats


@dataclass(frozen=True, eq=False)
class Scored:
    """An estimate with its scores and all that is said about it.

    Parameters
    ----------
    name, file : str
        Short unique name, and the path as it was given.
    estimate : Trajectory
        All its poses, with the reference's time and camera's axes.
    matches : Matches
        The poses of reference and estimate, as they were scored; of an estimate in parts those of
        the estimate are in the world of the reference.
    result : PASResult
        The scores at the first seed, and all that belongs to a single alignment.
    tas_seeds : list of float
        TAS of each seed.
    half_distance, half_angle : float
        Units at which TAS (by the refined registration) and RAS are one half; infinite where they
        never are.
    profiles : Profiles or None
        The scores over all units, where they were asked for.
    protocols : mapping of str to float
        Values of other projects' metrics by their names, where they have one.
    lost : float
        Share of the reference that is left out of the scores, since the track was lost there.
    ate : float or None
        RMSE of the estimated cameras after the least-squares alignment; None where there is none.
    body_rotation : (3, 3) ndarray or None
        Rotation of the camera's frame that was taken out.
    parts : list of Part
        The parts of an estimate in several ones.
    notes : list of str
        What the user should know about it.
    """

    name: str
    file: str
    estimate: Trajectory
    matches: Matches
    result: PASResult
    tas_seeds: list[float]
    half_distance: float
    half_angle: float
    profiles: Profiles | None
    protocols: Mapping[str, float]
    lost: float
    ate: float | None
    body_rotation: Floats | None
    parts: list[Part]
    notes: list[str]

    @property
    def tas(self) -> float:
        """Mean of the TAS over the seeds."""
        return statistics.mean(self.tas_seeds)  # exact: of equal values it is that value

    @property
    def tas_sd(self) -> float | None:
        """Standard deviation of the TAS over the seeds; None for a single one."""
        return _sd(self.tas_seeds)

    @property
    def pas_seeds(self) -> list[float]:
        """PAS of each seed."""
        weight, ras = self.result.weight, self.result.ras.score
        return [weight * tas + (1 - weight) * ras for tas in self.tas_seeds]

    @property
    def pas(self) -> float:
        """Mean of the PAS over the seeds."""
        return statistics.mean(self.pas_seeds)

    @property
    def pas_sd(self) -> float | None:
        """Standard deviation of the PAS over the seeds; None for a single one."""
        return _sd(self.pas_seeds)


def _sd(values: list[float]) -> float | None:
    return statistics.stdev(values) if len(values) > 1 else None


def score(
    reference: Trajectory,
    name: str,
    file: str,
    arguments: argparse.Namespace,
    frames: Floats | None = None,
) -> Scored:
    """Read, match, check and score one estimate; `frames` are the stamps of those due, if known."""
    form = FORMATS[arguments.format]
    with collected_warnings() as file_notes:  # these name the file already
        parts = read_parts(file, arguments)
    estimate = all_cameras(list(parts.values()))
    with collected_warnings() as notes:
        if form.timed:
            offset = time_offset(reference, estimate, arguments.t_offset)
            matches = matched(reference, estimate, arguments, t_offset=offset, frames=frames)
            if arguments.t_offset == "auto":
                notes.append(
                    f"time offset of {offset:.4f} s found, and added to its stamps"
                    if offset
                    else f"no time offset at which its positions fit {LEAST_GAIN:g} times as well"
                )
            else:
                notes += offset_notes(reference, estimate, offset)
        else:
            matches = matched(reference, estimate, arguments)
        poses = poses_of_parts(list(parts.values()), estimate, matches)
        poses, convention, body_rotation = converted(matches, poses, arguments)
        holder = assign_cameras(poses)
        with warnings.catch_warnings():
            if len(parts) > 1:  # what is said of a part would be taken for the whole
                warnings.simplefilter("ignore", AlignmentWarning)
            results = pas_of_parts(matches, poses, arguments)
            result = combine(results, holder)
            tas_seeds = tas_of_seeds(matches, poses, holder, result, arguments)
        half, profiles = half_and_profiles(reference, matches, poses, holder, result, arguments)
    notes += matching_notes(matches, reference, estimate, form)
    notes += swap_notes(reference, estimate)
    notes += convention_notes(
        convention, invert=arguments.invert, applied=body_rotation is not None
    )
    if body_rotation is not None:
        estimate = estimate._replace(poses=rotate_cameras(estimate.poses, body_rotation))
    if form.timed:
        estimate = estimate._replace(keys=estimate.keys + offset)
    protocols, unvalued = protocol_values(
        matches, arguments.metrics, seed=arguments.seed, n_parts=len(parts)
    )
    notes += unvalued
    one_ate, described = ate(matches), []
    if len(parts) > 1:
        described = described_parts(parts, results, holder)
        notes += parts_notes(described)
        matches = replace(matches, est_poses=in_one_world(poses, results, holder))
        one_ate = None  # that of a single world
    return Scored(
        name=name,
        file=file,
        estimate=estimate,
        matches=matches,
        result=result,
        tas_seeds=tas_seeds,
        half_distance=half,
        half_angle=rotation_profile(result).half,
        profiles=profiles,
        protocols=protocols,
        lost=1 - coverage(reference, matches),
        ate=one_ate,
        body_rotation=body_rotation,
        parts=described,
        notes=[*file_notes, *(f"{name}: {note}" for note in notes)],
    )


def read_parts(file: str, arguments: argparse.Namespace) -> dict[str, Trajectory]:
    """Read the parts of an estimate, of which there is one as a rule, camera-to-world."""
    form = FORMATS[arguments.est_format or arguments.format]
    parts = form.read_parts(file) if form.read_parts else {"": form.read(file)}
    if not arguments.invert:
        return parts
    return {name: part._replace(poses=inverse_poses(part.poses)) for name, part in parts.items()}


def matched(
    reference: Trajectory, estimate: Trajectory, arguments: argparse.Namespace, **options: Any
) -> Matches:
    """Match an estimate; where too few poses are, the error says by which options it was done."""
    timed = FORMATS[arguments.format].timed
    if timed:
        options["t_max_diff"] = arguments.t_max_diff
    matches = match(reference, estimate, missing=arguments.missing or "ignore", **options)
    if len(matches.keys) < min(4, len(reference.keys)):
        names = ("missing", "t_max_diff", "t_offset")
        settings = {"missing": arguments.missing, **options}
        given = ", ".join(
            f"--{key} {settings[key]}" for key in names if settings.get(key) is not None
        )
        hint = unit_hint(reference.keys, estimate.keys) if timed else ""
        raise ValueError(
            f"only {matches.matched} of {len(estimate.keys)} poses could be matched to the "
            f"reference, and it takes 4{given and f' ({given})'}{hint}"
        )
    return matches


def poses_of_parts(
    parts: Sequence[Trajectory], estimate: Trajectory, matches: Matches
) -> list[Floats]:
    """Return the poses of the matched cameras in each part, of an estimate joined from them."""
    if len(parts) == 1:
        return [matches.est_poses]
    rows = matches.est_rows.tolist()
    names = [str(estimate.keys[row]) if row >= 0 else None for row in rows]
    return [poses_by_name(part, names) for part in parts]


def converted(
    matches: Matches, poses: Sequence[Floats], arguments: argparse.Namespace
) -> tuple[list[Floats], Convention, Floats | None]:
    """Find the convention of the largest part, and take a rotation of the camera's frame out.

    Returns the poses of the parts, the convention, and the rotation if one was asked for and found.
    """
    largest = max(poses, key=lambda part: int(np.sum(finite_rows(part))))
    convention = find_convention(matches.gt_poses, largest)
    inverted = convention.inverted or convention.rotations_inverted
    # B of an inverted estimate holds for the inverted poses, not for these.
    automatic = arguments.body_rotation == "auto" and not inverted
    body_rotation = convention.body_rotation if automatic else None
    if body_rotation is not None:
        poses = [rotate_cameras(part, body_rotation) for part in poses]
    return list(poses), convention, body_rotation


def described_parts(
    names: Iterable[str], results: Sequence[PASResult], holder: Indices
) -> list[Part]:
    """Return what is told of the parts of an estimate."""
    return [
        Part(name, int(np.sum(holder == index)), one.tas.alignment)
        for index, (name, one) in enumerate(zip(names, results, strict=True))
    ]


def pas_of_parts(
    matches: Matches, poses: Sequence[Floats], arguments: argparse.Namespace
) -> list[PASResult]:
    """Return the scores of each part at the first seed, over all cameras."""
    unit = arguments.unit or derived_unit(matches)
    return [
        pas(
            matches.gt_poses,
            part,
            rng=arguments.seed,
            unit=unit,
            weight=arguments.weight,
            max_threshold=arguments.max_threshold,
            max_threshold_deg=arguments.max_threshold_deg,
            registration=arguments.registration,
        )
        for part in poses
    ]


def time_offset(reference: Trajectory, estimate: Trajectory, option: float | str) -> float:
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
    sure = abs(found.seconds) <= SMALL or found.gain >= LEAST_GAIN
    return found.seconds if sure else 0.0


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


def tas_of_seeds(
    matches: Matches,
    poses: Sequence[Floats],
    holder: Indices,
    result: PASResult,
    arguments: argparse.Namespace,
) -> list[float]:
    """Return the TAS of each seed, the first of which is that of the result."""
    gt = matches.gt_poses[:, :3, 3]
    options = {
        "unit": result.tas.unit,
        "max_threshold": arguments.max_threshold,
        "registration": arguments.registration,
    }
    scores = [result.tas.score]
    for seed in seeds(arguments)[1:]:
        results = [tas(gt, part[:, :3, 3], rng=seed, **options) for part in poses]
        scores.append(combine_tas(results, holder).score)
    return scores


def half_and_profiles(
    reference: Trajectory,
    matches: Matches,
    poses: Sequence[Floats],
    holder: Indices,
    result: PASResult,
    arguments: argparse.Namespace,
) -> tuple[float, Profiles | None]:
    """Return the half-score distance, and the scores over all units where they are asked for.

    The distance needs a few units alone. It is the same whether there are profiles or not.
    """
    gt, parts = matches.gt_poses[:, :3, 3], [part[:, :3, 3] for part in poses]
    unit = result.tas.unit
    half = profile_of_parts(gt, parts, holder, unit * HALF_UNITS, rng=arguments.seed).half
    if not (arguments.profile or arguments.plot or arguments.save_plot):
        return half, None
    try:
        units = extent_units(reference.poses[:, :3, 3])
    except ValueError:  # all cameras in one place, so that --unit alone has a size
        units = unit * HALF_UNITS
    tas_profile = profile_of_parts(gt, parts, holder, units, rng=arguments.seed)
    ras_profile = rotation_profile(result)
    return half, Profiles(units, tas_profile.scores, DEGREES, ras_profile.scores)


def rotation_profile(result: PASResult) -> ScoreProfile:
    """Return the profile of the RAS."""
    errors = np.sort(result.ras.errors)[None]
    return ScoreProfile(DEGREES, errors, len(result.ras.thresholds))


def aligned_positions(matches: Matches, result: PASResult) -> Floats:
    """Return the estimated camera centres, (n, 3), in the world of the reference; NaN for none."""
    positions = matches.est_poses[:, :3, 3]
    if result.tas.alignment is None:
        return np.full_like(positions, np.nan)
    return result.tas.alignment.inverse().apply(positions)


def seeds(arguments: argparse.Namespace) -> range:
    """Return the seeds that are scored: a single one where the score hardly depends on it."""
    repeat = 1 if arguments.registration == "refined" else arguments.repeat
    return range(arguments.seed, arguments.seed + repeat)


def ate(matches: Matches) -> float | None:
    """Return the ATE of the estimated cameras, for context; None where there is none."""
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    estimated = finite_rows(est)
    try:
        rmse = least_squares_rmse(gt[estimated], est[estimated])
    except ValueError:  # no camera was estimated, or no similarity fits
        return None
    return rmse if math.isfinite(rmse) else None
