"""`evaluate` on files and on trajectories in memory, and what its result tells."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import evaluate, tas_profile
from alignscores.evaluation.evaluation import STATUSES
from alignscores.io import FORMATS, Trajectory, read_kitti, read_tum
from alignscores.metrics import Metric
from tests.files import FILES

TUM = "tum/reference.txt", "tum/estimate.txt"


@pytest.fixture
def tum(examples):
    """(changes) -> the evaluation of the example."""
    return lambda **changes: evaluate(*(examples / file for file in TUM), format="tum", **changes)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [("sede", "did you mean seed?"), ("max_treshold", "max_threshold?"), ("xyz", "setting 'xyz'")],
)
def test_a_wrong_name_of_a_setting_is_answered_with_the_nearest(tum, wrong, message):
    with pytest.raises(TypeError, match=re.escape(message)):
        tum(**{wrong: 3})


def test_poses_in_arrays_are_matched_by_row_or_by_their_times(tum, examples):
    reference, estimate = (read_tum(examples / file) for file in TUM)
    times = reference.keys, estimate.keys
    evaluation = evaluate(reference.poses, estimate.poses[:, :3], times=times)
    assert evaluation.to_dict()["PAS"] == tum().pas
    n = len(estimate.keys)
    by_row = evaluate(reference.poses[:n], estimate.poses)
    assert by_row.to_dict()["n"] == n
    assert evaluate(list(reference.poses), reference.poses[None], times=times[0]).pas == 1
    with pytest.raises(ValueError, match="times need two arrays of poses"):
        evaluate(reference, estimate.poses, times=times[0])


def test_reprs_name_the_registration(in_notebook, tum):
    evaluation = tum()
    assert repr(evaluation) == (
        "Evaluation('estimate.txt', PAS 0.871, TAS 0.880, RAS 0.861, registration='refined')"
    )
    assert (
        repr(evaluation.result) == "PASResult(0.8709, TAS 0.88, RAS 0.86, registration='refined')"
    )
    assert repr(evaluation.result.tas) == "TASResult(0.8805, n=40, registration='refined')"
    assert repr(evaluation.estimate).startswith("Trajectory(38 poses, ")
    html = in_notebook(evaluation)
    assert "estimate.txt; alignment: similarity (refined)" in html
    assert "<th>half [m]</th><td>0.07</td>" in html


def test_numbers_hang_together(tum):
    evaluation = tum(registration="pcr99", repeat=4, weight=0.3, metrics="RAS,auc@30:vggt")
    assert evaluation.tas == np.mean(evaluation.tas_seeds)
    assert evaluation.pas == pytest.approx(0.3 * evaluation.tas + 0.7 * evaluation.ras)
    names = "TAS", "RAS", "PAS", "half_distance", "half_angle"
    assert [evaluation.value(name) for name in names] == [
        evaluation.to_dict()[name] for name in names
    ]
    assert evaluation.value("ATE") == evaluation.to_dict()["ate"]
    assert evaluation.value("HalfAngle") == evaluation.half_angle
    assert evaluation.value("AUC@30:vggt") == evaluation.metrics["auc@30:vggt"]
    assert evaluation.value("auc@10:vggt") is None  # was not asked for
    assert evaluation.to_dict()["metrics"] == {"RAS": evaluation.ras, **evaluation.metrics}
    gt, est = (
        poses[:, :3, 3] for poses in (evaluation.matches.gt_poses, evaluation.matches.est_poses)
    )
    profile = tas_profile(gt, est, [evaluation.half_distance])
    assert profile.scores[0] == pytest.approx(0.5, abs=0.01)


def test_statuses_tell_what_of_a_pose_is_missing():
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, :3, 3] = rng.random((20, 3))
    incomplete = poses.copy()
    incomplete[1, 0, 0] = incomplete[2, 2, 3] = incomplete[3, 0, 0] = incomplete[3, 0, 3] = np.nan
    estimate = Trajectory(np.arange(20.0)[:-1], incomplete[:-1])
    evaluation = evaluate(Trajectory(np.arange(20.0), poses), estimate, format="tum", max_gap=0.0)
    statuses = [STATUSES[code] for code in evaluation.statuses]
    assert statuses[:4] == ["matched", "no rotation", "no position", "lost"]
    assert statuses[4:] == ["matched"] * 15 + ["lost"]
    counts = evaluation.to_dict()
    assert counts["lost"] == pytest.approx(4 / 20)
    names = "expected", "matched", "no_position", "no_rotation"
    assert [counts[name] for name in names] == [20, 19, 3, 3]


def test_numbered_frames_may_be_missing(examples):
    """Every line of a KITTI file has its partner; keys in memory number the frames."""
    reference, estimate = (read_kitti(examples / file) for file in FILES["kitti"])
    thinned = Trajectory(estimate.keys[::2], estimate.poses[::2])
    failed, ignored = (evaluate(reference, thinned, missing=name) for name in ("fail", "ignore"))
    assert (len(failed.matches.keys), failed.matches.matched) == (40, 20)
    assert (len(ignored.matches.keys), ignored.matches.matched) == (20, 20)
    assert failed.ras == pytest.approx(ignored.ras / 2)


@pytest.mark.parametrize("files", ["kitti", "colmap"])
@pytest.mark.parametrize("missing", ["fail", "ignore"])
def test_a_row_of_nan_is_a_lost_frame(examples, files, missing):
    """The error on a file with fewer rows offers it, or the numbers of its frames (evo#204)."""
    reference, estimate = (FORMATS[files].read(examples / file) for file in FILES[files])
    poses = estimate.poses.copy()
    poses[1::2, :3] = np.nan
    thinned = Trajectory(estimate.keys[::2], estimate.poses[::2])
    nan, left_out = (
        evaluate(reference, each, missing=missing)
        for each in (Trajectory(estimate.keys, poses), thinned)
    )
    assert (nan.tas, nan.ras, nan.lost) == (left_out.tas, left_out.ras, left_out.lost)
    notes = [str(note) for note in nan.notes if note.kind == "ignored"]
    what = "frames" if files == "kitti" else "images"
    text = (
        f"only {1 - nan.lost:.0%} of the {what} are scored, since the rest is lost; --missing fail "
        "counts it as failures"
    )
    assert notes == ([text] if missing == "ignore" else [])


def test_a_table_of_pandas(tum):
    pandas = pytest.importorskip("pandas")
    plain, other = tum(metrics="auc@30:vggt,TAS"), tum(registration="pcr99", repeat=3)
    table = plain.to_frame()
    assert isinstance(table, pandas.DataFrame)
    assert len(table) == 1
    row = table.iloc[0].to_dict()
    printed = plain.to_dict()
    assert row["auc@30:vggt"] == printed["metrics"]["auc@30:vggt"]
    assert {key: row[key] for key in ("name", "TAS", "PAS", "half_distance", "ate", "n")} == {
        key: printed[key] for key in ("name", "TAS", "PAS", "half_distance", "ate", "n")
    }
    assert not any(isinstance(value, (list, dict)) for value in row.values())
    assert set(table) - {"auc@30:vggt"} == set(other.to_frame())
    assert list(pandas.concat([table, other.to_frame()])["TAS"]) == [plain.tas, other.tas]


def test_the_alignment_takes_the_reference_to_the_estimate():
    """Twice as large, turned about z and moved; a camera has no position, and one no rotation."""
    rng = np.random.default_rng(0)
    gt, est = np.tile(np.eye(4), (2, 12, 1, 1))
    gt[:, :3, :3], gt[:, :3, 3] = Rotation.random(12, rng=rng).as_matrix(), rng.random((12, 3))
    world = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    est[:, :3, :3] = world @ gt[:, :3, :3]
    est[:, :3, 3] = 2 * gt[:, :3, 3] @ world.T + [1, 2, 3]
    est[2, :3, 3] = est[5, :3, :3] = np.nan
    evaluation = evaluate(*(Trajectory(np.arange(12), poses) for poses in (gt, est)), unit=0.1)
    entry = evaluation.to_dict()
    assert evaluation.scale == entry["scale"] == pytest.approx(2)
    assert entry["alignment"]["scale"] == entry["scale"]
    np.testing.assert_allclose(entry["alignment"]["rotation"], world, atol=1e-9)
    np.testing.assert_allclose(entry["alignment"]["translation"], [1, 2, 3], atol=1e-9)
    rows = np.delete(np.arange(12), 2)
    np.testing.assert_allclose(evaluation.positions[rows], gt[rows, :3, 3], atol=1e-9)
    assert np.isnan(evaluation.positions[2]).all()
    counts = {"n": 12, "expected": 12, "matched": 12, "unmatched": 0}
    counts |= {"no_position": 1, "no_rotation": 1, "within_unit": 11 / 12, "within_10_deg": 11 / 12}
    assert {key: entry[key] for key in counts} == counts
    assert (entry["TAS"], entry["RAS"], entry["unit"]) == (11 / 12, 11 / 12, 0.1)
    assert entry["body_rotation"] is None


def test_functions_are_metrics_next_to_names(tum):
    def last_error(gt_poses, est_poses):
        return np.linalg.norm(gt_poses[-1, :3, 3] - est_poses[-1, :3, 3])

    def never(gt_poses, est_poses):
        return np.nan

    worst = Metric("worst", lambda gt, est: np.nanmax(np.abs(gt - est)), unit="units", needs=())
    evaluation = tum(metrics=["ate", last_error, worst, never])
    assert list(evaluation.metrics) == ["last_error", "worst"]
    assert evaluation.to_dict()["metrics"] == {"ATE": evaluation.ate, **evaluation.metrics}
    assert evaluation.value("last_error") == evaluation.metrics["last_error"] > 0
    assert "no value of never: it is not finite" in " ".join(map(str, evaluation.notes))
    assert evaluation.to_frame()["worst"].item() == evaluation.metrics["worst"]
