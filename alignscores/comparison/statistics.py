"""P(A beats B): how often a run of one system beats a run of another, and whether that is chance.

Larger values are better; a failed run has -inf. `Runs` holds the values of two systems on each
sequence where both have runs.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import combinations, product

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arrays import Booleans, Floats

__all__ = ["LEVEL", "MIN_RUNS", "MIN_SEQUENCES", "N_PERMUTATIONS", "Interval", "Test"]
__all__ += ["beats", "difference", "false_discovery", "holm"]
__all__ += ["paired_test", "permutation_test", "permuted_labels", "sequence_test"]
__all__ += ["studentised", "win_probability"]

LEVEL = 0.05  # significance
N_PERMUTATIONS = 9_999
MIN_RUNS = 5  # of each system over all sequences; fewer are not tested
MIN_SEQUENCES = 6  # with fewer no signed ranks are significant

Runs = Sequence[tuple[Floats, Floats]]


@dataclass(frozen=True)
class Test:
    """Tails of a test whether two systems are equal.

    `better` is the probability that equal systems give the first one as many wins as it has, or
    more; `worse` is the probability of as many or fewer. `smallest` is the least that either can
    be with so many runs, and `possible` whether the runs are enough for a test.
    """

    better: float
    worse: float
    smallest: float
    possible: bool

    @property
    def p(self) -> float:
        """The two-sided p-value."""
        return min(1.0, 2 * min(self.better, self.worse))


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


def win_probability(runs: Runs, paired: bool = False) -> float:
    """Return P(A beats B): the share of the pairs of runs that A wins, the mean over sequences.

    These are all pairs of runs on a sequence, or with `paired` those at the same index.
    """
    return float(np.mean([beats(a if paired else a[:, None], b).mean() for a, b in runs]))


def permutation_test(runs: Runs, *, dependent: bool = False) -> Test:
    """Test P(A beats B) = 1/2 by a studentised permutation test within sequences.

    The placement of a run is the share of the other system's runs that it beats. The mean over
    sequences of P(A beats B) - 1/2 is divided by its standard error, where the variance of P on a
    sequence is the variance of A's placements over their number plus that of B's. The statistic is
    the p-value of this quotient by Student's distribution with Satterthwaite's degrees of freedom
    (Brunner and Munzel, Biometrical Journal 2000). It is compared with the statistics of permuted
    labels of the systems (Neubert and Brunner, CSDA 2007): all of them where there are at most
    10,000, otherwise 9,999 random ones and the observed one. Therefore it is exact for equal
    systems, and nearly so where one system varies more than the other.

    With `dependent`, run k of a system shares something over all sequences, such as a build: its
    labels are permuted together, and its placement is the mean over the sequences.

    Where one system varies so much that the other's runs are a point to it, this is the sign test
    of its runs, whose levels are few: all of five runs lie on one side of the others by chance in
    6.25 %, and seven of eight in 7.0 %. Fewer than five are not tested: four would in 12.5 %.
    """
    wins, sizes = [], []
    for a, b in runs:
        both = np.concatenate([a, b] if dependent else [np.sort(a), np.sort(b)])
        wins.append(beats(both[:, None], both))
        sizes.append((len(a) + len(b), len(a)))
    if dependent:
        wins, sizes = [np.mean(wins, axis=0)], sizes[:1]
    labels, combined = permuted_labels(sizes)
    statistic = studentised(wins, labels, combined=combined)
    rounding = 1e-9 * np.abs(statistic).max()
    fewest = sum(min(n, size - n) for size, n in sizes)
    return Test(
        better=float(np.mean(statistic >= statistic[0] - rounding)),
        worse=float(np.mean(statistic <= statistic[0] + rounding)),
        smallest=1 / len(statistic),
        possible=fewest >= MIN_RUNS,
    )


def permuted_labels(sizes: Sequence[tuple[int, int]]) -> tuple[list[Floats], bool]:
    """Return for each sequence labels of its runs, the first n of them A's in the first row.

    They are all that there are, to be combined over sequences, if the combinations are at most
    10,000; otherwise they are as many random ones.
    """
    if math.prod(math.comb(size, n) for size, n in sizes) <= N_PERMUTATIONS + 1:
        return [_all_labels(size, n) for size, n in sizes], True
    return [_random_labels(*size, index) for index, size in enumerate(sizes)], False


def studentised(
    wins: Sequence[Floats], labels: Sequence[Floats], *, combined: bool = False
) -> Floats:
    """Return the statistic of the permutation test, larger where A is better.

    For each sequence `wins` says which of some runs beats which, and each row of `labels` which of
    them are A's. Rows of the same number go together, or with `combined` each with each.
    """
    by_sequence = list(map(_placements, wins, labels))
    excess, variance, uncertainty = (
        _over_sequences(values, combined) for values in zip(*by_sequence, strict=True)
    )
    t = excess / np.sqrt(variance)
    p = scipy.special.stdtr(variance**2 / uncertainty, -np.abs(t))
    return np.asarray(-np.sign(t) * np.log(np.maximum(p, np.finfo(float).tiny)))


def _placements(wins: Floats, labels: Floats) -> tuple[Floats, Floats, Floats]:
    """Return, for each row of labels of A, P(A beats B) - 1/2 on a sequence, and its variance.

    The third value is the sum of each system's squared variance over its degrees of freedom. A
    system whose placements are all equal has the least variance that others have: one pair of runs
    is lost.
    """
    n, other_labels = labels[0].sum(), 1 - labels
    m = labels.shape[1] - n
    placements_a = labels * (other_labels @ wins.T) / m  # shares of B's runs that A's runs beat
    placements_b = other_labels * (labels @ wins) / n  # shares of A's runs that beat B's runs
    mean = placements_a.sum(axis=1) / n
    smallest = 1 / (n * m) ** 2
    var_a, var_b = (
        np.maximum((np.einsum("ij,ij->i", values, values) / k - mean**2) / (k - 1), smallest)
        for values, k in ((placements_a, n), (placements_b, m))
    )
    return mean - 0.5, var_a + var_b, var_a**2 / (n - 1) + var_b**2 / (m - 1)


def _over_sequences(values: Sequence[Floats], combined: bool) -> Floats:
    """Return sums over sequences: of all combinations of labels, or of each row."""
    if combined:
        return reduce(lambda a, b: np.add.outer(a, b).ravel(), values)
    return np.asarray(np.sum(values, axis=0))


@lru_cache(maxsize=32)
def _all_labels(size: int, n: int) -> Floats:
    """Return all ways in which n of some runs can be A's; first the observed one, the first n."""
    labels = np.zeros((math.comb(size, n), size))
    np.put_along_axis(labels, np.array(list(combinations(range(size), n))), 1, axis=1)
    return labels


@lru_cache(maxsize=32)
def _random_labels(size: int, n: int, index: int) -> Floats:
    """Return the observed labels, in which A has the first n runs, and random permutations."""
    labels = np.zeros((N_PERMUTATIONS + 1, size))
    labels[:, :n] = 1
    rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(index,)))
    labels[1:] = rng.permuted(labels[1:], axis=1)
    return labels


def sequence_test(runs: Runs) -> Test:
    """Test by the signed ranks of the sequences, comparing the median runs on each."""
    return _signed_ranks([_difference(np.median(a), np.median(b)) for a, b in runs])


def paired_test(runs: Runs) -> Test:
    """Test by the signed ranks of pairs of runs, which are in the same order in both systems."""
    return _signed_ranks([_difference(*pair) for a, b in runs for pair in zip(a, b, strict=True)])


def _difference(a: float, b: float) -> float:
    return 0.0 if a == b else float(a - b)  # two failures are a tie


def _signed_ranks(differences: Sequence[float]) -> Test:
    """Return Wilcoxon's test, by permutations of the signs: exact also with ties and zeros.

    SciPy's needs 0.35 s for that with 11 differences, and 2 s from 14 on; this one a millisecond.
    """
    smallest = max(0.5 ** len(differences), 1 / (N_PERMUTATIONS + 1))
    possible = len(differences) >= MIN_SEQUENCES
    values = np.array([value for value in differences if value])
    positive = _flipped_signs(len(values)) ^ (values > 0)
    statistic = positive @ scipy.stats.rankdata(np.abs(values))
    better, worse = np.mean(statistic >= statistic[0]), np.mean(statistic <= statistic[0])
    return Test(float(better), float(worse), smallest, possible)


@lru_cache(maxsize=32)
def _flipped_signs(n: int) -> Booleans:
    """Return which of n signs are flipped: none in the first row, then all ways, or random ones."""
    if 2**n <= N_PERMUTATIONS + 1:
        return np.array(list(product([False, True], repeat=n)), dtype=bool).reshape(2**n, n)
    flipped = np.random.default_rng(0).random((N_PERMUTATIONS + 1, n)) < 0.5
    flipped[0] = False
    return flipped


def false_discovery(p_values: ArrayLike) -> Floats:
    """Adjust p-values for the false discovery rate; NaN marks a test that was not made.

    Of the differences with adjusted p-values up to a level, at most this share is expected to be
    false (Benjamini and Hochberg, JRSS B 1995).
    """
    p = np.asarray(p_values, dtype=np.float64)
    tested = np.isfinite(p)
    adjusted = np.full(p.shape, np.nan)
    if tested.any():
        adjusted[tested] = scipy.stats.false_discovery_control(p[tested])
    return adjusted


def holm(p_values: ArrayLike) -> Floats:
    """Adjust p-values, of any shape, by Holm's method; NaN marks a test that was not made.

    Where those up to a level are called significant, the probability that any is so by chance is
    at most this level (Holm, Scand. J. Statistics 1979). SciPy has no function for it.
    """
    p = np.asarray(p_values, dtype=np.float64)
    flat = p.ravel()
    order = np.argsort(flat, kind="stable")[: np.isfinite(flat).sum()]
    adjusted = np.full(flat.shape, np.nan)
    factors = np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(flat[order] * factors), 1.0)
    return adjusted.reshape(p.shape)


def difference(runs: Runs, paired: bool = False) -> Interval:
    """Return the difference of the means, over sequences, with Welch's interval of 95 %.

    There is none where a system has a single run on a sequence, or a value is infinite. With
    `paired` it is Student's, of the differences. SciPy has it for one sequence.
    """
    if not all(np.isfinite(values).all() for pair in runs for values in pair):
        return Interval(math.nan)
    value = float(np.mean([a.mean() - b.mean() for a, b in runs]))
    samples = [sample for a, b in runs for sample in ([a - b] if paired else [a, b])]
    if min(map(len, samples)) < 2:
        return Interval(value)
    variances = np.array([sample.var(ddof=1) / len(sample) for sample in samples])
    total = variances.sum()
    if not total:
        return Interval(value, value, value)
    dof = total**2 / sum(variances**2 / [len(sample) - 1 for sample in samples])
    half_width = float(scipy.special.stdtrit(dof, 1 - LEVEL / 2) * math.sqrt(total) / len(runs))
    return Interval(value, value - half_width, value + half_width)
