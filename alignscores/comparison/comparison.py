"""Systems over sequences and runs: found, scored in parallel, and summarised."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

from ..evaluation.evaluation import LOST, finite_or_none
from ..evaluation.notes import collected_warnings, ends_notes, why
from ..evaluation.settings import Settings, changed
from ..extras import require
from ..io import FAILURES, read_stamps, recognise
from ..metrics import metric
from ..texts import alike, first_few, printable
from ..version import __version__
from ..writing import write_whole
from .benchmark import Benchmark, Estimates, Run, from_files, from_patterns, read_yaml
from .patterns import Pattern
from .runs import COLUMNS, Outcome, Task, evaluate_run, forget_references, reference_of
from .summary import Summary, summarise
from .tables import as_html, legend, tables
from .verdicts import verdict

__all__ = ["Comparison", "compare", "compare_runs", "find_benchmark", "finite", "settings_of_run"]

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Systems with their means, ranks, and how often one beats another; `compare` returns it.

    Parameters
    ----------
    benchmark : Benchmark
        The sequences with their references, and all runs.
    settings : Settings
        How the runs were scored, where the benchmark says nothing else.
    summary : Summary
        Results of the runs, means, pairs of systems, and ranks.
    problems : list of str
        What was left out, and why.
    notes : list of str
        Notes on the runs, each once.

    Examples
    --------
    >>> from alignscores import compare
    >>> compare("tests/data/tum/reference.txt", ["tests/data/tum/estimate.txt"])
    Comparison(systems=1, sequences=1, runs=1, failed=0, registration='refined')
    """

    benchmark: Benchmark
    settings: Settings
    summary: Summary
    problems: list[str]
    notes: list[str]

    def __repr__(self) -> str:
        summary = self.summary
        return (
            f"Comparison(systems={len(summary.systems)}, sequences={len(summary.sequences)}, "
            f"runs={len(summary.results)}, failed={len(self.failed)}, "
            f"registration={self.settings.registration!r})"
        )

    def _repr_html_(self) -> str:
        lines = [*self.verdict(), *legend(self.summary, self.settings)]
        shown = [as_html(table) for table in tables(self.summary, "PAS")]
        return f"<p>{'<br>'.join(map(escape, lines))}</p>{''.join(shown)}"

    @property
    def failed(self) -> list[str]:
        """Why runs failed, or that they are missing; each of them counts as a failure."""
        return [r.outcome.error for r in self.summary.results if r.failed]

    @property
    def low_scores(self) -> list[str]:
        """Why the PAS of runs are low, once for each system."""
        low: dict[str, list[tuple[str, str]]] = {}
        for result in self.summary.results:
            if reason := result.outcome.low_score:
                low.setdefault(result.run.system, []).append((_name(result.run), reason))
        return [note for reasons in low.values() for note in alike(reasons)]

    def verdict(self, by: str = "PAS") -> list[str]:
        """Return in words which systems are ahead, and how certain that is.

        Parameters
        ----------
        by : str
            The metric.

        Returns
        -------
        list of str
            A few sentences; none for a single system.

        Examples
        --------
        >>> from alignscores import compare
        >>> compare("tests/data/tum/reference.txt", 2 * ["tests/data/tum/estimate.txt"]).verdict()
        ['estimate.txt, estimate.txt (2): one run on one sequence, too few to be tested.']
        """
        return verdict(self.summary, metric(by).name)

    def to_dict(self) -> dict[str, Any]:
        """Return what the command prints with ``--json``.

        Returns
        -------
        dict
            Settings, ``problems``, and the lists ``results`` (one entry a run), ``systems`` (one a
            system and sequence, and over all) and ``comparisons`` (one a pair of systems, sequence
            and metric). Infinite and unknown numbers are None. The keys are described in
            ``docs/reference/results.md``.

        Examples
        --------
        >>> from alignscores import compare
        >>> found = compare("tests/data/tum/reference.txt", ["tests/data/tum/estimate.txt"])
        >>> found.to_dict()["results"][0]["PAS"]
        0.8709
        """
        summary = self.summary
        return {
            "version": __version__,
            **self.settings.to_dict(),
            "problems": [printable(problem) for problem in self.problems],
            "results": [finite(result.to_dict()) for result in summary.results],
            "systems": [finite(entry.to_dict()) for entry in summary.entries.values()],
            "comparisons": [finite(pair.to_dict()) for pair in summary.pairs],
        }

    def to_frame(self) -> Any:
        """Return means, standard deviations and counts as a pandas DataFrame.

        Returns
        -------
        pandas.DataFrame
            One row a system and sequence, and one over all with the sequence None; the columns
            as in ``--csv``.

        Raises
        ------
        ModuleNotFoundError
            Where pandas is not installed.

        Examples
        --------
        >>> from alignscores import compare
        >>> found = compare("tests/data/tum/reference.txt", ["tests/data/tum/estimate.txt"])
        >>> found.to_frame()["system"].to_list()
        ['estimate.txt', 'estimate.txt']
        """
        rows = [entry.to_dict() for entry in self.summary.entries.values()]
        return require("pandas", "tables").DataFrame(rows)

    def save_page(self, path: str | Path, by: str = "PAS") -> None:
        """Save one page with verdict, tables and drawings, as ``--html`` does.

        Parameters
        ----------
        path : path
            The file, which is replaced.
        by : str
            The metric.

        Examples
        --------
        >>> from alignscores import compare
        >>> found = compare("tests/data/tum/reference.txt", ["tests/data/tum/estimate.txt"])
        >>> found.save_page("page.html")  # doctest: +SKIP
        """
        from ..pages.comparison import page  # which imports this module

        write_whole(Path(path), page(self, metric(by).name).encode())


def compare(
    references: str | Path,
    estimates: str | Estimates | None = None,
    settings: Settings | None = None,
    *,
    expect_all: bool = False,
    paired: bool = False,
    jobs: int = 1,
    cache: str | Path | None = None,
    **changes: Any,
) -> Comparison:
    """Compare systems over sequences and runs, as the command ``alignscores compare`` does.

    Parameters
    ----------
    references : path
        Pattern of the reference files, with ``{sequence}``; or the reference of a single sequence;
        or a YAML file that describes the benchmark, without `estimates`.
    estimates : str, list of paths, or mapping, optional
        Pattern of the estimated files, with ``{system}``, and ``{sequence}`` and ``{run}`` where
        there are several. Of a single sequence also the files of all systems, one run of each, or
        a mapping from each system to its file or files.
    settings : Settings, optional
        How they are scored; by default `Settings()`. ``frames`` may have ``{sequence}``. Without a
        ``format`` the first reference decides.
    expect_all : bool
        Whether each system was to be run on each sequence, so that it failed where it has no run;
        by default it was not tried there, unless the YAML file says how many ``runs`` there are.
    paired : bool
        Whether runs of the same name are paired, such as runs of one seed.
    jobs : int
        Processes in parallel, by joblib; -1: one for each core.
    cache : path, optional
        Folder where results are stored and looked for; by default everything is computed.
    **changes : object
        Settings that differ from these, such as ``format="tum"``.

    Returns
    -------
    Comparison
        Means, how often one system beats another, ranks, and all results.

    Raises
    ------
    ValueError
        Where nothing is found, or a setting or the YAML file is wrong.

    Examples
    --------
    >>> from alignscores import compare
    >>> folder = "tests/data/tum"
    >>> found = compare(f"{folder}/reference.txt", f"{folder}/{{system}}.txt")
    >>> found.summary.systems, found.summary.entries["estimate", None].mean("PAS")
    (['estimate'], 0.8709)
    >>> runs = {"orb": [f"{folder}/estimate.txt"] * 3, "dso": f"{folder}/reference.txt"}
    >>> compare(f"{folder}/reference.txt", runs)
    Comparison(systems=2, sequences=1, runs=4, failed=0, registration='refined')
    """
    settings = changed(settings or Settings(), changes)
    benchmark = find_benchmark(str(references), estimates, settings, expect_all)
    folder = None if cache is None else Path(cache)
    return compare_runs(benchmark, settings, paired=paired, jobs=jobs, cache=folder)


def find_benchmark(
    references: str, estimates: str | Estimates | None, settings: Settings, expect_all: bool
) -> Benchmark:
    """Find the files of two patterns, take those that are named, or read a YAML file."""
    if estimates is None:
        if Path(references).suffix not in (".yaml", ".yml"):
            raise ValueError(f"{references}: give a pattern of estimates, too, or one YAML file")
        return read_yaml(references, expect_all=expect_all)
    columns = settings.ref_columns or settings.columns
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
                    est_columns = settings.est_columns or settings.columns
                    options["est_format"] = recognise(run.file, est_columns)
    return benchmark


def compare_runs(
    benchmark: Benchmark,
    settings: Settings,
    *,
    paired: bool = False,
    jobs: int,
    cache: Path | None,
    progress: Progress = lambda text: None,
) -> Comparison:
    """Score and summarise all runs; what is wrong with one does not stop the others."""
    if isinstance(settings.frames, tuple):
        raise ValueError("frames must be a file, or a pattern with {sequence}, of each sequence")
    metrics = tuple(name for name in settings.metrics if name not in COLUMNS)  # there anyway
    settings = replace(settings, format=benchmark.format, metrics=metrics)
    problems = list(benchmark.problems)
    notes: list[tuple[str, str]] = []
    tasks: dict[Run, Task] = {}
    forget_references()  # so that their notes are shown again
    for sequence in benchmark.references:
        try:
            found, new = _tasks(benchmark, sequence, settings, cache)
        except FAILURES as error:
            problems.append(f"sequence {sequence}: left out: {why(error)}")
        else:
            tasks |= found
            notes += new
    runs = _scored(tasks, jobs, progress)
    if not runs:
        raise ValueError(f"nothing is left to be compared; {first_few(problems)}")
    summary = summarise(runs, settings.metrics, settings.form, paired)
    notes += _notes_of_sequences(runs)
    all_notes = [*_notes_of_runs(runs), *alike(notes)]
    return Comparison(benchmark, settings, summary, problems, all_notes)


def settings_of_run(benchmark: Benchmark, run: Run, settings: Settings) -> Settings:
    """Return the settings of a run, with the changes of its sequence and its system."""
    changes = {
        **benchmark.sequence_options.get(run.sequence, {}),
        **benchmark.system_options.get(run.system, {}),
    }
    if settings.frames is not None and "frames" not in changes:
        pattern = Pattern(str(settings.frames), ["sequence"])
        changes["frames"] = pattern.fill({"sequence": run.sequence})
    return replace(settings, **changes)


def _tasks(
    benchmark: Benchmark, sequence: str, settings: Settings, cache: Path | None
) -> tuple[dict[Run, Task], list[tuple[str, str]]]:
    """Return what is to be done on a sequence, and the notes on its reference."""
    file = benchmark.references[sequence]
    tasks: dict[Run, Task] = {}
    checked: set[str | None] = {None}  # the first run of a system shows what is mixed up in all
    for run in benchmark.runs:
        if run.sequence == sequence:
            of_run = settings_of_run(benchmark, run, settings)
            system = run.system if run.file else None
            tasks[run] = Task(file, run.file or "", of_run, cache, check=system not in checked)
            checked.add(system)
    with collected_warnings() as notes:
        reference_of(file, of_run)
        if of_run.frames is not None:
            read_stamps(str(of_run.frames))
    return tasks, [(sequence, note) for note in notes]


def _scored(tasks: Mapping[Run, Task], jobs: int, progress: Progress) -> list[tuple[Run, Outcome]]:
    """Return all runs with what became of them, missing ones among them."""
    there = [run for run in tasks if run.file]
    outcomes: dict[Run, Outcome] = {}
    joblib = require("joblib", "compare")
    try:
        scored = joblib.Parallel(jobs, return_as="generator")(
            joblib.delayed(evaluate_run)(tasks[run]) for run in there
        )
        for run, outcome in zip(there, scored, strict=True):
            outcomes[run] = outcome
            progress(f"scoring {len(outcomes)}/{len(there)}")
    except BrokenProcessPool:
        raise ChildProcessError("a process ended before its work was done; set --jobs 1") from None
    except BlockingIOError as error:
        reason = f"no further process can be started ({error.strerror}); set --jobs 1"
        raise ChildProcessError(reason) from None
    progress("")
    for run in tasks:
        if not run.file:
            missing = f"{run.system}: has no run {run.run} on {run.sequence}"
            outcomes[run] = Outcome({}, error=missing)
    return [(run, outcomes[run]) for run in tasks]


def _notes_of_sequences(runs: Sequence[tuple[Run, Outcome]]) -> list[tuple[str, str]]:
    """Return sequence and text of the notes that are about all of its runs."""
    notes: list[tuple[str, str]] = []
    for sequence in dict.fromkeys(run.sequence for run, _ in runs):
        timed = [one for run, one in runs if run.sequence == sequence and len(one.stamps)]
        covered = [one.statuses != LOST for one in timed]
        of_all = ends_notes([one.stamps for one in timed], covered)
        notes += [(sequence, str(note)) for note in of_all]
    return notes


def _notes_of_runs(runs: Sequence[tuple[Run, Outcome]]) -> list[str]:
    """Return the notes on the runs of each system, and on runs that are copies of each other."""
    by_system: dict[str, list[tuple[str, str]]] = {}
    scores: dict[tuple[str, str], list[Mapping[str, float]]] = {}
    for run, outcome in runs:
        notes = by_system.setdefault(run.system, [])
        notes += [(_name(run), note) for note in outcome.notes]
        scores.setdefault((run.sequence, run.system), []).append(outcome.scores)
    for (sequence, system), own in scores.items():
        if any(one and one in own[:index] for index, one in enumerate(own)):
            note = "runs with the same scores count as several: copies, or a deterministic system"
            by_system[system].append((f"{sequence}, {system}", note))
    return [note for notes in by_system.values() for note in alike(notes)]


def _name(run: Run) -> str:
    return f"{run.sequence}, {run.system}, run {run.run}"


def finite(value: Any) -> Any:
    """Return a value with None in place of numbers that JSON does not have."""
    if isinstance(value, dict):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(entry) for entry in value]
    return finite_or_none(value) if isinstance(value, float) else value
