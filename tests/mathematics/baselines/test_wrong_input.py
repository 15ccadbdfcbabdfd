"""Wrong input: each baseline names what is wrong; the library's tests have the full table."""

import numpy as np
import pytest

from baselines import ate, dre, dte, maa, rotation_statistics

POSES = np.concatenate([np.tile(np.eye(3), (4, 1, 1)), np.arange(12.0).reshape(4, 3, 1)], axis=2)
POSITIONS = POSES[:, :, 3] ** 2
INPUT = {ate: POSITIONS, dte: POSES, maa: POSES}


def changed(poses, row, column, value):
    poses = poses.copy()
    poses[row, 1, column] = value
    return poses


@pytest.mark.parametrize("metric", [ate, dte, dre, rotation_statistics, maa])
def test_wrong_arrays(metric):
    good = INPUT.get(metric, POSES[:, :, :3])
    with pytest.raises(ValueError, match=r"has 4 cameras but est_\w+ has 3"):
        metric(good, good[:3])
    with pytest.raises(ValueError, match=r"must have shape \(n, "):
        metric(good[0], good)
    not_finite = np.where(np.arange(good.size).reshape(good.shape) < good.size - 1, good, np.inf)
    with pytest.raises(ValueError, match=r"gt_\w+\[3\] is not finite"):
        metric(not_finite, good)
    if metric is not maa:
        with pytest.raises(ValueError, match=r"est_\w+\[3\] is not finite"):
            metric(good, not_finite)
    if metric is not ate:
        with pytest.raises(ValueError, match=r"est_\w+\[2\] is not a rotation"):
            metric(good, changed(good, 2, 1, -1.0))


@pytest.mark.parametrize(
    ("metric", "options", "message"),
    [
        (maa, {"max_threshold_deg": 180.1}, "max_threshold_deg must be at most 180, not 180.1"),
        (maa, {"n_thresholds": 2.5}, "n_thresholds must be a positive whole number"),
        (maa, {"n_thresholds": 10_001}, "max_threshold_deg / n_thresholds must be at least 0.001"),
        (dte, {"k": -1}, "k must be a positive finite number"),
    ],
)
def test_wrong_options(metric, options, message):
    with pytest.raises(ValueError, match=message):
        metric(POSES, POSES, **options)


def test_too_few_cameras_for_a_value():
    with pytest.raises(ValueError, match="gt_positions has no extent: all its cameras coincide"):
        ate(np.full((4, 3), 0.1), POSITIONS)
    with pytest.raises(ValueError, match="mAA needs at least 2 cameras, but gt_poses has 1"):
        maa(POSES[:1], POSES[:1])
