"""Costs and fits of the refined registration, against a library's singular values."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Similarity
from alignscores.registration.reweighting import (
    _best_rotations,
    _reweighted_fits,
    truncated_costs,
    weighted_fits,
)

KINDS = ["cube", "axis", "oblique line", "plane", "oblique plane", "helix", "clusters"]


def similar(row):
    return Similarity(row[0], row[1:10].reshape(3, 3), row[10:])


@pytest.mark.parametrize("alignment", ["similarity", "rigid", "yaw"])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("n", [5, 100])
@pytest.mark.parametrize("kind", KINDS)
def test_each_row_of_weights_is_the_least_squares_fit(
    cloud, another_world, kind, n, mirrored, alignment
):
    rng = np.random.default_rng(0)
    gt = cloud(kind, n, 0)
    est = another_world(gt + rng.normal(0, 0.05, gt.shape), 0, offset=1.0)
    if mirrored:
        est[:, 0] *= -1
    weights = rng.random((4, n))
    weights[1, n // 2 + 1 :] = 0
    for row, w in zip(weighted_fits(gt.T, est.T, weights, alignment), weights, strict=True):
        expected = Similarity.fit(gt, est, w, alignment=alignment)
        assert row[0] == pytest.approx(expected.scale, rel=1e-9)
        np.testing.assert_allclose(row[1:10].reshape(3, 3), expected.rotation, atol=1e-9)
        np.testing.assert_allclose(row[10:], expected.translation, atol=1e-9)


@pytest.mark.parametrize("values", [(1, 1, 1), (1, 0.999, 0.99), (1, 1e-3, 1e-6), (1, 0.5, 0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_best_rotations(values, sign):
    """The sweeps suffice, whatever the singular values: the largest correlation is reached."""
    rng = np.random.default_rng(0)
    u, v = (Rotation.random(2000, rng=rng).as_matrix() for _ in range(2))
    matrices = u * (np.array(values) * [1, 1, sign]) @ v
    with np.errstate(all="ignore"):
        rotations = np.moveaxis(_best_rotations(np.moveaxis(matrices, 0, -1)), -1, 0)
    correlations = np.sum(rotations * matrices, axis=(1, 2))
    np.testing.assert_allclose(correlations, np.dot(values, [1, 1, sign]), rtol=1e-14)
    np.testing.assert_allclose(rotations @ rotations.swapaxes(1, 2), [np.eye(3)] * 2000, atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(rotations), 1, atol=1e-14)


@pytest.mark.parametrize("towards", ["another line", "its opposite"])
def test_cameras_on_a_line_rotate_no_more_than_they_must(cloud, towards):
    gt = cloud("oblique line", 9, 0)
    axis = (gt[1] - gt[0]) / np.linalg.norm(gt[1] - gt[0])
    other = -axis if towards == "its opposite" else np.array([0.0, 0.6, 0.8])
    est = np.arange(9.0)[:, None] * other
    rotation = weighted_fits(gt.T, est.T, np.ones((1, 9)))[0, 1:10].reshape(3, 3)
    np.testing.assert_allclose(rotation @ axis, other, atol=1e-9)
    angle = np.arccos(np.clip(axis @ other, -1, 1))
    assert Rotation.from_matrix(rotation).magnitude() == pytest.approx(angle, abs=1e-7)


def test_cost_and_step_by_their_definition(noisy_scene):
    gt, est = noisy_scene(37, 10, 0.02, 0)
    start = Similarity.fit(gt, est, np.r_[np.ones(27), np.zeros(10)])
    row = np.r_[start.scale, start.rotation.ravel(), start.translation][None]
    errors = np.hypot(start.position_errors(gt, est), 0.001)
    cost = truncated_costs(gt.T, est.T, row, 0.04, 0.001)
    assert cost == pytest.approx(np.minimum(errors, 0.04).sum(), rel=1e-12)
    within = errors < 0.04
    assert 5 < np.count_nonzero(within) < 37
    expected = Similarity.fit(gt, est, within / errors)
    fits, costs = _reweighted_fits(gt.T, est.T, row, 0.04, 0.001, "similarity")
    step = similar(fits[0])
    assert costs == pytest.approx(truncated_costs(gt.T, est.T, fits, 0.04, 0.001))
    np.testing.assert_allclose(step.apply(gt), expected.apply(gt), atol=1e-9)


def test_nothing_to_fit():
    """Without weights or extent there is no fit, and an error that is no number counts T."""
    gt = np.arange(12.0).reshape(3, 4)
    for est, weights in ((gt, np.zeros((1, 4))), (np.ones((3, 4)), np.ones((1, 4)))):
        fits = weighted_fits(gt, est, weights)
        assert not 0 < fits[0, 0] < np.inf
        np.testing.assert_array_equal(truncated_costs(gt, est, 0 * fits + np.nan, 0.5, 0.0), 2.0)
