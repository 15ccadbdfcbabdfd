"""How often `compare` finds a difference, where there is one and where there is none.

``python -m studies.calibration`` prints the tables of docs/explanation/certainty.md. Runs are drawn
whose truth is known, and pairs of systems are tested as `alignscores.compare` does.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from alignscores.arrays import Floats
from alignscores.comparison.statistics import LEVEL, holm, rank_test, sequence_test

__all__ = ["SCATTERS", "Case", "found"]

Draw = Callable[[np.random.Generator, tuple[int, ...]], Floats]


def _gross(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return normal deviations, of which a tenth is ten times as large."""
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


def _row(name: str, cells: Sequence[str]) -> None:
    print(" | ".join([f"| {name}", *cells]) + " |", flush=True)


def _percent(case: Case, draws: int) -> str:
    return f"{100 * found(case, draws):.1f}"


def _false_alarms(draws: int) -> None:
    """Print the mean and the largest share of false alarms, over systems and sequences."""
    for failing in FAILING:
        cells = []
        for runs in RUNS:
            sizes = product(SYSTEMS, SEQUENCES)
            alarms = [100 * found(Case(*size, runs, failing=failing), draws) for size in sizes]
            cells.append(f"{np.mean(alarms):.1f} ({max(alarms):.1f})")
        _row(f"{100 * failing:.0f} % of the runs fail", cells)


def _single_runs(draws: int) -> None:
    """Print false alarms of systems with one run on each of several sequences."""
    for sequences in (6, 10):
        _row(f"{sequences} sequences", [_percent(Case(n, sequences, 1), draws) for n in SYSTEMS])


def _unequal_scatter(draws: int) -> None:
    """Print how often systems with the same median differ where one scatters more."""
    for wider, sequences in product((3.0, 10.0), (1, 5)):
        kinds = (3, 3), (5, 5), (10, 10), (3, 10)
        cells = [_percent(Case(2, sequences, runs, wider=wider), draws) for runs in kinds]
        _row(f"{wider:.0f} : 1, sequences: {sequences}", cells)


def _power(draws: int) -> None:
    """Print how often a system that is better is found."""
    for better, sequences, scatter in product((1.0, 2.0), (1, 6), ("normal", "10 % gross")):
        cells = [_percent(Case(2, sequences, n, scatter, better=better), draws) for n in RUNS]
        _row(f"{better:.0f} sd, {scatter}, sequences: {sequences}", cells)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="false alarms and power of the verdicts")
    parser.add_argument("--draws", type=int, default=1000)
    draws = parser.parse_args().draws
    for part in (_power, _unequal_scatter, _single_runs, _false_alarms):
        print(part.__name__.strip("_").replace("_", " "))
        part(draws)
