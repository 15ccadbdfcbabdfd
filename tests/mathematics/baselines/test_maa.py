"""mAA: against a loop over pairs with atan2, options, undefined pairs."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines import maa


def angle_between(a, b):
    """Angle of two vectors in degrees; infinite where one of them vanishes or is not finite."""
    if not (np.isfinite(a).all() and np.isfinite(b).all() and a.any() and b.any()):
        return np.inf
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def rotation_angle(rotation):
    """Angle of a rotation in degrees from its skew part and its trace."""
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0],
                     rotation[1, 0] - rotation[0, 1]])  # fmt: skip
    return float(np.degrees(np.arctan2(np.linalg.norm(skew), np.trace(rotation) - 1)))


def pair_errors(gt, est, *, fold_sign=False):
    """(pairs, 2) angles of relative rotations and directions, as seen by the first camera."""
    errors = []
    for i, j in combinations(range(len(gt)), 2):
        rotations, directions = [], []
        for poses in (gt, est):
            inverse = poses[i, :3, :3].T
            rotations.append(inverse @ poses[j, :3, :3])
            directions.append(inverse @ (poses[j, :3, 3] - poses[i, :3, 3]))
        turn = angle_between(*directions)
        if fold_sign and np.isfinite(turn):
            turn = min(turn, 180 - turn)
        errors.append((rotation_angle(rotations[0].T @ rotations[1]), turn))
    return np.array(errors)


def slow_maa(gt, est, largest=10.0, count=100, *, fold_sign=False):
    worst = pair_errors(gt, est, fold_sign=fold_sign).max(axis=1)
    return float(np.mean([np.mean(worst < largest * k / count) for k in range(1, count + 1)]))


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 12),
    largest=st.sampled_from([0.5, 10.0, 90.0, 180.0]),
    count=st.integers(1, 200),
    fold_sign=st.booleans(),
)
def test_each_option_counts_as_it_is_defined(scene, seed, n, largest, count, fold_sign):
    rng = np.random.default_rng(seed)
    gt, est = scene(n, n // 4, 0.3 * rng.random(), largest * rng.random(), seed)
    options = {"max_threshold_deg": largest, "n_thresholds": count, "fold_sign": fold_sign}
    expected = slow_maa(gt, est, largest, count, fold_sign=fold_sign)
    assert maa(gt, est, **options) == pytest.approx(expected, abs=1e-12)


def test_errors_at_a_threshold_are_not_below_it(poses):
    """Exact right angles and half turns."""
    gt = poses(np.tile(np.eye(3), (2, 1, 1)), [[0, 0, 0], [1, 0, 0]])
    right_angle, opposite = gt.copy(), gt.copy()
    right_angle[1, :, 3] = [0, 1, 0]
    opposite[1, :, 3] = [-1, 0, 0]
    assert maa(gt, right_angle, max_threshold_deg=90, n_thresholds=1) == 0
    assert maa(gt, right_angle, max_threshold_deg=180, n_thresholds=2) == 0.5
    assert maa(gt, opposite, max_threshold_deg=180, n_thresholds=1) == 0
    assert maa(gt, opposite, max_threshold_deg=180, n_thresholds=1, fold_sign=True) == 1


@pytest.mark.parametrize("n", [2, 5, 60, 333])
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-9, 10.0), (1e9, 1e4)])
def test_perfect_estimate_scores_exactly_1(scene, another_world, n, scale, offset):
    gt, _ = scene(n, 0, 0, 0, n)
    est = another_world(gt, n, scale=scale, offset=offset)
    for fold_sign in (False, True):
        assert maa(gt, est, fold_sign=fold_sign) == 1.0
        assert maa(gt, gt, fold_sign=fold_sign) == 1.0


@pytest.mark.parametrize("which", ["gt", "est", "both"])
def test_coincident_positions_fail(scene, which):
    gt, _ = scene(12, 0, 0, 0, 2)
    est = gt.copy()
    for poses in {"gt": [gt], "est": [est], "both": [gt, est]}[which]:
        poses[[3, 7, 11], :, 3] = poses[3, :, 3]
    # Moving cameras also spoils other pairs where the other side does not move along.
    expected = slow_maa(gt, est)
    assert maa(gt, est) == pytest.approx(expected, abs=1e-12)
    assert maa(gt, est, max_threshold_deg=180, fold_sign=True) <= (66 - 3) / 66
    if which == "both":
        assert maa(gt, est) == (66 - 3) / 66


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", [0, 3])
def test_pairs_of_cameras_that_were_not_estimated_fail(scene, value, column):
    gt, _ = scene(10, 0, 0, 0, 3)
    est = gt.copy()
    est[[0, 6], 1, column] = value
    assert maa(gt, est) == 28 / 45  # pairs among the 8 others
    noisy_gt, noisy = scene(10, 0, 0.03, 3, 4)
    share = slow_maa(noisy_gt[1:], noisy[1:])
    noisy[0, 1, column] = value
    assert maa(noisy_gt, noisy) == pytest.approx(share * 36 / 45, abs=1e-12)


@pytest.mark.parametrize("fold_sign", [False, True])
def test_pooled_angles_count_separately(scene, fold_sign):
    """Where two cameras coincide, only the direction of their pair is missing."""
    gt, est = scene(12, 0, 0.05, 3.0, 0)
    est[1, :3, 3] = est[0, :3, 3]
    errors = pair_errors(gt, est, fold_sign=fold_sign)
    assert np.isinf(errors).sum() == 1
    expected = np.mean([(errors < k / 10).mean() for k in range(1, 101)])
    pooled = maa(gt, est, pooled=True, fold_sign=fold_sign)
    assert pooled == pytest.approx(expected, abs=1e-12)
    assert pooled > maa(gt, est, fold_sign=fold_sign)
    assert maa(gt, gt, pooled=True) == 1
