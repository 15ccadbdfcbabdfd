"""RAS: a naive implementation, the perfect score, invariances, lost cameras."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import ras

SEEDS = st.integers(0, 10_000)


# --- a naive implementation ----------------------------------------------------------------------


def chordal(a, b):
    return np.linalg.norm(a - b)


def naive_ras(gt, est):
    """Score, errors and alignment in plain loops, written from the paper."""
    relative = [b @ a.T for a, b in zip(gt, est, strict=True)]
    costs = [sum(min(chordal(a, b), 0.5) for b in relative) for a in relative]
    best = relative[costs.index(min(costs))]
    inliers = [b for b in relative if chordal(best, b) < 0.5]
    u, _, vt = np.linalg.svd(sum(inliers))
    q = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    for _ in range(10):
        logs = [Rotation.from_matrix(r @ q.T).as_rotvec() for r in inliers]
        weights = [1 / np.linalg.norm(v) if np.linalg.norm(v) > 1e-15 else 0.0 for v in logs]
        if sum(weights) == 0:
            break
        step = sum(w * v for w, v in zip(weights, logs, strict=True)) / sum(weights)
        q = Rotation.from_rotvec(step).as_matrix() @ q
        if np.linalg.norm(step) < 0.001:
            break
    chords = [chordal(q @ a, b) for a, b in zip(gt, est, strict=True)]
    errors = [math.degrees(2 * math.asin(min(1, chord / math.sqrt(8)))) for chord in chords]
    score = sum(sum(e < k / 10 for e in errors) for k in range(1, 101)) / (100 * len(gt))
    return score, errors, q


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("n", "outliers", "sigma"),
    [(1, 0, 5), (2, 0, 5), (3, 1, 1), (10, 0, 3), (25, 10, 6), (40, 32, 1), (40, 0, 15)],
)
def test_against_plain_loops(noisy_rotations, n, outliers, sigma, seed):
    gt, est = noisy_rotations(n, outliers, sigma, seed)
    score, errors, alignment = naive_ras(gt, est)
    result = ras(gt, est)
    np.testing.assert_allclose(result.alignment, alignment, atol=1e-9)
    np.testing.assert_allclose(result.errors, errors, rtol=1e-6, atol=1e-6)
    assert result.score == pytest.approx(score, abs=1e-12)


# --- errors and conventions -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("degrees", "share"),
    [(0.05, 1), (0.15, 0.99), (5.05, 0.5), (9.95, 0.01), (10.05, 0), (90, 0), (180, 0)],
)
def test_score_of_one_turned_camera(noisy_rotations, degrees, share):
    """A camera turned by 5.05 degrees counts below 50 of the 100 thresholds, 0.1 to 10 degrees."""
    gt, est = noisy_rotations(50, 0, 0, 0)
    turn = Rotation.from_rotvec(np.array([0.6, 0.0, 0.8]) * degrees, degrees=True).as_matrix()
    est[7] = turn @ est[7]
    result = ras(gt, est)
    expected = np.where(np.arange(50) == 7, degrees, 0)
    np.testing.assert_allclose(result.errors, expected, atol=1e-3)
    assert result.score == pytest.approx((49 + share) / 50, abs=1e-12)


def test_alignment_maps_ground_truth_to_estimate(noisy_rotations):
    """The alignment is the rotation between the worlds: est = alignment @ gt, not its inverse."""
    gt, _ = noisy_rotations(30, 0, 0, 0)
    world = Rotation.from_euler("xyz", [20, -70, 130], degrees=True).as_matrix()
    result = ras(gt, world @ gt)
    np.testing.assert_allclose(result.alignment, world, atol=1e-12)


def test_axes_of_the_cameras_do_not_align(noisy_rotations):
    """A turn of every camera about its own axes is no change of world: not aligned away."""
    gt, _ = noisy_rotations(200, 0, 0, 0)
    turned = gt @ Rotation.from_euler("x", 60, degrees=True).as_matrix()
    assert ras(gt, turned).score < 0.2


# --- invariance -----------------------------------------------------------------------------------


@given(seed=SEEDS, n=st.integers(1, 60))
def test_world_camera_axes_and_order_change_nothing(noisy_rotations, seed, n):
    """Another world, other axes in each camera; a joint permutation permutes the errors."""
    gt, est = noisy_rotations(n, n // 4, 4, seed)
    rng = np.random.default_rng(seed)
    world = Rotation.random(rng=rng).as_matrix()
    axes = Rotation.random(n, rng=rng).as_matrix()
    order = rng.permutation(n)
    expected = ras(gt, est)
    for result in (ras(gt, world @ est), ras(world @ gt, est), ras(gt @ axes, est @ axes)):
        assert result.score == pytest.approx(expected.score, abs=1e-12)
        np.testing.assert_allclose(result.errors, expected.errors, atol=1e-6)
    result = ras(gt[order], est[order])
    assert result.score == pytest.approx(expected.score, abs=1e-12)
    np.testing.assert_allclose(result.errors, expected.errors[order], atol=1e-6)


def test_rotations_of_scipy_are_scored(noisy_rotations):
    """scipy Rotation objects, for either argument or both."""
    gt, est = noisy_rotations(30, 5, 4, 0)
    expected = ras(gt, est).score
    r, q = Rotation.from_matrix(gt), Rotation.from_matrix(est)
    assert ras(r, q).score == ras(r, est).score == ras(gt, q).score == expected


# --- cameras without an estimate ------------------------------------------------------------------


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("lost", [1, 30, 59])
def test_cameras_that_were_not_estimated_fail(noisy_rotations, lost, value):
    """A matrix that is not finite fails, the others are aligned without it: a perfect rest."""
    gt, est = noisy_rotations(60, 0, 0, 0)
    est[:lost, 1, 2] = value  # one entry is enough
    result = ras(gt, est)
    assert result.score == (60 - lost) / 60
    assert np.all(np.isinf(result.errors) == (np.arange(60) < lost))
