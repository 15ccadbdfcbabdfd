"""The least-squares similarity: its defining property, and clouds without full rank."""

import math

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import Similarity
from alignscores.similarity import least_squares_rmse

SEEDS = st.integers(0, 10_000)
SHAPES = ["cube", "axis", "oblique line", "plane", "oblique plane", "helix", "clusters"]


def cost(alignment, gt, est):
    return float(np.sum(alignment.position_errors(gt, est) ** 2))


def assert_proper(alignment):
    assert alignment.scale > 0
    np.testing.assert_allclose(alignment.rotation @ alignment.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(alignment.rotation) == pytest.approx(1)


@pytest.mark.parametrize("n", [2, 3, 4, 100])
@pytest.mark.parametrize("shape", SHAPES)
def test_exact_clouds(cloud, another_world, shape, n):
    """No error is left, at any rank, position and scale."""
    for seed in range(3):
        for scale, offset in ((2.5, 10.0), (1e-9, 0.0), (1e9, 1e4)):
            gt = cloud(shape, n, seed)
            est = another_world(gt, seed, scale=scale, offset=offset)
            alignment = Similarity.fit(gt, est)
            assert_proper(alignment)
            assert alignment.scale == pytest.approx(scale, rel=1e-9)
            bound = 1e-9 * max(1, offset) * n
            assert alignment.position_errors(gt, est).max() < bound
            assert least_squares_rmse(gt, est) < bound


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_smallest_sum_of_squares(noisy_scene, seed, mirrored):
    """No better similarity is found by a general minimiser from many rotations.

    In a mirrored estimate the best orthogonal matrix is a reflection, which does not count.
    """
    gt, est = noisy_scene(12, 3, 0.1, seed)
    rng = np.random.default_rng(seed)
    if mirrored:
        est[:, 0] *= -1
    alignment = Similarity.fit(gt, est)
    assert_proper(alignment)

    def objective(x):
        rotation = Rotation.from_rotvec(x[1:4]).as_matrix()
        residuals = math.exp(x[0]) * est @ rotation + x[4:] - gt
        return float(np.sum(residuals**2))

    starts = [np.r_[-math.log(2.5), Rotation.random(rng=rng).as_rotvec(), 0, 0, 0] for _ in "ab"]
    lowest = min(scipy.optimize.minimize(objective, start).fun for start in starts)
    assert cost(alignment, gt, est) == pytest.approx(lowest, rel=1e-6)
    assert 12 * least_squares_rmse(gt, est) ** 2 == pytest.approx(lowest, rel=1e-6)


@pytest.mark.parametrize("which", ["gt", "est", "both"])
def test_coincident_positions(cloud, which):
    """No scale: an error."""
    gt, est = cloud("cube", 20, 0), cloud("cube", 20, 1)
    for array in {"gt": [gt], "est": [est], "both": [gt, est]}[which]:
        array[:] = 0.1
    for function in (Similarity.fit, least_squares_rmse):
        with pytest.raises(ValueError, match="coincide"):
            function(gt, est)


@given(seed=SEEDS, n=st.integers(2, 20))
def test_cameras_on_a_line_rotate_no_more_than_they_must(seed, n):
    """The spin about the line is free: rounding does not choose it, whatever the order of axes."""
    rng = np.random.default_rng(seed)
    positions, (gt_axis, est_axis) = rng.normal(size=(n, 1)), rng.normal(size=(2, 3))
    for other_axis in (est_axis, -gt_axis):
        gt, est = (positions * axis + rng.normal(size=3) for axis in (gt_axis, other_axis))
        rotation = Similarity.fit(gt, est).rotation
        a, b = (axis / np.linalg.norm(axis) for axis in (gt_axis, other_axis))
        angle = math.atan2(np.linalg.norm(np.cross(a, b)), a @ b)
        assert Rotation.from_matrix(rotation).magnitude() == pytest.approx(angle, abs=1e-7)
        np.testing.assert_allclose(rotation @ a, b, atol=1e-9)
