"""How often `compare` finds a difference, where there is one and where there is none.

``python -m studies.calibration`` prints the tables of docs/explanation/certainty.md: runs are drawn
whose truth is known, and tested as `alignscores.compare` does.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pandas as pd

from alignscores.arrays import Floats
from alignscores.comparison.baseline import GATE_LEVEL
from alignscores.comparison.comparison import read_runs
from alignscores.comparison.statistics import (
    LEVEL,
    MIN_RUNS,
    permutation_test,
    permuted_labels,
    studentised,
)
from alignscores.comparison.summary import Design, checked_runs, pairs_of

__all__ = ["SCATTERS", "Case", "failing_gates", "many_systems", "significant_share", "tails"]
__all__ += ["significant_share_in", "worst_cases"]

Draw = Callable[[np.random.Generator, tuple[int, ...]], Floats]


def _gross(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return normal deviations; a tenth of them is ten times as large."""
    return rng.normal(size=shape) * np.where(rng.random(shape) < 0.1, 10, 1)


SCATTERS: Mapping[str, Draw] = {
    "normal": lambda rng, shape: rng.normal(size=shape),
    "t(2.5)": lambda rng, shape: rng.standard_t(2.5, shape),
    "10 % gross": _gross,
}


@dataclass(frozen=True)
class Case:
    """Two systems, equal by default; the first may be better, vary more, or choose its runs."""

    sequences: int = 1
    runs: tuple[int, int] = (5, 5)
    scatter: str = "normal"
    shift: float = 0.0  # by which the first is better, in standard deviations of normal runs
    scale: float = 1.0  # how many times as much it varies
    shared: float = 0.0  # share of the variance that runs of a name share over the sequences
    n_best_runs: int | None = None  # as many of its runs are reported, its best ones
    copies: int = 1  # of each of these, with so small changes that no score is the same
    effects: float = 0.0  # standard deviation of a system's mean between sequences
    n_best_sequences: int | None = None  # it hands in as many sequences, its best ones
    expect_all: bool = False  # whether it failed on the others

    def draw(self, rng: np.random.Generator, draws: int) -> list[tuple[Floats, Floats]]:
        """Return the values of the runs of both systems on each sequence, (draws, runs)."""
        values = []
        for n in self.runs:
            independent = SCATTERS[self.scatter](rng, (self.sequences, draws, n))
            common = SCATTERS[self.scatter](rng, (1, draws, n))
            effects = self.effects * rng.normal(size=(self.sequences, draws, 1))
            mixed = np.sqrt(1 - self.shared) * independent + np.sqrt(self.shared) * common
            values.append(mixed + effects)
        first, second = values[0] * self.scale + self.shift, values[1]
        if self.n_best_runs is not None:
            first = np.sort(first, axis=-1)[..., -self.n_best_runs :].repeat(self.copies, axis=-1)
            first += 1e-9 * np.arange(first.shape[-1])
        if self.n_best_sequences is not None:
            lead = first.mean(axis=-1, keepdims=True) - second.mean(axis=-1, keepdims=True)
            order = np.argsort(-lead, axis=0)
            first, second = (
                np.take_along_axis(values, order, axis=0) for values in (first, second)
            )
            if self.expect_all:  # a failed run is below all others
                failed = first[self.n_best_sequences :]
                failed[:] = second.min() - 1 - rng.random(failed.shape)
            else:
                first, second = first[: self.n_best_sequences], second[: self.n_best_sequences]
        return list(zip(first, second, strict=True))


def tails(runs: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    """Return the p-values of `permutation_test` that A is better, and worse, for many draws.

    Without ties all draws of runs have the same ranks but for the labels of the systems, and so
    the same permuted statistics: those of random labels.
    """
    sizes = [(a.shape[-1] + b.shape[-1], a.shape[-1]) for a, b in runs]
    wins = [np.tri(size, k=-1) + np.eye(size) / 2 for size, _ in sizes]  # of ranks
    ranked = [np.argsort(np.concatenate(pair, axis=-1), axis=-1) for pair in runs]
    labels = [(order < n).astype(float) for order, (_, n) in zip(ranked, sizes, strict=True)]
    statistic = studentised(wins, labels)
    permuted, combined = permuted_labels(sizes)
    expected = np.sort(studentised(wins, permuted, combined=combined))
    rounding = 1e-9 * np.abs(expected).max()
    below = np.searchsorted(expected, statistic - rounding, side="left")
    worse = np.searchsorted(expected, statistic + rounding, side="right") / len(expected)
    return 1 - below / len(expected), np.asarray(worse)


def significant_share(
    case: Case, draws: int, *, ahead: bool = False, dependent: bool = False, seed: int = 0
) -> float:
    """Return the share of the draws, in per cent, in which the systems differ significantly.

    With `ahead` only the first one may be better; with `dependent` runs of a name are one value.
    The draws of each case are independent of those of all others.
    """
    runs = case.draw(np.random.default_rng([seed, *repr(case).encode()]), draws)
    if sum(min(a.shape[-1], b.shape[-1]) for a, b in runs) < MIN_RUNS:
        return 0.0
    if dependent:
        pairs = ([(a[draw], b[draw]) for a, b in runs] for draw in range(draws))
        p = np.array([permutation_test(pair, dependent=True).p for pair in pairs])
    else:
        better, worse = tails(runs)
        p = 2 * (better if ahead else np.minimum(better, worse))
    return 100 * float(np.mean(p <= LEVEL))


def worst_cases(draws: int) -> dict[str, float]:
    """Return the ten largest shares of false alarms where one of two equal systems varies more.

    The cases are 3 to 10 runs of each on 1, 2 and 6 sequences, where the first system varies 3 or
    10 times as much. The worst ones by a first set of draws get 40 times as many new draws, so that
    none is among them by chance.
    """
    n_runs = range(3, 11)
    cases = [
        Case(sequences, (a, b), scatter, scale=scale)
        for scale, sequences, a, b, scatter in product(
            (3.0, 10.0), (1, 2, 6), n_runs, n_runs, SCATTERS
        )
    ]
    by_first_draws = sorted(cases, key=lambda case: significant_share(case, draws // 4, seed=1))
    return {
        f"{case.runs} on {case.sequences}, {case.scale:g} times, {case.scatter}": (
            significant_share(case, 10 * draws)
        )
        for case in by_first_draws[-10:]
    }


def _table(values: Floats, systems: Sequence[str]) -> pd.DataFrame:
    """Return a table of runs of values (systems, sequences, runs)."""
    index = pd.MultiIndex.from_product(
        [systems, *([str(k) for k in range(n)] for n in values.shape[1:])],
        names=["system", "sequence", "run"],
    )
    return pd.Series(values.ravel(), index, name="PAS").reset_index()


def many_systems(means: Sequence[float], draws: int) -> tuple[float, float]:
    """Return the share of the true differences of systems that are significant, in per cent.

    The second value is the share of false ones among the significant differences, the mean over
    draws. Each system has five runs on one sequence; `means` are in standard deviations.
    """
    rng = np.random.default_rng(0)
    names = [f"s{k}" for k in range(len(means))]
    mean = dict(zip(names, means, strict=True))
    powers, false_shares = [], []
    for _ in range(draws):
        values = np.array(means)[:, None, None] + rng.normal(size=(len(means), 1, 5))
        pairs = pairs_of(checked_runs(_table(values, names), "PAS"), "PAS", larger=True)
        better, other = pairs["a"].map(mean), pairs["b"].map(mean)
        differ = better != other
        ahead = pairs["a"].where(better > other, pairs["b"])
        significant = pairs["better"].notna()
        right = significant & differ & (pairs["better"] == ahead)
        powers.append(right.sum() / max(differ.sum(), 1))
        false_shares.append((significant & ~right).sum() / max(significant.sum(), 1))
    return 100 * float(np.mean(powers)), 100 * float(np.mean(false_shares))


def failing_gates(
    baselines: int,
    builds: int = 50,
    shared: float = 0.0,
    design: Design = "independent",
    sequences: int = 2,
) -> Floats:
    """Return p of ``--fail_on worse`` of builds of equal systems, (baselines, builds).

    Each compares two systems, with five runs on each sequence, with as many saved ones. A build
    fails at a level that its p reaches.
    """
    rng = np.random.default_rng(0)

    def drawn(n: int) -> Floats:
        independent, common = (rng.standard_t(2.5, (2, k, n, 5)) for k in (sequences, 1))
        return np.asarray(np.sqrt(1 - shared) * independent + np.sqrt(shared) * common)

    smallest = []
    for saved in np.moveaxis(drawn(baselines), 2, 0):
        p = []
        for now, before in zip(drawn(builds), saved, strict=True):  # of a system
            runs = [(a, np.tile(b, (builds, 1))) for a, b in zip(now, before, strict=True)]
            if design == "dependent":
                by_build = ([(a[k], b[k]) for a, b in runs] for k in range(builds))
                p.append([permutation_test(pair, dependent=True).worse for pair in by_build])
            else:
                p.append(tails(runs)[1].tolist())
        smallest.append(np.minimum(1, 2 * np.min(p, axis=0)))  # Holm's smaller p-value of two
    return np.array(smallest)


def significant_share_in(runs: pd.DataFrame, by: str, draws: int) -> pd.DataFrame:
    """Return how often five drawn runs of two systems differ significantly on each sequence.

    The third column is for two halves of the runs of the first system, which is equal to itself.
    """
    rng, n = np.random.default_rng(0), 5
    a, b = list(dict.fromkeys(runs["system"]))[:2]
    rows = []
    for sequence, group in runs.groupby("sequence", sort=False):
        x, y = (group.loc[group["system"] == name, by].to_numpy(float) for name in (a, b))
        halves, power = [], []
        for _ in range(draws):
            first = rng.permutation(x)
            power.append(permutation_test([(first[:n], rng.permutation(y)[:n])]).p <= LEVEL)
            halves.append(permutation_test([(first[:n], first[n : 2 * n])]).p <= LEVEL)
        rows.append((sequence, 100 * np.mean(power), 100 * np.mean(halves)))
    return pd.DataFrame(rows, columns=["sequence", "found, %", "halves, %"])


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description="false alarms and power of the verdicts")
    parser.add_argument("--draws", type=int, default=10_000)
    parser.add_argument("--runs", metavar="CSV", help="two systems with ten runs on each sequence")
    parser.add_argument("--by", default="PAS")
    arguments = parser.parse_args()
    draws = arguments.draws
    if arguments.runs:
        print(
            significant_share_in(read_runs(arguments.runs), arguments.by, draws)
            .round(1)
            .to_string()
        )
        return

    def show(title: str, rows: Mapping[str, Sequence[float]], columns: Sequence[object]) -> None:
        table = pd.DataFrame(list(rows.values()), list(rows), list(map(str, columns)))
        print(f"\n{title}\n{table.round(1).to_string()}", flush=True)

    sizes = [(3, 3), (5, 5), (10, 10), (3, 10), (5, 10), (10, 3), (10, 5)]
    rows: dict[str, Sequence[float]] = {}
    largest = 0.0
    for scale, sequences in product((1.0, 10.0), (1, 2, 6)):
        # The ranks of equal systems do not depend on how their runs scatter.
        scatters = list(SCATTERS) if scale > 1 else ["normal"]
        cells = [
            [
                significant_share(Case(sequences, n, scatter, scale=scale), draws)
                for scatter in scatters
            ]
            for n in sizes
        ]
        rows[f"{scale:g} times, {sequences} sequences"] = [float(np.mean(cell)) for cell in cells]
        largest = max(largest, *(max(cell) for cell in cells))
    show("False alarms, %: the first system varies as much, or 10 times as much", rows, sizes)
    print(f"mean over {', '.join(SCATTERS)}; the largest single value: {largest:.1f}")
    rows = {name: [share] for name, share in worst_cases(draws).items()}
    show("False alarms, %: the worst of all, 3 to 10 runs, 3 or 10 times as much", rows, ["%"])
    rows = {
        f"{scatter}, {sequences} sequences": [
            significant_share(Case(sequences, n, scatter, shift=1.0), draws) for n in sizes[:5]
        ]
        for scatter, sequences in product(("normal", "10 % gross"), (1, 6))
    }
    show("Found, %: the first system is better by 1 sd", rows, sizes[:5])
    rows = {}
    for sequences in (2, 6, 11):
        alike, wide = Case(sequences, shared=0.5), Case(sequences, shared=0.8, scale=10.0)
        shares = [significant_share(alike, draws)]
        for case in (alike, wide, replace(wide, runs=(5, 7))):
            shares.append(significant_share(case, draws // 2, dependent=True))
        rows[f"{sequences} sequences"] = shares
    columns = ["independent", "dependent", "80 %, 10 times as much", "likewise, 5 against 7 runs"]
    show("False alarms, %: runs of a name share half of the variance", rows, columns)
    n_tables = draws // 100
    rows = {
        "five equal, others 2 sd apart": many_systems([0] * 5 + [2, 4, 6, 8, 10], n_tables),
        "all equal": many_systems([0] * 10, n_tables),
        "3 sd apart": many_systems([3 * k for k in range(10)], n_tables),
    }
    show("Ten systems, five runs, one sequence, %", rows, ["found", "false among the significant"])
    six = Case(sequences=6, effects=1.0)
    cases = {
        "five runs": Case(),
        "50 runs": Case(runs=(50, 5)),
        "its best 5 of 10 runs": Case(runs=(10, 5), n_best_runs=5),
        "its best of 10 runs, five times": Case(runs=(10, 5), n_best_runs=1, copies=5),
        "one run, five times": Case(runs=(1, 5), n_best_runs=1, copies=5),
        "6 sequences, 1 sd between systems on each": six,
        "the 3 of these 6 where it is best": replace(six, n_best_sequences=3),
        "the same, with --expect_all": replace(six, n_best_sequences=3, expect_all=True),
    }
    rows = {name: [significant_share(case, draws, ahead=True)] for name, case in cases.items()}
    show("Ahead, %: one of two equal systems, which hands in", rows, ["of five runs"])
    gates = {
        "2 sequences": failing_gates(n_tables),
        "6 sequences, half shared": failing_gates(n_tables, shared=0.5, sequences=6),
        "the same, --runs dependent": failing_gates(
            n_tables, shared=0.5, design="dependent", sequences=6
        ),
    }
    for level in (0.05, GATE_LEVEL, 0.001):
        rows = {
            name: [50 * float((p <= level).mean()), 100 * float((p <= level).any(axis=1).mean())]
            for name, p in gates.items()
        }
        show(
            f"worse:{level:g}, 50 builds of equal systems", rows, ["fail", "baselines with any, %"]
        )


if __name__ == "__main__":
    main()
