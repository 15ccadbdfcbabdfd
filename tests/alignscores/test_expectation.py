"""The expected TAS against integrals, simulations of errors, and scores of simulated estimates."""

from typing import Any

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from scipy.integrate import quad

from alignscores import ExpectedScore, expected_tas, runs_needed, tas

Floats = NDArray[np.float64]
MAXWELL, GAMMA = scipy.stats.maxwell(), scipy.stats.gamma(3)  # noise in x, y and z; longer tails
LARGE = 10**9  # cameras: the fit of so many adds nothing


def displacements(errors: Any, n: int, rng: np.random.Generator) -> Floats:
    """Errors of a distribution in directions that are equally likely."""
    ways = rng.normal(size=(n, 3))
    lengths: Floats = errors.rvs(size=(n, 1), random_state=rng)
    return lengths * ways / np.linalg.norm(ways, axis=1, keepdims=True)


@pytest.mark.parametrize("errors", [MAXWELL, GAMMA, scipy.stats.uniform(0, 4)])
@pytest.mark.parametrize("unit", [2.0, 5.0, 30.0])
@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_moments_are_those_of_the_area(errors: Any, unit: float, lost: float) -> None:
    """Of max(0, 1 - e / d), but for the steps, by quadrature of the density."""

    def moment(e: float, k: int) -> float:
        return float((1 - e / unit) ** k * errors.pdf(e))

    moments = [(1 - lost) * quad(moment, 0, unit, args=(k,))[0] for k in (1, 2)]
    found = expected_tas(errors, 1, unit, lost=lost, alignment="none")
    assert found.mean == pytest.approx(moments[0], abs=0.006)  # half a step
    assert found.sd**2 == pytest.approx(moments[1] - moments[0] ** 2, abs=0.006)


def test_moments_are_those_of_simulated_errors() -> None:
    """A tenth of the cameras is lost, by chance; the scores are those of the definition."""
    rng = np.random.default_rng(0)
    errors = MAXWELL.rvs(size=(20_000, 50), random_state=rng)
    errors[rng.random(errors.shape) < 0.1] = np.inf
    scores = np.mean([(errors < 0.03 * k).mean(axis=1) for k in range(1, 101)], axis=0)
    expected = expected_tas(MAXWELL, 50, 3.0, lost=0.1, alignment="none")
    assert scores.mean() == pytest.approx(expected.mean, abs=4 * expected.sd / 141)
    assert scores.std() == pytest.approx(expected.sd, rel=0.02)


@pytest.mark.parametrize("alignment", ["similarity", "rigid", "yaw"])
@pytest.mark.parametrize(
    ("errors", "unit", "lost"), [(MAXWELL, 2, 0.0), (MAXWELL, 3.2, 0.3), (GAMMA, 6, 0.0)]
)
def test_the_fit_adds_what_is_expected(
    alignment: str, errors: Any, unit: float, lost: float
) -> None:
    """The same estimates are scored with and without an alignment, which leaves little scatter."""
    n, sigma = 60, 0.003
    gains = []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        gt = rng.random((n, 3))
        est = gt + sigma * displacements(errors, n, rng)
        est[: round(lost * n)] = np.nan
        settings: dict[str, Any] = {"registration": "refined", "unit": unit * sigma}
        free, fixed = (tas(gt, est, alignment=one, **settings) for one in (alignment, "none"))
        gains.append(free.score - fixed.score)
    free, fixed = (
        expected_tas(errors, n, unit, lost=lost, alignment=one) for one in (alignment, "none")
    )
    scatter = np.std(gains, ddof=1) / np.sqrt(len(gains))
    assert np.mean(gains) == pytest.approx(free.mean - fixed.mean, abs=3 * scatter + 0.002)


@pytest.mark.parametrize("n", [20, 100])
def test_scores_of_estimates_scatter_as_expected(n: int) -> None:
    scores = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        gt = rng.random((n, 3))
        est = gt + 0.01 * displacements(MAXWELL, n, rng)
        scores.append(tas(gt, est, registration="refined", unit=0.05).score)
    expected = expected_tas(MAXWELL, n, 5.0)
    assert np.mean(scores) == pytest.approx(expected.mean, abs=0.003)
    assert np.std(scores, ddof=1) == pytest.approx(expected.sd, rel=0.15)


def test_so_many_runs_tell_two_apart() -> None:
    """In four of five studies by a z-test; the fewer runs, the fewer studies."""
    rng = np.random.default_rng(0)
    first, second = ExpectedScore(0.62, 0.02), ExpectedScore(0.60, 0.03)
    for runs, power in ((int(runs_needed(first, second)), 0.8), (10, 0.42)):
        means = [rng.normal(one.mean, one.sd, (20_000, runs)).mean(1) for one in (first, second)]
        error = np.sqrt((first.sd**2 + second.sd**2) / runs)
        found = np.mean(np.abs(means[0] - means[1]) > 1.959964 * error)
        assert found == pytest.approx(power, abs=0.02)


def test_runs_needed_at_the_ends() -> None:
    score = ExpectedScore(0.5, 0.1)
    assert runs_needed(score, score) == np.inf
    assert runs_needed(score, ExpectedScore(0.9, 0.0)) == 1
    assert runs_needed(ExpectedScore(0.5, 0.0), ExpectedScore(0.9, 0.0)) == 1


def test_few_cameras_within_the_unit_are_refused() -> None:
    with pytest.raises(ValueError, match="of 20 cameras too few are within the unit 1: the fit"):
        expected_tas(MAXWELL, 20)
    with pytest.raises(ValueError, match="too few"):  # the score grows on both sides of the truth
        expected_tas(scipy.stats.uniform(3, 1), LARGE, 3.5)
    assert expected_tas(scipy.stats.uniform(3, 1), 20, 3.5, alignment="none").mean > 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_cameras": 0}, "n_cameras must be a positive whole number, not 0"),
        ({"n_cameras": 2.5}, "n_cameras must be a positive whole number, not 2.5"),
        ({"lost": 1}, "lost must be from 0 to 1, without 1, not 1"),
        ({"lost": np.nan}, "lost must be"),
        ({"unit": 0}, "unit must be a positive finite number, not 0"),
        ({"alignment": "affine"}, "alignment must be one of"),
    ],
)
def test_wrong_arguments(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        expected_tas(**{"errors": MAXWELL, "n_cameras": 100, "unit": 5, **changes})
