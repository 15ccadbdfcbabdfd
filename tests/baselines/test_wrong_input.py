"""Poses that are malformed: each baseline names what is wrong with them."""

from typing import Any

import numpy as np
import pytest

from alignscores.arrays import Floats
from baselines import ate, dre, dte, maa, rotation_statistics

GOOD = np.concatenate([np.tile(np.eye(3), (4, 1, 1)), np.arange(12.0).reshape(4, 3, 1)], axis=2)


def broken(row: int, column: int, value: float) -> Floats:
    poses = GOOD.copy()
    poses[row, 1, column] = value
    return poses


@pytest.mark.parametrize("metric", [dte, maa])
@pytest.mark.parametrize(
    ("gt", "est", "message"),
    [
        (broken(2, 3, np.nan), GOOD, r"gt_poses\[2\] is not finite"),
        (GOOD, broken(3, 1, -1.0), r"est_poses\[3\] is not a rotation: its determinant"),
        (GOOD, GOOD[:3], "gt_poses has 4 cameras but est_poses has 3"),
        (GOOD, GOOD[:, :, :3], r"est_poses must have shape \(n, 4, 4\) or \(n, 3, 4\)"),
        (GOOD[:0], GOOD[:0], "gt_poses has no cameras"),
    ],
)
def test_malformed_poses(metric: Any, gt: Floats, est: Floats, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        metric(gt, est)


@pytest.mark.parametrize("metric", [dre, rotation_statistics])
@pytest.mark.parametrize(
    ("gt", "est", "message"),
    [
        (broken(2, 0, np.nan), GOOD, r"gt_rotations\[2\] is not finite"),
        (GOOD, broken(3, 1, np.inf), r"est_rotations\[3\] is not finite"),
        (broken(1, 1, 1.01), GOOD, r"gt_rotations\[1\] is not a rotation: R\^T R"),
        (GOOD, GOOD[:2], "gt_rotations has 4 cameras but est_rotations has 2"),
        (GOOD[0], GOOD[0], r"gt_rotations must have shape \(n, 3, 3\)"),
    ],
)
def test_malformed_rotations(metric: Any, gt: Floats, est: Floats, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        metric(gt[..., :3], est[..., :3])


POSITIONS = GOOD[:, :, 3] ** 2
LAST_INFINITE = np.where(np.arange(4)[:, None] == 3, np.inf, POSITIONS)


@pytest.mark.parametrize(
    ("gt", "est", "message"),
    [
        (POSITIONS, LAST_INFINITE, r"est_positions\[3\] is not finite"),
        (POSITIONS, POSITIONS[:3], "gt_positions has 4 cameras but est_positions has 3"),
        (POSITIONS[:, :2], POSITIONS, r"gt_positions must have shape \(n, 3\), not \(4, 2\)"),
        (np.full((4, 3), 0.1), POSITIONS, "gt_positions has no extent: all its cameras coincide"),
        (POSITIONS, POSITIONS + 1j, "est_positions must hold real numbers"),
    ],
)
def test_malformed_positions(gt: Floats, est: Floats, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ate(gt, est)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"max_threshold_deg": 180.1}, "max_threshold_deg must be at most 180, not 180.1"),
        ({"n_thresholds": 2.5}, "n_thresholds must be a positive whole number"),
        ({"n_thresholds": 10_001}, "max_threshold_deg / n_thresholds must be at least 0.001"),
    ],
)
def test_malformed_options(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        maa(GOOD, GOOD, **options)
    with pytest.raises(ValueError, match="k must be a positive finite number"):
        dte(GOOD, GOOD, k=-1)


def test_the_maa_counts_a_missing_camera_as_failed_and_the_dte_refuses_it() -> None:
    missing = broken(3, 3, np.inf)
    with pytest.raises(ValueError, match=r"est_poses\[3\] is not finite"):
        dte(GOOD, missing)
    assert maa(GOOD, missing) == pytest.approx(0.5)  # 3 of 6 pairs
    with pytest.raises(ValueError, match="mAA needs at least 2 cameras, but gt_poses has 1"):
        maa(GOOD[:1], GOOD[:1])
