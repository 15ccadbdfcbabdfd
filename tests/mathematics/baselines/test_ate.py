"""ATE: against evo where evo answers, against the closed form where it refuses."""

import numpy as np
import pytest
from evo.core.metrics import APE, PoseRelation, StatisticsType
from evo.core.trajectory import PosePath3D
from scipy.spatial.transform import Rotation

from baselines import ate


def evo_ape(gt, est):
    """RMSE as ``evo_ape --align --correct_scale`` gives it."""
    still = np.tile([1.0, 0, 0, 0], (len(gt), 1))
    reference = PosePath3D(positions_xyz=gt, orientations_quat_wxyz=still)
    estimate = PosePath3D(positions_xyz=est.copy(), orientations_quat_wxyz=still)
    estimate.align(reference, correct_scale=True)
    metric = APE(PoseRelation.translation_part)
    metric.process_data((reference, estimate))
    return float(metric.get_statistic(StatisticsType.rmse))


def closed_form(gt, est):
    """RMSE from the singular values of the cross covariance: no rotation, any rank.

    It cancels where the errors are small, so the estimates here are noisy.
    """
    gt, est = gt - gt.mean(axis=0), est - est.mean(axis=0)
    u, d, vt = np.linalg.svd(gt.T @ est)
    d[2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return float(np.sqrt(((gt**2).sum() - d.sum() ** 2 / (est**2).sum()) / len(gt)))


def rms_spread(points):
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum() / len(points)))


@pytest.mark.parametrize("n", [3, 4, 10, 100])
@pytest.mark.parametrize("outliers", [0, 2])
@pytest.mark.parametrize("seed", range(5))
def test_equals_evo(scene, n, outliers, seed):
    gt, est = (poses[:, :, 3] for poses in scene(n, outliers, 0.05, 0, seed))
    assert ate(gt, est) == pytest.approx(evo_ape(gt, est), rel=1e-9)
    assert ate(gt, est) == pytest.approx(closed_form(gt, est), rel=1e-9)


def line(direction, n=30):
    return np.arange(n)[:, None] * np.array(direction) / np.linalg.norm(direction)


@pytest.mark.parametrize("direction", [[1.0, 0, 0], [1.0, 2, 3]])
@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e9])
@pytest.mark.parametrize("which", ["gt", "est", "both"])
def test_collinear_positions(direction, unit, which):
    """A line on either side, or both: the spin about it is free, the RMSE is not."""
    rng = np.random.default_rng(1)
    turn = Rotation.random(rng=rng)
    straight = line(direction)
    noisy = straight + rng.normal(0, 0.3, straight.shape)
    along = straight * (1 + rng.normal(0, 0.1, (len(straight), 1)))
    gt, est = {"gt": (straight, noisy), "est": (noisy, straight), "both": (straight, along)}[which]
    est = 3 * turn.apply(est) + 5
    assert ate(unit * gt, est) == pytest.approx(unit * closed_form(gt, est), rel=1e-7)
    assert ate(gt, unit * est) == pytest.approx(closed_form(gt, est), rel=1e-7)


@pytest.mark.parametrize("gt_unit", [1e-200, 1e-15, 1e-9, 1.0, 1e12])
@pytest.mark.parametrize("est_unit", [1e-200, 1e-9, 1.0, 1e200])
def test_the_error_is_in_units_of_the_ground_truth(scene, gt_unit, est_unit):
    """The error is in units of the ground truth, however small or large they are."""
    gt, est = (poses[:, :, 3] for poses in scene(40, 3, 0.05, 0, 0))
    assert ate(gt_unit * gt, est_unit * est) == pytest.approx(gt_unit * ate(gt, est), rel=1e-9)


def test_mirror_image_is_wrong():
    """No reflection: the mirrored cloud cannot be aligned."""
    gt = np.random.default_rng(3).random((20, 3))
    est = gt * [-1, 1, 1]
    assert ate(gt, est) == pytest.approx(closed_form(gt, est), rel=1e-9)
    assert ate(gt, est) > 0.2 * rms_spread(gt)
    assert ate([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[0, 0, 0], [-1, 0, 0], [-3, 0, 0]]) < 1e-15


@pytest.mark.parametrize("value", [1e15, 1e160, 1.7e308])
def test_cameras_absurdly_far_away(value):
    """One takes all of the alignment, two at opposite ends form a line: no overflow."""
    gt, est = np.random.default_rng(7).random((2, 20, 3))
    est[3] = [value, -value, value]
    assert 0.5 * rms_spread(gt) < ate(gt, est) < rms_spread(gt)
    est[0] = -est[3]
    assert 0.5 * rms_spread(gt) < ate(gt, est) < rms_spread(gt)
