"""DTE and DRE: reference values, invariances, winsorising, degenerate input."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from baselines import dre, dte
from baselines.averages import geometric_medians


def test_dte_equals_reference(reference_cases, poses):
    """All seeds; where the published code jitters the rotation (case_41) to 1e-7 only."""
    for name, case in reference_cases.items():
        gt, est = (poses(case[f"{which}_R"], case[f"{which}_xyz"]) for which in ("gt", "est"))
        tolerance = 1e-7 if name == "case_41" else 1e-9
        np.testing.assert_allclose(dte(gt, est), case["DTE"], rtol=0, atol=tolerance, err_msg=name)


def test_dre_equals_reference(reference_cases):
    for name, case in reference_cases.items():
        error = dre(case["gt_R"], case["est_R"])
        if case.meta["sigma_r_deg"] > 0:
            np.testing.assert_allclose(error, case["DRE_deg"], rtol=0, atol=1e-9, err_msg=name)
        else:  # arc cosine near 1, jitter
            np.testing.assert_allclose(error, case["DRE_deg"], rtol=0, atol=1e-2, err_msg=name)
    assert dre(reference_cases["case_63"]["gt_R"], reference_cases["case_63"]["est_R"]) < 1e-10


def test_known_values(poses):
    """A line with one outlier, whose error is cut at k median distances of 1."""
    still = np.tile(np.eye(3), (5, 1, 1))
    gt = poses(still, [[-2, 0, 0], [-1, 0, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0]])
    for x, k, error in ((100, 5, 1.0), (7, 5, 1.0), (6, 5, 0.8), (4.5, 5, 0.5), (6, 8, 0.5)):
        est = gt.copy()
        est[4, 0, 3] = x
        expected = (error / 5 + np.sqrt(error**2 / 5)) / 2
        assert dte(gt, est, k=k) == pytest.approx(expected, rel=1e-9)
    assert dte(gt, est) == dte(gt, est, k=5)


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(3, 20),
    outliers=st.integers(0, 3),
    log_scale=st.floats(-6, 6),
)
def test_invariances(scene, another_world, seed, n, outliers, log_scale):
    """A similarity of the estimate and the order of the cameras change nothing."""
    gt, est = scene(n, min(outliers, n // 5), 0.05, 5, seed)
    moved = another_world(est, seed + 1, scale=10**log_scale)
    order = np.random.default_rng(seed).permutation(n)
    error = dte(gt, est)
    assert 0 < error <= 1
    assert dte(gt[order], est[order]) == pytest.approx(error, rel=1e-9)
    shifted = est.copy()
    shifted[:, :, 3] = 10**log_scale * (est[:, :, 3] + [3, -2, 1])
    assert dte(gt, shifted) == pytest.approx(error, rel=1e-8)
    # 10 steps from medians taken coordinate by coordinate: the axes of the world matter a little.
    assert dte(gt, moved) == pytest.approx(error, abs=0.05)

    angle = dre(gt[:, :, :3], est[:, :, :3])
    assert 0 < angle <= 180
    assert dre(gt[order, :, :3], est[order, :, :3]) == pytest.approx(angle, rel=1e-9)
    # Of 330 scenes of 3 cameras one differs by 2.5 %, of 5,700 larger ones none by 1.2 %.
    assert dre(gt[:, :, :3], moved[:, :, :3]) == pytest.approx(angle, rel=0.02 if n > 3 else 0.05)


def test_dte_sees_rotations_in_its_alignment_alone(scene):
    """The clouds are turned by the cameras' rotations: the axes of a camera are body-fixed."""
    gt, est = scene(40, 0, 0.0, 0, 3)
    assert dte(gt, est) < 1e-5
    turned = est.copy()
    turned[:, :, :3] = Rotation.from_rotvec([0, 0, 30], degrees=True).as_matrix() @ est[:, :, :3]
    assert dte(gt, turned) > 0.05
    assert dre(gt[:, :, :3], turned[:, :, :3]) < 1e-9


def test_exact_rotations():
    """No NaN and no complex number from an arc cosine: an exact estimate has no error."""
    rng = np.random.default_rng(0)
    for n in (1, 2, 5, 500):
        gt = Rotation.random(n, rng=rng)
        assert dre(gt, gt) < 1e-10
        assert dre(gt, Rotation.random(rng=rng) * gt) < 1e-10
    still = np.tile(np.eye(3), (5, 1, 1))
    assert dre(still, still) == 0
    one_wrong = still.copy()
    one_wrong[0] = Rotation.from_rotvec([0, 0, 90], degrees=True).as_matrix()
    assert dre(still, one_wrong) == pytest.approx((90 / 5 + np.sqrt(90**2 / 5)) / 2, rel=1e-12)


def test_coincident_estimates(poses):
    """Most estimates in one place: these stay at the median, the others are cut."""
    rng = np.random.default_rng(5)
    gt = poses(Rotation.random(9, rng=rng), rng.random((9, 3)))
    est = gt.copy()
    est[:, :, 3] = 0.1
    centred = gt[:, :, 3] - geometric_medians(gt[None, :, :, 3])[0]
    distances = np.linalg.norm(centred, axis=1)
    ratios = np.minimum(distances / (5 * np.median(distances)), 1)
    assert dte(gt, est) == pytest.approx((ratios.mean() + np.sqrt((ratios**2).mean())) / 2)
    est[7:, :, 3] = rng.random((2, 3))
    ratios[7:] = 1
    assert dte(gt, est) == pytest.approx((ratios.mean() + np.sqrt((ratios**2).mean())) / 2)


def test_coincident_ground_truth(poses):
    gt = poses(np.tile(np.eye(3), (9, 1, 1)), np.random.default_rng(6).random((9, 3)))
    gt[:5, :, 3] = 0.3
    with pytest.raises(ValueError, match="DTE has no unit: at least half of the cameras in gt_pos"):
        dte(gt, gt)
    with pytest.raises(ValueError, match="DTE has no unit"):
        dte(gt[:1], gt[:1])
