"""How often `compare` finds a difference, where there is one and where there is none.

``python -m studies.calibration`` prints the numbers of docs/explanation/certainty.md. Runs are
drawn whose truth is known, and pairs of systems are tested as `alignscores.compare` does.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from alignscores.arrays import Floats
from alignscores.comparison.baseline import changes
from alignscores.comparison.benchmark import Run
from alignscores.comparison.runs import COLUMNS, Outcome
from alignscores.comparison.statistics import LEVEL, holm, rank_test, sequence_test
from alignscores.comparison.summary import Summary, summarise
from alignscores.io import FORMATS

__all__ = ["SCATTERS", "Case", "failing_gates", "found"]

Draw = Callable[[np.random.Generator, tuple[int, ...]], Floats]
Table = Iterator[tuple[str, list[list["Case"]]]]  # name of a row, cases of each cell


def _gross(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return normal deviations; a tenth of them is ten times as large."""
    return rng.normal(size=shape) * np.where(rng.random(shape) < 0.1, 10, 1)


def _drift(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return the logarithm of the root mean square of a random walk."""
    walks = np.cumsum(rng.normal(size=(*shape, 100)), axis=-1)
    return np.asarray(np.log(np.mean(walks**2, axis=-1)) / 2)


SCATTERS: Mapping[str, Draw] = {
    "normal": lambda rng, shape: rng.normal(size=shape),
    "t(2.5)": lambda rng, shape: rng.standard_t(2.5, shape),
    "10 % gross": _gross,
    "drift": _drift,
}
FAILING = 0.0, 0.1, 0.3
SYSTEMS, RUNS, SEQUENCES = (2, 5, 10), (2, 3, 5, 10), (1, 3, 10)


@dataclass(frozen=True)
class Case:
    """What is drawn: by default equal systems; the first one may be better, or scatter more."""

    systems: int = 2
    sequences: int = 1
    runs: int | tuple[int, int] = 5  # of each, or of the first and of the others
    scatter: str = "normal"
    failing: float = 0.0
    better: float = 0.0  # in standard deviations of normal runs
    wider: float = 1.0

    def draw(self, rng: np.random.Generator) -> list[list[Floats]]:
        """Return the values of the runs of each system on each sequence."""
        first, others = self.runs if isinstance(self.runs, tuple) else (self.runs, self.runs)
        drawn = []
        for system in range(self.systems):
            shape = self.sequences, first if system == 0 else others
            values = SCATTERS[self.scatter](rng, shape)
            values = values * self.wider + self.better if system == 0 else values
            drawn.append(list(np.where(rng.random(shape) < self.failing, -np.inf, values)))
        return drawn


def found(case: Case, draws: int, seed: int = 0) -> float:
    """Return the share of the draws in which some pair of systems differs significantly."""
    rng = np.random.default_rng(seed)
    test = sequence_test if case.runs == 1 else rank_test
    significant = 0
    for _ in range(draws):
        pairs = combinations(case.draw(rng), 2)
        tests = [test(list(zip(*pair, strict=True))) for pair in pairs]
        p = holm([one.p if one.possible else np.nan for one in tests])
        significant += bool((p <= LEVEL).any())
    return significant / draws


def failing_gates(gates: int, seed: int = 0) -> int:
    """Return how many gates of equal runs fail by ``--fail_on worse``.

    Each compares two systems, with five runs on each of two sequences, with as many saved ones.
    """
    rng = np.random.default_rng(seed)
    runs = [Run(s, system, str(k), "file") for s in "st" for system in "ab" for k in range(5)]

    def drawn() -> Summary:
        scores = SCATTERS["t(2.5)"](rng, (len(runs),)).tolist()
        outcomes = [Outcome(dict.fromkeys(COLUMNS, score), n=10, unit=1.0) for score in scores]
        return summarise(list(zip(runs, outcomes, strict=True)), [], FORMATS["tum"])

    failed = 0
    for _ in range(gates):
        now, saved = drawn(), drawn()
        changed = changes(now, "saved.json", saved.results, "PAS").systems
        failed += any(one.change == "worse" for one in changed)
    return failed


def _percent(cases: Iterable[Case], draws: int) -> str:
    """Return the mean of the shares, in per cent, and the largest where there are several."""
    shares = [100 * found(case, draws) for case in cases]
    return f"{np.mean(shares):.1f}" + (f" ({max(shares):.1f})" if len(shares) > 1 else "")


def _false_alarms() -> Table:
    """Equal systems, over numbers of systems and sequences."""
    for scatter, failing in product(SCATTERS, FAILING):
        single = [Case(n, 10, 1, scatter, failing) for n in (2, 5)]
        several = [
            [Case(*size, runs, scatter, failing) for size in product(SYSTEMS, SEQUENCES)]
            for runs in RUNS
        ]
        yield f"{scatter}, {failing:.0%} fail", [single, *several]


def _power() -> Table:
    """Two systems; one is better."""
    for better, sequences, scatter in product((1.0, 2.0), (1, 6), ("normal", "10 % gross")):
        cases = [[Case(2, sequences, runs, scatter, better=better)] for runs in RUNS]
        yield f"{better:.0f} sd, {scatter}, sequences: {sequences}", cases


def _unequal_scatter() -> Table:
    """Two systems with the same median; one scatters more."""
    for wider, sequences in product((3.0, 10.0), (1, 5)):
        cases = [
            [Case(2, sequences, runs, wider=wider)] for runs in ((3, 3), (5, 5), (10, 10), (3, 10))
        ]
        yield f"{wider:.0f} : 1, sequences: {sequences}", cases


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="false alarms and power of the verdicts")
    parser.add_argument("--draws", type=int, default=500)
    parser.add_argument("--gates", type=int, default=1000)
    arguments = parser.parse_args()
    draws, gates = arguments.draws, arguments.gates
    print(f"Of {gates} gates of equal runs fail: {failing_gates(gates)}")
    for table in (_power, _unequal_scatter, _false_alarms):
        print(table.__doc__)
        for name, columns in table():
            cells = [_percent(cases, draws) for cases in columns]
            print(f"| {' | '.join([name, *cells])} |", flush=True)
