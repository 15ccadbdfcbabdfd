"""One run: read, matched and scored, or taken from the cache by the content of its files."""

import argparse
import hashlib
import json
import warnings
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices
from ..cli.notes import collected_warnings, convention_notes, offset_notes, parts_notes, swap_notes
from ..cli.saving import statuses, write_whole
from ..cli.scoring import (
    aligned_positions,
    converted,
    described_parts,
    matched,
    pas_of_parts,
    poses_of_parts,
    read_parts,
    tas_of_seeds,
    time_offset,
)
from ..pose import PASResult
from ..profile import HALF_UNITS, ScoreProfile, tas_profile
from ..protocols import NoValueError, protocol
from ..trajectories.association import Matches, in_order
from ..trajectories.files import Trajectory, read_stamps
from ..trajectories.formats import FORMATS
from ..trajectories.parts import all_cameras, assign_cameras, combine, in_one_world
from ..translation import closest_pair_quartile, tas
from ..validation import AlignmentWarning, finite_rows

__all__ = ["Due", "Outcome", "Task", "due", "evaluate", "read_reference"]


POOR = 0.5  # TAS below which it may be that the clocks differ
LARGE = "points3D"  # of a COLMAP model: its size stands for its content, no score depends on it


@dataclass(frozen=True)
class Task:
    """An estimate to be scored: its files, the options, and the metrics besides the scores."""

    reference: str
    estimate: str
    options: argparse.Namespace
    metrics: tuple[str, ...] = ()
    cache: str | None = None
    check: bool = False  # conventions and clocks, which takes longer than all else


@dataclass(frozen=True)
class Due:
    """How many cameras were due, and their d; None where it does not exist."""

    n: int
    unit: float | None


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one estimate.

    Parameters
    ----------
    scores : dict of str to float
        TAS, RAS, PAS, half_distance, half_angle and the metrics; an error without a value is
        infinite.
    n : int
        Number of cameras that were scored.
    failures : int
        Number of those without a position or without a rotation.
    unit : float
        d.
    n_rows : int
        Number of rows of the reference.
    rows : (n,) ndarray of int
        Row of each camera in the reference, ascending.
    statuses : (n,) ndarray of uint8
        Whether each camera was matched, or why it is a failure: `alignscores.cli.saving.statuses`.
    positions : (n, 3) ndarray
        Estimated camera centres in the world of the reference; NaN where there are none.
    position_errors, rotation_errors : (n,) ndarray
        In units of the ground truth and in degrees; infinite for a failure.
    position_scores, rotation_scores : (n,) ndarray
        Share of the thresholds that each camera is within: their means are the scores.
    distance_terms, angle_terms : (n,) ndarray
        By how much each camera lifts half_distance and half_angle, to first order: their means are
        0. Zeros where these are 0 or infinite.
    notes : list of str
        What the user should know about it.
    error : str
        Why it could not be scored; empty if it could.
    """

    scores: dict[str, float]
    n: int = 0
    failures: int = 0
    unit: float = np.nan
    n_rows: int = 0
    rows: Indices = field(default_factory=lambda: np.empty(0, np.intp))
    statuses: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    positions: Floats = field(default_factory=lambda: np.empty((0, 3)))
    position_errors: Floats = field(default_factory=lambda: np.empty(0))
    rotation_errors: Floats = field(default_factory=lambda: np.empty(0))
    position_scores: Floats = field(default_factory=lambda: np.empty(0))
    rotation_scores: Floats = field(default_factory=lambda: np.empty(0))
    distance_terms: Floats = field(default_factory=lambda: np.empty(0))
    angle_terms: Floats = field(default_factory=lambda: np.empty(0))
    notes: list[str] = field(default_factory=list)
    error: str = ""

    @property
    def places(self) -> Floats:
        """Row of each camera, as a share of the number of rows, from 0 to 1."""
        return np.asarray((self.rows + 0.5) / self.n_rows)


ARRAYS = (
    *("rows", "statuses", "positions"),
    *("position_errors", "rotation_errors", "position_scores", "rotation_scores"),
    *("distance_terms", "angle_terms"),
)


def evaluate(task: Task) -> Outcome:
    """Score an estimate, or take the result of the same files and options from the cache."""
    try:
        file = _cached_file(task, "run")
        if file and (outcome := _loaded(file, task.estimate)):
            return outcome
        outcome = _scored(task)
    except ValueError as error:
        return Outcome({}, error=_named(error, task.estimate))
    if file:
        _store(file, outcome, task.estimate)
    return outcome


def due(task: Task) -> Due | str:
    """Return how many cameras an estimate should have, with their d; or why that is unknown."""
    try:
        file = _cached_file(task, "due")
        if file and file.is_file():
            try:
                return Due(**json.loads(file.read_text()))
            except (TypeError, ValueError):
                pass
        with collected_warnings():
            reference, frames = _read(task)
            estimate = all_cameras(list(read_parts(task.estimate, task.options).values()))
            matches, _ = _matched(reference, estimate, frames, task.options)
        found = Due(len(matches.keys), _quartile(matches.gt_poses[:, :3, 3]))
    except ValueError as error:
        return _named(error, task.estimate)
    if file:
        write_whole(file, json.dumps(found.__dict__).encode())
    return found


@lru_cache(maxsize=2)
def read_reference(path: str, format: str) -> Trajectory:
    """Read a reference; each is read once for the runs that follow each other."""
    return in_order(FORMATS[format].read(path, complete=True))


def _named(error: ValueError, file: str) -> str:
    message = " ".join(str(error).split())
    return message if message.startswith(file) else f"{file}: {message}"


def _quartile(gt: Floats) -> float | None:
    try:
        return closest_pair_quartile(gt)
    except ValueError:
        return None


def _read(task: Task) -> tuple[Trajectory, Floats | None]:
    frames = getattr(task.options, "frames", None)
    with collected_warnings():  # the command tells them, once for each sequence
        reference = read_reference(task.reference, task.options.format)
    return reference, None if frames is None else read_stamps(frames)


def _matched(
    reference: Trajectory,
    estimate: Trajectory,
    frames: Floats | None,
    options: argparse.Namespace,
) -> tuple[Matches, float]:
    if not FORMATS[options.format].timed:
        return matched(reference, estimate, options), 0.0
    offset = time_offset(reference, estimate, options.t_offset)
    return matched(reference, estimate, options, t_offset=offset, frames=frames), offset


def _scored(task: Task) -> Outcome:
    options = task.options
    with collected_warnings() as notes:
        reference, frames = _read(task)
        parts = read_parts(task.estimate, options)
        estimate = all_cameras(list(parts.values()))
        matches, offset = _matched(reference, estimate, frames, options)
        poses = poses_of_parts(list(parts.values()), estimate, matches)
        if task.check or options.body_rotation == "auto":
            poses, convention, rotation = converted(matches, poses, options)
            notes += convention_notes(
                convention, invert=options.invert, applied=rotation is not None
            )
            notes += swap_notes(reference, estimate)
        holder = assign_cameras(poses)
        with warnings.catch_warnings():
            if len(parts) > 1:  # what is said of a part would be taken for the whole
                warnings.simplefilter("ignore", AlignmentWarning)
            results = pas_of_parts(matches, poses, options)
            result = combine(results, holder)
            tas_seeds = tas_of_seeds(matches, poses, holder, result, options)
        poor = result.tas.score < POOR and FORMATS[options.format].timed
        if task.check and poor and options.t_offset != "auto":
            notes += offset_notes(reference, estimate, offset)
        if len(parts) > 1:
            matches = replace(matches, est_poses=in_one_world(poses, results, holder))
            notes += parts_notes(described_parts(parts, results, holder))
        else:
            matches = replace(matches, est_poses=poses[0])
        scores, reasons = _scores(
            matches, result, tas_seeds, task.metrics, options, whole=len(parts) == 1
        )
        notes += reasons
    failed = ~(np.isfinite(result.tas.errors) & finite_rows(matches.est_poses))
    return Outcome(
        scores=scores,
        n=len(matches.keys),
        failures=int(failed.sum()),
        unit=result.tas.unit,
        n_rows=len(reference.keys),
        rows=matches.gt_rows,
        statuses=statuses(matches),
        positions=aligned_positions(matches, result),
        position_errors=result.tas.errors,
        rotation_errors=result.ras.errors,
        position_scores=_shares(result.tas.errors, result.tas.thresholds),
        rotation_scores=_shares(result.ras.errors, result.ras.thresholds),
        distance_terms=half_terms(
            _errors_at(scores["half_distance"], matches, result, options, whole=len(parts) == 1),
            scores["half_distance"],
        ),
        angle_terms=half_terms(result.ras.errors, scores["half_angle"]),
        notes=notes,
    )


def _scores(
    matches: Matches,
    result: PASResult,
    tas_seeds: Sequence[float],
    metrics: Sequence[str],
    options: argparse.Namespace,
    *,
    whole: bool,
) -> tuple[dict[str, float], list[str]]:
    """Return the scores, means over the seeds, and the metrics; and why some have no value."""
    tas, ras = float(np.mean(tas_seeds)), result.ras.score
    gt, est = matches.gt_poses, matches.est_poses
    if whole:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AlignmentWarning)  # the TAS has told it
            distance = tas_profile(
                gt[:, :3, 3],
                est[:, :3, 3],
                result.tas.unit * HALF_UNITS,
                rng=options.seed,
                registration=options.registration,
            ).half
    else:
        distance = _half(result.tas.errors)
    scores = {
        "TAS": tas,
        "RAS": ras,
        "PAS": result.weight * tas + (1 - result.weight) * ras,
        "half_distance": distance,
        "half_angle": _half(result.ras.errors),
    }
    reasons = []
    for name in metrics:
        metric = protocol(name)
        try:
            value = metric(
                gt[:, :3, 3], gt[:, :3, :3], est[:, :3, 3], est[:, :3, :3], rng=options.seed
            )
        except NoValueError as error:
            value = np.nan
            reasons.append(f"no value of {name}, which counts as a failure: {error}")
        scores[name] = value if np.isfinite(value) else worst(name)
    return scores, reasons


def worst(metric: str) -> float:
    """Return the value of a metric for a run that failed: 0 for a score, else infinite."""
    return 0.0 if larger_is_better(metric) else np.inf


def larger_is_better(metric: str) -> bool:
    """Tell whether a metric is a score, not an error."""
    if metric in ("half_distance", "half_angle"):
        return False
    return metric in ("TAS", "RAS", "PAS") or protocol(metric).family.larger_is_better


def _half(errors: Floats) -> float:
    """Return the unit at which the score of errors under a fixed alignment is one half."""
    return ScoreProfile(np.ones(1), np.sort(errors)[None], 100).half


def _errors_at(
    unit: float, matches: Matches, result: PASResult, options: argparse.Namespace, *, whole: bool
) -> Floats:
    """Return the position errors of the alignment at a unit; of one in parts, those it has."""
    if not (whole and 0 < unit < np.inf):
        return result.tas.errors
    gt, est = (poses[:, :3, 3] for poses in (matches.gt_poses, matches.est_poses))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)  # the TAS has told it
        return tas(gt, est, unit=unit, rng=options.seed, registration=options.registration).errors


def half_terms(errors: Floats, half: float) -> Floats:
    """Return by how much each camera lifts the unit of half a score, to first order.

    At that unit h the mean of the cameras' scores s is 1/2. Where it is S(h) for other weights of
    the cameras, h moves by (1/2 - s) / S'(h) for each, with S'(h) the mean of e / h² over the
    errors e < h.
    """
    inside = errors < half
    if not 0 < half < np.inf or not errors[inside].any():
        return np.zeros(len(errors))
    slope = errors[inside].sum() / (len(errors) * half**2)
    return np.asarray((0.5 - _shares(errors, half * np.arange(1, 101) / 100)) / slope)


def _shares(errors: Floats, thresholds: Floats) -> Floats:
    """Return the share of the thresholds that each error is below; the mean is the score."""
    return 1 - np.searchsorted(thresholds, errors, side="right") / len(thresholds)


def _cached_file(task: Task, kind: str) -> Path | None:
    """Return the file of the cache for the content of a task's files and its options."""
    if task.cache is None:
        return None
    options = {key: value for key, value in vars(task.options).items() if key != "frames"}
    settings: list[Any] = [_content_of_code(), kind, sorted(options.items())]
    if kind == "run":
        settings += [task.metrics, task.check]
    digest = hashlib.sha256(json.dumps(settings).encode())
    for path in (task.reference, task.estimate, getattr(task.options, "frames", None)):
        digest.update(_content_hash(path) if path else b"-")
    return Path(task.cache) / f"{digest.hexdigest()}.{'npz' if kind == 'run' else 'json'}"


@cache
def _content_of_code() -> str:
    """Return the hash of this package: a clone changes more often than its version."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _content_hash(path: str) -> bytes:
    """Return the hash of a file, or of those of a COLMAP model or a folder of some."""
    root = Path(path)
    files = sorted(file for file in root.rglob("*") if file.is_file()) if root.is_dir() else [root]
    digest = hashlib.sha256()
    for file in files:
        try:
            content = str(file.stat().st_size).encode() if file.stem == LARGE else file.read_bytes()
        except OSError:  # whoever reads it says why
            content = b""
        name = str(file.relative_to(root)) if root.is_dir() else file.suffix
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.digest()


def _store(file: Path, outcome: Outcome, path: str) -> None:
    described = {
        "scores": outcome.scores,
        "n": outcome.n,
        "failures": outcome.failures,
        "unit": outcome.unit,
        "n_rows": outcome.n_rows,
        "notes": outcome.notes,
        "path": path,
    }
    buffer = BytesIO()
    arrays = {name: getattr(outcome, name) for name in ARRAYS}
    np.savez(buffer, described=np.array(json.dumps(described)), **arrays)
    write_whole(file, buffer.getvalue())


def _loaded(file: Path, path: str) -> Outcome | None:
    """Return a stored outcome, None where there is none that can be read."""
    try:
        with np.load(BytesIO(file.read_bytes())) as stored:
            described = json.loads(str(stored["described"]))
            arrays = {name: stored[name] for name in ARRAYS}
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
        return None
    written = described.pop("path")
    described["notes"] = [note.replace(written, path) for note in described["notes"]]
    return Outcome(**described, **arrays)
