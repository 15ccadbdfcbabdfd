"""Median-1 ... RMS-2: reference values, the two alignments, invariances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from baselines import dre, rotation_statistics

NAMES = ["Median-1", "Mean-1", "RMS-1", "Median-2", "Mean-2", "RMS-2"]


def turns(*degrees):
    """Rotations about one tilted axis."""
    axis = np.array([2, -1, 2]) / 3
    return Rotation.from_rotvec(np.outer(degrees, axis), degrees=True)


def test_l1_statistics_equal_reference(reference_cases):
    for name, case in reference_cases.items():
        if case.meta["sigma_r_deg"] == 0:  # arc cosine near 1, jitter
            continue
        statistics = rotation_statistics(case["gt_R"], case["est_R"])
        median = np.median(case["l1_err_deg"])
        assert statistics["Median-1"] == pytest.approx(median, abs=1e-9), name
        assert statistics["Mean-1"] == pytest.approx(float(case["l1_mean_deg"]), abs=1e-9), name
        assert statistics["RMS-1"] == pytest.approx(float(case["l1_rms_deg"]), abs=1e-9), name


def test_known_values():
    """About one axis: L1 takes the median angle, L2 the mean angle."""
    gt = Rotation.random(5, rng=np.random.default_rng(0))
    statistics = rotation_statistics(gt, turns(10, 10, 10, 20, 60) * gt)
    assert list(statistics) == NAMES
    assert all(type(value) is float for value in statistics.values())
    expected = {
        "Median-1": 0,
        "Mean-1": (10 + 50) / 5,
        "RMS-1": np.sqrt((10**2 + 50**2) / 5),
        "Median-2": 12,  # mean 22: errors 12, 12, 12, 2, 38
        "Mean-2": (3 * 12 + 2 + 38) / 5,
        "RMS-2": np.sqrt((3 * 12**2 + 2**2 + 38**2) / 5),
    }
    assert statistics == pytest.approx(expected, abs=1e-9)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 30), outliers=st.integers(0, 5))
def test_each_alignment_is_the_better_by_its_norm(scene, seed, n, outliers):
    gt, est = (p[:, :, :3] for p in scene(n, min(outliers, n // 4), 0, 3, seed))
    statistics = rotation_statistics(gt, est)
    assert statistics["RMS-2"] <= statistics["RMS-1"] * (1 + 1e-12)
    assert statistics["Mean-1"] <= statistics["Mean-2"] * 1.02  # 10 steps
    assert dre(gt, est) == pytest.approx((statistics["Mean-1"] + statistics["RMS-1"]) / 2)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 20))
def test_invariances(scene, another_world, seed, n):
    """The world of the estimate and the order of the cameras; L1 up to its 10 steps."""
    gt, est = scene(n, 0, 0, 5, seed)
    moved = another_world(est, seed + 1)
    order = np.random.default_rng(seed).permutation(n)
    statistics = rotation_statistics(gt[:, :, :3], est[:, :, :3])
    in_order = rotation_statistics(gt[order, :, :3], est[order, :, :3])
    assert in_order == pytest.approx(statistics, rel=1e-6, abs=1e-9)
    elsewhere = rotation_statistics(gt[:, :, :3], moved[:, :, :3])
    for name in NAMES[3:]:
        assert elsewhere[name] == pytest.approx(statistics[name], rel=1e-8, abs=1e-9)
    assert elsewhere["Mean-1"] == pytest.approx(statistics["Mean-1"], rel=0.02, abs=1e-9)
