"""PAS: the weighted mean of the TAS of the positions and the RAS of the rotations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, pas, ras, tas


def compose(rotations, positions):
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3] = rotations
    poses[:, :3, 3] = positions
    return poses


@pytest.fixture(scope="session")
def noisy_poses(noisy_scene, noisy_rotations):
    """(n, outliers, sigma, sigma_deg, seed) -> (n, 4, 4) ground truth and estimate."""

    def make(n, outliers, sigma, sigma_deg, seed):
        gt_positions, est_positions = noisy_scene(n, outliers, sigma, seed)
        gt_rotations, est_rotations = noisy_rotations(n, outliers, sigma_deg, seed)
        return compose(gt_rotations, gt_positions), compose(est_rotations, est_positions)

    return make


@pytest.mark.filterwarnings("ignore::alignscores.AlignmentWarning")
@given(seed=st.integers(0, 10_000), n=st.integers(4, 60), weight=st.floats(0, 1))
def test_weighted_mean_of_its_parts(noisy_poses, seed, n, weight):
    """Both parts are what tas and ras give by themselves; the last row may be left out."""
    gt, est = noisy_poses(n, n // 5, 0.03, 4, seed)
    result = pas(gt, est, rng=seed, weight=weight)
    translation = tas(gt[:, :3, 3], est[:, :3, 3], rng=seed)
    rotation = ras(gt[:, :3, :3], est[:, :3, :3])
    np.testing.assert_array_equal(result.tas.errors, translation.errors)
    np.testing.assert_array_equal(result.ras.errors, rotation.errors)
    assert result.tas.score == translation.score
    assert result.ras.score == rotation.score
    expected = weight * translation.score + (1 - weight) * rotation.score
    assert result.score == pytest.approx(expected, abs=1e-12)
    assert 0 <= result.score <= 1
    assert float(result) == result.score == pas(gt[:, :3], est, rng=seed, weight=weight).score
    assert type(result.score) is float


@given(seed=st.integers(0, 10_000), n=st.integers(4, 60), weight=st.floats(0, 1))
def test_perfect_estimate(noisy_poses, seed, n, weight):
    """Exactly 1, whatever the weight, though the two worlds of its parts are others."""
    gt, est = noisy_poses(n, 0, 0, 0, seed)
    result = pas(gt, est, weight=weight)
    assert result.score == pas(gt, gt, weight=weight).score == 1.0
    assert not np.allclose(result.tas.alignment.rotation, result.ras.alignment, atol=1e-3)


def test_poses_are_camera_to_world(noisy_poses):
    """A change of world multiplies poses from the left and changes nothing; inverses would differ.

    The relative pose of the worlds holds for both parts.
    """
    gt, _ = noisy_poses(30, 0, 0, 0, 0)
    world = np.eye(4)
    world[:3, :3] = Rotation.from_euler("xyz", [0.4, -1, 2]).as_matrix()
    world[:3, 3] = [3, 2, 1]
    result = pas(gt, world @ gt)
    assert result.score == 1.0
    np.testing.assert_allclose(result.ras.alignment, world[:3, :3], atol=1e-12)
    assert result.tas.alignment is not None
    np.testing.assert_allclose(result.tas.alignment.rotation, world[:3, :3], atol=1e-9)
    np.testing.assert_allclose(result.tas.alignment.translation, world[:3, 3], atol=1e-9)
    inverse = np.linalg.inv(gt)
    assert pas(inverse, np.linalg.inv(world @ gt)).score < 0.5


@pytest.mark.parametrize(
    "options",
    [
        {"unit": 0.7},
        {"n_hypotheses": 30},
        {"max_threshold": 3.0},
        {"n_thresholds": 7},
        {"rng": 5},
        {"registration": "refined"},
        {"max_threshold_deg": 30.0},
    ],
)
def test_options_are_passed_on(noisy_poses, options):
    """Each option changes a part of the score as it changes tas or ras."""
    gt, est = noisy_poses(60, 20, 0.05, 4, 0)
    (name,) = options
    default, result = pas(gt, est), pas(gt, est, **options)
    if name != "max_threshold_deg":
        expected = tas(gt[:, :3, 3], est[:, :3, 3], **options)
        assert result.tas.score == expected.score != default.tas.score
        np.testing.assert_array_equal(result.tas.thresholds, expected.thresholds)
    if name in ("max_threshold_deg", "n_thresholds"):
        expected = ras(gt[:, :3, :3], est[:, :3, :3], **options)
        assert result.ras.score == expected.score != default.ras.score
        np.testing.assert_array_equal(result.ras.thresholds, expected.thresholds)


def test_lost_cameras(noisy_poses):
    """A pose that is not finite fails in both parts, its centre (rotation) alone in one of them."""
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
        result = pas(gt, np.full_like(est, np.nan))
    assert result.score == 0
    assert sorted(str(warning.message)[:8] for warning in caught) == ["RAS is 0", "TAS is 0"]


@pytest.mark.parametrize(
    "row", [[0, 0, 0, 2], [0, 0, 1e-3, 1], [1, 2, 3, 1], [0, 0, 0, -1], [0, 0, 0, np.nan]]
)
def test_bad_last_row(noisy_poses, row):
    """A last row that is not (0, 0, 0, 1): a transposed pose, a scale, or garbage."""
    gt, est = noisy_poses(20, 0, 0, 0, 0)
    bad = est.copy()
    bad[7, 3] = row
    with pytest.raises(ValueError, match=r"^gt_poses\[7\]"):
        pas(bad, est)
    if np.isfinite(row).all():
        with pytest.raises(ValueError, match=r"^est_poses\[7\]"):
            pas(gt, bad)
    with pytest.raises(ValueError, match="est_poses"):
        pas(gt, est.transpose(0, 2, 1))
