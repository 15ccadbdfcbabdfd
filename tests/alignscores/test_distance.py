"""Distances and angles at which a score is reached: exact steps, the search, and its optimum."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, tas, tas_distance, tas_profile


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
    ("alignment", "score", "least"),
    [("similarity", 0.5, 5), ("similarity", 0.25, 9), ("rigid", 0.5, 3), ("none", 0.25, 1)],
)
def test_cameras_that_any_alignment_fits_have_no_distance(alignment, score, least):
    rng = np.random.default_rng(11)
    for n in range(1, 12):
        gt, est = rng.random((2, n, 3))
        if n < least:
            with pytest.warns(AlignmentWarning, match="of them exactly"):
                distance = tas_distance(gt, est, score, alignment=alignment)
            assert np.isnan(distance)
        else:
            distance = tas_distance(gt, est, score, alignment=alignment)
            assert distance > 0
        if n >= 3:
            profile = tas_profile(gt, est, [distance if n >= least else 1.0], alignment=alignment)
            assert profile.unit_at(score) == pytest.approx(distance, rel=0.01, nan_ok=True)


def test_nothing_to_align():
    gt = np.random.default_rng(6).random((10, 3))
    with pytest.warns(AlignmentWarning, match="cannot be aligned"):
        assert tas_distance(gt, np.full_like(gt, np.nan)) == np.inf
    with pytest.warns(AlignmentWarning):
        assert tas_distance(np.ones_like(gt), gt) == np.inf
