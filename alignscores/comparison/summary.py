"""What the runs say about the systems: means, differences with intervals, ranks."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..metrics import header, metric
from ..trajectories.formats import Format
from .answers import NOTHING, Cell, answers, chosen
from .benchmark import Run
from .intervals import LEVEL, Failures, Interval, error_of_pair
from .runs import COLUMNS, Outcome

__all__ = ["Summary", "summarise"]


Entry = dict[str, Any]  # of the JSON output


@dataclass(frozen=True, eq=False)
class Summary:
    """All that is shown; the entries are those of the JSON output, with infinite numbers."""

    headers: dict[str, str]  # what was measured, and how it heads a column
    sequences: list[str]
    systems: list[str]  # from the best to the worst by their overall PAS
    runs: list[tuple[Run, Outcome]]  # those that failed or are missing, too
    results: list[Entry]  # one entry a run
    entries: dict[tuple[str, str | None], Entry]  # of system and sequence; None: over all
    comparisons: list[Entry]  # one entry a pair of systems, sequence or None, and metric

    def in_order(self) -> list[Entry]:
        """Return the entries, sequence by sequence, those over all at the end."""
        return [
            self.entries[system, sequence]
            for sequence in [*self.sequences, None]
            for system in self.systems
            if self.entries[system, sequence]["runs"]
        ]


def summarise(
    runs: Sequence[tuple[Run, Outcome]],
    metrics: Sequence[str],
    form: Format,
) -> Summary:
    """Summarise scored, failed and missing runs; a system without any was not tried there."""
    names = [*COLUMNS, *metrics]
    sequences = list(dict.fromkeys(run.sequence for run, _ in runs))
    not_given = {sequence: _not_given(runs, sequence, names) for sequence in sequences}
    runs = [
        (run, replace(outcome, scores=not_given[run.sequence]) if outcome.error else outcome)
        for run, outcome in runs
    ]
    systems = list(dict.fromkeys(run.system for run, _ in runs))
    due = {
        sequence: max(outcome.n for run, outcome in runs if run.sequence == sequence)
        for sequence in sequences
    }
    results = [_result(run, outcome, due[run.sequence], metrics) for run, outcome in runs]
    groups = {
        (system, sequence): _Group(
            [
                (result, outcome)
                for result, (run, outcome) in zip(results, runs, strict=True)
                if (run.system, run.sequence) == (system, sequence)
            ],
            names,
        )
        for system in systems
        for sequence in sequences
    }
    entries: dict[tuple[str, str | None], Entry] = {}
    for system in systems:
        for sequence in sequences:
            entries[system, sequence] = _entry(system, sequence, groups[system, sequence])
        of_system = [entries[system, sequence] for sequence in sequences]
        entries[system, None] = _overall(system, [of for of in of_system if of["runs"]], names)
    systems.sort(key=lambda system: (-entries[system, None]["PAS"], system))
    comparisons = []
    for name in names:
        failures = {system: _failures(groups, system, name) for system in systems}
        for place in [*sequences, None]:
            at = [system for system in systems if entries[system, place]["runs"]]
            within = sequences if place is None else [place]
            pairs, ranks = _column(groups, failures, at, place, within, name)
            comparisons += pairs
            for system in systems:
                entries[system, place].setdefault("rank", {})[name] = ranks.get(system)
    length = form.unit if form.unit == "m" else ""
    headers = {name: header(name, length) for name in names}
    return Summary(headers, sequences, systems, list(runs), results, entries, comparisons)


def _not_given(
    runs: Sequence[tuple[Run, Outcome]], sequence: str, names: Sequence[str]
) -> dict[str, float]:
    """Return NaN for what no run on a sequence is given, so that those that failed lack nothing."""
    scored = [of for run, of in runs if run.sequence == sequence and not of.error]
    return {
        name: math.nan
        for name in names
        if scored and all(math.isnan(_value(outcome, name)) for outcome in scored)
    }


class _Group:
    """The runs of a system on a sequence: values by metric, those of runs that did not fail apart.

    A run that has an infinite error has failed by this metric. A value that is not given (NaN), as
    a distance of few cameras, is left out.
    """

    def __init__(self, runs: Sequence[tuple[Entry, Outcome]], names: Sequence[str]) -> None:
        self.results = [result for result, _ in runs]
        self.n_parts = {outcome.n_parts for _, outcome in runs if outcome.n}
        self.values = {name: [_value(outcome, name) for _, outcome in runs] for name in names}
        self.scored = {
            name: [
                value
                for value, (_, outcome) in zip(values, runs, strict=True)
                if math.isfinite(value) and not outcome.error
            ]
            for name, values in self.values.items()
        }

    def cell(self, name: str) -> Cell:
        """Return what is compared: the values, and how many failed of the runs that have any."""
        given = sum(not math.isnan(value) for value in self.values[name])
        return Cell(self.scored[name], Failures(given - len(self.scored[name]), given))


def _value(outcome: Outcome, name: str) -> float:
    """Return what a run has of a metric; of a failed one it is the worst there is."""
    return outcome.scores.get(name, metric(name).worst)


def _result(run: Run, outcome: Outcome, due: int, metrics: Sequence[str]) -> Entry:
    scored = not outcome.error
    return {
        "sequence": run.sequence,
        "system": run.system,
        "run": run.run,
        "file": run.file,
        "status": "scored" if scored else "missing" if run.file is None else "failed",
        "error": outcome.error or None,
        **{name: _value(outcome, name) for name in COLUMNS},
        "metrics": {name: _value(outcome, name) for name in metrics},
        "n": outcome.n if scored else due,
        "failures": outcome.failures if scored else due,
        "lost": outcome.lost if scored else 1.0,
        "unit": outcome.unit if scored else None,
        "parts": outcome.n_parts,
        "scale": outcome.scale if math.isfinite(outcome.scale) else None,
        "notes": outcome.notes,
    }


def _entry(system: str, sequence: str, group: _Group) -> Entry:
    """Return the means of a system on a sequence, and its counts."""
    results = group.results
    failed = sum(result["status"] != "scored" for result in results)
    return {
        "system": system,
        "sequence": sequence,
        "runs": len(results),
        "failed_runs": failed,
        "n": sum(result["n"] for result in results),
        "failures": sum(result["failures"] for result in results),
        "lost": _mean([result["lost"] for result in results]),
        **_means(group.values),
        "failing": _failing(failed, len(results)),
        "scored": {name: _mean(values) for name, values in group.scored.items()},
    }


def _overall(system: str, entries: Sequence[Entry], names: Sequence[str]) -> Entry:
    """Return the means of a system over the sequences, with the counts of all runs."""
    keys = ("runs", "failed_runs", "n", "failures")
    counts = {key: sum(entry[key] for entry in entries) for key in keys}
    return {
        "system": system,
        "sequence": None,
        **counts,
        "lost": _mean([entry["lost"] for entry in entries]),
        "sequences": len(entries),
        **_means({name: [entry[name] for entry in entries] for name in names}),
        "failing": _failing(counts["failed_runs"], counts["runs"]),
        "scored": {name: _mean([entry["scored"][name] for entry in entries]) for name in names},
    }


def _failing(failed: int, runs: int) -> Interval | None:
    """Return the interval of the probability that a run fails."""
    return Failures(failed, runs).limits(1 - LEVEL) if runs else None


def _given(values: Iterable[float]) -> list[float]:
    return [value for value in values if not math.isnan(value)]


def _mean(values: Iterable[float]) -> float:
    """Return the mean of the values that are given."""
    given = _given(values)
    return float(np.mean(given)) if given else math.nan


def _means(values: Mapping[str, Sequence[float]]) -> dict[str, float | None]:
    """Return the mean of each metric, and its standard deviation where there is one."""
    given = {name: _given(several) for name, several in values.items()}
    return {name: _mean(several) for name, several in given.items()} | {
        f"{name}_sd": float(np.std(several, ddof=1))
        if len(several) > 1 and np.isfinite(several).all()
        else None
        for name, several in given.items()
    }


Groups = Mapping[tuple[str, str], _Group]


def _column(
    groups: Groups,
    failures: Mapping[str, Failures],
    systems: Sequence[str],
    place: str | None,
    sequences: Sequence[str],
    name: str,
) -> tuple[list[Entry], dict[str, list[int]]]:
    """Return the comparisons of systems by a metric at a place, and their ranks there.

    Two systems are compared on the sequences that both were tried on; `failures` are those of all
    runs. Where models are in different numbers of parts nothing compares. Ranks are for new runs,
    unless some pair can be compared for new sequences alone.
    """
    parts = [groups[system, sequence].n_parts for system in systems for sequence in sequences]
    if len(set().union(*parts)) > 1:
        return [], {}
    error = error_of_pair(len(systems))
    found = {}
    for a, b in combinations(systems, 2):
        cells = [
            (groups[a, sequence].cell(name), groups[b, sequence].cell(name))
            for sequence in sequences
        ]
        if both := [pair for pair in cells if all(cell.failures.of for cell in pair)]:
            found[a, b] = both, answers(both, name, error, [failures[a], failures[b]])
    question = chosen([answer for _, answer in found.values()])
    comparisons = []
    better: dict[tuple[str, str], str] = {}
    for (a, b), (both, answer) in found.items():
        taken = answer[question] if question else None
        if taken and taken["better"]:
            better[a, b] = taken["better"]
        comparisons.append(
            {
                "a": a,
                "b": b,
                "sequence": place,
                "metric": name,
                "sequences": len(both),
                "question": question,
                **(taken or {**NOTHING, "difference": _gap(both)}),
                "distinguishable": bool(taken and taken["better"]),
                **answer,
            }
        )
    return comparisons, _ranks(systems, better) if question else {}


def _failures(groups: Groups, system: str, name: str) -> Failures:
    """Return how many runs of a system failed by a metric, on all sequences."""
    cells = [group.cell(name) for (other, _), group in groups.items() if other == system]
    return Failures(*np.sum([cell.failures for cell in cells], axis=0))


def _gap(pairs: Sequence[tuple[Cell, Cell]]) -> float:
    """Return the difference of the scores of two systems, where nothing tells its interval."""
    found = [np.mean(a.scored) - np.mean(b.scored) for a, b in pairs if a.scored and b.scored]
    return _mean(map(float, found))


def _ranks(systems: Sequence[str], better: Mapping[tuple[str, str], str]) -> dict[str, list[int]]:
    """Return one more than the number of systems ahead, and the number of those not behind.

    `better` tells of pairs that can be told apart which one is.
    """
    ahead, behind = dict.fromkeys(systems, 0), dict.fromkeys(systems, 0)
    for (a, b), which in better.items():
        first, second = (a, b) if which == "a" else (b, a)
        ahead[second] += 1
        behind[first] += 1
    return {system: [1 + ahead[system], len(systems) - behind[system]] for system in systems}
