"""One run: scored, or taken from the cache by the content of its files."""

import hashlib
import json
import math
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, lru_cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices
from ..evaluation.evaluation import STATUSES, Evaluation
from ..evaluation.matching import files_below, read_reference
from ..evaluation.notes import collected_warnings, why
from ..evaluation.scoring import score
from ..evaluation.settings import Settings
from ..metrics import LEVELS, metric
from ..trajectories.files import FAILURES, FileError, Trajectory
from ..trajectories.files.arrays import unpack_arrays
from ..trajectories.files.text import read_bytes, reading_once
from ..trajectories.formats import Format
from ..validation import finite_rows
from .cache import load, store

__all__ = ["COLUMNS", "Outcome", "Task", "evaluate_run", "forget_references", "reference_of"]

COLUMNS = "TAS", "RAS", "PAS", "half_distance", "half_angle"  # of every comparison
# Files of a COLMAP model that no score depends on: their size stands for their content.
POINTS = "points3D"


@dataclass(frozen=True)
class Task:
    """An estimate to be scored: its files, and how; with `check` its conventions and its clock."""

    reference: str
    estimate: str
    settings: Settings
    cache: Path | None = None
    check: bool = False


NO_ROWS = partial[Indices](np.empty, 0, np.intp)
NO_CODES = partial[NDArray[np.uint8]](np.empty, 0, np.uint8)
NO_NUMBERS = partial(np.empty, 0)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one estimate; arrays have an entry a camera that is scored."""

    scores: Mapping[str, float]  # an infinite error where there is no value
    n: int = 0
    failures: int = 0  # cameras without a position or without a rotation
    unit: float = np.nan
    lost: float = 1.0
    scale: float = np.nan  # of the alignment, where there is one for all
    n_parts: int = 1
    n_rows: int = 0  # of the reference
    rows: Indices = field(default_factory=NO_ROWS)  # in the reference, ascending
    statuses: NDArray[np.uint8] = field(default_factory=NO_CODES)  # of `Evaluation`
    # Aligned centres (n, 3), and errors in the reference's unit and in degrees; a failure's are not
    # finite.
    positions: Floats = field(default_factory=partial(np.empty, (0, 3)))
    position_errors: Floats = field(default_factory=NO_NUMBERS)
    rotation_errors: Floats = field(default_factory=NO_NUMBERS)
    notes: list[str] = field(default_factory=list)
    error: str = ""  # why there is no score, if there is none

    @property
    def places(self) -> Floats:
        """Row of each camera, as a share of the number of rows, from 0 to 1."""
        return np.asarray((self.rows + 0.5) / self.n_rows)


def evaluate_run(task: Task) -> Outcome:
    """Score an estimate, or take the result of the same files and settings from the cache."""
    try:
        with reading_once():
            file = _cached_file(task, "run")
            if file and (outcome := _loaded(file, task)):
                return outcome
            with collected_warnings():  # the comparison tells them, once for each sequence
                reference = reference_of(
                    task.reference, task.settings.format, task.settings.ref_topic
                )
            evaluation = score(
                reference,
                task.estimate,
                task.settings,
                name="",
                check=task.check,
            )
            outcome = _outcome(evaluation)
            # pycolmap and evo read files themselves, which may have changed in between
            if file and file == _cached_file(task, "run"):
                _store(file, outcome, task.estimate)
            return outcome
    except FAILURES as error:
        return Outcome({}, error=_with_file(error, task.estimate))


def reference_of(path: str, format: str | None, topic: str | None) -> Trajectory:
    """Read a reference; each is read once for the runs that follow each other."""
    settings = Settings(format=format, ref_topic=topic)
    with reading_once():
        return _reference(path, settings, _content_hash(path, settings.form))


@lru_cache(maxsize=2)
def _reference(path: str, settings: Settings, content: bytes) -> Trajectory:
    """Return the reference that a file with this content holds."""
    return read_reference(path, settings)


forget_references = _reference.cache_clear


def _with_file(error: Exception, file: str) -> str:
    message = why(error)
    return message if message.startswith(file) else f"{file}: {message}"


def _outcome(evaluation: Evaluation) -> Outcome:
    """Return what the comparison needs of an evaluation."""
    matches, result = evaluation.matches, evaluation.result
    failed = ~(np.isfinite(result.tas.errors) & finite_rows(matches.est_poses))
    names = [*COLUMNS, *evaluation.settings.metrics]
    scores = {name: _score(evaluation, name) for name in names}
    notes = list(evaluation.notes)
    unvalued = [name for name in evaluation.settings.metrics if evaluation.value(name) is None]
    if counted := [name for name in unvalued if not math.isnan(scores[name])]:
        notes.append(f"without a value, counted as failures: {', '.join(counted)}")
    if few := [name for name in names if math.isnan(scores[name])]:
        notes.append(f"too few cameras for {', '.join(few)}: left out of its means")
    return Outcome(
        scores=scores,
        n=len(matches.keys),
        failures=int(failed.sum()),
        unit=result.tas.unit,
        lost=evaluation.lost,
        scale=np.nan if evaluation.scale is None else evaluation.scale,
        n_parts=max(len(evaluation.parts), 1),
        n_rows=len(evaluation.reference.keys),
        rows=matches.gt_rows,
        statuses=evaluation.statuses,
        positions=evaluation.positions,
        position_errors=result.tas.errors,
        rotation_errors=result.ras.errors,
        notes=notes,
    )


def _score(evaluation: Evaluation, name: str) -> float:
    """Return a value; the worst where there is none, NaN for a distance of too few cameras."""
    value = evaluation.value(name)
    if value is not None:
        return value
    known = metric(name)
    distances = {"half_distance": evaluation.half_distance, **evaluation.metrics}
    return distances.get(name, math.nan if known.family in LEVELS else known.worst)


def _cached_file(task: Task, kind: str) -> Path | None:
    """Return the file of the cache for the content of a task's files and its settings."""
    if task.cache is None:
        return None
    settings = {key: value for key, value in vars(task.settings).items() if key != "frames"}
    described: list[Any] = [_content_of_code(), kind, sorted(settings.items())]
    if kind == "run":
        described += [task.check]
    digest = hashlib.sha256(json.dumps(described).encode())
    for path, form in (
        (task.reference, task.settings.form),
        (task.estimate, task.settings.est_form),
        (task.settings.frames, None),
    ):
        digest.update(_content_hash(str(path), form) if path is not None else b"-")
    return task.cache / f"{digest.hexdigest()}.{'npz' if kind == 'run' else 'json'}"


@cache
def _content_of_code() -> str:
    """Return the hash of this package: a clone changes more often than its version."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _content_hash(path: str, form: Format | None) -> bytes:
    """Return the hash of a file, or of those of a COLMAP model or a folder of some."""
    digest = hashlib.sha256()
    in_memory = not (form and form.topics)  # bags may be too large
    for file in files_below(path):
        try:
            if file.stem == POINTS:
                content = str(file.stat().st_size).encode()
            elif file == Path(path) and in_memory:
                content = hashlib.sha256(read_bytes(path)).digest()
            elif file.is_file():
                with file.open("rb") as opened:
                    content = hashlib.file_digest(opened, "sha256").digest()
            else:
                content = b""
        except (OSError, FileError):  # whoever reads it says why
            content = b""
        name = file.suffix if file == Path(path) else str(file.relative_to(path))
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.digest()


ARRAYS = [
    entry.name
    for entry in fields(Outcome)
    if isinstance(getattr(Outcome({}), entry.name), np.ndarray)
]
DESCRIBED = "scores", "n", "failures", "unit", "lost", "scale", "n_parts", "n_rows", "notes"


def _store(file: Path, outcome: Outcome, path: str) -> None:
    described = {**{name: getattr(outcome, name) for name in DESCRIBED}, "path": path}
    buffer = BytesIO()
    arrays = {name: getattr(outcome, name) for name in ARRAYS}
    np.savez(buffer, described=np.array(json.dumps(described)), **arrays)
    store(file, buffer.getvalue())


def _loaded(file: Path, task: Task) -> Outcome | None:
    """Return a stored outcome, None where there is none that can be read."""
    try:
        stored: dict[str, Any] = dict(unpack_arrays(file, load(file) or b""))
        stored |= json.loads(str(stored.pop("described")))
        written = stored.pop("path")
        outcome = Outcome(**stored)
        if not isinstance(written, str) or not _is_sound(
            outcome, {*COLUMNS, *task.settings.metrics}
        ):
            return None
        notes = [note.replace(written, task.estimate) for note in outcome.notes]
    except (ArithmeticError, AttributeError, KeyError, RecursionError, TypeError, ValueError):
        return None
    return replace(outcome, notes=notes)


def _is_double(value: Any) -> bool:
    """Tell whether a value is a number that a double can hold."""
    return isinstance(value, float) or (isinstance(value, int) and abs(value) <= sys.float_info.max)


def _is_sound(outcome: Outcome, names: Collection[str]) -> bool:
    """Tell whether a stored outcome has the types and the bounds of one that was computed."""
    like = Outcome({})
    counts = outcome.n, outcome.failures, outcome.n_parts, outcome.n_rows
    numbers = outcome.unit, outcome.lost, outcome.scale, *outcome.scores.values()
    return (
        outcome.scores.keys() == names
        and all(type(count) is int and count >= 0 for count in counts)
        and all(map(_is_double, numbers))
        and all(0 <= outcome.scores[name] <= 1 for name in ("TAS", "RAS", "PAS"))
        and all(isinstance(note, str) for note in outcome.notes)
        and all(
            getattr(outcome, name).dtype == getattr(like, name).dtype
            and getattr(outcome, name).shape == (outcome.n, *getattr(like, name).shape[1:])
            for name in ARRAYS
        )
        and bool(np.all(np.diff(outcome.rows, prepend=-1, append=outcome.n_rows) > 0))
        and bool(np.all(outcome.statuses < len(STATUSES)))
    )
