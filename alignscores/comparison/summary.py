"""What the runs say about the systems: means, how often one beats another, ranks."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import numpy as np

from ..arrays import Floats
from ..io import Format
from ..metrics import header, metric
from . import statistics
from .benchmark import Run
from .runs import COLUMNS, Outcome
from .statistics import LEVEL, MIN_SEQUENCES, Interval, Test

__all__ = ["WITHIN", "Entry", "Pair", "Result", "Summary", "by_system", "compared", "summarise"]

WITHIN = "ranks within sequences"

Rank = tuple[int, int]  # the first and the last place that a system may have


@dataclass(frozen=True, eq=False)
class Result:
    """A run and what became of it; a failed one has the worst values that there are."""

    run: Run
    outcome: Outcome

    @property
    def failed(self) -> bool:
        """Whether the run is missing, or could not be scored."""
        return bool(self.outcome.error)

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of the JSON output, in which numbers may be infinite."""
        outcome, scores = self.outcome, self.outcome.scores
        return {
            **vars(self.run),
            "status": ("failed" if self.run.file else "missing") if self.failed else "scored",
            "error": outcome.error or None,
            **{name: scores[name] for name in COLUMNS},
            "metrics": {name: scores[name] for name in scores if name not in COLUMNS},
            "n": outcome.n,
            "failures": outcome.failures,
            "lost": outcome.lost,
            "unit": outcome.unit,
            "chance": outcome.chance,
            "scale": outcome.scale,
            "notes": outcome.all_notes,
        }


Results = Mapping[str, Sequence[Result]]  # the runs of a system, by sequence


@dataclass(frozen=True, eq=False)
class Entry:
    """A system on a sequence, or over all (None): means over runs, and then over sequences."""

    system: str
    sequence: str | None
    results: Results
    ranks: Mapping[str, Rank | None]

    @property
    def runs(self) -> int:
        """How many runs there should be."""
        return sum(map(len, self.results.values()))

    @property
    def failed(self) -> int:
        """How many of them failed or are missing."""
        return sum(result.failed for own in self.results.values() for result in own)

    @property
    def failing(self) -> tuple[float, float]:
        """The interval of the probability that a run fails."""
        return statistics.failure_interval(self.failed, self.runs)

    @property
    def lost(self) -> float:
        """Share of the expected time, or cameras, without a pose."""
        return _mean(self._means(lambda result: result.outcome.lost))

    def mean(self, name: str) -> float:
        """Return the mean of a metric: a failed run has a score of 0, and an infinite error."""
        return _mean(self._means(lambda result: result.outcome.scores[name]))

    def mean_of_scored(self, name: str) -> float:
        """Return the mean of a metric over the runs that did not fail."""
        return _mean(self._means(lambda r: math.nan if r.failed else r.outcome.scores[name]))

    def deviation(self, name: str) -> float:
        """Return the standard deviation of the runs, or over all of the means on sequences."""
        values = self._means(lambda result: result.outcome.scores[name])
        if self.sequence is not None:
            values = [result.outcome.scores[name] for result in self.results[self.sequence]]
        is_defined = len(values) > 1 and bool(np.isfinite(values).all())
        return float(np.std(values, ddof=1)) if is_defined else math.nan

    def _means(self, value: Callable[[Result], float]) -> list[float]:
        return [_mean(map(value, own)) for own in self.results.values()]

    def to_dict(self) -> dict[str, Any]:
        """Return a row of the JSON output, CSV and table of pandas."""
        results = [result for own in self.results.values() for result in own]
        low, high = self.failing
        units = (result.outcome.unit for result in results if np.isfinite(result.outcome.unit))
        entry = {
            "system": self.system,
            "sequence": self.sequence,
            "sequences": len(self.results),
            "runs": self.runs,
            "failed_runs": self.failed,
            "failing_low": low,
            "failing_high": high,
            "n": sum(result.outcome.n for result in results),
            "failures": sum(result.outcome.failures for result in results),
            "lost": self.lost,
            "unit": next(units, None) if self.sequence is not None else None,
        }
        for name, rank in self.ranks.items():
            entry[name] = self.mean(name)
            entry[f"{name}_sd"] = self.deviation(name)
            entry[f"{name}_scored"] = self.mean_of_scored(name)
            entry[f"{name}_rank_best"], entry[f"{name}_rank_worst"] = rank or (None, None)
        return entry


@dataclass(frozen=True, eq=False)
class Pair:
    """How often runs of a system beat another system's by a metric, and how that was tested.

    It is for a sequence, or over all (None); the p-values are Holm's.
    """

    metric: str
    runs: Sequence[tuple[Floats, Floats]]  # on each sequence that both were tried on
    means: tuple[float, float]  # on these
    wins: float  # of a
    difference: Interval
    method: str
    test: Test
    like_these: Test | None  # for sequences like these, if there are enough of these
    p: float = math.nan  # not tested
    p_like_these: float = math.nan
    a: str = ""
    b: str = ""
    sequence: str | None = None

    @property
    def tested(self) -> bool:
        """Whether so many runs can give a significant difference."""
        return self.test.possible

    @property
    def better(self) -> str | None:
        """The system that is significantly ahead."""
        return self._ahead(self.p, self.test)

    @property
    def better_like_these(self) -> str | None:
        """The system that is significantly ahead on sequences like these."""
        return self._ahead(self.p_like_these, self.like_these)

    def _ahead(self, p: float, test: Test | None) -> str | None:
        if test is None or not p <= LEVEL:
            return None
        return self.a if test.better < test.worse else self.b

    def interval(self) -> dict[str, float]:
        """Return the difference of the means with its interval, as the JSON output has them."""
        difference = self.difference
        return {"difference": difference.value, "low": difference.low, "high": difference.high}

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of the JSON output, in which numbers may be unknown (NaN)."""
        return {
            "a": self.a,
            "b": self.b,
            "sequence": self.sequence,
            "metric": self.metric,
            "sequences": len(self.runs),
            "wins": self.wins,
            **self.interval(),
            "method": self.method if self.tested else None,
            "p_alone": _p(self.test if self.tested else None),
            "p": self.p,
            "better": self.better,
            "p_like_these": self.p_like_these,
            "better_like_these": self.better_like_these,
        }


@dataclass(frozen=True, eq=False)
class Summary:
    """All that is shown of a comparison."""

    headers: dict[str, str]  # what was measured, and how it heads a column
    sequences: list[str]
    systems: list[str]  # from the best to the worst by their overall PAS
    results: list[Result]
    entries: dict[tuple[str, str | None], Entry]  # where the system was tried
    pairs: list[Pair]
    length: str  # unit of positions, where it is known

    def of(self, system: str, sequence: str) -> Sequence[Result]:
        """Return the runs of a system on a sequence."""
        return self.entries[system, None].results.get(sequence, [])

    def unit(self, sequence: str) -> float:
        """Return d of a sequence, the same for all runs."""
        units = [r.outcome.unit for r in self.results if r.run.sequence == sequence]
        return next(filter(math.isfinite, units), math.nan)

    def ranked(self, by: str) -> list[str]:
        """Return the systems by their ranks, then by their means over all.

        Those without a rank come last: a mean over fewer or easier sequences leads nowhere.
        """

        def place(system: str) -> list[float]:
            entry = self.entries[system, None]
            means = (
                -metric(by).sign * value for value in (entry.mean(by), entry.mean_of_scored(by))
            )
            last = math.inf, math.inf
            return [
                *(entry.ranks[by] or last),
                *(math.inf if math.isnan(value) else value for value in means),
            ]

        return sorted(self.systems, key=place)

    def pairs_by(self, name: str, sequence: str | None = None) -> list[Pair]:
        """Return the pairs of systems by a metric, on a sequence or over all."""
        return [pair for pair in self.pairs if (pair.metric, pair.sequence) == (name, sequence)]


def summarise(
    runs: Sequence[tuple[Run, Outcome]],
    metrics: Sequence[str],
    form: Format,
    paired: bool = False,
) -> Summary:
    """Summarise scored, failed and missing runs; a system without any was not tried there."""
    measured = [*COLUMNS, *metrics]
    sequences = list(dict.fromkeys(run.sequence for run, _ in runs))
    results = [result for sequence in sequences for result in _results(runs, sequence, measured)]
    systems = by_system(results)
    pairs: list[Pair] = []
    entries: dict[tuple[str, str | None], Entry] = {}
    for sequence in [*sequences, None]:
        there = {
            system: own if sequence is None else {sequence: own[sequence]}
            for system, own in systems.items()
            if sequence is None or sequence in own
        }
        own = {name: _pairs(there, sequence, name, paired) for name in measured}
        ranks = {name: _ranks(of_name) for name, of_name in own.items()}
        for system, tried in there.items():
            of_system = {name: ranks[name].get(system) for name in measured}
            entries[system, sequence] = Entry(system, sequence, tried, of_system)
        pairs += [pair for of_name in own.values() for pair in of_name]
    overall = {system: entries[system, None] for system in systems}
    by = "PAS" if any(not np.isnan(entry.mean("PAS")) for entry in overall.values()) else "TAS"
    order = sorted(systems, key=lambda system: (-np.nan_to_num(overall[system].mean(by)), system))
    length = form.unit if form.unit == "m" else ""
    headers = {name: header(name, length) for name in measured}
    return Summary(headers, sequences, order, results, entries, pairs, length)


def by_system(results: Iterable[Result]) -> dict[str, dict[str, list[Result]]]:
    """Return runs by system and sequence."""
    systems: dict[str, dict[str, list[Result]]] = {}
    for result in results:
        systems.setdefault(result.run.system, {}).setdefault(result.run.sequence, []).append(result)
    return systems


def _results(
    runs: Sequence[tuple[Run, Outcome]], sequence: str, names: Sequence[str]
) -> list[Result]:
    """Return the runs on a sequence; what no scored one is given, a failed one does not lack."""
    own = [(run, outcome) for run, outcome in runs if run.sequence == sequence]
    scored = [outcome for _, outcome in own if not outcome.error]
    n = max((outcome.n for outcome in scored), default=0)
    worst = {name: metric(name).worst for name in names}
    if scored:
        missing = (name for name in names if all(math.isnan(o.scores[name]) for o in scored))
        worst |= dict.fromkeys(missing, math.nan)
    return [
        Result(run, replace(of, scores=worst, n=n, failures=n) if of.error else of)
        for run, of in own
    ]


def _mean(values: Iterable[float]) -> float:
    """Return the mean; distances that are not given, of too few cameras, are left out."""
    defined = [value for value in values if not math.isnan(value)]
    return float(np.mean(defined)) if defined else math.nan


def _p(test: Test | None) -> float:
    return test.p if test else math.nan


def _pairs(
    systems: Mapping[str, Results], sequence: str | None, name: str, paired: bool
) -> list[Pair]:
    """Return all pairs of systems that share sequences, with Holm's p-values."""
    both = [
        (a, b, compared(systems[a], systems[b], name, paired)) for a, b in combinations(systems, 2)
    ]
    pairs = [replace(pair, a=a, b=b, sequence=sequence) for a, b, pair in both if pair]
    p = statistics.holm([_p(pair.test if pair.tested else None) for pair in pairs])
    p_like_these = statistics.holm([_p(pair.like_these) for pair in pairs])
    return [
        replace(pair, p=float(own), p_like_these=float(new))
        for pair, own, new in zip(pairs, p, p_like_these, strict=True)
    ]


def compared(first: Results, second: Results, name: str, paired: bool = False) -> Pair | None:
    """Compare two systems by a metric on the sequences that both were tried on.

    Sequences with several runs of each are the better evidence: where there are any, others are
    left out. None means no shared sequence.
    """
    shared = [(first[sequence], second[sequence]) for sequence in first if sequence in second]
    if paired:
        shared = [_same_runs(a, b) for a, b in shared]
    shared = [pair for pair in shared if all(len(_values(own, name)) for own in pair)]
    several = [pair for pair in shared if min(len(_values(own, name)) for own in pair) > 1]
    if not shared:
        return None
    if paired:
        method, test = "paired runs", statistics.paired_test
    elif several:
        method, test, shared = WITHIN, statistics.rank_test, several
    else:
        method, test = "signed ranks of sequences", statistics.sequence_test
    values = [(_values(a, name), _values(b, name)) for a, b in shared]
    runs = [(_in_order(a, name), _in_order(b, name)) for a, b in shared]
    return Pair(
        metric=name,
        runs=runs,
        means=(_mean(a.mean() for a, _ in values), _mean(b.mean() for _, b in values)),
        wins=statistics.wins(runs, paired),
        difference=statistics.welch(values, paired),
        method=method,
        test=test(runs),
        like_these=statistics.sequence_test(runs) if len(runs) >= MIN_SEQUENCES else None,
    )


def _same_runs(a: Sequence[Result], b: Sequence[Result]) -> tuple[list[Result], list[Result]]:
    """Return the runs of either that the other has by the same name, in one order."""
    both = [pair for pair in product(a, b) if pair[0].run.run == pair[1].run.run]
    return [first for first, _ in both], [second for _, second in both]


def _values(own: Sequence[Result], name: str) -> Floats:
    values = [result.outcome.scores[name] for result in own]
    return np.array([value for value in values if not math.isnan(value)])


def _in_order(own: Sequence[Result], name: str) -> Floats:
    """Return values, larger ones better; a failed run loses to every other."""
    scored = [result for result in own if not math.isnan(result.outcome.scores[name])]
    return np.array(
        [-math.inf if r.failed else metric(name).sign * r.outcome.scores[name] for r in scored]
    )


def _ranks(pairs: Sequence[Pair]) -> dict[str, Rank]:
    """Return one more than the number of systems ahead, and the number of those not behind.

    Systems that are in no test have no rank, and do not count.
    """
    tested = {system for pair in pairs if pair.tested for system in (pair.a, pair.b)}
    winners = [pair.better for pair in pairs if pair.better]
    losers = [pair.b if pair.better == pair.a else pair.a for pair in pairs if pair.better]
    return {
        system: (1 + losers.count(system), len(tested) - winners.count(system)) for system in tested
    }
