"""What the runs say about the systems: means, differences with intervals, ranks."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from ..arrays import Floats
from ..metrics import header, metric
from ..trajectories.formats import Format
from .benchmark import Run
from .intervals import (
    BLOCKS,
    Difference,
    margin,
    over_runs,
    over_sequences,
    over_stretches,
    series,
)
from .runs import COLUMNS, Outcome

__all__ = ["Summary", "summarise"]


MOST_CELLS = 1000  # parts of a trajectory that are told apart

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
    *,
    weight: float,
    form: Format,
) -> Summary:
    """Summarise scored, failed and missing runs; a system without any was not tried there."""
    names = [*COLUMNS, *metrics]
    sequences = list(dict.fromkeys(run.sequence for run, _ in runs))
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
            weight,
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
        for place in [*sequences, None]:
            at = [system for system in systems if entries[system, place]["runs"]]
            of_place = sequences if place is None else [place]
            pairs, ranks = _pairs(groups, at, place, of_place, name, form.ordered)
            comparisons += pairs
            for system in systems:
                rank = ranks.get(system)
                entries[system, place].setdefault("rank", {})[name] = rank and list(rank)
    length = form.unit if form.unit == "m" else ""
    headers = {name: header(name, length) for name in names}
    return Summary(headers, sequences, systems, list(runs), results, entries, comparisons)


class _Group:
    """The runs of a system on a sequence, with their values by metric and the means of these."""

    def __init__(
        self, runs: Sequence[tuple[Entry, Outcome]], names: Sequence[str], weight: float
    ) -> None:
        self.results = [result for result, _ in runs]
        self.outcomes = [outcome for _, outcome in runs]
        self.values = {name: [_value(outcome, name) for outcome in self.outcomes] for name in names}
        self.means = {name: _mean(values) for name, values in self.values.items()}
        self.weight = weight

    @property
    def n_parts(self) -> frozenset[int]:
        """The numbers of parts that its models are in."""
        return frozenset(outcome.n_parts for outcome in self.outcomes if outcome.n)

    @property
    def fewest(self) -> int:
        """The number of cameras of the run that has the fewest."""
        return min((outcome.n for outcome in self.outcomes if outcome.n), default=0)

    def series(self, name: str, n_cells: int) -> Floats:
        """Return the mean series of the runs; a failed run has 0 wherever it is looked at."""
        total = np.zeros(n_cells)
        for outcome in self.outcomes:
            if outcome.n:
                total += series(outcome.places, self._of_cameras(outcome, name), n_cells)
        return total / len(self.outcomes)

    def _of_cameras(self, outcome: Outcome, name: str) -> Floats:
        if name == "half_distance":
            return outcome.distance_terms
        if name == "half_angle":
            return outcome.angle_terms
        weight = {"TAS": 1.0, "RAS": 0.0, "PAS": self.weight}[name]
        return weight * outcome.position_scores + (1 - weight) * outcome.rotation_scores


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
        "scale": outcome.scale if math.isfinite(outcome.scale) else None,
        "notes": outcome.notes,
    }


def _entry(system: str, sequence: str, group: _Group) -> Entry:
    """Return the means of a system on a sequence, and its counts."""
    results = group.results
    return {
        "system": system,
        "sequence": sequence,
        "runs": len(results),
        "failed_runs": sum(result["status"] != "scored" for result in results),
        "n": sum(result["n"] for result in results),
        "failures": sum(result["failures"] for result in results),
        "lost": _mean([result["lost"] for result in results]),
        **_means(group.values),
    }


def _overall(system: str, entries: Sequence[Entry], names: Sequence[str]) -> Entry:
    """Return the means of a system over the sequences, with the counts of all runs."""
    counts = ("runs", "failed_runs", "n", "failures")
    return {
        "system": system,
        "sequence": None,
        **{key: sum(entry[key] for entry in entries) for key in counts},
        "lost": _mean([entry["lost"] for entry in entries]),
        "sequences": len(entries),
        **_means({name: [entry[name] for entry in entries] for name in names}),
    }


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _means(values: Mapping[str, Sequence[float]]) -> dict[str, float | None]:
    """Return the mean of each metric, and its standard deviation where there is one."""
    return {name: _mean(several) for name, several in values.items()} | {
        f"{name}_sd": float(np.std(several, ddof=1))
        if len(several) > 1 and np.isfinite(several).all()
        else None
        for name, several in values.items()
    }


def _pairs(
    groups: Mapping[tuple[str, str], _Group],
    systems: Sequence[str],
    place: str | None,
    sequences: Sequence[str],
    name: str,
    ordered: bool,
) -> tuple[list[Entry], dict[str, tuple[int, int]]]:
    """Return the comparisons of systems by a metric at a place, and their ranks there.

    Two systems are compared on the sequences that both were tried on. Where models are in
    different numbers of parts nothing compares.
    """
    parts = {groups[system, sequence].n_parts for system in systems for sequence in sequences}
    if len(set().union(*parts)) > 1:
        return [], {}
    comparisons, apart = [], {}
    for a, b in combinations(systems, 2):
        both = [
            sequence
            for sequence in sequences
            if groups[a, sequence].outcomes and groups[b, sequence].outcomes
        ]
        if not both:
            continue
        pairs = [(groups[a, sequence], groups[b, sequence]) for sequence in both]
        difference = _difference(pairs, name, ordered)
        means = [_mean([group.means[name] for group in of]) for of in zip(*pairs, strict=True)]
        comparison = _comparison(a, b, place, name, means, difference, len(systems))
        comparisons.append({**comparison, "sequences": len(both)})
        if comparison["distinguishable"]:
            apart[a, b] = difference.value
    return comparisons, _ranks(systems, apart, name)


def _difference(pairs: Sequence[tuple[_Group, _Group]], name: str, ordered: bool) -> Difference:
    """Return the difference of two systems on a sequence, or over several.

    Where errors are infinite it is of `_bounded` ones: its sign and its error tell the two apart.
    """
    values = [(a.values[name], b.values[name]) for a, b in pairs]
    means = [(a.means[name], b.means[name]) for a, b in pairs]
    finite = np.isfinite(means).all()
    if not finite:
        values = [_bounded(*of_pair) for of_pair in values]
        means = [(_mean(of_a), _mean(of_b)) for of_a, of_b in values]
    differences = [of_a - of_b for of_a, of_b in means]
    if len(pairs) > 1:
        return over_sequences(differences)
    of_a, of_b = values[0]
    if min(len(of_a), len(of_b)) > 1:
        return over_runs(of_a, of_b)
    found = None
    if name in COLUMNS and finite:
        found = _over_trajectory(differences[0], *pairs[0], name, ordered)
    return found or Difference(differences[0], math.nan, 1)


def _over_trajectory(
    value: float, of_a: _Group, of_b: _Group, name: str, ordered: bool
) -> Difference | None:
    """Return the difference, its error over parts of the trajectory; None of too few cameras."""
    n_cells = min(n for n in (of_a.fewest, of_b.fewest, MOST_CELLS) if n)
    if ordered:
        n_cells -= n_cells % BLOCKS
    if not n_cells or not (of_a.fewest or of_b.fewest):
        return None
    differences = of_a.series(name, n_cells) - of_b.series(name, n_cells)
    return over_stretches(value, differences, ordered=ordered)


def _bounded(a: Sequence[float], b: Sequence[float]) -> tuple[list[float], list[float]]:
    """Map errors to [0, 1] in their order: the median of the finite ones to a half, inf to 1."""
    finite = [value for value in (*a, *b) if 0 < value < math.inf]
    scale = float(np.median(finite)) if finite else 1.0

    def share(value: float) -> float:
        return value / (value + scale) if value < math.inf else 1.0

    return [share(value) for value in a], [share(value) for value in b]


def _comparison(
    a: str,
    b: str,
    sequence: str | None,
    name: str,
    means: Sequence[float],
    difference: Difference,
    n_systems: int,
) -> Entry:
    value, half = difference.value, margin(difference, n_systems)
    distinguishable = abs(value) > half
    if not np.isfinite(means).all():
        gap = -math.inf if means[0] < means[1] else math.inf if means[1] < means[0] else math.nan
        distinguishable = distinguishable and not gap * value < 0  # the table shows the means
        value = half = math.nan
    low, high = value - half, value + half
    return {
        "a": a,
        "b": b,
        "sequence": sequence,
        "metric": name,
        "difference": value,
        "low": low,
        "high": high,
        "distinguishable": distinguishable,
    }


def _ranks(
    systems: Sequence[str], apart: Mapping[tuple[str, str], float], name: str
) -> dict[str, tuple[int, int]]:
    """Return one more than the number of systems ahead, and the number of those not behind.

    `apart` has the differences of those that can be told apart.
    """
    sign = 1 if metric(name).family.larger_is_better else -1
    ahead, behind = dict.fromkeys(systems, 0), dict.fromkeys(systems, 0)
    for (a, b), difference in apart.items():
        better, lesser = (a, b) if sign * difference > 0 else (b, a)
        ahead[lesser] += 1
        behind[better] += 1
    return {system: (1 + ahead[system], len(systems) - behind[system]) for system in systems}
