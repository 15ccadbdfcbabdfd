"""The least-squares similarity: its defining property, weights, and clouds without full rank."""

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
KINDS = ["cube", "axis", "oblique line", "plane", "oblique plane", "helix", "clusters"]


def cost(alignment, gt, est, weights=1.0):
    return float(np.sum(weights * alignment.position_errors(gt, est) ** 2))


def assert_proper(alignment):
    assert alignment.scale > 0
    np.testing.assert_allclose(alignment.rotation @ alignment.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(alignment.rotation) == pytest.approx(1)


@pytest.mark.parametrize("n", [2, 3, 4, 100])
@pytest.mark.parametrize("kind", KINDS)
def test_exact_clouds(cloud, another_world, kind, n):
    """Of any rank, at any place and scale: no error is left."""
    for seed in range(3):
        for scale, offset in ((2.5, 10.0), (1e-9, 0.0), (1e9, 1e4)):
            gt = cloud(kind, n, seed)
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
    weights = rng.random(12)
    if mirrored:
        est[:, 0] *= -1
    alignment = Similarity.fit(gt, est, weights)
    assert_proper(alignment)

    def objective(x):
        rotation = Rotation.from_rotvec(x[1:4]).as_matrix()
        residuals = math.exp(x[0]) * est @ rotation + x[4:] - gt
        return float(np.sum(weights[:, None] * residuals**2))

    starts = [np.r_[-math.log(2.5), Rotation.random(rng=rng).as_rotvec(), 0, 0, 0] for _ in "four"]
    least = min(scipy.optimize.minimize(objective, start).fun for start in starts)
    assert cost(alignment, gt, est, weights) == pytest.approx(least, rel=1e-6)
    rmse = math.sqrt(cost(Similarity.fit(gt, est), gt, est) / 12)
    assert least_squares_rmse(gt, est) == pytest.approx(rmse, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_weights(cloud, another_world, kind):
    """Weight 0 leaves a camera out, whole weights repeat it, and only their ratios count."""
    rng = np.random.default_rng(0)
    gt = cloud(kind, 30, 0)
    est = another_world(gt + rng.normal(0, 0.05, gt.shape), 0)
    est[20:] = [1e200, -1e200, 0]
    times = np.r_[rng.integers(1, 4, 20), np.zeros(10, dtype=int)]
    alignments = [
        Similarity.fit(np.repeat(gt, times, axis=0), np.repeat(est, times, axis=0)),
        *(Similarity.fit(gt, est, factor * times) for factor in (1, 1e300, 1e-300)),
    ]
    errors = [alignment.position_errors(gt[:20], est[:20]) for alignment in alignments]
    for alignment, some in zip(alignments, errors, strict=True):
        assert alignment.scale == pytest.approx(alignments[0].scale, rel=1e-9)
        np.testing.assert_allclose(some, errors[0], atol=1e-9)


@pytest.mark.parametrize("which", ["gt", "est", "both"])
def test_coincident_positions(cloud, which):
    """No scale: an error, whether all cameras coincide or all that count."""
    gt, est = cloud("cube", 20, 0), cloud("cube", 20, 1)
    weights = np.r_[np.zeros(10), np.ones(10)]
    for array in {"gt": [gt], "est": [est], "both": [gt, est]}[which]:
        array[10:] = 7.0
    for arguments in ((gt, est, weights), (gt[10:], est[10:])):
        with pytest.raises(ValueError, match="coincide"):
            Similarity.fit(*arguments)
    with pytest.raises(ValueError, match="coincide"):
        least_squares_rmse(gt[10:], est[10:])


@given(seed=SEEDS, n=st.integers(2, 20))
def test_cameras_on_a_line_rotate_no_more_than_they_must(seed, n):
    """The spin about the line is free: rounding does not choose it, whatever the order of axes."""
    rng = np.random.default_rng(seed)
    places, (gt_axis, est_axis) = rng.normal(size=(n, 1)), rng.normal(size=(2, 3))
    for other_axis in (est_axis, -gt_axis):
        gt, est = (places * axis + rng.normal(size=3) for axis in (gt_axis, other_axis))
        rotation = Similarity.fit(gt, est).rotation
        a, b = (axis / np.linalg.norm(axis) for axis in (gt_axis, other_axis))
        angle = math.atan2(np.linalg.norm(np.cross(a, b)), a @ b)
        assert Rotation.from_matrix(rotation).magnitude() == pytest.approx(angle, abs=1e-7)
        np.testing.assert_allclose(rotation @ a, b, atol=1e-9)
