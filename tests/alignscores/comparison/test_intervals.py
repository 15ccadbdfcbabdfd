"""Intervals: closed forms against drawing and against SciPy, and how often they hold."""

from itertools import combinations

import numpy as np
import pytest
from scipy import stats
from scipy.special import stdtrit

from alignscores import pas
from alignscores.comparison import answers as of_pairs
from alignscores.comparison.answers import Cell, chosen
from alignscores.comparison.benchmark import Run
from alignscores.comparison.intervals import (
    Difference,
    Failures,
    error_of_pair,
    joined,
    largest_scatter,
    margin,
    needed,
    over_runs,
    over_sequences,
)
from alignscores.comparison.runs import Outcome
from alignscores.comparison.summary import summarise
from alignscores.trajectories.formats import FORMATS
from experiments.scenes import make_scene

RNG = np.random.default_rng(0)


def test_over_runs_is_welch():
    a, b = RNG.normal(0.7, 0.1, 4), RNG.normal(0.5, 0.2, 7)
    found = over_runs([(a, b)])
    low, high = stats.ttest_ind(a, b, equal_var=False).confidence_interval()
    half = stats.t.ppf(0.975, found.dof) * found.error
    assert (found.value - half, found.value + half) == pytest.approx((low, high))
    assert margin(found, 0.05) == pytest.approx(half)
    assert margin(over_runs([([0.5, 0.5], [0.7, 0.7])]), 0.05) == 0


def test_over_runs_of_several_sequences_takes_the_scatter_on_each():
    """However far apart the sequences are: nothing but their runs is new."""
    cells = [(RNG.normal(mean + 0.1, 0.1, 5), RNG.normal(mean, 0.1, 5)) for mean in (0, 10, 50)]
    found, alone = over_runs(cells), [over_runs([cell]) for cell in cells]
    assert found.value == pytest.approx(np.mean([one.value for one in alone]))
    assert found.error == pytest.approx(np.sqrt(sum(one.error**2 for one in alone)) / 3)
    assert max(one.dof for one in alone) < found.dof <= 3 * 8


def test_over_sequences_is_paired():
    a, b = RNG.normal(size=(2, 6))
    low, high = stats.ttest_rel(a, b).confidence_interval()
    found = over_sequences(a - b)
    half = margin(found, 0.05)
    assert (found.value - half, found.value + half) == pytest.approx((low, high))


@pytest.mark.parametrize("name", ["PAS", "ate:rmse"])
def test_systems_with_the_same_values_in_all_runs_are_not_told_apart(name):
    cell = Cell([0.5, 0.5], Failures(0, 2))
    found = of_pairs.answers([(cell, cell)] * 2, name, 0.05, [Failures(0, 4)] * 2)
    for answer in found.values():
        assert (answer["difference"], answer["better"], answer["needed"]) == (0, None, None)


def test_all_pairs_hold_together():
    assert error_of_pair(2) == pytest.approx(0.05)
    errors = stats.t.rvs(4, size=(100_000, 6), random_state=RNG)  # of the pairs of 4 systems
    held = np.abs(errors).max(axis=1) <= margin(Difference(0.0, 1.0, 4), error_of_pair(4))
    assert held.mean() == pytest.approx(0.95, abs=0.003)


@pytest.mark.parametrize(("failed", "of"), [(0, 3), (1, 10), (10, 10), (7, 20)])
def test_how_often_runs_fail_has_the_exact_interval(failed, of):
    expected = stats.binomtest(failed, of).proportion_ci(0.95, method="exact")
    assert Failures(failed, of).limits(0.05) == pytest.approx(tuple(expected))


@pytest.mark.parametrize(("failed", "of"), [(0, 3), (1, 10), (10, 10), (7, 20), (0.5, 4)])
def test_the_mid_p_interval_counts_half_of_what_was_seen(failed, of):
    down, up = Failures(failed, of).reach(0.05)
    low, high = failed / of - down, failed / of + up
    if failed == int(failed):
        tails = (
            stats.binom.sf(failed, of, low) + stats.binom.pmf(failed, of, low) / 2,
            stats.binom.cdf(failed - 1, of, high) + stats.binom.pmf(failed, of, high) / 2,
        )
        assert tails[0] == pytest.approx(0.025 if failed else 0.5)
        assert tails[1] == pytest.approx(0.025 if failed < of else 0.5)
    outer = Failures(failed, of).limits(0.05)
    assert outer[0] <= low <= failed / of <= high <= outer[1]
    # Without a failure, or nothing but them, the other side is that of one-sided intervals.
    if not failed:
        assert high == pytest.approx(Failures(failed, of).limits(0.1)[1])


@pytest.mark.parametrize("n", [2, 3, 4, 5, 7, 10, 20])
def test_systems_that_fail_alike_are_seldom_told_apart(n):
    """Of all outcomes of n runs each, whatever the probability of failing."""
    told = np.zeros((n + 1, n + 1))
    for failed in np.ndindex(told.shape):
        cells = [cell([0.5] * (n - k), k) for k in failed]
        found = answers([tuple(cells)], "ATE", 0.05)["new_runs"]["failing"]
        told[failed] = found["low"] > 0 or found["high"] < 0
    for p in np.linspace(0.01, 0.99, 50):
        chance = stats.binom.pmf(np.arange(n + 1), n, p)
        assert chance @ told @ chance <= 0.08


def test_failures_tell_equal_scores_apart():
    for more in (0, 1e-9):
        pair = cell([0.4, 0.6, 0.5, 0.5]), cell([0.4, 0.6, 0.5, 0.5 + more], 2)
        assert answers([pair], "PAS", 0.05)["new_runs"]["needed"] == 27


def test_an_interval_of_parts():
    assert joined(1.0, (3, 0), (4, 2)) == pytest.approx((-4, 3))


@pytest.mark.parametrize("n", [3, 10])
def test_a_difference_that_so_many_runs_tell_just_so_takes_these_runs(n):
    dof = 2 * (n - 1)
    reach = stats.t.ppf(0.975, dof) + stats.t.ppf(0.8, dof)
    assert needed(Difference(-1.001 * reach, 1.0, dof), n, 0.05) == n
    assert needed(Difference(0.999 * reach, 1.0, dof), n, 0.05) == n + 1
    exactly = stdtrit(dof, 1 - 0.05 / 2) + stdtrit(dof, 0.8)
    assert needed(Difference(exactly, 1.0, dof), n, 0.05) == n


@pytest.mark.parametrize(("of_the_least", "found"), [(1.00001, 1000), (0.99999, None)])
def test_up_to_1000_runs_may_be_needed(of_the_least, found):
    dof = 10**9 * 999 / 9
    reach = stats.t.ppf(0.975, dof) + stats.t.ppf(0.8, dof)
    difference = Difference(of_the_least * reach * np.sqrt(10 / 1000), 1.0, 10**9)
    assert needed(difference, 10, 0.05) == found


@pytest.mark.parametrize(
    ("least", "found"),
    [(0, 2), (1, 2), (1.99, 2), (2, 3), (7.5, 8), (999, 1000), (1000, None), (np.inf, None)],
)
def test_more_than_the_least_runs_are_needed(least, found):
    assert needed(Difference(0.1, 1e-9, 18), 10, 0.05, least) == found


@pytest.mark.parametrize("n", [2, 3, 10])
@pytest.mark.parametrize("value", [0.1, -0.1])
def test_with_the_largest_scatter_so_many_runs_tell_a_difference_just_so(n, value):
    scatter = largest_scatter(value, n, 0.05)
    dof = 2 * (n - 1)
    reach = stats.t.ppf(0.975, dof) + stats.t.ppf(0.8, dof)
    assert reach * scatter * np.sqrt(1 / n + 1 / n) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("failed", "of", "share", "times"),
    [(1, 10, 0.3, 0.35), (0, 4, 0.5, 0.25), (1, 4, 0.25, np.inf), (2, 4, 0.25, np.inf)],
)
def test_how_many_times_as_many_runs_bear_one_more_failure(failed, of, share, times):
    """So many times as many runs, of which as large a share and one more failed, fail as often."""
    found = Failures(failed, of)
    assert found.more_until(share) == pytest.approx(times)
    if np.isfinite(times):
        assert (times * failed + 1) / (times * of + 1) == pytest.approx(share)


@pytest.mark.parametrize("n_systems", [1, 2, 3, 4, 10])
def test_the_intervals_of_independent_pairs_hold_together(n_systems):
    n_pairs = len(list(combinations(range(n_systems), 2)))
    assert (1 - error_of_pair(n_systems)) ** max(n_pairs, 1) == pytest.approx(0.95)


@pytest.mark.parametrize("n_systems", [2, 5])
def test_as_many_runs_as_are_needed_tell_systems_apart_in_four_of_five_cases(n_systems):
    error = error_of_pair(n_systems)
    n = needed(Difference(0.1, 0.1, 18), 10, error)
    runs = RNG.normal([[[0.1], [0]]], 0.1 * np.sqrt(5), size=(2000, 2, n))  # with such an error
    found = [over_runs([pair]) for pair in runs]
    told = np.mean([abs(one.value) > margin(one, error) for one in found])
    assert told == pytest.approx(0.8, abs=0.04)
    scatter = largest_scatter(0.1, n, error)
    assert 0.1 * np.sqrt(5) <= scatter <= 1.1 * 0.1 * np.sqrt(5)
    assert needed(Difference(0.1, 1e-9, 18), 10, error, 7.5) == 8
    assert needed(Difference(0.0, 0.1, 18), 10, error) is None
    assert needed(Difference(0.001, 0.1, 18), 10, error) is None


def cell(values, failed=0):
    return Cell(values, Failures(failed, len(values) + failed))


def answers(pairs, name, error):
    """Return the answers where there are no other runs."""
    runs = [Failures(*np.sum([c.failures for c in of], axis=0)) for of in zip(*pairs, strict=True)]
    return of_pairs.answers(pairs, name, error, runs)


def test_both_questions_are_answered_where_the_data_allow():
    one, other = cell([0.8]), cell([0.5])
    assert answers([(one, other)], "TAS", 0.05) == {"new_runs": None, "new_sequences": None}
    found = answers([(one, other), (one, other)], "TAS", 0.05)
    assert found["new_runs"] is None
    assert found["new_sequences"]["better"] == "a"
    assert chosen([found]) == "new_sequences"
    several = cell([0.8, 0.81, 0.79]), cell([0.5, 0.51, 0.49])
    alone = answers([several], "TAS", 0.05)
    assert alone["new_sequences"] is None
    assert chosen([alone, answers([(one, other)], "TAS", 0.05)]) == "new_runs"
    assert chosen([answers([several] * 2, "TAS", 0.05), found]) == "new_sequences"
    assert chosen([answers([several] * 2, "TAS", 0.05)]) == "new_runs"
    assert chosen([answers([(one, other)], "TAS", 0.05)]) is None


@pytest.mark.parametrize("name", ["TAS", "ATE"])
def test_of_equal_values_the_system_is_ahead_that_fails_less_often(name):
    never, often = cell([0.5] * 20), cell([0.5] * 2, failed=18)
    assert answers([(never, often)], name, 0.05)["new_runs"]["better"] == "a"
    assert answers([(often, never)], name, 0.05)["new_runs"]["better"] == "b"


PARTS = "failing", "with_failures"


def entry_of(found):
    return tuple(float(found[key]) for key in ("difference", "low", "high"))


def test_an_answer_is_put_together_of_its_parts():
    """Welch's interval, those of failures, and both in the means in which failures count."""
    a, b = cell([0.7, 0.8, 0.8, 0.9]), cell([0.3, 0.4, 0.5], failed=1)
    found = answers([(a, b)], "PAS", 0.05)["new_runs"]
    low, high = stats.ttest_ind(a.scored, b.scored, equal_var=False).confidence_interval()
    half = (high - low) / 2
    (down_a, up_a), (down_b, up_b) = (one.failures.reach(0.05) for one in (a, b))
    assert entry_of(found) == pytest.approx((0.4, low, high))
    assert entry_of(found["failing"]) == pytest.approx(
        (-0.25, -0.25 - np.hypot(down_a, up_b), -0.25 + np.hypot(up_a, down_b))
    )
    assert entry_of(found["with_failures"]) == pytest.approx(
        (
            0.8 - 0.3,
            0.5 - np.sqrt(half**2 + (0.8 * up_a) ** 2 + (0.4 * down_b) ** 2),
            0.5 + np.sqrt(half**2 + (0.8 * down_a) ** 2 + (0.4 * up_b) ** 2),
        )
    )
    assert found["better"] == "a"


def test_an_answer_for_new_sequences_is_put_together_of_its_parts():
    """Each sequence counts alike, however many runs there are; what fails are shares of runs."""
    pairs = [
        (cell([0.8, 0.9]), cell([0.5], failed=1)),
        (cell([0.7]), cell([0.4, 0.5, 0.3], failed=1)),
        (cell([0.9], failed=3), cell([0.6])),
    ]
    found = answers(pairs, "PAS", 0.05)["new_sequences"]
    differences = [0.35, 0.3, 0.3]
    low, high = stats.ttest_1samp(differences, 0).confidence_interval()
    half = (high - low) / 2
    (down_a, up_a), (down_b, up_b) = (Failures(sum_of, 3).reach(0.05) for sum_of in (0.75, 0.75))
    assert entry_of(found) == pytest.approx((np.mean(differences), low, high))
    assert entry_of(found["failing"]) == pytest.approx(
        (0, -np.hypot(down_a, up_b), np.hypot(up_a, down_b)), abs=1e-12
    )
    lead = (0.85 + 0.7 + 0.9 / 4 - 0.5 / 2 - 1.2 / 4 - 0.6) / 3
    of_a, of_b = (0.8 + 0.9 + 0.7 + 0.9) / 4, (0.5 + 0.4 + 0.5 + 0.3 + 0.6) / 5
    assert entry_of(found["with_failures"]) == pytest.approx(
        (
            lead,
            lead - np.sqrt(half**2 + (of_a * up_a) ** 2 + (of_b * down_b) ** 2),
            lead + np.sqrt(half**2 + (of_a * down_a) ** 2 + (of_b * up_b) ** 2),
        )
    )


@pytest.mark.parametrize("name", ["PAS", "ATE"])
def test_systems_that_change_places_change_signs(name):
    rng = np.random.default_rng(5)
    for _ in range(40):
        shift = rng.choice([0.0, 0.2, 0.4])
        pairs = [
            tuple(
                cell(list(rng.uniform(low, low + 0.1, rng.integers(1, 5))), int(rng.integers(0, 3)))
                for low in (0.3, 0.3 + shift)
            )
            for _ in range(rng.integers(1, 4))
        ]
        found = answers(pairs, name, 0.05)
        mirrored = answers([(b, a) for a, b in pairs], name, 0.05)
        for question, answer in found.items():
            if answer is None:
                assert mirrored[question] is None
                continue
            other = mirrored[question]
            swapped = {"a": "b", "b": "a", None: None}[answer["better"]]
            assert (other["better"], other["needed"]) == (swapped, answer["needed"])
            both = (answer, other), *((answer[key], other[key]) for key in PARTS)
            for one, two in both:
                value, low, high = entry_of(two)
                expected = pytest.approx((-value, -high, -low), abs=1e-12, nan_ok=True)
                assert entry_of(one) == expected


def test_cells_of_one_run_do_not_tell_how_runs_scatter():
    """Sequences with a single scored run are left out of what new runs are asked, not of means."""
    several, alone = (cell([0.7, 0.8]), cell([0.4, 0.5])), (cell([0.9], 1), cell([0.1, 0.1]))
    found = answers([several, alone], "PAS", 0.05)["new_runs"]
    assert found["difference"] == pytest.approx(0.3)
    assert found["with_failures"]["difference"] == pytest.approx((0.3 + 0.45 - 0.1) / 2)
    found = answers([several, alone], "PAS", 0.05)["new_sequences"]
    assert found["difference"] == pytest.approx((0.3 + 0.8) / 2)


def test_systems_that_never_succeed_are_equal():
    found = answers([(cell([], 2), cell([], 2))] * 2, "PAS", 0.05)
    for answer in found.values():
        assert answer["better"] is answer["needed"] is None
        assert np.isnan(answer["difference"])
        assert answer["failing"]["difference"] == answer["with_failures"]["difference"] == 0


@pytest.mark.parametrize(
    ("runs", "sequences", "question"),
    [
        ([1, 1], [1, 1], "new_runs"),
        ([1, 0], [1, 1], "new_sequences"),
        ([1, 0], [0, 1], "new_sequences"),
        ([1, 0], [0, 0], "new_runs"),
        ([0, 0], [0, 1], "new_sequences"),
        ([0, 0], [0, 0], None),
        ([], [], None),
    ],
)
def test_the_question_of_a_column(runs, sequences, question):
    answered = {0: None, 1: {"better": None}}
    found = [
        {"new_runs": answered[of_runs], "new_sequences": answered[of_sequences]}
        for of_runs, of_sequences in zip(runs, sequences, strict=True)
    ]
    assert chosen(found) == question


def test_intervals_stay_within_what_is_possible():
    cells = [(cell([0.9]), cell([0.1])), (cell([0.1]), cell([0.2]))]
    found = answers(cells, "TAS", 0.05)["new_sequences"]
    assert (found["low"], found["high"]) == (-1, 1)
    assert found["failing"] == {"difference": 0, "low": -1, "high": 1} | found["failing"]
    percent = [tuple(cell([100 * one.scored[0]]) for one in both) for both in cells]
    assert answers(percent, "auc@30:vggt", 0.05)["new_sequences"]["high"] == 100
    assert answers(percent, "ATE", 0.05)["new_sequences"]["high"] > 100


def test_failures_are_told_apart():
    """Better runs, a system that fails more often, and both: who is ahead."""
    good, poor = [0.80, 0.81, 0.82] * 4, [0.40, 0.41, 0.42] * 4

    def better(a, b, name="TAS"):
        return answers([(a, b)], name, 0.05)["new_runs"]["better"]

    assert better(cell(good), cell(poor)) == "a"
    assert better(cell(good, 1), cell(poor, 2)) == "a"
    assert better(cell(good, 1), cell([0.75, 0.76, 0.77] * 4)) is None  # better, and failed once
    assert better(cell(good, 1), cell([0.1, 0.11, 0.12] * 4)) == "a"  # so much better
    assert better(cell(good, 12), cell(good)) == "b"  # as good, and fails more often
    assert better(cell([], 5), cell(poor)) == "b"
    assert better(cell([], 2), cell(poor[:2])) is None
    assert better(cell(good), cell(poor), "ATE") == "b"
    assert better(cell(poor, 1), cell(good), "ATE") is None
    found = answers([(cell(good, 1), cell(poor))], "ATE", 0.05)["new_runs"]
    assert np.isnan(found["with_failures"]["low"])  # infinite as soon as a run fails


def test_one_more_failure_does_not_change_who_is_ahead():
    """Runs elsewhere tell how often a system fails: the more there are, the less is feared."""
    good, poor = [0.80, 0.81, 0.82], [0.60, 0.61, 0.62]
    pair = cell(good), cell(poor)

    def better(*runs):
        return of_pairs.answers([pair], "TAS", 0.05, runs)["new_runs"]

    alone, more = Failures(0, 3), Failures(0, 9)
    assert better(alone, alone)["better"] is None  # 0.81 with a fourth that fails: 0.6075
    assert better(more, alone)["better"] == "a"
    assert better(Failures(2, 9), more)["better"] is None
    assert better(alone, alone)["needed"] == 4
    assert better(more, more)["needed"] == 2
    assert better(Failures(4, 9), more)["needed"] is None
    assert answers([tuple(pair)], "half_distance", 0.05)["new_runs"]["better"] == "b"


def test_of_several_sequences_one_more_failure_is_one_among_all_runs():
    """The mean is 0.66 x 6 / 7 then; it takes 7 runs on each of two to be above 0.61."""
    pair = cell([0.65, 0.66, 0.67]), cell([0.60, 0.61, 0.62])
    found = answers([pair, pair], "TAS", 0.05)["new_runs"]
    assert (found["low"] > 0, found["better"], found["needed"]) == (True, None, 7)
    elsewhere = [Failures(0, 15), Failures(0, 6)]
    found = of_pairs.answers([pair, pair], "TAS", 0.05, elsewhere)["new_runs"]
    assert found["better"] == "a"


@pytest.mark.parametrize(("of", "better"), [(1, None), (2, "a")])
def test_a_mean_that_one_more_failure_makes_equal_is_not_ahead(of, better):
    """From 1 to 1/2, or to 2/3."""
    runs = [Failures(0, of), Failures(0, 2)]
    pair = cell([1.0, 1.0]), cell([0.5, 0.5])
    assert of_pairs.answers([pair], "TAS", 0.05, runs)["new_runs"]["better"] == better


def test_sequences_on_which_one_of_two_never_succeeds_tell_no_difference_of_scores():
    pairs = [(cell([0.75]), cell([0.5])), (cell([0.875]), cell([], 2)), (cell([], 1), cell([0.5]))]
    found = answers(pairs, "PAS", 0.05)["new_sequences"]
    assert np.isnan(entry_of(found)).all()
    lead = (0.75 + 0.875 - 0.5 - 0.5) / 3
    assert found["with_failures"]["difference"] == pytest.approx(lead)
    found = answers([*pairs, (cell([0.625]), cell([0.25]))], "PAS", 0.05)["new_sequences"]
    assert found["difference"] == pytest.approx((0.25 + 0.375) / 2)


def test_errors_and_failures_that_contradict_each_other_give_no_order():
    small, large = [0.1, 0.11, 0.12] * 4, [0.4, 0.41, 0.42] * 4
    found = answers([(cell(small, 12), cell(large * 2))], "ATE", 0.05)["new_runs"]
    assert found["failing"]["low"] > 0
    assert found["high"] < 0
    assert found["better"] is None
    found = answers([(cell(large, 12), cell(large * 2))], "ATE", 0.05)["new_runs"]
    assert found["better"] == "b"


def outcome(seed, sigma, *, error="drift", n=60):
    """Return a run of a system on a tower; each camera is lost one time in twenty."""
    rng = np.random.default_rng([*seed, int(100 * sigma)])
    scene = make_scene(
        rng,
        geometry="helix",
        error=error,
        n_cameras=n,
        n_outliers=int(rng.binomial(n, 0.05)),
        sigma_t=sigma,
        sigma_r_deg=10 * sigma,
    )
    result = pas(scene.gt_poses, scene.est_poses, unit=1.0, registration="refined")
    scores = {"TAS": result.tas.score, "RAS": result.ras.score, "PAS": result.score}
    return Outcome(scores, n=n, n_rows=n, rows=np.arange(n))


@pytest.fixture
def coverage(monkeypatch):
    """(draws, truth by metric, sequence) -> by metric, how often the intervals of all pairs hold.

    No other metrics are summarised, since that takes most of the time.
    """

    def coverage(draws, truth, sequence):
        monkeypatch.setattr("alignscores.comparison.summary.COLUMNS", tuple(truth))
        held = {name: [] for name in truth}
        for runs in draws:
            comparisons = summarise(runs, [], FORMATS["tum"]).comparisons
            for name, means in truth.items():
                held[name].append(
                    all(
                        found["low"] <= means[found["a"]] - means[found["b"]] <= found["high"]
                        for found in comparisons
                        if (found["sequence"], found["metric"]) == (sequence, name)
                    )
                )
        return {name: np.mean(each) for name, each in held.items()}

    return coverage


def means(outcomes, metric):
    return {
        name: np.mean([outcome.scores[metric] for outcome in several])
        for name, several in outcomes.items()
    }


def test_one_run_each_has_no_rank(pool):
    """However far apart: their errors drift, and nothing tells how another run would."""
    for index in range(0, 60, 3):
        runs = [(Run("q", name, "1", "file"), several[index]) for name, several in pool.items()]
        found = summarise(runs, [], FORMATS["tum"])
        assert not any(pair["distinguishable"] for pair in found.comparisons)
        assert {entry["rank"]["PAS"] for entry in found.in_order()} == {None}
        assert all(np.isnan(pair["low"]) for pair in found.comparisons)


def test_systems_stand_in_the_order_of_their_means():
    scores = {"c": 0.5, "b": 0.9, "a": 0.5}
    outcomes = {
        name: Outcome(dict.fromkeys(("TAS", "RAS", "PAS"), of)) for name, of in scores.items()
    }
    runs = [(Run("q", name, "1", "file"), outcome) for name, outcome in outcomes.items()]
    assert summarise(runs, [], FORMATS["tum"]).systems == ["b", "a", "c"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("systems", "n_sequences", "n_runs"),
    [("ab", 1, 3), ("ab", 1, 10), ("abcd", 1, 5), ("ab", 5, 1), ("abcd", 5, 1), ("ab", 5, 3)],
)
def test_several_runs_or_sequences_nominal_95_percent_holds(
    systems, n_sequences, n_runs, pool, coverage
):
    outcomes = {name: pool[name] for name in systems}
    rng = np.random.default_rng(2)
    draws = (
        [
            (Run(f"q{sequence}", name, str(run), "file"), several[rng.integers(len(several))])
            for name, several in outcomes.items()
            for sequence in range(n_sequences)
            for run in range(n_runs)
        ]
        for _ in range(400)
    )
    at = "q0" if n_sequences == 1 else None
    found = coverage(draws, {"PAS": means(outcomes, "PAS")}, at)
    assert 0.93 <= found["PAS"] <= 0.97


@pytest.fixture(scope="module")
def pool():
    """Runs with drift, which are drawn from: their mean is the truth."""
    return {
        name: [outcome([3, index], sigma) for index in range(60)]
        for name, sigma in (("a", 0.2), ("b", 0.3), ("c", 0.4), ("d", 0.6))
    }
