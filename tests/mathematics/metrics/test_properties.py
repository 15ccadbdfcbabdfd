"""Properties of metrics by name: frames, missing cameras, bounds, hostile input, memory."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores.metrics import (
    METRICS,
    SCORES,
    NoValueError,
    colmap_relative_auc,
    evo_are,
    evo_rpe,
    hloc_median,
    hloc_recall,
    kitti_relative_error,
    metric,
    rpg_relative_error,
    vggt_auc,
)

EXAMPLES = {entry.example or entry.name: entry for entry in METRICS if entry.name not in SCORES}
# Whose values do not change when the estimate's world is turned, moved and scaled, or not scaled.
SIM3 = """
    rra@5:vggt rta@5:vggt rta@5:mapanything auc@30:vggt auc@30:mapanything auc@30:da3
    auc@5:colmap recall@50cm,30deg:hloc-sim3
    median:hloc-sim3 median:hloc-sim3:rotation ate:rmse ate:mean are:rmse are rpe@1f rpe@1m
    rpe@1m:rotation rpe@1m:scale rpe@1m:all-reference rpe@1m:all rpg@1m rpg@1m:rotation
""".split()  # noqa: SIM905
SE3 = "ate:rmse:se3 are:se3 rpe@1f:none rpe@1m:none kitti kitti:rotation rpg@1m:se3"
# To lose any one camera never helps.
FAIL = """
    rra@5:vggt rta@5:vggt auc@30:vggt auc@30:mapanything auc@30:da3 auc@5:colmap
    recall@5cm,5deg:hloc median:hloc median:hloc:rotation
""".split()  # noqa: SIM905


def scene(n=30, sigma=0.03, sigma_deg=2.0, seed=0, outliers=3, step=None):
    """Poses of the ground truth and of an estimate in the same frame, (n, 3, 4)."""
    rng = np.random.default_rng([seed, n])
    positions = rng.random((n, 3)) if step is None else step * rng.random((n, 3)).cumsum(axis=0)
    rotations = Rotation.random(n, rng=rng)
    noise = Rotation.from_rotvec(rng.normal(0, sigma_deg, (n, 3)), degrees=True)
    est_positions = positions + rng.normal(0, sigma, (n, 3))
    est_positions[:outliers] = 3 * rng.random((outliers, 3))
    gt = np.dstack([rotations.as_matrix(), positions])
    return gt, np.dstack([(noise * rotations).as_matrix(), est_positions])


def moved(cameras, seed, scale):
    gt, est = cameras
    rng = np.random.default_rng(seed)
    turn = Rotation.random(rng=rng).as_matrix()
    positions = scale * (est[:, :, 3] @ turn.T + rng.uniform(-10, 10, 3))
    return gt, np.dstack([turn @ est[:, :, :3], positions])


def without(cameras, rows):
    gt, est = (part.copy() for part in cameras)
    est[rows] = np.nan
    return gt, est


def with_positions(cameras, change, which=(0, 1)):
    changed = [part.copy() for part in cameras]
    for i in which:
        changed[i][:, :, 3] = change(changed[i][:, :, 3])
    return tuple(changed)


@pytest.mark.parametrize(("names", "scale"), [(SIM3, 3.7), (SE3.split(), 1.0)])
def test_the_world_of_the_estimate_does_not_matter(names, scale):
    cameras = scene(n=60, step=20.0, sigma=0.1)
    near = scene(n=20)
    for name in names:
        entry = metric(name)
        chosen = cameras if name.startswith("kitti") else near
        value = entry(*chosen)
        assert entry(*moved(chosen, 1, scale)) == pytest.approx(value, rel=1e-9, abs=1e-9), name
        assert value not in (0, 100), name


@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from(FAIL))
def test_a_missing_camera_never_helps(seed, name):
    entry = metric(name)
    cameras = scene(n=8, seed=seed, outliers=2)
    value = entry(*cameras)
    for row in range(8):
        assert entry.sign * entry(*without(cameras, row)) <= entry.sign * value + 1e-9


@pytest.mark.parametrize("name", ["roterr", "transerr:cami2v", "cammc:cameractrl", "kitti"])
def test_sums_over_all_frames_and_kitti_refuse_missing_frames(name):
    with pytest.raises(NoValueError, match="frame 2 has no estimate"):
        metric(name)(*without(scene(n=60, step=20.0), 2))


@pytest.mark.parametrize("name", EXAMPLES)
def test_bounds_and_perfect_estimates(name):
    """Scores from 0 to 100 %, all of it for a perfect estimate; errors are 0 there."""
    entry = metric(name)
    best = 100.0 if entry.larger_is_better else 0.0
    step = 20.0 if "order" in entry.needs and not name.startswith("rpe") else 0.5
    gt, est = scene(n=60 if step > 1 else 25, step=step)
    assert entry(gt, gt) == pytest.approx(best, abs=2e-6)
    value = entry(gt, est)
    assert value >= 0
    assert type(value) is float
    assert value <= best if entry.larger_is_better else value > 0


HOSTILE = {
    "one camera": [part[:1] for part in scene()],
    "two cameras": [part[:2] for part in scene()],
    "three cameras": [part[:3] for part in scene()],
    "nothing estimated": without(scene(), slice(None)),
    "one estimated": without(scene(), slice(1, None)),
    "two estimated": without(scene(), slice(2, None)),
    "coincident ground truth": with_positions(scene(), np.ones_like, [0]),
    "coincident estimate": with_positions(scene(), np.ones_like, [1]),
    "all coincident": with_positions(scene(), np.ones_like),
    "huge": with_positions(scene(), lambda p: 1e200 * p),
    "huge estimate": with_positions(scene(), lambda p: 1e300 * p, [1]),
    "tiny": with_positions(scene(), lambda p: 1e-200 * p),
    "far off": with_positions(scene(), lambda p: 1e8 + p),
    "on a line": with_positions(scene(), lambda p: p * [1, 0, 0], [0]),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_input_has_a_value_or_a_reason(case):
    """A value within the bounds, or a reason why there is none; never a warning or a crash."""
    for name, entry in EXAMPLES.items():
        try:
            value = metric(name)(*HOSTILE[case])
        except NoValueError:
            assert name not in FAIL or case == "one camera", name
            continue
        assert value >= 0, name
        if entry.larger_is_better:
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
    with pytest.raises(ValueError, match=f"^{named} "):
        function(*scene(n=12), **options)


@pytest.mark.parametrize("function", [vggt_auc, colmap_relative_auc])
def test_memory_does_not_grow_with_the_pairs(function):
    poses = scene(n=1500)
    tracemalloc.start()
    function(*poses, 5)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8e6  # a number a pair takes 9 MB
