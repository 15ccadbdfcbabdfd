"""APE and RPE are those of the installed evo, called independently, and of its command."""

import os
import subprocess
import sys

import numpy as np
import pytest
from evo.core import metrics as evo
from evo.core.trajectory import PosePath3D
from scipy.spatial.transform import Rotation

from alignscores import Trajectory, evaluate
from alignscores.metrics import NoValueError, evo_are, evo_ate, evo_rpe
from tests.files import EXAMPLES

ALIGNED = {
    "sim3": {"correct_scale": True},
    "se3": {},
    "scale": {"correct_only_scale": True},
}
RELATIONS = {
    "translation": evo.PoseRelation.translation_part,
    "rotation": evo.PoseRelation.rotation_angle_deg,
    "distance": evo.PoseRelation.point_distance,
}


def scene(seed=0, n=80):
    """Poses (n, 4, 4) of a drive and of an estimate in another frame, with drift."""
    rng = np.random.default_rng(seed)
    gt, est = np.tile(np.eye(4), (2, n, 1, 1))
    turns = Rotation.from_rotvec(rng.normal(0, 0.1, (n, 3)).cumsum(axis=0))
    gt[:, :3, :3] = turns.as_matrix()
    gt[:, :3, 3] = np.cumsum(turns.apply([0.3, 0, 0.05]), axis=0)
    frame = Rotation.random(rng=rng)
    noise = Rotation.from_rotvec(rng.normal(0, 0.02, (n, 3)))
    est[:, :3, :3] = (frame * noise * turns).as_matrix()
    drift = rng.normal(0, 0.02, (n, 3)).cumsum(axis=0)
    est[:, :3, 3] = 1.7 * frame.apply(gt[:, :3, 3] + drift) + 4
    return gt, est


def expected(metric, gt, est, alignment, statistic):
    """The statistic by evo's classes, from positions and quaternions."""
    paths = []
    for poses in (gt, est):
        quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=True)
        positions = poses[:, :3, 3].copy()
        paths.append(PosePath3D(positions_xyz=positions, orientations_quat_wxyz=quaternions))
    if alignment != "none":
        paths[1].align(paths[0], **ALIGNED[alignment])
    metric.process_data(tuple(paths))
    return metric.get_statistic(evo.StatisticsType[statistic])


@pytest.mark.parametrize("alignment", ["sim3", "se3", "scale", "none"])
@pytest.mark.parametrize("statistic", ["rmse", "mean", "median", "std", "min", "max", "sse"])
def test_absolute_errors(alignment, statistic):
    gt, est = scene()
    options = {"alignment": alignment, "statistic": statistic}
    distance = expected(evo.APE(RELATIONS["translation"]), gt, est, alignment, statistic)
    assert evo_ate(gt[:, :3, 3], est[:, :3, 3], **options) == pytest.approx(distance, rel=1e-9)
    angle = expected(evo.APE(RELATIONS["rotation"]), gt, est, alignment, statistic)
    assert evo_are(gt, est, **options) == pytest.approx(angle, rel=1e-6)


@pytest.mark.parametrize("pairs", ["consecutive", "consecutive-reference", "all", "all-reference"])
@pytest.mark.parametrize("error", RELATIONS)
@pytest.mark.parametrize("alignment", ["sim3", "none"])
@pytest.mark.parametrize("over", [{"distance": 1.0}, {"frames": 7}])
def test_relative_errors(pairs, error, alignment, over):
    gt, est = scene(1)
    of_metres = "distance" in over
    metric = evo.RPE(
        RELATIONS[error],
        *over.values(),
        evo.Unit.meters if of_metres else evo.Unit.frames,
        all_pairs=pairs.startswith("all"),
        pairs_from_reference=pairs.endswith("reference"),
    )
    value = expected(metric, gt, est, alignment, "rmse")
    ours = evo_rpe(gt, est, **over, error=error, alignment=alignment, pairs=pairs)
    assert ours == pytest.approx(value, rel=1e-6)


def test_missing_poses_are_left_out():
    gt, est = scene(2)
    est[10:14] = np.nan
    finite = np.isfinite(est).all(axis=(1, 2))
    assert evo_rpe(gt, est, 1.0) == evo_rpe(gt[finite], est[finite], 1.0)
    assert evo_are(gt, est) == evo_are(gt[finite], est[finite])


def test_where_evo_stops_there_is_no_value():
    gt, est = scene(3)
    straight = gt * [[1, 1, 1, 1], [1, 1, 1, 0], [1, 1, 1, 0], [1, 1, 1, 1]]
    with pytest.raises(NoValueError, match="evo: Degenerate covariance rank"):
        evo_are(straight, est)
    with pytest.raises(NoValueError, match=r"evo: .*delta"):
        evo_rpe(gt, est, 1000.0)


def test_the_commands_of_evo(tmp_path):
    """``evo_ape`` and ``evo_rpe`` on the files of the tutorial print the values of `evaluate`."""
    files = [str(EXAMPLES / "tum" / name) for name in ("reference.txt", "estimate.txt")]
    # evo's commands stop at poses that are not finite.
    lines = (EXAMPLES / "tum" / "estimate.txt").read_text().splitlines(keepends=True)
    files[1] = str(tmp_path / "estimate.txt")
    (tmp_path / "estimate.txt").write_text("".join(line for line in lines if "nan" not in line))
    code = "import sys; from evo.cli import entry_points; getattr(entry_points, sys.argv.pop(1))()"
    commands = {
        "ate:rmse": ["ape", "-as"],
        "are:mean:se3": ["ape", "-a", "-r", "angle_deg"],
        "rpe@1m:all:none": ["rpe", "-d", "1", "-u", "m", "--all_pairs"],
    }
    result = evaluate(*files, sync="nearest", metrics=list(commands))
    for name, (program, *options) in commands.items():
        done = subprocess.run(
            [sys.executable, "-c", code, program, "tum", *files, *options],
            env={**os.environ, "HOME": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        printed = dict(line.split() for line in done.stdout.splitlines() if "\t" in line)
        statistic = "mean" if ":mean" in name else "rmse"
        assert result.value(name) == pytest.approx(float(printed[statistic]), abs=1e-6)


def test_without_evo_the_extra_is_named_and_the_ate_stays(monkeypatch):
    gt, est = scene(4)
    reference, estimate = (Trajectory(np.arange(80) / 10, poses) for poses in (gt, est))
    value = evaluate(reference, estimate).ate
    monkeypatch.setitem(sys.modules, "evo", None)
    message = r'evo is not installed: pip install "alignscores\[evo\]"'
    for name in ("ate:rmse", "are", "rpe@1f"):
        with pytest.raises(ModuleNotFoundError, match=message):
            evaluate(reference, estimate, metrics=name)
    with pytest.raises(ModuleNotFoundError, match=message):
        evo_ate(gt[:, :3, 3], est[:, :3, 3])
    assert evaluate(reference, estimate, metrics="ATE,kitti").ate == value
