"""How often a run of one system beats a run of another, and whether that may be chance.

Larger values are better; a failed run has -inf. `Runs` holds the values of two
systems on each sequence that both were tried on.
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arrays import Floats

__all__ = [
    "LEVEL",
    "MIN_SEQUENCES",
    "N_MAX",
    "Interval",
    "Test",
    "beats",
    "failure_interval",
    "holm",
]
__all__ += ["paired_test", "rank_test", "runs_needed", "sequence_test", "welch", "wins"]

LEVEL = 0.05  # significance
N_MAX = 50  # runs of each system that `runs_needed` tries
MIN_SEQUENCES = 6  # from which signed ranks can be significant
LATTICE = 5_000  # values of the statistic up to which its distribution is computed exactly

Runs = Sequence[tuple[Floats, Floats]]


@dataclass(frozen=True)
class Test:
    """Tails of a test whether two systems are equal; `smallest` is the least that a tail can be.

    `better` is the probability that equal systems give the first one as many wins as it has, or
    more; `worse` is the probability of as many or fewer.
    """

    better: float
    worse: float
    smallest: float

    @property
    def p(self) -> float:
        """The two-sided p-value."""
        return min(1.0, 2 * min(self.better, self.worse))

    @property
    def possible(self) -> bool:
        """Whether so many runs can give a significant difference."""
        return 2 * self.smallest <= LEVEL


@dataclass(frozen=True)
class Interval:
    """A value with its confidence interval, which is NaN where it is unknown."""

    value: float
    low: float = math.nan
    high: float = math.nan


def beats(first: ArrayLike, second: ArrayLike) -> Floats:
    """Return 1 where the first value is larger, 0 where it is smaller, and 1/2 otherwise."""
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    return np.asarray(0.5 + ((a > b) * 0.5 - (a < b) * 0.5))


def wins(runs: Runs, paired: bool = False) -> float:
    """Return the share of the pairs of runs that the first wins, in the mean over sequences.

    These are all pairs of runs on a sequence, or with `paired` those at the same place.
    """
    return float(np.mean([beats(a if paired else a[:, None], b).mean() for a, b in runs]))


def rank_test(runs: Runs) -> Test:
    """Test `wins` against equal systems, whose runs on a sequence could be exchanged.

    The distribution is exact, also with ties, unless the numbers of runs are large or of too many
    kinds: then it is the normal distribution with the exact variance. On one sequence without ties
    it is the exact test of Mann and Whitney. No tail is smaller than that of as many runs of each
    as the system with fewer has: two runs that scatter may both lie above ten that do not.
    """
    sizes = [(len(a), len(b)) for a, b in runs]
    fewer = [min(pair) for pair in sizes]
    smallest = math.prod(1 / math.comb(2 * n, n) for n in fewer)
    unit = math.lcm(*(n * m for n, m in sizes))
    if 2 * unit * len(runs) > LATTICE:
        deviation = math.sqrt(sum(float(_variance(a, b)) for a, b in runs)) / len(runs)
        above = (wins(runs) - 0.5) / deviation if deviation else 0.0
        better, worse = map(float, scipy.special.ndtr([-above, above]))
        return Test(max(better, smallest), max(worse, smallest), smallest)
    null = _distribution(tuple(sorted((_ties(a, b), len(a)) for a, b in runs)), unit)
    seen = sum(
        int(2 * beats(a[:, None], b).sum()) * (unit // (n * m))
        for (a, b), (n, m) in zip(runs, sizes, strict=True)
    )
    better, worse = float(null[seen:].sum()), float(null[: seen + 1].sum())
    return Test(max(better, smallest), max(worse, smallest), smallest)


@lru_cache
def _distribution(samples: tuple[tuple[tuple[int, ...], int], ...], unit: int) -> Floats:
    """Return how probable each sum of wins over sequences is, in halves of a pair out of `unit`."""
    null = np.ones(1)
    for ties, n in samples:
        of_sequence = np.zeros(2 * unit + 1)
        of_sequence[:: unit // (n * (sum(ties) - n))] = _wins(ties, n)
        null = np.convolve(null, of_sequence)
    return null


@lru_cache
def _wins(ties: tuple[int, ...], n: int) -> Floats:
    """Return how probable each of twice the number of wins is for n of some values with ties."""
    ranks = np.repeat(2 * np.cumsum(ties) - np.array(ties) + 1, ties).tolist()  # twice the mean
    fewer, n_pairs = min(n, len(ranks) - n), n * (len(ranks) - n)
    counts = np.zeros((fewer + 1, sum(ranks) + 1))
    counts[0, 0] = 1
    for rank in ranks:
        counts[1:, rank:] += counts[:-1, :-rank].copy()
    least = fewer * (fewer + 1)
    probabilities = counts[fewer, least : least + 2 * n_pairs + 1] / math.comb(len(ranks), n)
    return probabilities if fewer == n else probabilities[::-1]


def _ties(a: Floats, b: Floats) -> tuple[int, ...]:
    """Return how many values there are of each, in rising order."""
    return tuple(np.unique(np.concatenate([a, b]), return_counts=True)[1].tolist())


def _variance(a: Floats, b: Floats) -> Floats:
    """Return the variance of the share of wins on a sequence if all orders are as probable."""
    n, m, both = a.shape[-1], b.shape[-1], np.concatenate([a, b], axis=-1)
    equal = (both[..., None] == both[..., None, :]).sum(axis=-1)
    ties = (equal**2 - 1).sum(axis=-1) / ((n + m) * (n + m - 1))
    return np.asarray((n + m + 1 - ties) / (12 * n * m))


def sequence_test(runs: Runs) -> Test:
    """Test by the signed ranks of the sequences, on each of which the median runs are compared."""
    return _signed_ranks([_difference(np.median(a), np.median(b)) for a, b in runs])


def paired_test(runs: Runs) -> Test:
    """Test by the signed ranks of pairs of runs, which are in the same order in both systems."""
    return _signed_ranks([_difference(*pair) for a, b in runs for pair in zip(a, b, strict=True)])


def _difference(a: float, b: float) -> float:
    return 0.0 if a == b else float(a - b)  # two failures are a tie


def _signed_ranks(differences: Sequence[float]) -> Test:
    """Return Wilcoxon's test of differences, exact also with ties; those that are 0 are left out.

    SciPy's takes 0.1 s for ten differences with ties, such as between failed runs.
    """
    nonzero = np.array([value for value in differences if value])
    ranks = np.rint(2 * scipy.stats.rankdata(np.abs(nonzero))).astype(int)  # whole also with ties
    null = np.ones(1)  # how probable each sum of the positive ones is
    for rank in ranks:
        null = (np.pad(null, (0, rank)) + np.pad(null, (rank, 0))) / 2
    seen = int(ranks[nonzero > 0].sum())
    better, worse = float(null[seen:].sum()), float(null[: seen + 1].sum())
    return Test(better, worse, 0.5 ** len(differences))


def holm(p_values: ArrayLike) -> Floats:
    """Adjust p-values, of any shape, by Holm's method; NaN marks a test that was not made.

    Where those up to a level are called significant, the probability that any is so by chance is
    at most this level (Holm, Scand. J. Statistics 1979).
    """
    p = np.asarray(p_values, dtype=np.float64)
    flat = p.ravel()
    order = np.argsort(flat, kind="stable")[: np.isfinite(flat).sum()]
    adjusted = np.full(flat.shape, np.nan)
    factors = np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(flat[order] * factors), 1.0)
    return adjusted.reshape(p.shape)


def welch(runs: Runs, paired: bool = False) -> Interval:
    """Return the difference of the means, over sequences, with Welch's interval of 95 %.

    There is none where a system has a single run on a sequence, or a value is infinite. With
    `paired` it is Student's, of the differences.
    """
    if not all(np.isfinite(of_one).all() for pair in runs for of_one in pair):
        return Interval(math.nan)
    difference = float(np.mean([a.mean() - b.mean() for a, b in runs]))
    values = [of_one for a, b in runs for of_one in ([a - b] if paired else [a, b])]
    if min(map(len, values)) < 2:
        return Interval(difference)
    shares = np.array([of_one.var(ddof=1) / len(of_one) for of_one in values])
    free = np.array([len(of_one) - 1 for of_one in values])
    total = shares.sum()
    if not total:
        return Interval(difference, difference, difference)
    dof = total**2 / (shares**2 / free).sum()
    reach = float(scipy.special.stdtrit(dof, 1 - LEVEL / 2) * math.sqrt(total) / len(runs))
    return Interval(difference, difference - reach, difference + reach)


def failure_interval(failed: int, runs: int) -> tuple[float, float]:
    """Return Clopper and Pearson's interval of 95 % for the probability that a run fails."""
    low, high = scipy.stats.binomtest(failed, runs).proportion_ci(1 - LEVEL)
    return float(low), float(high)


def runs_needed(runs: Runs, level: float = LEVEL, draws: int = 200) -> int | None:
    """Return how many runs of each make the difference significant in four of five cases.

    Runs are drawn from those that there are, and tested by the normal approximation of
    `rank_test`. None means more than `N_MAX`.
    """

    def enough(n: int) -> bool:
        if math.comb(2 * n, n) ** len(runs) < 2 / level:  # nothing is significant
            return False
        rng = np.random.default_rng(n)
        excess, variance = np.zeros(draws), np.zeros(draws)
        for a, b in runs:
            x, y = rng.choice(a, (draws, n)), rng.choice(b, (draws, n))
            excess += n**2 * (beats(x[:, :, None], y[:, None]).mean(axis=(1, 2)) - 0.5)
            variance += n**4 * _variance(x, y)
        distance = np.maximum(np.sign(wins(runs) - 0.5) * excess - 0.5, 0)  # half a step less
        reached = distance >= scipy.special.ndtri(1 - level / 2) * np.sqrt(variance)
        return bool(np.mean(reached & (variance > 0)) >= 0.8)

    numbers = range(2, N_MAX + 1)
    first = bisect_left(numbers, True, key=enough)
    return numbers[first] if first < len(numbers) else None
