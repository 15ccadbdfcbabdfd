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


@dataclass(frozen=True, eq=False)
class Summary:
    """All that is shown; the entries are those of the JSON output, with infinite numbers.

    Parameters
    ----------
    headers : dict of str to str
        What was measured, and how it heads a column.
    sequences, systems : list of str
        Their names, the systems from the best to the worst by their overall PAS.
    runs : list of (Run, Outcome)
        Those that were scored, and those that failed or are missing.
    results : list of dict
        One entry a run.
    entries : dict of (str, str or None) to dict
        One entry a system and sequence, and over all with sequence None.
    comparisons : list of dict
        One entry a pair of systems, sequence or None, and metric.
    ranks : dict of (str or None, str) to dict of str to (int, int)
        Sequence and metric -> best and worst rank that each system may have.
    """

    headers: dict[str, str]
    sequences: list[str]
    systems: list[str]
    runs: list[tuple[Run, Outcome]]
    results: list[dict[str, Any]]
    entries: dict[tuple[str, str | None], dict[str, Any]]
    comparisons: list[dict[str, Any]]
    ranks: dict[tuple[str | None, str], dict[str, tuple[int, int]]]

    def in_order(self) -> list[dict[str, Any]]:
        """Return the entries, sequence by sequence, those over all at the end."""
        return [
            self.entries[system, sequence]
            for sequence in [*self.sequences, None]
            for system in self.systems
        ]


def summarise(
    runs: Sequence[tuple[Run, Outcome]],
    metrics: Sequence[str],
    *,
    weight: float,
    form: Format,
) -> Summary:
    """Summarise scored, failed and missing runs: every system has one on every sequence."""
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
            [outcome for run, outcome in runs if (run.system, run.sequence) == (system, sequence)],
            weight,
        )
        for system in systems
        for sequence in sequences
    }
    entries: dict[tuple[str, str | None], dict[str, Any]] = {}
    for system in systems:
        for sequence in sequences:
            own = [
                result
                for result in results
                if (result["system"], result["sequence"]) == (system, sequence)
            ]
            entries[system, sequence] = _entry(
                system,
                sequence,
                own,
                {name: groups[system, sequence].values(name) for name in names},
            )
        entries[system, None] = _overall(
            system, [entries[system, sequence] for sequence in sequences], names
        )
    systems.sort(key=lambda system: (-entries[system, None]["PAS"], system))
    comparisons = []
    ranks: dict[tuple[str | None, str], dict[str, tuple[int, int]]] = {}
    for name in names:
        for at in [*sequences, None]:
            apart = {}
            for a, b in combinations(systems, 2):
                difference = _difference(
                    groups, a, b, [at] if at else sequences, name, form.ordered
                )
                means = entries[a, at][name], entries[b, at][name]
                comparison = _comparison(a, b, at, name, means, difference, len(systems))
                comparisons.append(comparison)
                if comparison["distinguishable"]:
                    apart[a, b] = difference.value
            ranks[at, name] = _ranks(systems, apart, name)
    for (system, place), entry in entries.items():
        entry["rank"] = {name: list(ranks[place, name][system]) for name in names}
    length = form.unit if form.unit == "m" else ""
    headers = {name: header(name, length) for name in names}
    return Summary(headers, sequences, systems, list(runs), results, entries, comparisons, ranks)


class _Group:
    """The runs of a system on a sequence."""

    def __init__(self, outcomes: Sequence[Outcome], weight: float) -> None:
        self.outcomes = outcomes
        self.weight = weight

    def values(self, name: str) -> list[float]:
        """Return the values of all runs, of failed ones the worst there is."""
        return [outcome.scores.get(name, metric(name).worst) for outcome in self.outcomes]

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


def _result(run: Run, outcome: Outcome, due: int, metrics: Sequence[str]) -> dict[str, Any]:
    scored = not outcome.error
    return {
        "sequence": run.sequence,
        "system": run.system,
        "run": run.run,
        "file": run.file,
        "status": "scored" if scored else "missing" if run.file is None else "failed",
        "error": outcome.error or None,
        **{name: outcome.scores.get(name, metric(name).worst) for name in COLUMNS},
        "metrics": {name: outcome.scores.get(name, metric(name).worst) for name in metrics},
        "n": outcome.n if scored else due,
        "failures": outcome.failures if scored else due,
        "unit": outcome.unit if scored else None,
        "notes": outcome.notes,
    }


def _entry(
    system: str,
    sequence: str | None,
    own: Sequence[Mapping[str, Any]],
    values: Mapping[str, Sequence[float]],
) -> dict[str, Any]:
    means = {name: float(np.mean(several)) for name, several in values.items()}
    spread = {
        f"{name}_sd": float(np.std(several, ddof=1))
        if len(several) > 1 and np.isfinite(several).all()
        else None
        for name, several in values.items()
    }
    return {
        "system": system,
        "sequence": sequence,
        "runs": len(own),
        "failed_runs": sum(one["status"] != "scored" for one in own),
        "n": sum(one["n"] for one in own),
        "failures": sum(one["failures"] for one in own),
        **means,
        **spread,
    }


def _overall(
    system: str, entries: Sequence[Mapping[str, Any]], names: Sequence[str]
) -> dict[str, Any]:
    """Return the mean over the sequences, with the counts of all runs."""
    whole = _entry(system, None, [], {name: [one[name] for one in entries] for name in names})
    counts = ("runs", "failed_runs", "n", "failures")
    return {**whole, **{key: sum(one[key] for one in entries) for key in counts}}


def _difference(
    groups: Mapping[tuple[str, str], _Group],
    a: str,
    b: str,
    sequences: Sequence[str],
    name: str,
    ordered: bool,
) -> Difference:
    """Return the difference of two systems on a sequence, or over several.

    Where errors are infinite it is of `_bounded` ones: its sign and its error tell the two apart.
    """
    pairs = [(groups[a, sequence], groups[b, sequence]) for sequence in sequences]
    values = [(one.values(name), two.values(name)) for one, two in pairs]
    finite = all(np.isfinite([*first, *second]).all() for first, second in values)
    if not finite:
        values = [_bounded(first, second) for first, second in values]
    if len(sequences) > 1:
        return over_sequences([np.mean(first) - np.mean(second) for first, second in values])
    (first, second), (one, two) = values[0], pairs[0]
    if min(len(first), len(second)) > 1:
        return over_runs(first, second)
    value = float(np.mean(first) - np.mean(second))
    if name not in COLUMNS or not finite:
        return Difference(value, math.nan, 1)
    n_cells = (
        min(n for n in (one.fewest, two.fewest, MOST_CELLS) if n) if one.fewest or two.fewest else 0
    )
    if ordered:
        n_cells -= n_cells % BLOCKS
    found = n_cells and over_stretches(
        value, one.series(name, n_cells) - two.series(name, n_cells), ordered=ordered
    )
    return found or Difference(value, math.nan, 1)


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
    means: tuple[float, float],
    difference: Difference,
    n_systems: int,
) -> dict[str, Any]:
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
