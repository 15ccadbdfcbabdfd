"""One estimate against its reference: read, matched, checked and scored."""

import argparse
import math
import statistics
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..pose import PASResult, pas
from ..similarity import least_squares_rmse
from ..trajectories.association import Matches, coverage, match, unit_hint
from ..trajectories.conventions import find_convention, rotate_cameras
from ..trajectories.files import Trajectory, inverse_poses
from ..trajectories.timing import find_offset
from ..translation import closest_pair_quartile, tas
from ..validation import finite_rows
from .formats import FORMATS
from .notes import collected_warnings, convention_notes, matching_notes, offset_notes, swap_notes

__all__ = ["Scored", "score", "seeds"]


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
        The poses of reference and estimate, as they were scored.
    result : PASResult
        The scores at the first seed, and all that belongs to a single alignment.
    tas_seeds : list of float
        TAS of each seed.
    lost : float
        Share of the reference that is left out of the scores, since the track was lost there.
    ate : float or None
        RMSE of the estimated cameras after the least-squares alignment; None where there is none.
    body_rotation : (3, 3) ndarray or None
        Rotation of the camera's frame that was taken out.
    notes : list of str
        What the user should know about it.
    """

    name: str
    file: str
    estimate: Trajectory
    matches: Matches
    result: PASResult
    tas_seeds: list[float]
    lost: float
    ate: float | None
    body_rotation: NDArray[np.float64] | None
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
    frames: NDArray[np.float64] | None = None,
) -> Scored:
    """Read, match, check and score one estimate; `frames` are the stamps of those due, if known."""
    form = FORMATS[arguments.format]
    timing = {key: getattr(arguments, key) for key in ("t_max_diff", "t_offset") if form.timed}
    with collected_warnings() as file_notes:  # these name the file already
        estimate = FORMATS[arguments.est_format or arguments.format].read(file)
    if arguments.invert:
        estimate = estimate._replace(poses=inverse_poses(estimate.poses))
    with collected_warnings() as notes:
        if form.timed:
            timing["t_offset"] = time_offset(reference, estimate, arguments.t_offset)
        missing = arguments.missing or "ignore"
        matches = match(reference, estimate, missing=missing, frames=frames, **timing)
        if len(matches.keys) < min(4, len(reference.keys)):
            options = {"missing": arguments.missing, **timing}
            given = ", ".join(
                f"--{key} {value}" for key, value in options.items() if value is not None
            )
            hint = unit_hint(reference.keys, estimate.keys) if form.timed else ""
            raise ValueError(
                f"only {matches.matched} of {len(estimate.keys)} poses could be matched to the "
                f"reference, and it takes 4{given and f' ({given})'}{hint}"
            )
        if form.timed and arguments.t_offset == "auto":
            notes += [f"time offset of {timing['t_offset']:.4f} s found, and added to its stamps"]
        elif form.timed:
            notes += offset_notes(reference, estimate, timing["t_offset"])
        convention = find_convention(matches.gt_poses, matches.est_poses)
        inverted = convention.inverted or convention.rotations_inverted
        # B of an inverted estimate holds for the inverted poses, not for these.
        automatic = arguments.body_rotation == "auto" and not inverted
        body_rotation = convention.body_rotation if automatic else None
        est_poses = matches.est_poses
        if body_rotation is not None:
            est_poses = rotate_cameras(est_poses, body_rotation)
        result = pas(
            matches.gt_poses,
            est_poses,
            rng=arguments.seed,
            unit=arguments.unit or derived_unit(matches),
            weight=arguments.weight,
            max_threshold=arguments.max_threshold,
            max_threshold_deg=arguments.max_threshold_deg,
            registration=arguments.registration,
        )
        tas_seeds = tas_of_seeds(matches, result, arguments)
    notes += matching_notes(matches, reference, estimate, form)
    notes += swap_notes(reference, estimate)
    notes += convention_notes(
        convention, invert=arguments.invert, applied=body_rotation is not None
    )
    if body_rotation is not None:
        estimate = estimate._replace(poses=rotate_cameras(estimate.poses, body_rotation))
    if form.timed:
        estimate = estimate._replace(keys=estimate.keys + timing["t_offset"])
    return Scored(
        name=name,
        file=file,
        estimate=estimate,
        matches=matches,
        result=result,
        tas_seeds=tas_seeds,
        lost=1 - coverage(reference, matches),
        ate=ate(matches),
        body_rotation=body_rotation,
        notes=[*file_notes, *(f"{name}: {note}" for note in notes)],
    )


def time_offset(reference: Trajectory, estimate: Trajectory, option: float | str) -> float:
    """Return the time offset to be used: the one given, or for "auto" the one found."""
    if option != "auto":
        return float(option)
    found = find_offset(reference, estimate)
    if found is None:
        raise ValueError(
            "no time offset makes its positions fit those of the reference; --t_offset X sets one"
            f"{unit_hint(reference.keys, estimate.keys)}"
        )
    return found.seconds


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


def tas_of_seeds(matches: Matches, result: PASResult, arguments: argparse.Namespace) -> list[float]:
    """Return the TAS of each seed, the first of which is that of the result."""
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    options = {
        "unit": result.tas.unit,
        "max_threshold": arguments.max_threshold,
        "registration": arguments.registration,
    }
    others = [tas(gt, est, rng=seed, **options).score for seed in seeds(arguments)[1:]]
    return [result.tas.score, *others]


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
