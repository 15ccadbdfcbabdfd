"""Scores at all thresholds, against the scores at each unit, closed forms, and dense searches."""

import warnings

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import (
    AlignmentWarning,
    ScoreProfile,
    ras,
    ras_profile,
    tas,
    tas_distance,
    tas_profile,
)

SEEDS = st.integers(0, 10_000)


def half_normal_score(ratio):
    """Score of half-normal errors at the unit ``ratio`` sigma: the mean of max(0, 1 - e / u)."""
    return scipy.special.erf(ratio / np.sqrt(2)) + np.sqrt(2 / np.pi) * (
        np.expm1(-(ratio**2) / 2) / ratio
    )


# --- the crossing ---------------------------------------------------------------------------------


@given(
    seed=SEEDS,
    n=st.integers(1, 30),
    n_thresholds=st.integers(1, 100),
    score=st.floats(0.01, 1.0),
)
def test_crossing_is_the_smallest_number_that_reaches_the_score(seed, n, n_thresholds, score):
    rng = np.random.default_rng(seed)
    errors = np.sort(np.where(rng.random(n) < 0.2, np.inf, rng.exponential(size=n)))
    errors[: n // 5] = errors[n // 5]  # ties
    unit = ScoreProfile(np.array([1.0]), errors[None], n_thresholds).unit_at(score)

    def at(u):
        steps = np.arange(1, n_thresholds + 1) / n_thresholds
        return (errors[:, None] < u * steps).mean()

    if np.isinf(unit):
        assert at(1e300) < score
    else:
        assert at(unit) >= score
        assert at(np.nextafter(unit, 0)) < score


# --- against known distributions ------------------------------------------------------------------


@pytest.mark.parametrize("outliers", [0.0, 0.25, 0.45])
def test_half_normal_angles(outliers):
    """The half-score angle of half-normal errors, with a share of outliers, in closed form."""
    rng = np.random.default_rng(0)
    n, sigma = 4000, 1.5
    axes = rng.normal(size=(n, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    angles = np.abs(rng.normal(0, sigma, n))
    gt = Rotation.random(n, rng=rng)
    est = Rotation.from_rotvec(np.radians(angles)[:, None] * axes) * gt
    lost = est.as_matrix()
    lost[: int(outliers * n)] = np.nan
    target = 0.5 / (1 - outliers)
    ratio = scipy.optimize.brentq(lambda a: half_normal_score(a) - target, 0.1, 100)
    profile = ras_profile(gt, lost, n_thresholds=1000)
    assert profile.half == pytest.approx(ratio * sigma, rel=0.05)


# --- against the scores ---------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_with_pcr99_the_scores_are_those_of_tas(noisy_scene, seed):
    """Bit for bit: its alignment does not depend on the unit."""
    gt, est = noisy_scene(80, 20, 0.03, seed)
    units = np.geomspace(0.01, 2, 9)
    profile = tas_profile(gt, est, units, rng=seed, registration="pcr99", n_thresholds=37)
    expected = [tas(gt, est, rng=seed, unit=u, n_thresholds=37).score for u in units]
    np.testing.assert_array_equal(profile.scores, expected)


@pytest.mark.parametrize(("n", "outliers"), [(40, 0), (100, 40), (600, 200), (1500, 300)])
def test_refined_scores_are_no_less_than_those_of_tas(noisy_scene, n, outliers):
    """An alignment from one unit counts at the others; beyond that scores differ by the scatter."""
    gt, est = noisy_scene(n, outliers, 0.03, 0)
    units = np.geomspace(0.02, 0.5, 12)
    scores = tas_profile(gt, est, units).scores
    expected = np.array([tas(gt, est, unit=u, registration="refined").score for u in units])
    assert np.all(scores >= expected - 0.002)
    assert np.all(scores <= expected + 0.02)
    assert np.mean(scores - expected) < 0.004


def test_scores_of_rotations_are_those_of_ras():
    rng = np.random.default_rng(0)
    gt = Rotation.random(30, rng=rng).as_matrix()
    est = Rotation.from_rotvec(rng.normal(0, 0.05, (30, 3))).as_matrix() @ gt
    est[3] = np.nan
    profile = ras_profile(gt, est)
    expected = [ras(gt, est, max_threshold_deg=u).score for u in profile.units]
    np.testing.assert_array_equal(profile.scores, expected)
    assert (profile.units[0], profile.units[-1], len(profile.units)) == (0.01, 180, 64)


@given(seed=SEEDS, n=st.integers(3, 60), share=st.floats(0, 0.6), sigma=st.floats(1e-6, 0.3))
def test_scores_never_fall(noisy_scene, seed, n, share, sigma):
    gt, est = noisy_scene(n, int(share * n), sigma, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        for registration in ("pcr99", "refined"):
            scores = tas_profile(gt, est, registration=registration).scores
            assert np.all(np.diff(scores) >= 0)
            assert 0 <= scores[0] <= scores[-1] <= 1


# --- invariances ----------------------------------------------------------------------------------


@pytest.mark.parametrize("sigma", [1e-7, 0.03])
def test_any_world_scale_and_grid(noisy_scene, another_world, sigma):
    gt, est = noisy_scene(150, 30, sigma, 0)
    half = tas_profile(gt, est).half
    assert tas_profile(gt, another_world(est, 3, scale=0.01)).half == pytest.approx(half, rel=0.003)
    assert tas_profile(1000 * gt + 5, est).half == pytest.approx(1000 * half, rel=0.003)
    for units in ([1e-9], [0.5 * half, 2 * half], [100.0]):
        assert tas_profile(gt, est, units).half == pytest.approx(half, rel=0.003)


# --- hostile input --------------------------------------------------------------------------------


def test_nothing_can_be_aligned():
    gt = np.random.default_rng(0).random((10, 3))
    with pytest.warns(AlignmentWarning, match="cannot be aligned") as caught:
        profile = tas_profile(gt, np.full((10, 3), np.nan))
    assert [warning.filename for warning in caught] == [__file__]
    assert profile.half == np.inf
    assert not profile.scores.any()


def test_ground_truth_without_extent():
    gt = np.ones((5, 3))
    with pytest.raises(ValueError, match="no extent to derive units from"):
        tas_profile(gt, gt)


# --- distances ------------------------------------------------------------------------------------


def noisy(n, lost, sigma, seed):
    rng = np.random.default_rng([seed, n])
    gt = rng.random((n, 3))
    est = 2 * Rotation.random(rng=rng).apply(gt + rng.normal(scale=sigma, size=gt.shape)) + 3
    est[: round(n * lost)] = 10 * rng.random((round(n * lost), 3))
    return gt, est


@pytest.mark.parametrize("score", [0.25, 0.5])
@pytest.mark.parametrize("lost", [0.0, 0.2, 0.4])
@pytest.mark.parametrize("n", [10, 20, 100, 400])
def test_no_smaller_unit_reaches_the_score(n, lost, score):
    """Neither of a dense profile, of any seed, nor with all alignments of both."""
    gt, est = noisy(n, lost, 0.02, 0)
    distance = tas_distance(gt, est, score)
    assert tas(gt, est, unit=distance, registration="refined").score == pytest.approx(
        score, abs=0.004
    )
    units = distance * np.linspace(0.9, 1.02, 25)
    others = [tas_profile(gt, est, units, rng=seed).unit_at(score) for seed in range(3)]
    assert min(others) > (0.995 if n > 20 or score == 0.5 else 0.98) * distance


@pytest.mark.parametrize("alignment", ["rigid", "yaw", "none"])
def test_the_alignment_is_that_which_was_asked_for(alignment):
    gt = np.random.default_rng(1).random((50, 3))
    est = 1.5 * gt
    assert tas_distance(gt, est) < 1e-9
    distance = tas_distance(gt, est, alignment=alignment)
    result = tas(gt, est, unit=distance, registration="refined", alignment=alignment)
    assert 0.01 < distance < 1
    assert result.score == pytest.approx(0.5, abs=0.002)


@pytest.mark.parametrize(("score", "missing"), [(0.5, 21), (0.25, 31), (1.0, 1)])
def test_missing_cameras_bound_the_score(score, missing):
    """With exactly a share 1 - score missing, all others must be below the first threshold."""
    gt, est = noisy(40, 0, 0.02, 4)
    est[:missing] = np.nan
    assert tas_distance(gt, est, score) == np.inf
    est[missing - 1] = est[missing]  # one more, wherever it is
    assert tas_distance(gt, est, score) < np.inf


@pytest.mark.parametrize(
    ("alignment", "score", "n_needed"),
    [("similarity", 0.5, 5), ("similarity", 0.25, 9), ("rigid", 0.5, 3), ("none", 0.25, 1)],
)
def test_cameras_that_any_alignment_fits_have_no_distance(alignment, score, n_needed):
    rng = np.random.default_rng(11)
    for n in range(1, 12):
        gt, est = rng.random((2, n, 3))
        if n < n_needed:
            with pytest.warns(AlignmentWarning, match="of them exactly"):
                distance = tas_distance(gt, est, score, alignment=alignment)
            assert np.isnan(distance)
        else:
            distance = tas_distance(gt, est, score, alignment=alignment)
            assert distance > 0
        if n >= 3:
            profile = tas_profile(
                gt, est, [distance if n >= n_needed else 1.0], alignment=alignment
            )
            assert profile.unit_at(score) == pytest.approx(distance, rel=0.01, nan_ok=True)


def test_a_distance_without_an_alignment():
    gt = np.random.default_rng(6).random((10, 3))
    with pytest.warns(AlignmentWarning, match="cannot be aligned"):
        assert tas_distance(gt, np.full_like(gt, np.nan)) == np.inf
    with pytest.warns(AlignmentWarning):
        assert tas_distance(np.ones_like(gt), gt) == np.inf
