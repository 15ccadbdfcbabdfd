"""Runs, scored in parallel: a table with a row for each run, and the errors of each frame.

Workers import this module, so pandas is imported only where the table is built.
"""

import hashlib
import json
import math
import os
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Booleans, Floats
from ..evaluation.evaluation import FAILED, LOST, Evaluation, Hint
from ..evaluation.notes import collected_warnings, why
from ..evaluation.reading import files_below, read_reference
from ..evaluation.rigs import of_model
from ..evaluation.scoring import score
from ..evaluation.settings import ABOUT, Settings
from ..extras import require
from ..files import open_file, read_bytes
from ..io import FAILURES, FileError, Trajectory
from ..metrics import SCORES, metric
from ..texts import printable
from ..version import __version__
from ..writing import write_whole
from .benchmark import Run

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["SEPARATOR", "Errors", "Progress", "Task", "check_file", "forget_references"]
__all__ += ["reference_of", "score_runs"]

SEPARATOR = " | "  # between the notes of a run
MAX_BYTES = 10**13  # of a bag
MAX_SERIAL_RUNS = 16  # as many are scored before another process would have started
# Settings that change no score, or that have their own columns.
OMITTED_SETTINGS = {"format", "est_format", "frames", "metrics", "reference_sigma"}

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Errors:
    """The errors of the scored frames of a run, not finite where there is no pose.

    `time` is the stamp in seconds, or the row in the reference where there are no stamps (`timed`).
    """

    time: Floats
    position: Floats
    rotation: Floats
    covered: Booleans
    timed: bool


@dataclass(frozen=True)
class Task:
    """An estimate to be scored: its files, and how; with `check` its conventions and its clock."""

    run: Run
    reference: str
    settings: Settings
    cache: Path | None = None
    check: bool = False


Result = tuple[dict[str, Any], Errors | None]  # the row of a run; a failed one has no errors


def score_runs(
    tasks: Sequence[Task], jobs: int, progress: Progress
) -> "tuple[pd.DataFrame, dict[Run, Errors]]":
    """Score runs; return a table with a row for each run, in their order, and the errors by run.

    A failed run, and one without a file, has no scores. A run with the scores of an earlier one is
    a copy.
    """
    pandas = require("pandas", "compare")
    rows: list[dict[str, Any]] = []  # as of missing runs, until there is a result
    for task in tasks:
        run = task.run
        rows.append(
            {
                **vars(run),
                "file": run.file or "",
                "status": "missing",
                "error": ""
                if run.file
                else f"{run.system}: has no run {run.run} on {run.sequence}",
                **dict.fromkeys([*SCORES, *task.settings.metrics], math.nan),
                "n": 0,
                "lost": 1.0,
                **dict.fromkeys(["unit", "scale", "chance"], math.nan),
                "reference_rotations": None,
                **dict.fromkeys(["notes", "hints", "low_score"], ""),
                "settings": settings_text(task.settings),
            }
        )
    errors: dict[Run, Errors] = {}
    to_score = [(index, task) for index, task in enumerate(tasks) if task.run.file]
    with closing(_results(to_score, jobs)) as results:
        for number, (index, (row, errors_of_run), file) in enumerate(results, 1):
            if errors_of_run:
                errors[tasks[index].run] = errors_of_run
                if file:  # not in a worker, which may be ended while it writes
                    _store(row, errors_of_run, file)
            rows[index] |= row
            progress(f"scoring {number}/{len(to_score)}")
    progress("")
    table = pandas.DataFrame(rows)
    table["reference_rotations"] = table.groupby("sequence")["reference_rotations"].transform("max")
    table["reference_rotations"] = table["reference_rotations"].eq(True)
    aligned = table[(table["status"] == "scored") & (table["TAS"] > 0)]
    is_copy = aligned.duplicated(["sequence", "system", *SCORES])
    table.loc[is_copy.index[is_copy], "status"] = "copy"
    return table, errors


def _results(
    tasks: Sequence[tuple[int, Task]], jobs: int
) -> Generator[tuple[int, Result, Path | None], None, None]:
    """Yield index and result of each task when it is done, and where to store the result.

    They are scored in this process if they are few.
    """
    joblib = require("joblib", "compare")
    if jobs == 1 or len(tasks) <= MAX_SERIAL_RUNS:
        yield from ((index, *_score_run(task)) for index, task in tasks)
        return
    folder = Path.cwd()
    calls = (joblib.delayed(_score_in)(folder, *task) for task in tasks)
    try:
        with joblib.parallel_config("loky", inner_max_num_threads=1):
            yield from joblib.Parallel(jobs, return_as="generator_unordered")(calls)
    except joblib.externals.loky.process_executor.BrokenProcessPool:
        raise ChildProcessError(
            "a process ended before its work was done, as when memory is short; set fewer jobs"
        ) from None
    except BlockingIOError as error:
        reason = f"no further process can be started ({error.strerror}); set --jobs 1"
        raise ChildProcessError(reason) from None


def _score_in(folder: Path, index: int, task: Task) -> tuple[int, Result, Path | None]:
    os.chdir(folder)  # a process that joblib has kept may have started in another one
    return index, *_score_run(task)


def settings_text(settings: Settings) -> str:
    """Return the settings that change scores and are not the defaults, as a text."""
    values = {name: getattr(settings, name) for name in ABOUT if name not in OMITTED_SETTINGS}
    return ", ".join(
        f"{name}={printable(str(value))}"
        for name, value in values.items()
        if value != getattr(Settings, name)
    )


def _score_run(task: Task) -> tuple[Result, Path | None]:
    """Score an estimate, or take the result of the same files and settings from the cache.

    The second value is the file of the cache in which a new result is to be stored.
    """
    file = None if task.cache is None else _file_in_cache(task, task.cache)
    if file and (stored := _read_stored(file)):
        return stored, None
    return _score_estimate(task), file


def _store(row: dict[str, Any], errors: Errors, file: Path) -> None:
    """Store a result in a file of the cache; a note says why if that fails."""
    values = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(errors).items()
    }
    try:
        write_whole(file, json.dumps({"row": row, "errors": values}).encode())
    except ValueError as error:
        notes = [row["notes"], f"is not stored in {file.parent}: {why(error)}"]
        row["notes"] = SEPARATOR.join(filter(None, notes))


def _score_estimate(task: Task) -> Result:
    """Score an estimate; the row of a failed one says why."""
    file = str(task.run.file)
    try:
        check_file(file)
        with collected_warnings():  # the comparison shows them, once for each sequence
            reference = reference_of(task.reference, task.settings)
            rig_frames = of_model(task.reference, task.settings)
        evaluation = score(
            reference,
            file,
            task.settings,
            name="",
            ref_file=task.reference,
            rig_frames=rig_frames,
            check=task.check,
        )
        if failed := [note.text for note in evaluation.notes if note.kind == FAILED]:
            raise ValueError(failed[0])
    except FAILURES as error:
        message, name = printable(why(error)), printable(file)
        message = message if message.startswith(name) else f"{name}: {message}"
        return {"status": "failed", "error": message}, None
    matches, result = evaluation.matches, evaluation.result
    timed = matches.keys.dtype.kind == "f"
    errors = Errors(
        time=matches.keys if timed else matches.gt_rows.astype(float),
        position=result.tas.errors,
        rotation=result.ras.errors,
        covered=evaluation.statuses != LOST,
        timed=timed,
    )
    return _row(evaluation) | {"reference_rotations": reference.has_rotations}, errors


def _row(evaluation: Evaluation) -> dict[str, Any]:
    """Return what the table has of an evaluation."""
    metrics = evaluation.settings.metrics
    scores = {name: _score(evaluation, name) for name in (*SCORES, *metrics)}
    hints = [str(note) for note in evaluation.notes if isinstance(note, Hint)]
    others = [note for note in evaluation.notes if not isinstance(note, Hint)]
    notes = [str(note) for note in others if note.kind != "low"]
    without_value = [name for name in metrics if evaluation.value(name) is None]
    if failed := [name for name in without_value if not math.isnan(scores[name])]:
        notes.append(f"without a value, counted as failures: {', '.join(failed)}")
    unknown = [name for name, score in scores.items() if math.isnan(score)]
    if not evaluation.has_rotations:
        unknown = [name for name in unknown if "rotations" not in metric(name).needs]
    if unknown:
        notes.append(f"too few cameras for {', '.join(unknown)}: left out of its means")
    return {
        "status": "scored",
        **scores,
        "n": len(evaluation.matches.keys),
        "lost": evaluation.lost,
        "unit": evaluation.result.tas.unit,
        "scale": math.nan if evaluation.scale is None else evaluation.scale,
        "chance": evaluation.chance,
        "notes": SEPARATOR.join(notes),
        "hints": SEPARATOR.join(hints),
        "low_score": next((note.text for note in evaluation.notes if note.kind == "low"), ""),
    }


def _score(evaluation: Evaluation, name: str) -> float:
    """Return a value; the worst where there is none, NaN without rotations or for few cameras."""
    value = evaluation.value(name)
    if value is not None:
        return value
    entry = metric(name)
    if "rotations" in entry.needs and not evaluation.has_rotations:
        return math.nan
    return evaluation.half_distance if name == "half_distance" else entry.worst


def check_file(path: str) -> None:
    """Raise an error for a pipe, which may stay empty, or a device, which may never end."""
    if Path(path).exists() and not (Path(path).is_file() or Path(path).is_dir()):
        raise FileError(path, "is a pipe or a device, not a file")


def reference_of(path: str, settings: Settings) -> Trajectory:
    """Read a reference; each is read once for the runs that follow each other."""
    names = "format", "ref_topic", "columns", "ref_columns", "ref_invert", "rate"
    return _reference(path, Settings(**{name: getattr(settings, name) for name in names}))


@lru_cache(maxsize=2)
def _reference(path: str, settings: Settings) -> Trajectory:
    check_file(path)
    return read_reference(path, settings)


forget_references = _reference.cache_clear


def _file_in_cache(task: Task, folder: Path) -> Path:
    """Return the file of a result: the hash of settings, version and content names it."""
    settings = {**vars(task.settings), "check": task.check, "frames": None, "file": task.run.file}
    frames = [] if task.settings.frames is None else [str(task.settings.frames)]
    paths = [task.reference, str(task.run.file), *frames]
    content = __version__, sorted(settings.items()), list(map(_content_hash, paths))
    return folder / f"{hashlib.sha256(json.dumps(content).encode()).hexdigest()}.json"


def _content_hash(path: str) -> str:
    """Return the hash of a file, or of the files in a folder."""
    digest = hashlib.sha256()
    for file in files_below(path):
        name = file.suffix if file == Path(path) else file.relative_to(path).as_posix()
        digest.update(f"{name}\0".encode())
        try:
            with open_file(file, MAX_BYTES) as opened:
                digest.update(hashlib.file_digest(opened, "sha256").digest())
        except (FileError, OSError):  # whoever reads it says why
            pass
    return digest.hexdigest()


def _read_stored(file: Path) -> Result | None:
    """Return the result in a file of the cache, None where there is none."""
    try:
        stored = json.loads(read_bytes(file))
        row, errors = dict(stored["row"]), dict(stored["errors"])
        numbers = [row[name] for name in (*SCORES, "n", "lost", "unit", "scale", "chance")]
        texts = [row[name] for name in ("notes", "hints", "low_score")]
        if not all(isinstance(value, (int, float)) for value in numbers):
            return None
        if row["status"] != "scored" or not all(isinstance(value, str) for value in texts):
            return None
        names = "time", "position", "rotation"
        arrays = {name: np.array(errors[name], dtype=float) for name in names}
        covered = np.array(errors["covered"], dtype=bool)
        if covered.ndim != 1 or any(value.shape != covered.shape for value in arrays.values()):
            return None
        return row, Errors(**arrays, covered=covered, timed=bool(errors["timed"]))
    except (KeyError, OSError, RecursionError, TypeError, ValueError):
        return None
