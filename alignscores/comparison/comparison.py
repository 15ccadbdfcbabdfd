"""The comparison of systems over sequences and runs: from their files to the verdict."""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..evaluation.evaluation import finite_or_none
from ..evaluation.match import check_reference
from ..evaluation.notes import collected_warnings, ends_notes, why
from ..evaluation.rigs import of_model, of_reference
from ..evaluation.settings import Settings, changed
from ..files import read_text
from ..io import FAILURES, FileError, read_stamps, recognise
from ..metrics import SCORES, metric
from ..texts import alike, first_few, printable
from ..version import __version__
from .advice import advise_systems
from .benchmark import Benchmark, Estimates, Run, from_files, from_patterns, read_yaml
from .patterns import BenchmarkError, Pattern
from .runs import Errors, Progress, Task, check_file, forget_references, reference_of, score_runs
from .summary import (
    Better,
    Design,
    checked_runs,
    completed,
    larger_is_better,
    pairs_of,
    records,
    summarise,
)
from .verdict import left_out_sequences, notes_on_runs, texts_by_run, verdict

__all__ = ["Comparison", "compare", "compare_runs", "find_benchmark", "for_json", "from_table"]
__all__ += ["read_runs"]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Systems compared by one metric; `compare` returns it.

    Parameters
    ----------
    runs : DataFrame
        A row for each run: ``sequence, system, run, file, status`` (*scored*, *failed*, *missing*
        or *copy*), ``error``, a column for each metric, ``n``, ``lost``, ``unit``, ``scale``,
        ``chance``, ``notes`` and ``settings``. A failed run has the worst values.
    by : str
        The metric of verdict, ranks and pairs.
    larger : bool
        Whether larger values of it are better.
    design : {"independent", "dependent", "paired"}
        What runs of the same name have in common.
    settings : Settings or None
        How the runs were scored, unless the benchmark says otherwise; None for a table.
    problems : list of str
        What was left out, and why.
    left_out : list of str
        The sequences that were left out.
    sequence_notes : list of str
        Notes on the references.
    errors : mapping of Run to Errors
        The errors of the frames of each scored run; empty for a table.

    Examples
    --------
    >>> from alignscores import compare
    >>> compare("tests/data/tum/reference.txt", ["tests/data/tum/estimate.txt"])
    Comparison(systems=1, sequences=1, runs=1, failed=0, by='PAS')
    """

    runs: pd.DataFrame
    by: str = "PAS"
    larger: bool = True
    design: Design = "independent"
    settings: Settings | None = None
    problems: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    sequence_notes: list[str] = field(default_factory=list)
    errors: Mapping[Run, Errors] = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"Comparison(systems={self.runs['system'].nunique()}, "
            f"sequences={self.runs['sequence'].nunique()}, runs={len(self.runs)}, "
            f"failed={len(self.failed)}, by={self.by!r})"
        )

    def _repr_html_(self) -> str:
        lines = "<br>".join(map(escape, [*self.verdict, *self.notes]))
        names = ["system", "rank_best", "rank_worst", self.by, "failed", "runs", "lost"]
        table = self.overall[names].to_html(index=False, na_rep="-", float_format="{:.4g}".format)
        return f"<p>{lines}</p>{table}"

    @property
    def distinct(self) -> pd.DataFrame:
        """The runs without copies, from which everything is computed."""
        return self.runs[self.runs["status"] != "copy"]

    @cached_property
    def pairs(self) -> pd.DataFrame:
        """A row for each pair of systems, on each sequence and over all (`sequence` None).

        `wins` is P(A beats B); the columns are described in ``docs/reference/results.md``.
        """
        sequences = [None, *self.runs["sequence"].unique()]
        return pairs_of(self.distinct, self.by, self.larger, self.design, sequences)

    @cached_property
    def summary(self) -> pd.DataFrame:
        """A row for each system and sequence, and over all: means, deviations, failures, ranks."""
        return summarise(self.distinct, self.by, self.larger, self.pairs)

    @property
    def overall(self) -> pd.DataFrame:
        """The rows of `summary` over all sequences, the best system first."""
        return self.summary[self.summary["sequence"].isna()]

    @cached_property
    def verdict(self) -> list[str]:
        """Sentences on which systems are ahead, and how certain that is.

        Examples
        --------
        >>> import pandas as pd
        >>> from alignscores import compare
        >>> runs = pd.DataFrame({"system": [*"aaaaabbbbb"], "run": [*"0123401234"]})
        >>> runs["sequence"], runs["PAS"] = "room", [0.95, 0.94, 0.93, 0.92, 0.91, *5 * [0.5]]
        >>> compare(runs, by="PAS").verdict[0][:44]
        'a is ahead of b: it wins 100 % of the run pa'
        """
        lines = verdict(self.distinct, self.by, self.larger, self.overall, self.pairs)
        return lines + left_out_sequences(self.left_out, self.runs)

    @cached_property
    def notes(self) -> list[str]:
        """Notes on what may be wrong with the runs."""
        return [*notes_on_runs(self.runs, self.by, self.design), *self.sequence_notes]

    @property
    def failed(self) -> list[str]:
        """Why runs failed, or that they are missing; each of them counts as a failure."""
        runs = advise_systems(self.runs)
        rows = runs[runs["status"].isin(["failed", "missing"])]
        return [
            row["error"] or "{sequence}, {system}, run {run}: has no ".format(**row) + self.by
            for row in records(rows)
        ]

    @property
    def low_scores(self) -> list[str]:
        """Why the PAS of runs are low, once for each system."""
        return [
            note
            for _, group in self.runs.groupby("system", sort=False)
            for note in alike(texts_by_run(group, "low_score"))
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return what the command prints with ``--json``.

        Returns
        -------
        dict
            Settings, ``problems``, ``verdict``, ``notes``, and the tables ``runs``, ``summary`` and
            ``pairs`` as lists of rows. Infinite and unknown numbers are None. The keys are
            described in ``docs/reference/results.md``.

        Examples
        --------
        >>> from alignscores import compare
        >>> comparison = compare("tests/data/tum/reference.txt", ["tests/data/tum/estimate.txt"])
        >>> comparison.to_dict()["runs"][0]["PAS"]
        0.8709
        """
        return {
            "version": __version__,
            "by": self.by,
            "better": "larger" if self.larger else "smaller",
            "design": self.design,
            **({} if self.settings is None else self.settings.to_dict()),
            "problems": [printable(problem) for problem in self.problems],
            "verdict": self.verdict,
            "notes": self.notes,
            **{name: for_json(getattr(self, name)) for name in ("runs", "summary", "pairs")},
        }


def compare(
    references: str | Path | pd.DataFrame,
    estimates: str | Estimates | None = None,
    settings: Settings | None = None,
    *,
    by: str = "PAS",
    better: Better | None = None,
    dependent: bool = False,
    paired: bool = False,
    expect_all: bool = False,
    jobs: int = 1,
    cache: str | Path | None = None,
    **changes: Any,
) -> Comparison:
    """Compare systems over sequences and runs, as the command ``alignscores compare`` does.

    Parameters
    ----------
    references : path or DataFrame
        Pattern of the reference files, with ``{sequence}``; or the reference of a single sequence.
        Without `estimates`: a YAML file that describes the benchmark; or a table, or CSV file, of
        runs with any metric: the columns ``system`` and `by`, and where there are several
        ``sequence`` and ``run``. A run without a value has failed.
    estimates : str, list of paths, or mapping, optional
        Pattern of the estimated files, with ``{system}``, and ``{sequence}`` and ``{run}`` where
        there are several. Of a single sequence also the files of all systems, one run of each, or
        a mapping from each system to its file or files.
    settings : Settings, optional
        How they are scored; by default `Settings()`. ``frames`` may have ``{sequence}``. Without a
        ``format`` the first reference decides.
    by : str
        The metric of verdict, ranks and pairs.
    better : {"larger", "smaller"}, optional
        Which values are better, of a metric that this package does not know.
    dependent : bool
        Whether runs of the same name share something over the sequences, such as a build or a
        night: then each counts as one value.
    paired : bool
        Whether runs of the same name are paired, such as runs of one seed.
    expect_all : bool
        Whether each system was to be run on each sequence, so that it failed where it has no run;
        by default it was not tried there, unless the YAML file says how many ``runs`` there are.
    jobs : int
        Processes in parallel; -1: as many as processors. Up to 16 runs take one.
    cache : path, optional
        Folder where results are stored and looked for; by default everything is computed.
    **changes : object
        Settings that differ from these, such as ``format="tum"``.

    Returns
    -------
    Comparison
        The tables ``runs``, ``summary`` and ``pairs``, and the ``verdict``.

    Raises
    ------
    ValueError
        Where nothing is found, or a setting, the table or the YAML file is wrong.
    ModuleNotFoundError
        Where pandas or joblib is not installed.

    Examples
    --------
    >>> from alignscores import compare
    >>> folder = "tests/data/tum"
    >>> comparison = compare(f"{folder}/reference.txt", f"{folder}/{{system}}.txt")
    >>> comparison.runs[["system", "PAS"]].to_dict("list")
    {'system': ['estimate'], 'PAS': [0.8709]}
    >>> import pandas as pd
    >>> runs = pd.DataFrame({"system": 5 * ["a"] + 5 * ["b"], "seconds": range(10)})
    >>> compare(runs, by="seconds", better="smaller").pairs[["a", "b", "wins", "better"]]
       a  b  wins better
    0  a  b   1.0      a
    1  a  b   1.0      a
    """
    if dependent and paired:
        raise ValueError("runs are either dependent or paired, not both")
    design: Design = "dependent" if dependent else "paired" if paired else "independent"
    if isinstance(references, pd.DataFrame):
        return from_table(references, by, better, design)
    if estimates is None and Path(references).suffix == ".csv":
        return from_table(read_runs(str(references)), by, better, design)
    settings = changed(settings or Settings(), changes)
    benchmark = find_benchmark(str(references), estimates, settings, expect_all)
    folder = None if cache is None else Path(cache)
    return compare_runs(benchmark, settings, by=by, design=design, jobs=jobs, cache=folder)


def from_table(
    runs: pd.DataFrame, by: str, better: Better | None = None, design: Design = "independent"
) -> Comparison:
    """Return the comparison of a table of runs by one of its metrics."""
    with suppress(ValueError):
        by = by if by in runs else metric(by).name
    larger = larger_is_better(by, better)
    runs = checked_runs(runs, by)
    values = completed(runs, by, better)
    runs.loc[values.index, values.columns] = values
    return Comparison(runs, by, larger, design)


def read_runs(file: str) -> pd.DataFrame:
    """Return the table of runs in a CSV file, or in the JSON of a comparison."""
    text = read_text(file)
    try:
        if Path(file).suffix == ".json":
            return pd.DataFrame(json.loads(text)["runs"])
        texts = dict.fromkeys(("sequence", "system", "run"), str)
        runs = pd.read_csv(StringIO(text), dtype=texts)
    except (KeyError, RecursionError, TypeError, ValueError):
        raise FileError(file, "has no table of runs, as --save_csv and --save_json write") from None
    for name in texts:
        if name in runs:
            runs[name] = runs[name].str.replace(r"^'(?=[=+\-@])", "", regex=True)
    return runs


def find_benchmark(
    references: str, estimates: str | Estimates | None, settings: Settings, expect_all: bool
) -> Benchmark:
    """Find the files of two patterns, take those that are named, or read a YAML file."""
    if estimates is None:
        if Path(references).suffix not in (".yaml", ".yml"):
            raise BenchmarkError(
                f"{references}: give a pattern of estimates, too, or one YAML or CSV file"
            )
        return read_yaml(references, expect_all=expect_all)
    columns = settings.columns_of_reference
    if isinstance(estimates, str):
        benchmark = from_patterns(
            settings.format, references, estimates, columns=columns, expect_all=expect_all
        )
    else:
        benchmark = from_files(settings.format, references, estimates, columns=columns)
    if settings.format is None and settings.est_format is None:
        for run in benchmark.runs:
            options = benchmark.system_options.setdefault(run.system, {})
            with suppress(*FAILURES):  # which scoring reports
                if run.file and "est_format" not in options:
                    check_file(run.file)
                    est_columns = settings.columns_of_estimates
                    options["est_format"] = recognise(run.file, est_columns)
    return benchmark


def compare_runs(
    benchmark: Benchmark,
    settings: Settings,
    *,
    by: str = "PAS",
    design: Design = "independent",
    jobs: int,
    cache: Path | None,
    progress: Progress = lambda text: None,
) -> Comparison:
    """Score and compare all runs; what is wrong with one does not stop the others."""
    if isinstance(settings.frames, tuple):
        raise ValueError("frames must be a file, or a pattern with {sequence}, of each sequence")
    settings = replace(settings, format=benchmark.format)
    by = metric(by).name
    names = list(dict.fromkeys([*SCORES, *settings.metrics]))
    if by not in names:
        raise ValueError(f"by must be one of {', '.join(names)}, not {by}")
    problems, left_out = list(benchmark.problems), list(benchmark.left_out)
    notes: list[tuple[str, str]] = []
    tasks: list[Task] = []
    forget_references()  # so that their notes are shown again
    for sequence in benchmark.references:
        try:
            tasks_on_sequence, notes_on_reference = _tasks(benchmark, sequence, settings, cache)
        except FAILURES as error:
            problems.append(f"sequence {sequence}: left out: {why(error)}")
            left_out.append(sequence)
        else:
            tasks += tasks_on_sequence
            notes += notes_on_reference
    if not tasks:
        raise ValueError(f"nothing is left to be compared; {first_few(problems)}")
    runs, errors = score_runs(tasks, jobs, progress)
    are_copies = runs["status"] == "copy"
    copies = {task.run for task, is_copy in zip(tasks, are_copies, strict=True) if is_copy}
    unexpected = benchmark.missing_for_copies(copies)
    runs = runs[[task.run not in unexpected for task in tasks]]
    comparison = from_table(runs, by, design=design)
    notes += _notes_on_ends(errors)
    return replace(
        comparison,
        settings=settings,
        problems=problems,
        left_out=left_out,
        sequence_notes=alike(notes),
        errors=errors,
    )


def _tasks(
    benchmark: Benchmark, sequence: str, settings: Settings, cache: Path | None
) -> tuple[list[Task], list[tuple[str, str]]]:
    """Return what is to be done on a sequence, and the notes on its reference."""
    file, options = benchmark.references[sequence], benchmark.sequence_options.get(sequence, {})
    if settings.frames is not None and "frames" not in options:
        pattern = Pattern(str(settings.frames), ["sequence"])
        options = {**options, "frames": pattern.fill({"sequence": sequence})}
    settings = replace(settings, **options)
    with collected_warnings() as notes:
        reference, rig_frames = reference_of(file, settings), of_model(file, settings)
        if settings.frames is not None:
            read_stamps(str(settings.frames))
        check_reference(reference, settings, of_reference(reference, rig_frames, settings))
    tasks: list[Task] = []
    checked_systems: set[str] = set()  # the first run of a system shows what is mixed up in all
    for run in benchmark.runs:
        if run.sequence == sequence:
            system_options = benchmark.system_options.get(run.system, {})
            if "invert" in system_options:  # which may be false, whatever the option says
                system_options = {**system_options, "est_invert": system_options["invert"]}
            run_settings = replace(settings, **system_options)
            check = bool(run.file) and run.system not in checked_systems
            tasks.append(Task(run, file, run_settings, cache, check))
            checked_systems |= {run.system} if run.file else set()
    return tasks, [(sequence, note) for note in notes]


def _notes_on_ends(errors: Mapping[Run, Errors]) -> list[tuple[str, str]]:
    """Return sequence and text of the notes on time that no run of a sequence covers."""
    notes: list[tuple[str, str]] = []
    sequences = list(dict.fromkeys(run.sequence for run in errors))
    for sequence in sequences:
        of_sequence = [errors[run] for run in errors if run.sequence == sequence]
        timed = [entry for entry in of_sequence if entry.timed]
        uncovered = ends_notes(
            [entry.time for entry in timed],
            [entry.covered for entry in timed],
            sequence if len(sequences) > 1 else "",
        )
        notes += [(sequence, str(note)) for note in uncovered]
    return notes


def for_json(value: Any) -> Any:
    """Return a value as JSON has it: None for numbers that are not finite, rows of a table."""
    if isinstance(value, pd.DataFrame):
        return [for_json(row) for row in records(value)]
    if isinstance(value, dict):
        return {str(key): for_json(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [for_json(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return finite_or_none(value)
    return printable(value) if isinstance(value, str) else value
