"""How often the intervals of `alignscores compare` hold: ``python -m benchmarks.certainty``.

Runs are drawn whose truth is known: the score of a run is the mean over its cameras, whose errors
are correlated along the trajectory or drift. Sequences differ in how hard they are, for all systems
and, by a mixture, for each. A run fails with a probability of its system.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from tqdm import tqdm

from alignscores.arrays import Floats
from alignscores.comparison.answers import QUESTIONS, Cell, answers
from alignscores.comparison.intervals import Failures, error_of_pair, margin, over_runs
from alignscores.metrics import metric

__all__ = ["CASES", "Case", "Counts", "leave_out", "simulate"]

CAMERAS = 200
POOL = 300  # runs of a system on a sequence that are drawn from
SEQUENCES = 40  # that are drawn from
LARGEST = 2.0  # error that scores, of a camera whose error is 1 in the root mean square
SCATTER = 0.3  # of how hard sequences are
SCORE, ERROR = "TAS", "ATE"
KEPT = 3  # of the real runs, whose interval is to hold the others


@dataclass(frozen=True)
class Case:
    """What is drawn; by default two systems that are the same."""

    name: str
    systems: int = 2
    sequences: int = 1
    runs: int = 5
    correlation: float | None = 0.0  # time, as a share of the trajectory; None: drift
    scales: Sequence[float] = (1.0,)  # of the errors of the systems, in turn
    failing: Sequence[float] = (0.0,)  # probabilities, in turn
    mixture: float = 0.0  # scatter of how hard a sequence is for a single system
    metric: str = SCORE  # or ERROR

    @property
    def same(self) -> bool:
        """Whether no system is better than another."""
        return len(self.scales) == len(self.failing) == 1


EQUAL = "equal"
FAILS = "better by a tenth, fails in 10 %"
NUMBERS = 3, 5, 10, 20
CASES = (
    *(Case(EQUAL, runs=n) for n in (2, *NUMBERS)),
    *(Case(EQUAL, systems=n) for n in (4, 10, 20)),
    *(Case(f"errors last {100 * tau:.0f} %", correlation=tau) for tau in (0.02, 0.05, 0.1, 0.2)),
    *(Case("drift", runs=n, correlation=None) for n in (2, 3, 5, 10)),
    *(Case(EQUAL, sequences=q, runs=n) for q in (2, 5, 10) for n in (1, 3)),
    *(Case("drift", sequences=q, correlation=None, runs=1) for q in (2, 5, 10)),
    *(
        Case(f"all fail in {100 * p:.0f} %", runs=n, failing=(p,))
        for p in (0.1, 0.3)
        for n in NUMBERS
    ),
    *(Case("all fail in 10 %", sequences=5, runs=n, failing=(0.1,)) for n in (1, 3)),
    *(Case("all fail in 10 %", systems=10, runs=n, failing=(0.1,)) for n in (5, 10)),
    *(Case("better by a tenth", scales=(0.9, 1), runs=n) for n in NUMBERS),
    *(Case("better by a third", scales=(2 / 3, 1), runs=n) for n in NUMBERS),
    *(
        Case("better by a fifth", sequences=q, scales=(0.8, 1), mixture=0.2, runs=n)
        for q in (2, 5, 10)
        for n in (1, 5)
    ),
    *(Case("one fails in 30 %", failing=(0.3, 0), runs=n) for n in NUMBERS),
    *(
        Case("better by a third, the other fails", scales=(2 / 3, 1), failing=(0, 0.1), runs=n)
        for n in NUMBERS
    ),
    *(Case(FAILS, scales=(0.9, 1), failing=(0.1, 0), runs=n) for n in NUMBERS),
    *(Case(FAILS, sequences=5, scales=(0.9, 1), failing=(0.1, 0), runs=n) for n in (3, 10)),
    *(
        Case("drift; " + FAILS, scales=(0.9, 1), failing=(0.1, 0), correlation=None, runs=n)
        for n in NUMBERS
    ),
    *(
        Case("better by a third, fails in 20 %", scales=(2 / 3, 1), failing=(0.2, 0), runs=n)
        for n in NUMBERS
    ),
)
OF_ERRORS = tuple(
    replace(case, metric=ERROR)
    for case in CASES
    if case.sequences == 1 and case.systems == 2 and case.runs in (3, 10)
    if case.correlation == 0
)


@dataclass
class Counts:
    """In how many draws there was an answer, and what was then true of all pairs."""

    answered: int = 0
    held: int = 0  # the intervals of scores
    held_with_failures: int = 0  # those of means in which failures count
    wrong: int = 0  # a system was ahead that is not better
    right: int = 0  # each that is better was ahead
    wrong_by_mean: int = 0  # likewise, by the intervals of means in which failures count
    right_by_mean: int = 0
    fails_more: int = 0  # a system was ahead that fails more often


ONE = "one sequence"  # new runs on one of several


def simulate(case: Case, draws: int, seed: int = 0) -> Mapping[str, Counts]:
    """Draw benchmarks and count, by question, what `compare` says rightly of them."""
    rng = np.random.default_rng(seed)
    pools = [_pool(case, scale, rng) for scale in dict.fromkeys(case.scales)]
    failing = np.array([case.failing[k % len(case.failing)] for k in range(case.systems)])
    pool_of = [
        list(dict.fromkeys(case.scales)).index(case.scales[k % len(case.scales)])
        for k in range(case.systems)
    ]
    means = np.array([pools[k].mean(axis=1) for k in pool_of])  # of system and sequence
    counts = {question: Counts() for question in (*QUESTIONS, ONE)}
    for _ in range(draws):
        drawn = rng.integers(SEQUENCES, size=case.sequences)
        cells = [
            [_cell(pools[pool_of[k]][sequence], failing[k], case.runs, rng) for sequence in drawn]
            for k in range(case.systems)
        ]
        truths = {"new_runs": means[:, drawn], "new_sequences": means, ONE: means[:, drawn[:1]]}
        for question, found in _answers(cells, case.metric).items():
            _count(counts[question], found, truths[question].mean(axis=1), failing, case.metric)
    return counts


def _pool(case: Case, scale: float, rng: np.random.Generator) -> Floats:
    """Return scores, or errors, of runs of a system, (sequences, runs)."""
    hard = np.exp(SCATTER * np.random.default_rng(1).normal(size=SEQUENCES))  # for all systems
    own = np.exp(case.mixture * rng.normal(size=SEQUENCES))
    noise = rng.normal(size=(SEQUENCES, POOL, CAMERAS))
    if case.correlation is None:
        errors = np.cumsum(noise, axis=2) / np.sqrt(CAMERAS / 2)
    else:
        kept = np.exp(-1 / (case.correlation * CAMERAS)) if case.correlation else 0.0
        noise[:, :, 1:] *= np.sqrt(1 - kept**2)
        errors = lfilter([1], [1, -kept], noise, axis=2)
    errors *= scale * (hard * own)[:, None, None]
    if not metric(case.metric).family.larger_is_better:
        return np.asarray(np.sqrt((errors**2).mean(axis=2)))
    return np.asarray(np.clip(1 - np.abs(errors) / LARGEST, 0, 1).mean(axis=2))


def _cell(pool: Floats, failing: float, runs: int, rng: np.random.Generator) -> Cell:
    failed = rng.binomial(runs, failing)
    return Cell(pool[rng.integers(POOL, size=runs - failed)].tolist(), Failures(failed, runs))


Found = dict[tuple[int, int], dict[str, Any]]


def _answers(cells: Sequence[Sequence[Cell]], name: str) -> dict[str, Found]:
    """Return what `compare` says of each pair, by question."""
    error = error_of_pair(len(cells))
    runs = [Failures(*np.sum([cell.failures for cell in of], axis=0)) for of in cells]
    found: dict[str, Found] = {question: {} for question in (*QUESTIONS, ONE)}
    for a, b in combinations(range(len(cells)), 2):
        both = list(zip(cells[a], cells[b], strict=True))
        of_pair = answers(both, name, error, [runs[a], runs[b]])
        if both[1:]:
            of_first = answers(both[:1], name, error, [runs[a], runs[b]])
            of_pair[ONE] = of_first["new_runs"]
        for question, answer in of_pair.items():
            if answer:
                found[question][a, b] = answer
    return found


def _count(counts: Counts, found: Found, means: Floats, failing: Floats, name: str) -> None:
    """Count what is right of the answers for all pairs; an interval that is unknown holds.

    By scores the better system is that with the better mean, failures counted; by errors one that
    is behind neither in these nor in how often it fails.
    """
    if not found:
        return
    totals = means * (1 - failing)
    counts.answered += 1
    facts = []
    for (a, b), answer in found.items():
        counted = answer["with_failures"]
        gap, total, less = means[a] - means[b], totals[a] - totals[b], failing[b] - failing[a]
        orders = {int(np.sign(total))}
        if not metric(name).family.larger_is_better:
            orders = {int(np.sign(-gap)), int(np.sign(less))}
        ahead = {"a": 1, "b": -1, None: 0}[answer["better"]]
        by_mean = int(counted["low"] > 0) - int(counted["high"] < 0)
        better = {1, -1} & orders if len(orders & {1, -1}) == 1 else {0}
        facts.append(
            {
                "held": not (answer["low"] > gap or answer["high"] < gap),
                "held_with_failures": not (counted["low"] > total or counted["high"] < total),
                "wrong": ahead not in {0, *orders},
                "right": ahead in better,
                "wrong_by_mean": by_mean not in {0, *orders},
                "right_by_mean": by_mean in better,
                "fails_more": ahead * less < 0,
            }
        )
    for key in facts[0]:
        whole = all if key.startswith(("held", "right")) else any
        setattr(counts, key, getattr(counts, key) + whole(fact[key] for fact in facts))


HEADER = """\
| case | systems | seq. | runs | new | scores | means | wrong | right | mean wrong | mean right |
|---|--:|--:|--:|---|--:|--:|--:|--:|--:|--:|"""
HEADER_OF_ERRORS = """\
| case | runs | errors | wrong | right | fails more |
|---|--:|--:|--:|--:|--:|"""


def lines(case: Case, counts: Mapping[str, Counts]) -> Iterator[str]:
    """Yield a row of the table for each question that was answered."""
    for question, found in counts.items():
        if n := found.answered:
            shares = {key: f"{count / n:.3f}" for key, count in vars(found).items()}
            if case.same:
                shares |= {"right": "", "right_by_mean": ""}
            row = [case.name, case.systems, case.sequences, case.runs]
            row += [question.removeprefix("new_"), *list(shares.values())[1:-1]]
            if case.metric != SCORE:
                keys = "held", "wrong", "right", "fails_more"
                row = [case.name, case.runs, *(shares[key] for key in keys)]
            yield f"| {' | '.join(map(str, row))} |"


def leave_out(runs: pd.DataFrame, name: str, draws: int, seed: int = 0) -> float:
    """Return how often the interval of 3 of the runs holds the difference of the others.

    The others are several runs, too: the interval is as much longer as that makes it. `runs` are
    those of `snakemake real`; drawn are sequences and, of each two systems there, runs.
    """
    rng = np.random.default_rng(seed)
    pairs = [
        [own[name].dropna().to_numpy() for own in both]
        for _, on_sequence in runs[runs["change"] == "as it is"].groupby("sequence")
        for both in combinations([own for _, own in on_sequence.groupby("system")], 2)
    ]
    pairs = [both for both in pairs if min(map(len, both)) > 2 * KEPT]
    held = []
    for _ in range(draws):
        a, b = (rng.permutation(values) for values in pairs[rng.integers(len(pairs))])
        found = over_runs([(a[:KEPT].tolist(), b[:KEPT].tolist())])
        others = float(a[KEPT:].mean() - b[KEPT:].mean())
        longer = np.sqrt(1 + KEPT / (min(len(a), len(b)) - KEPT))
        held.append(abs(found.value - others) <= longer * margin(found, error_of_pair(2)))
    return float(np.mean(held))


def main() -> None:
    """Print the table of all cases, or of real runs."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.certainty", description=__doc__)
    parser.add_argument(
        "--draws", type=int, default=2000, help="of each case; of many systems a quarter"
    )
    parser.add_argument("--runs", nargs="+", metavar="FILE.csv", help="runs that are left out")
    options = parser.parse_args()
    draws = options.draws
    if options.runs:
        runs = pd.concat(map(pd.read_csv, options.runs), ignore_index=True)
        for name in ("TAS", "RAS", "PAS", "half_distance", "half_angle", "ATE"):
            print(f"| {name} | {leave_out(runs, name, draws):.3f} |")
        return
    for header, cases in ((HEADER, CASES), (HEADER_OF_ERRORS, OF_ERRORS)):
        print(header)
        for case in tqdm(cases, disable=None):
            n = draws if case.systems < 10 else draws // 4
            for line in lines(case, simulate(case, n)):
                print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
