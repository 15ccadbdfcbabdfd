"""Names of metrics: any case, arguments, options; functions; unknown ones."""

import numpy as np
import pytest

from alignscores.metrics import METRICS, Metric, header, metric

NAMES = [entry.example or entry.name for entry in METRICS]


@pytest.mark.parametrize("name", NAMES)
def test_every_name_is_found_in_any_case(name):
    for spelling in (name, name.lower(), f" {name.upper()} "):
        assert metric(spelling).name == name
    assert metric(name).worst == (0 if metric(name).larger_is_better else np.inf)
    assert metric(name).sign == (1 if metric(name).larger_is_better else -1)


def test_names_are_those_of_one_metric_each():
    assert len({metric(name) for name in NAMES}) == len(METRICS)
    assert len({entry.syntax for entry in METRICS}) == len(METRICS)


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("auc@30deg:vggt", "auc@30:vggt"),
        ("recall@5cm,5deg:hloc", "recall@0.05m,5:hloc"),
        ("rpe@100cm", "rpe@1m:translation:consecutive:rmse:sim3"),
        ("rpe@1m:rotation:all", "rpe@1m:all:rotation"),
        ("are", "are:sim3:rmse"),
        ("rpg@500mm", "rpg@0.5m:mean:sim3"),
        ("HalfDistance", "half_distance"),
        ("half", "half_distance"),
    ],
)
def test_names_with_the_same_meaning(name, other):
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (20, 1, 1))
    gt[:, :3, 3] = np.cumsum(rng.random((20, 3)), axis=0)
    est = gt.copy()
    est[:, :3, 3] += rng.normal(0, 0.03, (20, 3))
    assert metric(name)(gt, est) == metric(other)(gt, est)


def test_functions_are_metrics():
    def worst_error(gt, est):
        return np.linalg.norm(gt[:, :3, 3] - est[:, :3, 3], axis=1).max()

    poses = np.tile(np.eye(4), (3, 1, 1))
    moved = poses.copy()
    moved[2, 1, 3] = 4
    entry = metric(worst_error)
    assert (entry.name, entry(poses, moved), entry.larger_is_better) == ("worst_error", 4.0, False)
    shares = Metric("shares", lambda gt, est: np.mean(gt == est), "%", True, needs=())
    assert metric(shares) is shares
    assert header(shares, "m") == "shares [%]"
    assert shares(poses, moved) == pytest.approx(8 / 9)


@pytest.mark.parametrize(
    ("name", "close"),
    [
        ("auc@30", "auc@30:vggt"),
        ("auc@30:vgt", "auc@30:vggt"),
        ("auc@0:vggt", "auc@30:vggt"),
        ("auc@2.5:vggt", "auc@30:vggt"),
        ("rpe@1", "rpe@1m"),
        ("rpe@0f", "rpe@1f"),
        ("rpe@1s", "rpe@1f"),
        ("ate:mean:rmse", "ate:rmse"),
        ("ate:rmse:rmse", "ate:rmse"),
        ("rpe@1m:sim3:none", "rpe@1m"),
        ("kiti", "kitti"),
        ("kitti@5m", "kitti"),
        ("recall@5cm:hloc", "recall@5cm,5deg:hloc"),
        ("recall@5cm,5deg:hlok", "recall@5cm,5deg:hloc-sim3"),
    ],
)
def test_unknown_names_are_answered_with_close_ones(name, close):
    with pytest.raises(ValueError, match=f"unknown metric .*; close to it are .*({close})"):
        metric(name)
    with pytest.raises(ValueError, match="unknown metric 'foo'; `alignscores metrics` lists all"):
        metric("foo")
