"""The metric classes, used as code written for evo uses evo's own."""

from types import SimpleNamespace

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.metrics import StatisticsType
from evo.core.trajectory import PosePath3D
from evo.tools import file_interface

from alignscores import pas
from alignscores.trajectories import evo
from alignscores.trajectories.evo import PAS, RAS, TAS


@pytest.fixture
def pair(examples):
    reference = file_interface.read_tum_trajectory_file(examples / "tum/reference.txt")
    estimate = file_interface.read_tum_trajectory_file(examples / "tum/estimate.txt")
    return sync.associate_trajectories(reference, estimate)


@pytest.fixture
def expected(pair):
    reference, estimate = pair
    return pas(np.array(reference.poses_se3), np.array(estimate.poses_se3))


@pytest.mark.parametrize(
    "metric", [metrics.APE(), TAS(), RAS(), PAS()], ids=lambda m: type(m).__name__
)
def test_code_written_for_ape(metric, pair):
    reference, estimate = pair
    if isinstance(metric, metrics.APE):  # which knows nothing of NaN
        estimate = reference
    metric.process_data((reference, estimate))
    statistics = metric.get_all_statistics()
    for statistic in StatisticsType:
        assert statistics[statistic.value] == pytest.approx(
            metric.get_statistic(statistic), nan_ok=True
        )
    result = metric.get_result("the reference", "the estimate")
    assert result.info["ref_name"] == "the reference"
    assert result.info["est_name"] == "the estimate"
    assert str(metric) in result.info["title"]
    assert len(result.np_arrays["error_array"]) == reference.num_poses == len(metric.error)
    assert result.stats == pytest.approx(statistics, nan_ok=True)


def test_the_scores_are_those_of_the_functions(pair, expected):
    for metric, result in ((TAS(), expected.tas), (RAS(), expected.ras)):
        metric.process_data(pair)
        assert metric.result.score == result.score
        np.testing.assert_allclose(metric.error, result.errors, rtol=1e-10)
        assert metric.get_all_statistics()[type(metric).__name__] == result.score
        assert np.isinf(metric.get_statistic(StatisticsType.max))  # one was not estimated
        median = metric.get_statistic(StatisticsType.median)
        assert median == pytest.approx(np.median(result.errors))
    metric = PAS()
    metric.process_data(pair)
    assert metric.result.score == expected.score
    statistics = metric.get_all_statistics()
    scores = {"TAS": expected.tas.score, "RAS": expected.ras.score, "PAS": expected.score}
    assert {key: statistics[key] for key in scores} == scores
    assert statistics["d"] == expected.tas.unit


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_the_mean_error_of_pas_is_what_is_missing(pair, weight):
    metric = PAS(weight=weight)
    metric.process_data(pair)
    assert metric.get_statistic(StatisticsType.mean) == pytest.approx(1 - metric.result.score)
    assert metric.get_statistic(StatisticsType.max) == 1.0
    by_hand = [
        sum(error >= threshold for threshold in metric.result.tas.thresholds) / 100
        for error in metric.result.tas.errors
    ]
    if weight == 1:
        np.testing.assert_allclose(metric.error, by_hand)


def test_options_reach_the_functions(pair):
    coarse, fine = TAS(n_thresholds=10, unit=2.0, rng=3), TAS()
    coarse.process_data(pair)
    fine.process_data(pair)
    assert len(coarse.result.thresholds) == 10
    assert coarse.result.unit == 2.0
    assert fine.result.unit != 2.0


def test_arrays_of_pas(pair, expected):
    metric = PAS()
    metric.process_data(pair)
    arrays = metric.get_result().np_arrays
    np.testing.assert_allclose(arrays["position_error_array"], expected.tas.errors, rtol=1e-10)
    np.testing.assert_allclose(arrays["rotation_error_deg_array"], expected.ras.errors, rtol=1e-10)


def test_what_cannot_be_scored(pair):
    reference, estimate = pair
    short = PosePath3D(poses_se3=reference.poses_se3[:5])
    with pytest.raises(metrics.MetricsException, match="has 38 poses, the estimate 5; associate"):
        TAS().process_data((reference, short))
    with pytest.raises(metrics.MetricsException, match="must be a pair"):
        TAS().process_data((reference,))
    few = PosePath3D(poses_se3=reference.poses_se3[:3])
    with pytest.raises(metrics.MetricsException, match="at least 4"):
        PAS().process_data((few, few))
    with pytest.raises(metrics.MetricsException, match=r"gt_rotations\[\d+\] is not finite"):
        RAS().process_data((estimate, reference))


def test_rounded_matrices_of_evo_are_scored(examples):
    """KITTI files have few digits, and evo takes their matrices as they are."""
    reference = file_interface.read_kitti_poses_file(examples / "kitti/reference.txt")
    rounded = PosePath3D(poses_se3=[np.round(pose, 4) for pose in reference.poses_se3])
    metric = RAS()
    metric.process_data((reference, rounded))
    assert metric.result.score == 1.0


def test_an_error_misses_the_thresholds_that_it_is_not_below():
    errors = np.array([0.5, 1.0, 2.5, 4.0, 5.0, np.inf])
    result = SimpleNamespace(thresholds=np.array([1.0, 2, 3, 4]), errors=errors)
    assert evo._missed(result).tolist() == [0, 0.25, 0.5, 1, 1, 1]


def test_before_anything_is_scored_there_is_no_error():
    for metric in (TAS(), RAS(), PAS()):
        assert metric.error.tolist() == []
    assert [str(metric) for metric in (TAS(), RAS(), PAS())] == [
        "TAS (m)",
        "RAS (deg)",
        "PAS (unit-less)",
    ]


def test_matrices_are_corrected_that_are_rotations_up_to_a_hundredth():
    skew = np.eye(4)
    skew[0, 1] = 1e-2  # which is in RᵀR - I, too
    near = np.eye(4)
    near[0, 1] = 0.0099
    found = evo._poses(SimpleNamespace(poses_se3=[skew, near, np.eye(4)]))
    np.testing.assert_array_equal(found[0], skew)
    np.testing.assert_allclose(found[1, :3, :3] @ found[1, :3, :3].T, np.eye(3), atol=1e-12)
    assert found[2].tolist() == np.eye(4).tolist()


def test_matrices_of_whole_numbers_become_floats():
    found = evo._poses(SimpleNamespace(poses_se3=[np.eye(4, dtype=int)]))
    assert found.dtype == float


def test_a_result_becomes_a_metric(pair, expected):
    metric = PAS()
    metric.process_data(pair)
    other = PAS.of(expected)
    assert other.result is expected
    np.testing.assert_array_equal(other.error, metric.error)


def test_a_score_of_nothing_is_no_metric():
    with pytest.raises(TypeError, match="abstract"):
        evo._Score()
