"""How often a run beats another: against SciPy, by hand, and by brute force."""

import math
from itertools import combinations, product

import numpy as np
import pytest
from scipy import stats

from alignscores.comparison.statistics import (
    beats,
    difference,
    false_discovery,
    holm,
    paired_test,
    permutation_test,
    sequence_test,
    win_probability,
)

FAILED = -np.inf


def draw(n, m, sequences=1, shift=0.0, seed=0):
    rng = np.random.default_rng([seed, n, m])
    return [(rng.normal(shift, size=n), rng.normal(size=m)) for _ in range(sequences)]


def test_a_failed_run_loses_to_every_other_and_ties_count_half():
    assert beats([1, 0, 0, FAILED, np.nan], [0, 1, 0, FAILED, 0]).tolist() == [1, 0, 0.5, 0.5, 0.5]
    first = np.array([0.9, FAILED]), np.array([0.1, 0.9])
    second = np.array([0.5]), np.array([FAILED])
    assert win_probability([first]) == (1 + 0.5) / 4
    assert win_probability([first, second]) == (1.5 / 4 + 1) / 2
    assert win_probability([first], paired=True) == 0.5


def studentised(runs):
    """The statistic of some runs, by the definition: a p-value on a scale that grows with P."""
    excess, variances, free = 0.0, [], []
    for a, b in runs:
        of_a = [np.mean([(x > y) + (x == y) / 2 for y in b]) for x in a]
        of_b = [np.mean([(x > y) + (x == y) / 2 for x in a]) for y in b]
        excess += np.mean(of_a) - 0.5
        for placements in (of_a, of_b):
            variances.append(
                max(np.var(placements, ddof=1) / len(placements), (len(a) * len(b)) ** -2.0)
            )
            free.append(len(placements) - 1)
    dof = sum(variances) ** 2 / sum(v**2 / f for v, f in zip(variances, free, strict=True))
    t = excess / math.sqrt(sum(variances))
    return -np.sign(t) * math.log(stats.t.sf(abs(t), dof))


def exchanged(a, b):
    """All ways in which the runs of a sequence can belong to the two systems."""
    both = np.concatenate([a, b])
    for first in combinations(range(len(both)), len(a)):
        yield both[list(first)], np.delete(both, first)


@pytest.mark.parametrize("ties", [False, True])
@pytest.mark.parametrize(("n", "m", "sequences"), [(5, 4, 1), (3, 3, 2), (2, 3, 2)])
def test_few_permutations_are_all_made(n, m, sequences, ties):
    runs = draw(n, m, sequences, shift=0.7)
    if ties:
        runs = [(np.round(a), np.where(b < -0.5, FAILED, np.round(b))) for a, b in runs]
    observed = studentised(runs)
    permutations = [
        studentised(exchange) for exchange in product(*(exchanged(a, b) for a, b in runs))
    ]
    test = permutation_test(runs)
    assert test.better == pytest.approx(np.mean(np.array(permutations) >= observed - 1e-9))
    assert test.worse == pytest.approx(np.mean(np.array(permutations) <= observed + 1e-9))


@pytest.mark.parametrize(("n", "m", "shift"), [(5, 5, 0.7), (4, 6, -0.5), (6, 4, 1.0)])
def test_on_one_sequence_the_statistic_is_the_p_value_of_brunner_and_munzel(n, m, shift):
    """By SciPy, which has no permutations of it."""
    ((a, b),) = draw(n, m, shift=shift)

    def statistic(x, y):
        if x.min() > y.max() or x.max() < y.min():
            return np.inf * np.sign(x[0] - y[0])
        test = stats.brunnermunzel(y, x)
        return -np.sign(test.statistic) * math.log(test.pvalue)

    permutations = np.array([statistic(x, y) for x, y in exchanged(a, b)])
    test = permutation_test([(a, b)])
    assert test.better == pytest.approx(np.mean(permutations >= statistic(a, b) - 1e-9))
    assert test.worse == pytest.approx(np.mean(permutations <= statistic(a, b) + 1e-9))


@pytest.mark.parametrize(("n", "m"), [(5, 5), (3, 5), (5, 3)])
def test_a_run_that_is_worse_gains_nothing(n, m):
    """Nor one that fails on purpose: in no order of the runs does the p-value fall."""
    for first in combinations(range(n + m), n):
        a, b = np.array(first, float), np.delete(np.arange(n + m, dtype=float), first)
        p = permutation_test([(a, b)]).better
        for run, worse in product(range(n), (FAILED, *b - 0.5)):
            if worse < a[run]:
                lower = a.copy()
                lower[run] = worse
                assert permutation_test([(lower, b)]).better >= p - 1e-9


def test_many_permutations_are_drawn_and_repeated():
    runs = draw(10, 10, 2, shift=0.5)
    test = permutation_test(runs)
    assert test == permutation_test(runs)
    assert test == permutation_test([(a[::-1], b[::-1]) for a, b in runs])
    ((a, b),) = draw(12, 12, shift=0.4)
    plain = stats.mannwhitneyu(a, b, method="exact").pvalue  # with so equal a scatter, nearly
    assert permutation_test([(a, b)]).p == pytest.approx(plain, abs=0.03)
    far = permutation_test([(a + 100, b)])
    assert (far.better, far.worse) == (pytest.approx(1e-4), 1)


@pytest.mark.parametrize(("n", "m", "p"), [(3, 8, 2 / 165), (2, 10, 2 / 66), (5, 5, 2 / 252)])
def test_what_is_fully_separated_has_the_exact_p_value(n, m, p):
    assert permutation_test([(np.arange(n) + 100.0, np.arange(float(m)))]).p == pytest.approx(p)


@pytest.mark.parametrize(
    ("n", "m", "sequences", "possible"),
    [(5, 5, 1, True), (4, 10, 1, False), (3, 3, 2, True), (2, 10, 2, False), (2, 2, 3, True)],
)
def test_fewer_than_five_runs_of_a_system_are_not_tested(n, m, sequences, possible):
    """Whatever they are, they may all lie on one side of the others by chance."""
    test = permutation_test([(np.arange(n) + 100.0, np.arange(float(m)))] * sequences)
    assert test.possible == possible


@pytest.mark.parametrize(("n", "m", "sequences", "draws"), [(3, 10, 2, 120), (7, 7, 1, 400)])
def test_a_system_that_varies_more_is_not_called_different(n, m, sequences, draws):
    """The plain permutation test is wrong in 20 % of the first draws; without degrees of freedom
    the studentised one is wrong in 9 % of the second ones.
    """
    rng = np.random.default_rng(0)
    draws = [
        [(rng.normal(0, 10, n), rng.normal(0, 1, m)) for _ in range(sequences)]
        for _ in range(draws)
    ]
    assert np.mean([permutation_test(runs).p <= 0.05 for runs in draws]) <= 0.055


def test_dependent_runs_count_once():
    """Run k shares half of its variance over six sequences."""
    rng = np.random.default_rng(0)
    rejections = []
    for _ in range(150):
        shared = rng.normal(size=(2, 5))
        runs = [tuple(shared + rng.normal(size=(2, 5))) for _ in range(6)]
        tests = [permutation_test(runs, dependent=dependent) for dependent in (False, True)]
        rejections.append([test.p <= 0.05 for test in tests])
    independent, dependent = np.mean(rejections, axis=0)
    assert dependent <= 0.08 < independent
    single = permutation_test(runs[:1], dependent=True)
    assert single.p == pytest.approx(permutation_test(runs[:1]).p)


def test_single_runs_are_tested_by_signed_ranks_of_sequences():
    gains = np.array([0.1, 0.2, -0.05, 0.3, 0.4, 0.25, 0.15])
    test = sequence_test([(np.array([gain]), np.zeros(1)) for gain in gains])
    assert test.p == pytest.approx(stats.wilcoxon(gains).pvalue)
    assert sequence_test([(np.ones(1), np.array([FAILED]))] * 6).p == 2 / 64
    ties = np.array([0.1, 0.1, -0.1, np.inf, np.inf, 0.3])
    tested = sequence_test([(np.array([gain]), np.zeros(1)) for gain in ties])
    assert tested.better == pytest.approx(stats.wilcoxon(ties, alternative="greater").pvalue)
    zeros = np.array([0.0, 0.0, 0.1, 0.2, -0.3, 0.4, 0.5])
    tested = sequence_test([(np.array([gain]), np.zeros(1)) for gain in zeros])
    assert tested.p == pytest.approx(stats.wilcoxon(zeros[2:]).pvalue)
    assert not sequence_test([(np.ones(1), np.zeros(1))] * 5).possible
    assert sequence_test([(np.array([FAILED]), np.array([FAILED]))] * 6).p == 1


def test_paired_runs_are_tested_by_signed_ranks_of_pairs():
    rng = np.random.default_rng(0)
    hard, gains = rng.normal(0, 10, (2, 5)), rng.normal(0.8, 0.3, (2, 5))
    runs = list(zip(hard + gains, hard, strict=True))
    assert paired_test(runs).p == pytest.approx(stats.wilcoxon(gains.ravel()).pvalue)
    many = rng.normal(0.4, 1, 40)  # of more than 13 pairs only some signs are permuted
    found = paired_test([(many, np.zeros(40))])
    assert found.p == pytest.approx(stats.wilcoxon(many).pvalue, abs=0.01)
    assert found == paired_test([(many, np.zeros(40))])
    assert permutation_test(runs).p > 0.3
    assert difference(runs, paired=True).low > 0 > difference(runs).low


def test_differences_of_means_have_welch_s_interval():
    ((a, b),) = draw(5, 8)
    expected = stats.ttest_ind(a, b, equal_var=False).confidence_interval()
    interval = difference([(a, b)])
    assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high))
    assert interval.value == pytest.approx(a.mean() - b.mean())
    two = difference([(a, b), (a, b)])
    assert two.high - two.low < (interval.high - interval.low) / math.sqrt(2)
    single = difference([(a[:1], b)])
    assert math.isfinite(single.value)
    assert math.isnan(single.low)
    assert math.isnan(difference([(a, np.array([np.inf, 1]))]).value)
    assert vars(difference([(np.ones(2), np.zeros(2))])) == {"value": 1, "low": 1, "high": 1}


def test_several_p_values_are_adjusted():
    adjusted = holm([[0.04, 0.01], [np.nan, 0.03]])
    assert adjusted.ravel() == pytest.approx([0.06, 0.03, np.nan, 0.06], nan_ok=True)
    assert holm([0.6, 0.5]).tolist() == [1, 1]
    assert holm([]).size == 0
    assert false_discovery([0.01, np.nan, 0.04]) == pytest.approx([0.02, np.nan, 0.04], nan_ok=True)
    assert false_discovery([]).size == 0
