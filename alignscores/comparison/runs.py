"""One run: scored, or taken from the cache by the content of its files."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices
from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import collected_warnings, why
from ..evaluation.reading import read_reference
from ..evaluation.scoring import score
from ..evaluation.settings import Settings
from ..io import FAILURES, FileError, Trajectory
from ..io.files import read_bytes
from ..metrics import metric
from ..validation import finite_rows
from ..writing import write_whole
from .cache import file_of

__all__ = ["COLUMNS", "Outcome", "Task", "evaluate_run", "forget_references", "reference_of"]

COLUMNS = "TAS", "RAS", "PAS", "half_distance", "half_angle"  # of every comparison


@dataclass(frozen=True)
class Task:
    """An estimate to be scored: its files, and how; with `check` its conventions and its clock."""

    reference: str
    estimate: str
    settings: Settings
    cache: Path | None = None
    check: bool = False


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one estimate; arrays have an entry a camera that is scored."""

    scores: Mapping[str, float]  # an infinite error where there is no value
    n: int = 0
    failures: int = 0  # cameras without a position or without a rotation
    unit: float = np.nan
    lost: float = 1.0
    scale: float = np.nan  # of the alignment, where there is one for all
    chance: float = np.nan  # TAS of a camera that never moves, of the reference alone
    rows: Indices = field(default_factory=lambda: np.empty(0, np.intp))  # in the reference
    stamps: Floats = field(default_factory=lambda: np.empty(0))  # in seconds; none of images
    statuses: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    # Errors in the reference's unit and in degrees; a failure's are not finite.
    position_errors: Floats = field(default_factory=lambda: np.empty(0))
    rotation_errors: Floats = field(default_factory=lambda: np.empty(0))
    notes: list[str] = field(default_factory=list)
    low_score: str = ""  # why the PAS is low
    error: str = ""  # why there is no score, if there is none

    @property
    def all_notes(self) -> list[str]:
        """The notes, and why the PAS is low."""
        return [*self.notes, self.low_score] if self.low_score else self.notes

    @property
    def times(self) -> Floats:
        """The stamps; of images their rows in the reference."""
        return self.stamps if len(self.stamps) else self.rows.astype(float)


def evaluate_run(task: Task) -> Outcome:
    """Score an estimate, or take the result of the same files and settings from the cache."""
    if task.cache is None:
        return _scored(task)
    settings = {**vars(task.settings), "check": task.check, "frames": None, "file": task.estimate}
    frames = [] if task.settings.frames is None else [str(task.settings.frames)]
    file = file_of(task.cache, settings, [task.reference, task.estimate, *frames])
    if outcome := _stored(file):
        return outcome
    outcome = _scored(task)
    if not outcome.error:
        values = {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in vars(outcome).items()
        }
        try:
            write_whole(file, json.dumps(values).encode())
        except ValueError as error:
            outcome.notes.append(f"is not stored in {task.cache}: {why(error)}")
    return outcome


def _scored(task: Task) -> Outcome:
    """Score an estimate; an outcome without scores says why it has none."""
    settings = task.settings
    try:
        check_file(task.estimate)
        with collected_warnings():  # the comparison shows them, once for each sequence
            reference = reference_of(task.reference, settings)
        return _outcome(score(reference, task.estimate, settings, name="", check=task.check))
    except FAILURES as error:
        message, file = why(error), task.estimate
        return Outcome({}, error=message if message.startswith(file) else f"{file}: {message}")


def check_file(path: str) -> None:
    """Raise an error for a pipe or a device, which nobody may write to or which never ends."""
    if Path(path).exists() and not (Path(path).is_file() or Path(path).is_dir()):
        raise FileError(path, "is a pipe or a device, not a file")


def reference_of(path: str, settings: Settings) -> Trajectory:
    """Read a reference; each is read once for the runs that follow each other."""
    names = "format", "ref_topic", "columns", "ref_columns", "rate"
    return _reference(path, Settings(**{name: getattr(settings, name) for name in names}))


@lru_cache(maxsize=2)
def _reference(path: str, settings: Settings) -> Trajectory:
    check_file(path)
    return read_reference(path, settings)


forget_references = _reference.cache_clear


def _outcome(evaluation: Evaluation) -> Outcome:
    """Return what the comparison needs of an evaluation."""
    matches, result = evaluation.matches, evaluation.result
    failed = ~(np.isfinite(result.tas.errors) & finite_rows(matches.est_poses))
    names = [*COLUMNS, *evaluation.settings.metrics]
    scores = {name: _score(evaluation, name) for name in names}
    notes = [str(note) for note in evaluation.notes if note.kind != "low"]
    unvalued = [name for name in evaluation.settings.metrics if evaluation.value(name) is None]
    if counted := [name for name in unvalued if not math.isnan(scores[name])]:
        notes.append(f"without a value, counted as failures: {', '.join(counted)}")
    valued = [
        name for name in names if evaluation.has_rotations or "rotations" not in metric(name).needs
    ]
    if few := [name for name in valued if math.isnan(scores[name])]:
        notes.append(f"too few cameras for {', '.join(few)}: left out of its means")
    return Outcome(
        scores=scores,
        n=len(matches.keys),
        failures=int(failed.sum()),
        unit=result.tas.unit,
        lost=evaluation.lost,
        chance=evaluation.chance,
        scale=np.nan if evaluation.scale is None else evaluation.scale,
        rows=matches.gt_rows,
        stamps=matches.keys if matches.keys.dtype.kind == "f" else np.empty(0),
        statuses=evaluation.statuses,
        position_errors=result.tas.errors,
        rotation_errors=result.ras.errors,
        notes=notes,
        low_score=next((note.text for note in evaluation.notes if note.kind == "low"), ""),
    )


def _score(evaluation: Evaluation, name: str) -> float:
    """Return a value; the worst where there is none, NaN without rotations or for few cameras."""
    value = evaluation.value(name)
    if value is not None:
        return value
    entry = metric(name)
    if "rotations" in entry.needs and not evaluation.has_rotations:
        return math.nan
    return evaluation.half_distance if name == "half_distance" else entry.worst


def _stored(file: Path) -> Outcome | None:
    """Return the outcome in a file of the cache, None where there is none."""
    try:
        stored = json.loads(read_bytes(file))
        for name, value in vars(Outcome({})).items():
            if isinstance(value, np.ndarray):
                stored[name] = np.array(stored[name], value.dtype)
            elif isinstance(value, float):
                stored[name] = float(stored[name])
            elif not isinstance(stored[name], type(value)):
                return None
        stored["scores"] = {name: float(score) for name, score in stored["scores"].items()}
        return Outcome(**stored)
    except (AttributeError, KeyError, OSError, TypeError, ValueError):
        return None
