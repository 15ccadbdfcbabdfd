"""Outliers are as many, and as wrong, as stated; what they do to alignments is a fact."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

from experiments.metrics import METRICS, evaluate
from experiments.scenes import PATHS, make_scene
from experiments.scenes.outliers import CLUSTER_SCALES, OUTLIERS


def outliers(pattern, count, *, seed=0, geometry="car", n=100, side=10.0):
    """Return rotations and positions with outliers, and those without."""
    rng = np.random.default_rng(seed)
    gt_rotations, gt_positions = PATHS[geometry](rng, n, 1.0)
    rotations, positions = gt_rotations.copy(), gt_positions.copy()
    OUTLIERS[pattern](rng, rotations, positions, count, side)
    return rotations, positions, gt_rotations, gt_positions


def changed(now, before):
    """Return the cameras with other values; NaN is other."""
    return np.flatnonzero((now != before).reshape(len(now), -1).any(axis=1))


@pytest.mark.parametrize("pattern", OUTLIERS)
@pytest.mark.parametrize("count", [0, 1, 17, 60])
def test_so_many_cameras_are_outliers_and_the_others_are_untouched(pattern, count):
    # A random walk: no last motion leads to the next true camera.
    rotations, positions, gt_rotations, gt_positions = outliers(
        pattern, count, geometry="random_walk"
    )
    np.testing.assert_array_equal(
        changed(rotations, gt_rotations), changed(positions, gt_positions)
    )
    assert len(changed(positions, gt_positions)) == count
    again = outliers(pattern, count, geometry="random_walk")
    np.testing.assert_array_equal(again[0], rotations)
    np.testing.assert_array_equal(again[1], positions)


@pytest.mark.parametrize("side", [1.0, 10.0, 1000.0])
def test_uniform_outliers_fill_a_cube_of_the_side_asked_for(side):
    _, positions, _, gt = outliers("uniform", 1500, n=2000, side=side)
    for axis in positions[changed(positions, gt)].T:
        assert stats.kstest(axis, stats.uniform(-side / 2, side).cdf).pvalue > 1e-3


def test_a_cluster_is_consecutive_and_moved_by_one_similarity():
    scales, firsts, centres, turns = [], [], [], []
    for seed in range(300):
        rotations, positions, gt_rotations, gt = outliers("cluster", 30, seed=seed, side=6.0)
        part = changed(positions, gt)
        np.testing.assert_array_equal(np.diff(part), 1)
        between = rotations[part] @ gt_rotations[part].transpose(0, 2, 1)
        np.testing.assert_allclose(between, np.tile(between[0], (30, 1, 1)), atol=1e-12)
        local, gt_local = (p[part] - p[part].mean(axis=0) for p in (positions, gt))
        scale = np.linalg.norm(local) / np.linalg.norm(gt_local)
        np.testing.assert_allclose(local, scale * gt_local @ between[0].T, atol=1e-9)
        scales.append(scale)
        firsts.append(part[0])
        turns.append(between[0])
        centres.append(positions[part].mean(axis=0))
    low, high = np.log(CLUSTER_SCALES)
    assert stats.kstest(np.log(scales), stats.uniform(low, high - low).cdf).pvalue > 1e-3
    assert stats.kstest(np.ravel(centres), stats.uniform(-3, 6).cdf).pvalue > 1e-3
    assert (min(firsts), max(firsts)) == (0, 70)
    assert stats.kstest(firsts, stats.uniform(-0.5, 71).cdf).pvalue > 1e-3
    for column in np.array(turns)[:, :, :2].reshape(-1, 6).T:  # a uniform rotation's entries
        assert stats.kstest(column, stats.uniform(-1, 2).cdf).pvalue > 1e-3


@pytest.mark.parametrize("pattern", ["frozen", "diverging"])
def test_a_lost_track_goes_on_from_what_was_estimated(pattern):
    """The noise of the last pose, or of the last motion, is in all that follow it."""
    rng = np.random.default_rng(0)
    noisy = {"geometry": "car", "n_cameras": 60, "sigma_t": 0.2, "sigma_r_deg": 5.0}
    scene = make_scene(rng, **noisy, outliers=pattern, n_outliers=20)
    whole = make_scene(np.random.default_rng(0), **noisy, outliers=pattern, n_outliers=0)
    np.testing.assert_array_equal(scene.est_poses[:40], whole.est_poses[:40])
    tracked = list(zip(scene.est_rotations[37:], scene.est_positions[37:], strict=True))
    motions = [
        np.column_stack([before.T @ after, before.T @ (there - here)])
        for (before, here), (after, there) in pairwise(tracked)
    ]
    expected = motions[1] if pattern == "diverging" else np.eye(3, 4)
    np.testing.assert_allclose(motions[2:], np.tile(expected, (20, 1, 1)), atol=1e-9)


SCENE = {"geometry": "cube", "n_cameras": 100, "sigma_t": 0.03, "sigma_r_deg": 3.0}


def evaluated(scene):
    return evaluate(scene, METRICS, np.random.SeedSequence(0))


def test_missing_cameras_fail_in_the_scores_and_are_left_out_of_the_other_metrics():
    scene = make_scene(np.random.default_rng(0), **SCENE, outliers="missing", n_outliers=40)
    values = evaluated(scene)
    assert np.isfinite(list(values.values())).all()

    rest = evaluated(scene.estimated)
    assert len(scene.estimated.gt_positions) == 60
    left_out = ("ATE", "DTE", "DRE", "Median-1", "RMS-2")
    assert {name: values[name] for name in left_out} == {name: rest[name] for name in left_out}
    assert values["RAS"] == pytest.approx(0.6 * rest["RAS"], abs=1e-12)
    assert values["TAS"] == pytest.approx(0.6 * rest["TAS"], abs=0.1)  # another registration
    pairs = 60 * 59 / (100 * 99)
    assert values["mAA"] == pytest.approx(pairs * rest["mAA"], abs=1e-12)
