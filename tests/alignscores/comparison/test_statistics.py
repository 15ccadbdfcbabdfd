"""How often a run beats another: against SciPy, by hand, and by simulation."""

import math

import numpy as np
import pytest
from scipy import stats

from alignscores.comparison.statistics import (
    LEVEL,
    beats,
    holm,
    paired_test,
    rank_test,
    runs_needed,
    sequence_test,
    welch,
    wins,
)
from studies.calibration import SCATTERS, Case, found

FAILED = -np.inf


def draw(n, m, sequences=1, shift=0.0, seed=0):
    rng = np.random.default_rng([seed, n, m])
    return [(rng.normal(shift, size=n), rng.normal(size=m)) for _ in range(sequences)]


def test_a_failed_run_loses_to_every_other_and_ties_count_half():
    assert beats([1, 0, 0, FAILED, np.nan], [0, 1, 0, FAILED, 0]).tolist() == [1, 0, 0.5, 0.5, 0.5]
    one = np.array([0.9, FAILED]), np.array([0.1, 0.9])
    other = np.array([0.5]), np.array([FAILED])
    assert wins([one]) == (1 + 0.5) / 4
    assert wins([one, other]) == (1.5 / 4 + 1) / 2
    assert wins([one], paired=True) == 0.5


@pytest.mark.parametrize(("n", "m"), [(2, 2), (5, 5), (40, 40)])
def test_on_one_sequence_it_is_the_test_of_mann_and_whitney(n, m):
    ((a, b),) = draw(n, m, shift=0.5)
    test = rank_test([(a, b)])
    for tail, own in (("greater", test.better), ("less", test.worse), ("two-sided", test.p)):
        exact = stats.mannwhitneyu(a, b, alternative=tail, method="exact").pvalue
        assert own == pytest.approx(exact, abs=1e-12)


def test_ties_and_failures_are_tested_exactly():
    a, b = np.array([FAILED, FAILED, 0.3, 0.5]), np.array([0.3, 0.6, 0.7, FAILED])
    for tail, own in (("greater", "better"), ("less", "worse")):
        exact = stats.permutation_test(
            (a, b), lambda x, y: wins([(x, y)]), n_resamples=np.inf, alternative=tail
        )
        assert getattr(rank_test([(a, b)]), own) == pytest.approx(exact.pvalue)


def test_the_distribution_over_sequences_is_that_of_all_exchanges():
    """Of two runs of each on three sequences the best of the 6 ** 3 orders is as rare."""
    runs = [(np.array([2.0, 3]), np.array([0.0, 1]))] * 3
    assert rank_test(runs).better == pytest.approx(1 / 216)
    assert rank_test(runs).worse == pytest.approx(1)
    assert rank_test([(b, a) for a, b in runs]).worse == pytest.approx(1 / 216)


def test_many_runs_have_the_normal_distribution():
    ((a, b),) = draw(40, 43, shift=0.3)
    exact = stats.mannwhitneyu(a, b, method="exact").pvalue
    assert rank_test([(a, b)] * 2).p < rank_test([(a, b)]).p == pytest.approx(exact, abs=0.01)
    assert rank_test([(np.zeros(400), np.zeros(400))]).p == 1


@pytest.mark.parametrize(
    ("n", "m", "sequences", "possible"),
    [(3, 3, 1, False), (4, 4, 1, True), (2, 2, 2, False), (2, 2, 3, True), (2, 10, 1, False)],
)
def test_so_few_runs_cannot_differ_significantly(n, m, sequences, possible):
    """The system with fewer runs decides."""
    test = rank_test([(np.arange(n) + 100.0, np.arange(float(m)))] * sequences)
    assert test.possible == possible == (test.p <= LEVEL)


def test_single_runs_are_tested_by_signed_ranks_of_sequences():
    gains = np.array([0.1, 0.2, -0.05, 0.3, 0.4, 0.25, 0.15])
    test = sequence_test([(np.array([gain]), np.zeros(1)) for gain in gains])
    assert test.p == pytest.approx(stats.wilcoxon(gains).pvalue)
    assert sequence_test([(np.ones(1), np.array([FAILED]))] * 6).p == 2 / 64
    ties = np.array([0.1, 0.1, -0.1, np.inf, np.inf, 0.3])
    tested = sequence_test([(np.array([gain]), np.zeros(1)) for gain in ties])
    assert tested.better == pytest.approx(stats.wilcoxon(ties, alternative="greater").pvalue)
    assert not sequence_test([(np.ones(1), np.zeros(1))] * 5).possible
    assert sequence_test([(np.array([FAILED]), np.array([FAILED]))] * 6).p == 1


def test_paired_runs_are_tested_by_signed_ranks_of_pairs():
    rng = np.random.default_rng(0)
    hard, gains = rng.normal(0, 10, (2, 5)), rng.normal(0.8, 0.3, (2, 5))
    runs = list(zip(hard + gains, hard, strict=True))
    assert paired_test(runs).p == pytest.approx(stats.wilcoxon(gains.ravel()).pvalue)
    assert rank_test(runs).p > 0.3
    assert welch(runs, paired=True).low > 0 > welch(runs).low


def test_differences_of_means_have_welch_s_interval():
    ((a, b),) = draw(5, 8)
    expected = stats.ttest_ind(a, b, equal_var=False).confidence_interval()
    found = welch([(a, b)])
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high))
    assert found.value == pytest.approx(a.mean() - b.mean())
    two = welch([(a, b), (a, b)])
    assert two.high - two.low < (found.high - found.low) / math.sqrt(2)
    single = welch([(a[:1], b)])
    assert math.isfinite(single.value)
    assert math.isnan(single.low)
    assert math.isnan(welch([(a, np.array([np.inf, 1]))]).value)
    assert vars(welch([(np.ones(2), np.zeros(2))])) == {"value": 1, "low": 1, "high": 1}


def test_several_p_values_are_adjusted_by_holm():
    found = holm([[0.04, 0.01], [np.nan, 0.03]])
    assert found.ravel() == pytest.approx([0.06, 0.03, np.nan, 0.06], nan_ok=True)
    assert holm([0.6, 0.5]).tolist() == [1, 1]
    assert holm([]).size == 0


def test_the_runs_that_are_needed_find_the_difference():
    runs = draw(10, 10, sequences=2, shift=0.8)
    needed = runs_needed(runs)
    assert 5 < needed < 30
    rng = np.random.default_rng(1)
    drawn = [[(rng.choice(a, needed), rng.choice(b, needed)) for a, b in runs] for _ in range(300)]
    assert np.mean([rank_test(again).p <= LEVEL for again in drawn]) == pytest.approx(0.8, abs=0.1)
    assert runs_needed(runs, LEVEL / 10) > needed
    assert runs_needed([(np.ones(3), np.zeros(3))]) == 4
    assert runs_needed([(np.zeros(3), np.zeros(3))]) is None


@pytest.mark.parametrize("scatter", SCATTERS)
@pytest.mark.parametrize(("systems", "sequences", "runs"), [(2, 1, 5), (3, 5, 3), (3, 6, 1)])
def test_equal_systems_seldom_differ(scatter, systems, sequences, runs):
    for failing in (0.0, 0.3):
        assert found(Case(systems, sequences, runs, scatter, failing), draws=200) <= 0.095


def test_a_better_system_is_found_though_runs_are_grossly_wrong():
    assert found(Case(2, 6, 5, "10 % gross", better=1.0), draws=200) > 0.7
