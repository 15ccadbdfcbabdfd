"""PAS: the weighted mean of the TAS of the positions and the RAS of the rotations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, pas, ras, tas


@pytest.fixture(scope="session")
def noisy_poses(noisy_scene, noisy_rotations):
    """(n, outliers, sigma, sigma_deg, seed) -> (n, 4, 4) ground truth and estimate."""

    def make(n, outliers, sigma, sigma_deg, seed):
        poses = np.tile(np.eye(4), (2, n, 1, 1))
        poses[..., :3, 3] = noisy_scene(n, outliers, sigma, seed)
        poses[..., :3, :3] = noisy_rotations(n, outliers, sigma_deg, seed)
        return poses

    return make


OF_TAS = "unit", "n_hypotheses", "max_threshold", "n_thresholds", "rng", "registration"
OF_RAS = "max_threshold_deg", "n_thresholds"


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"unit": 0.7},
        {"n_hypotheses": 30},
        {"max_threshold": 3.0},
        {"n_thresholds": 7},
        {"rng": 5},
        {"registration": "refined"},
        {"max_threshold_deg": 30.0},
    ],
)
@pytest.mark.parametrize("weight", [0, 0.3, 1])
def test_weighted_mean_of_tas_and_ras(noisy_poses, options, weight):
    """With the same options; the last row of a pose may be left out."""
    gt, est = noisy_poses(60, 20, 0.05, 4, 0)
    result = pas(gt[:, :3], est, weight=weight, **options)
    for part, function, cut, names in (
        (result.tas, tas, np.s_[:, :3, 3], OF_TAS),
        (result.ras, ras, np.s_[:, :3, :3], OF_RAS),
    ):
        used = {name: value for name, value in options.items() if name in names}
        expected = function(gt[cut], est[cut], **used)
        np.testing.assert_array_equal(part.errors, expected.errors)
        np.testing.assert_array_equal(part.thresholds, expected.thresholds)
        if used:
            assert part.score != function(gt[cut], est[cut]).score
    expected = weight * result.tas.score + (1 - weight) * result.ras.score
    assert float(result) == result.score == pytest.approx(expected, abs=1e-12)


@given(seed=st.integers(0, 10_000), n=st.integers(4, 60), weight=st.floats(0, 1))
def test_a_perfect_estimate_scores_1(noisy_poses, seed, n, weight):
    """Whatever the weight, though positions and rotations are in different frames here."""
    gt, est = noisy_poses(n, 0, 0, 0, seed)
    result = pas(gt, est, weight=weight)
    assert result.score == 1.0
    assert not np.allclose(result.tas.alignment.rotation, result.ras.alignment, atol=1e-3)


def test_poses_are_camera_to_world(noisy_poses):
    """Another coordinate frame multiplies them from the left; inverted poses score low."""
    gt, _ = noisy_poses(30, 0, 0, 0, 0)
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_euler("xyz", [0.4, -1, 2]).as_matrix()
    frame[:3, 3] = [3, 2, 1]
    result = pas(gt, frame @ gt)
    assert result.score == 1.0
    np.testing.assert_allclose(result.ras.alignment, frame[:3, :3], atol=1e-12)
    np.testing.assert_allclose(result.tas.alignment.rotation, frame[:3, :3], atol=1e-9)
    np.testing.assert_allclose(result.tas.alignment.translation, frame[:3, 3], atol=1e-9)
    assert pas(np.linalg.inv(gt), np.linalg.inv(frame @ gt)).score < 0.5


def test_cameras_that_were_not_estimated_fail(noisy_poses):
    """A pose that is not finite in both scores, a centre (rotation) in one of them."""
    gt, perfect = noisy_poses(20, 0, 0, 0, 0)
    for value in (np.nan, np.inf, -np.inf):
        for rows in (3, 4):  # the last row may be not finite, too
            est = perfect[:, :rows].copy()
            est[:5] = value
            result = pas(gt, est)
            assert (result.score, result.tas.score, result.ras.score) == (0.75, 0.75, 0.75)
    est = perfect.copy()
    est[:4, 1, 3] = np.nan
    est[4:9, 2, 2] = np.inf
    result = pas(gt, est)
    assert (result.tas.score, result.ras.score) == (0.8, 0.75)
    with pytest.warns(AlignmentWarning) as caught:
        assert pas(gt, np.full_like(est, np.nan)).score == 0
    assert sorted(str(warning.message)[:8] for warning in caught) == ["RAS is 0", "TAS is 0"]
