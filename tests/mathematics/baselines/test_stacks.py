"""Scenes in one array have the values of single scenes, bit for bit."""

import numpy as np
import pytest

from baselines import ate, dre, dte, maa, rotation_statistics


@pytest.fixture(scope="module")
def stacks(scene):
    """(2, 3, n, 3, 4) poses of ground truth and estimate."""
    scenes = [scene(12, 2, 0.05, 4.0, seed) for seed in range(6)]
    return tuple(
        np.reshape(poses, (2, 3, 12, 3, 4)) for poses in map(np.stack, zip(*scenes, strict=True))
    )


def medians(gt, est):
    return rotation_statistics(gt, est)["Median-2"]


@pytest.mark.parametrize(
    ("metric", "columns"),
    [
        (ate, 3),
        (dte, slice(4)),
        (maa, slice(4)),
        (dre, slice(3)),
        (medians, slice(3)),
    ],
)
def test_a_stack_of_scenes_has_the_value_of_each(stacks, metric, columns):
    gt, est = (poses[..., columns] for poses in stacks)
    together = metric(gt, est)
    assert together.shape == (2, 3)
    for scene in np.ndindex(2, 3):
        expected = metric(gt[scene], est[scene])
        assert type(expected) is float
        assert together[scene] == expected
    broken = est.copy()
    broken[1, 2, 5, 0] = np.nan
    if metric is not maa:
        with pytest.raises(ValueError, match=r"est_\w+\[1, 2\]\[5\] is not finite"):
            metric(gt, broken)
    with pytest.raises(ValueError, match=r"gt_\w+ has scenes in \(2, 3\), but est_\w+ has scenes"):
        metric(gt, est[0])
    with pytest.raises(ValueError, match="has 12 cameras but"):
        metric(gt, est[:, :, :-1])


def test_pairs_are_counted_in_several_ways_at_once(stacks):
    gt, est = stacks
    values = maa(gt, est, max_threshold_deg=[10, 5, 20], fold_sign=[False, True, True])
    assert values.shape == (2, 3, 3)
    for way, (largest, fold) in enumerate([(10, False), (5, True), (20, True)]):
        expected = maa(gt, est, max_threshold_deg=largest, fold_sign=fold)
        np.testing.assert_array_equal(values[..., way], expected)
