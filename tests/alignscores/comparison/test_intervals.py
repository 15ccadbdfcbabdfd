"""Intervals: closed forms against drawing and against SciPy, and how often they hold."""

import numpy as np
import pytest
from scipy import stats

from alignscores import ScoreProfile, pas, tas, tas_distance
from alignscores.comparison.benchmark import Run
from alignscores.comparison.intervals import (
    Difference,
    margin,
    over_runs,
    over_sequences,
    over_stretches,
    series,
)
from alignscores.comparison.runs import Outcome, _shares, half_terms
from alignscores.comparison.summary import summarise
from alignscores.trajectories.formats import FORMATS
from experiments.scenes import make_scene

RNG = np.random.default_rng(0)


def test_over_runs_is_welch():
    a, b = RNG.normal(0.7, 0.1, 4), RNG.normal(0.5, 0.2, 7)
    found = over_runs(a, b)
    low, high = stats.ttest_ind(a, b, equal_var=False).confidence_interval()
    half = stats.t.ppf(0.975, found.dof) * found.error
    assert (found.value - half, found.value + half) == pytest.approx((low, high))
    assert margin(found, 2) == pytest.approx(half)
    assert margin(over_runs([0.5, 0.5], [0.7, 0.7]), 2) == 0


def test_over_sequences_is_paired():
    a, b = RNG.normal(size=(2, 6))
    low, high = stats.ttest_rel(a, b).confidence_interval()
    found = over_sequences(a - b)
    half = margin(found, 2)
    assert (found.value - half, found.value + half) == pytest.approx((low, high))


def test_all_pairs_hold_together():
    errors = stats.t.rvs(4, size=(100_000, 6), random_state=RNG)  # of the pairs of 4 systems
    held = np.abs(errors).max(axis=1) <= margin(Difference(0.0, 1.0, 4), 4)
    assert held.mean() == pytest.approx(0.95, abs=0.003)


def test_the_variance_of_blocks_is_that_of_drawing_them():
    values = np.cumsum(RNG.normal(size=100))
    starts = RNG.integers(100, size=(20_000, 10))
    drawn = values[(starts[..., None] + np.arange(10)) % 100].mean(axis=(1, 2))
    error = over_stretches(0.0, values - values.mean(), ordered=True).error
    assert error * np.sqrt(1 - 10 / 100) == pytest.approx(drawn.std(), rel=0.02)
    unordered = over_stretches(0.0, values, ordered=False)
    assert unordered.error == pytest.approx(stats.sem(values))
    assert over_stretches(0.0, values[:19], ordered=True) is None


def test_a_series_tells_how_a_mean_changes():
    places, scores = RNG.random((2, 500))
    found = series(places, scores, 10)
    assert found.sum() == pytest.approx(0)
    kept = places >= 0.1  # without the first of ten parts
    assert scores[kept].mean() - scores.mean() == pytest.approx(-found[0] / 10, rel=0.2)


def outcome(seed, sigma, *, error="gaussian", n=60, half_score=False):
    """Return a run of a system on a tower; each camera is lost one time in twenty.

    The half-score distance takes several times as long as the scores.
    """
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
    terms = np.zeros(n)
    if half_score:
        positions = scene.gt_poses[:, :3, 3], scene.est_poses[:, :3, 3]
        half = tas_distance(*positions)
        terms = half_terms(tas(*positions, unit=half, registration="refined").errors, half)
        scores["half_distance"] = half
    return Outcome(
        scores,
        n=n,
        distance_terms=terms,
        n_rows=n,
        rows=np.arange(n),
        position_scores=_shares(result.tas.errors, result.tas.thresholds),
        rotation_scores=_shares(result.ras.errors, result.ras.thresholds),
    )


@pytest.fixture
def coverage(monkeypatch):
    """(draws, truth by metric, sequence) -> by metric, how often the intervals of all pairs hold.

    No other metrics are summarised, since that takes most of the time.
    """

    def coverage(draws, truth, sequence):
        monkeypatch.setattr("alignscores.comparison.summary.COLUMNS", tuple(truth))
        held = {name: [] for name in truth}
        for runs in draws:
            comparisons = summarise(runs, [], weight=0.5, form=FORMATS["tum"]).comparisons
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


@pytest.mark.parametrize(
    ("error", "count", "low", "high"),
    # Where all cameras err together there is one draw of the error: nothing tells how it varies.
    [("gaussian", 300, 0.93, 0.97), ("student_t", 300, 0.93, 0.97), ("bias", 100, 0, 0.8)],
)
def test_one_run_each_nominal_95_percent_holds(error, count, low, high, coverage):
    half_score = error != "bias"
    outcomes = {
        name: [outcome([1, i], sigma, error=error, half_score=half_score) for i in range(count)]
        for name, sigma in (("a", 0.2), ("b", 0.3))
    }
    draws = (
        [(Run("q", name, "1", "file"), several[index]) for name, several in outcomes.items()]
        for index in range(count)
    )
    names = ("PAS", "half_distance") if half_score else ("PAS",)
    found = coverage(draws, {name: means(outcomes, name) for name in names}, "q")
    assert all(low <= share <= high for share in found.values())


@pytest.mark.parametrize(
    ("systems", "n_sequences", "n_runs"),
    [("ab", 1, 3), ("ab", 1, 10), ("abcd", 1, 5), ("ab", 5, 1), ("abcd", 5, 1)],
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
        name: [outcome([3, index], sigma, error="drift") for index in range(60)]
        for name, sigma in (("a", 0.2), ("b", 0.3), ("c", 0.4), ("d", 0.6))
    }


def test_half_terms_tell_how_the_half_score_unit_changes():
    errors = RNG.exponential(size=2000)
    half = half_of(errors)
    terms = half_terms(errors, half)
    assert terms.mean() == pytest.approx(0, abs=0.02 * half)
    kept = np.arange(2000) >= 100
    change = half_of(errors[kept]) - half
    assert change == pytest.approx(terms[kept].mean() - terms.mean(), abs=2e-3)
    assert not half_terms(errors, np.inf).any()
    assert not half_terms(np.zeros(5), 1e-300).any()


def half_of(errors):
    return ScoreProfile(np.array([1.0]), np.sort(errors)[None], 100).half
