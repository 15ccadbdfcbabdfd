"""What holds for the protocols by name: worlds, missing cameras, bounds, hostile input, memory."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores.protocols import (
    PROTOCOLS,
    NoValueError,
    colmap_relative_auc,
    evo_are,
    evo_rpe,
    hloc_median,
    hloc_recall,
    kitti_relative_error,
    protocol,
    rpg_relative_error,
    vggt_auc,
)

EXAMPLES = {family.example: family for family in PROTOCOLS}
# Whose values do not change when the estimate's world is turned, moved and scaled, or not scaled.
SIM3 = """
    rra@5:vggt rta@5:vggt rta@5:mapanything auc@30:vggt auc@30:mapanything auc@30:da3
    auc@5:colmap recall@50cm,30deg:hloc-sim3
    median:hloc-sim3 median:hloc-sim3:rotation ate:rmse ate:mean are:rmse rpe@1f rpe@1m
    rpe@1m:rotation rpe@1m:scale rpe@1m:all-reference rpe@1m:all rpg@1m rpg@1m:rotation
""".split()  # noqa: SIM905
SE3 = "ate:se3 are:se3 rpe@1f:none rpe@1m:none kitti kitti:rotation rpg@1m:se3"
# To lose any one camera never helps.
FAIL = """
    rra@5:vggt rta@5:vggt auc@30:vggt auc@30:mapanything auc@30:da3 auc@5:colmap
    recall@5cm,5deg:hloc median:hloc median:hloc:rotation
""".split()  # noqa: SIM905


def scene(n=30, sigma=0.03, sigma_deg=2.0, seed=0, outliers=3, step=None):
    """Ground truth, and an estimate in the same world; positions and rotations of each."""
    rng = np.random.default_rng([seed, n])
    positions = rng.random((n, 3)) if step is None else step * rng.random((n, 3)).cumsum(axis=0)
    rotations = Rotation.random(n, rng=rng)
    noise = Rotation.from_rotvec(rng.normal(0, sigma_deg, (n, 3)), degrees=True)
    est_positions = positions + rng.normal(0, sigma, (n, 3))
    est_positions[:outliers] = 3 * rng.random((outliers, 3))
    return positions, rotations.as_matrix(), est_positions, (noise * rotations).as_matrix()


def moved(cameras, seed, scale):
    gt, gt_rotations, est, est_rotations = cameras
    rng = np.random.default_rng(seed)
    turn = Rotation.random(rng=rng).as_matrix()
    est = scale * (est @ turn.T + rng.uniform(-10, 10, 3))
    return gt, gt_rotations, est, turn @ est_rotations


def without(cameras, rows):
    gt, gt_rotations, est, est_rotations = (part.copy() for part in cameras)
    est[rows], est_rotations[rows] = np.nan, np.nan
    return gt, gt_rotations, est, est_rotations


@pytest.mark.parametrize(("names", "scale"), [(SIM3, 3.7), (SE3.split(), 1.0)])
def test_the_world_of_the_estimate_does_not_matter(names, scale):
    cameras = scene(n=60, step=20.0, sigma=0.1)
    near = scene(n=20)
    for name in names:
        metric = protocol(name)
        chosen = cameras if name.startswith("kitti") else near
        value = metric(*chosen)
        assert metric(*moved(chosen, 1, scale)) == pytest.approx(value, rel=1e-9, abs=1e-9), name
        assert value not in (0, 100), name


@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from(FAIL))
def test_a_missing_camera_never_helps(seed, name):
    metric = protocol(name)
    sign = 1 if metric.family.larger_is_better else -1
    cameras = scene(n=8, seed=seed, outliers=2)
    value = metric(*cameras)
    for row in range(8):
        assert sign * metric(*without(cameras, row)) <= sign * value + 1e-9


def test_sums_over_all_frames_and_kitti_refuse_missing_frames():
    for family in (f for f in PROTOCOLS if f.missing == "refused"):
        with pytest.raises(NoValueError, match="frame 2 has no estimate"):
            protocol(family.example)(*without(scene(n=60, step=20.0), 2))


@pytest.mark.parametrize("name", EXAMPLES)
def test_bounds_and_perfect_estimates(name):
    """Scores from 0 to 100 %, all of it for a perfect estimate; errors are 0 there."""
    metric, family = protocol(name), EXAMPLES[name]
    best = 100.0 if family.larger_is_better else 0.0
    metres = 20.0 if family.ordered and not name.startswith("rpe") else 0.5
    gt, gt_rotations, est, _ = cameras = scene(n=60 if metres > 1 else 25, step=metres)
    assert metric(gt, gt_rotations, gt, gt_rotations) == pytest.approx(best, abs=2e-6)
    value = metric(*cameras)
    assert value >= 0
    assert type(value) is float
    assert value <= best if family.larger_is_better else value > 0
    if not family.rotations:
        assert metric(gt, None, est, None) == value
    else:
        with pytest.raises(ValueError, match="needs the rotations"):
            metric(gt, None, est, None)


HOSTILE = {
    "one camera": [part[:1] for part in scene()],
    "two cameras": [part[:2] for part in scene()],
    "three cameras": [part[:3] for part in scene()],
    "nothing estimated": without(scene(), slice(None)),
    "one estimated": without(scene(), slice(1, None)),
    "two estimated": without(scene(), slice(2, None)),
    "coincident ground truth": (np.ones((30, 3)), *scene()[1:]),
    "coincident estimate": (*scene()[:2], np.ones((30, 3)), scene()[3]),
    "all coincident": (np.ones((30, 3)), scene()[1], np.ones((30, 3)), scene()[3]),
    "huge": (1e200 * scene()[0], scene()[1], 1e200 * scene()[2], scene()[3]),
    "huge estimate": (*scene()[:2], 1e300 * scene()[2], scene()[3]),
    "tiny": (1e-200 * scene()[0], scene()[1], 1e-200 * scene()[2], scene()[3]),
    "far off": (1e8 + scene()[0], scene()[1], 1e8 + scene()[2], scene()[3]),
    "on a line": (scene()[0] * [1, 0, 0], *scene()[1:]),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_input(case):
    """A value within the bounds, or a reason why there is none; never a warning or a crash."""
    for name, family in EXAMPLES.items():
        try:
            value = protocol(name)(*HOSTILE[case])
        except NoValueError:
            assert family.missing != "fail" or "sim3" in name or case == "one camera", name
            continue
        assert value >= 0, name
        if family.larger_is_better:
            assert value <= 100, name
            if case in ("nothing estimated", "one estimated"):
                assert value == 0, name


@pytest.mark.parametrize(
    ("function", "options", "named"),
    [
        (vggt_auc, {"k": 181}, "k"),
        (vggt_auc, {"k": 2.5}, "k"),
        (vggt_auc, {"k": 5, "convention": "pi3"}, "convention"),
        (colmap_relative_auc, {"max_error_deg": -1}, "max_error_deg"),
        (colmap_relative_auc, {"max_error_deg": 5, "accuracy": 0}, "accuracy"),
        (hloc_recall, {"max_error": np.nan}, "max_error"),
        (hloc_recall, {"alignment": "se3"}, "alignment"),
        (hloc_median, {"error": "pose"}, "error"),
        (evo_are, {"alignment": "rigid"}, "alignment"),
        (evo_are, {"statistic": "mode"}, "statistic"),
        (evo_rpe, {"distance": 0}, "distance"),
        (evo_rpe, {"pairs": "some"}, "pairs"),
        (evo_rpe, {"frames": 1.5}, "frames"),
        (kitti_relative_error, {"error": "percent"}, "error"),
        (rpg_relative_error, {"length": 1, "alignment": "none"}, "alignment"),
        (rpg_relative_error, {"length": 1, "error": "percent"}, "error"),
    ],
)
def test_options_are_checked(function, options, named):
    gt, gt_rotations, est, est_rotations = scene(n=12)
    cameras = np.dstack([gt_rotations, gt]), np.dstack([est_rotations, est])
    with pytest.raises(ValueError, match=f"^{named} "):
        function(*cameras, **options)


@pytest.mark.parametrize(
    ("name", "close"),
    [
        ("auc@30", "auc@30:vggt"),
        ("auc@30:vgt", "auc@30:vggt"),
        ("auc@0:vggt", "auc@30:vggt"),
        ("auc@2.5:vggt", "auc@30:vggt"),
        ("rpe@1", "rpe@1m"),
        ("rpe@0f", "rpe@1m"),
        ("ate:mean:rmse", "ate:rmse"),
        ("ate:rmse:rmse", "ate:rmse"),
        ("kiti", "kitti"),
        ("recall@5cm,5deg:hlok", "recall@5cm,5deg:hloc-sim3"),
    ],
)
def test_unknown_names_are_answered_with_close_ones(name, close):
    with pytest.raises(ValueError, match=f"unknown metric .*; close to it are .*({close})"):
        protocol(name)


@pytest.mark.parametrize("function", [vggt_auc, colmap_relative_auc])
def test_memory_does_not_grow_with_the_pairs(function):
    gt, gt_rotations, est, est_rotations = scene(n=1500)
    poses = np.dstack([gt_rotations, gt]), np.dstack([est_rotations, est])
    tracemalloc.start()
    function(*poses, 5)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8e6  # a number a pair takes 9 MB
