"""Poses that are malformed: each baseline names what is wrong with them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats
from baselines import dre, dte, maa, rotation_statistics

GOOD = np.concatenate([np.tile(np.eye(3), (4, 1, 1)), np.arange(12.0).reshape(4, 3, 1)], axis=2)


def bad_entry(row: int, column: int, value: float) -> Floats:
    broken = GOOD.copy()
    broken[row, 1, column] = value
    return broken


@pytest.mark.parametrize("metric", [dte, maa])
@pytest.mark.parametrize(
    ("gt", "est", "message"),
    [
        (bad_entry(2, 3, np.nan), GOOD, r"gt_poses\[2\] is not finite"),
        (bad_entry(1, 0, np.inf), GOOD, r"gt_poses\[1\] is not finite"),
        (GOOD, bad_entry(3, 1, -1.0), r"est_poses\[3\] is not a rotation: its determinant"),
        (bad_entry(0, 1, 1.1), GOOD, r"gt_poses\[0\] is not a rotation: R\^T R"),
        (GOOD, GOOD[:3], "gt_poses has 4 cameras but est_poses has 3"),
        (GOOD[:, :, :3], GOOD, r"gt_poses must have shape \(n, 4, 4\) or \(n, 3, 4\)"),
        (GOOD, GOOD[:, :, :3], r"est_poses must have shape \(n, 4, 4\) or \(n, 3, 4\)"),
        (GOOD[:0], GOOD[:0], "gt_poses has no cameras"),
    ],
)
def test_malformed_poses(
    metric: Callable[..., object], gt: Floats, est: Floats, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        metric(gt, est)


def test_poses_that_one_of_them_takes() -> None:
    """A camera that was not estimated fails in the mAA, which needs a pair of cameras."""
    missing = bad_entry(3, 3, np.inf)
    with pytest.raises(ValueError, match=r"est_poses\[3\] is not finite"):
        dte(GOOD, missing)
    assert maa(GOOD, missing) == pytest.approx(0.5)  # 3 of 6 pairs
    with pytest.raises(ValueError, match="mAA needs at least 2 cameras, but gt_poses has 1"):
        maa(GOOD[:1], GOOD[:1])


@pytest.mark.parametrize("metric", [dte, maa])
def test_homogeneous_poses(
    metric: Callable[..., object], scene: Callable[..., tuple[Floats, Floats]]
) -> None:
    gt, est = scene(10, 1, 0.1, 5, 0)
    last = np.tile([[[0.0, 0, 0, 1]]], (10, 1, 1))
    full = [np.concatenate([p, last], axis=1) for p in (gt, est)]
    assert metric(*full) == metric(gt, est)


@pytest.mark.parametrize("metric", [dre, rotation_statistics])
@pytest.mark.parametrize(
    ("gt", "est", "message"),
    [
        (bad_entry(2, 0, np.nan), GOOD, r"gt_rotations\[2\] is not finite"),
        (GOOD, bad_entry(3, 1, np.inf), r"est_rotations\[3\] is not finite"),
        (GOOD, bad_entry(1, 1, -1.0), r"est_rotations\[1\] is not a rotation: its determinant"),
        (bad_entry(1, 1, 1.01), GOOD, r"gt_rotations\[1\] is not a rotation: R\^T R"),
        (GOOD, GOOD[:2], "gt_rotations has 4 cameras but est_rotations has 2"),
        (GOOD[0], GOOD[0], r"gt_rotations must have shape \(n, 3, 3\)"),
        (GOOD[:0], GOOD[:0], "gt_rotations has no cameras"),
    ],
)
def test_malformed_rotations(metric: Any, gt: Floats, est: Floats, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        metric(gt[..., :3], est[..., :3])


@pytest.mark.parametrize("metric", [dre, rotation_statistics])
def test_a_single_rotation_is_no_array_of_them(metric: Any) -> None:
    with pytest.raises(ValueError, match=r"gt_rotations must have shape \(n, 3, 3\)"):
        metric(Rotation.identity(), GOOD[..., :3])
