"""`evaluate` on files and on trajectories in memory, and what its result tells."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Evaluation, Settings, evaluate, tas_profile
from alignscores.evaluation.evaluation import STATUSES, Part, _alignment, _sd, finite_or_none
from alignscores.metrics import metric
from alignscores.similarity import Similarity, least_squares_rmse
from alignscores.trajectories.association import match
from alignscores.trajectories.files import Trajectory, read_kitti, read_nerf, read_tum

from ..conftest import FILES

TUM = "tum/reference.txt", "tum/estimate.txt"


@pytest.fixture
def tum(examples):
    """(changes) -> the evaluation of the example."""
    return lambda **changes: evaluate(*(examples / file for file in TUM), format="tum", **changes)


@pytest.mark.parametrize("form", FILES)
def test_to_dict_is_the_entry_of_the_command(form, run, examples, monkeypatch):
    monkeypatch.chdir(examples)
    options = "--registration", "pcr99", "--repeat", 2, "--metrics", "TAS,ate:rmse,kitti:rotation"
    options = options if form in ("tum", "kitti", "euroc") else options[:-2]
    _, out, _ = run(form, *FILES[form], *options, "--json")
    (printed,) = json.loads(out)["results"]
    assert printed.pop("rank") == [1, 1]
    metrics = options[-1] if len(options) > 4 else ()
    settings = Settings(format=form, registration="pcr99", repeat=2, metrics=metrics)
    found = evaluate(*FILES[form], settings)
    assert isinstance(found, Evaluation)
    assert found.settings == settings
    assert found.to_dict() == printed
    assert list(found.to_dict()) == list(printed)


def test_changes_differ_from_settings(tum, examples):
    settings = Settings(format="tum", seed=3, weight=0.2)
    files = [examples / file for file in TUM]
    assert evaluate(*files, settings, seed=5).to_dict() == tum(seed=5, weight=0.2).to_dict()
    assert evaluate(*files, settings, seed=5).settings == Settings(format="tum", seed=5, weight=0.2)
    with pytest.raises(TypeError, match="sede"):
        tum(sede=3)
    with pytest.raises(ValueError, match="give the format of the files: format=tum"):
        evaluate(*files)


def test_numbers_hang_together(tum):
    found = tum(registration="pcr99", repeat=4, weight=0.3, metrics="RAS,auc@30:vggt")
    assert found.tas == np.mean(found.tas_seeds)
    assert found.tas_sd == pytest.approx(np.std(found.tas_seeds, ddof=1))
    assert found.pas == pytest.approx(0.3 * found.tas + 0.7 * found.ras)
    assert found.pas_sd == pytest.approx(0.3 * found.tas_sd)
    names = "TAS", "RAS", "PAS", "half_distance", "half_angle", "ATE"
    assert [found.value(name) for name in names] == [found.to_dict()[name] for name in names]
    assert found.value("half:rotation") == found.half_angle
    assert found.value("AUC@30:vggt") == found.metrics["auc@30:vggt"]
    assert found.value("auc@10:vggt") is None  # was not asked for
    assert found.to_dict()["metrics"] == {"RAS": found.ras, **found.metrics}
    gt, est = (poses[:, :3, 3] for poses in (found.matches.gt_poses, found.matches.est_poses))
    profile = tas_profile(gt, est, [found.half_distance])
    assert profile.scores[0] == pytest.approx(0.5, abs=0.01)


def test_shares_below_d_and_10_degrees_end_there():
    """Two cameras are off by 5 % less and by 5 % more, the others by nothing."""
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (40, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = (
        Rotation.random(40, rng=rng).as_matrix(),
        rng.random((40, 3)),
    )
    off = poses.copy()
    for row, factor in enumerate((0.95, 1.05)):
        off[row, :3, 3] += [2 * factor, 0, 0]
        off[row, :3, :3] @= Rotation.from_rotvec([10 * factor, 0, 0], degrees=True).as_matrix()
    found = evaluate(
        *(Trajectory(np.arange(40), one) for one in (poses, off)), format="kitti", unit=2.0
    )
    entry = found.to_dict()
    assert (entry["within_unit"], entry["within_10_deg"]) == (39 / 40, 39 / 40)
    on_the_border = replace(
        found.result,
        tas=replace(found.result.tas, errors=np.full(40, 2.0)),
        ras=replace(found.result.ras, errors=np.full(40, 10.0)),
    )
    entry = replace(found, result=on_the_border).to_dict()
    assert (entry["within_unit"], entry["within_10_deg"]) == (0, 0)


def test_statuses_tell_what_of_a_pose_is_missing():
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, :3, 3] = rng.random((20, 3))
    some = poses.copy()
    some[1, 0, 0] = some[2, 2, 3] = some[3, 0, 0] = some[3, 0, 3] = np.nan
    estimate = Trajectory(np.arange(20.0)[:-1], some[:-1])
    found = evaluate(Trajectory(np.arange(20.0), poses), estimate, format="tum", max_gap=0.0)
    told = [STATUSES[code] for code in found.statuses]
    assert told[:4] == ["matched", "no rotation", "no position", "no pose"]
    assert told[4:] == ["matched"] * 15 + ["lost"]


def test_other_metrics_of_keyframes_are_those_of_their_own_poses(examples):
    """A pose that stands for several frames weighs no more than another."""
    reference, estimate = (read_tum(examples / file) for file in TUM)
    rows = [*range(20), *range(20, 38, 4)]
    keyframes = Trajectory(estimate.keys[rows], estimate.poses[rows])
    found = evaluate(reference, keyframes, format="tum", metrics="ate:rmse").metrics["ate:rmse"]
    own = match(reference, keyframes, missing="ignore", sync="nearest", max_gap=0.0)
    gt, est = (one[:, :3] for one in (own.gt_poses, own.est_poses))
    expected = metric("ate:rmse")(gt[..., 3], gt[..., :3], est[..., 3], est[..., :3])
    assert found == pytest.approx(expected, rel=0.005)  # of every frame it is 2 % less


def test_what_of_a_pose_is_not_finite_is_counted_apart(examples):
    reference, (rows, poses) = (read_kitti(examples / FILES["kitti"][0]) for _ in range(2))
    poses[3:5, :3, 3] = np.nan
    poses[7, :3, :3] = np.nan
    counts = evaluate(reference, Trajectory(rows, poses), format="kitti").to_dict()
    names = "non_finite", "no_position", "no_rotation"
    assert [counts[name] for name in names] == [3, 2, 1]


def test_metrics_over_time_have_the_stamps(tum):
    found = tum(metrics="rpe@0.5s")
    assert found.value("rpe@0.5s") > 0
    assert found.notes == []


def test_the_half_score_distance_is_by_the_refined_registration(tum):
    assert tum(registration="pcr99").half_distance == tum(registration="refined").half_distance


@pytest.mark.parametrize("up", ["x", "-y", "z"])
def test_all_that_is_aligned_about_an_axis_is_so_about_this_one(examples, up):
    files, index = [examples / file for file in FILES["kitti"]], 58
    found = evaluate(*files, format="kitti", alignment="yaw", up=up)
    unit = found.profiles.units[index]
    at_unit = evaluate(*files, found.settings, unit=unit, max_threshold=1.0)
    assert found.profiles.tas[index] == pytest.approx(at_unit.tas, abs=0.01)
    assert at_unit.tas > 0.2
    gt, est = (poses[:, :3, 3] for poses in (found.matches.gt_poses, found.matches.est_poses))
    known = np.isfinite(est[:, 0])
    expected = least_squares_rmse(gt[known], est[known], alignment="yaw", up=up)
    assert found.ate == pytest.approx(expected)


def test_cameras_in_one_place_have_a_profile_of_the_unit_that_is_given():
    """No position has an extent; all are within any unit of where they should be."""
    still = Trajectory(np.arange(5), np.tile(np.eye(4), (5, 1, 1)))
    found = evaluate(still, still, format="kitti", unit=2.0, alignment="none")
    assert found.profiles.units[[0, -1]].tolist() == [0.125, 8.0]
    assert found.profiles.tas.tolist() == [1.0] * len(found.profiles.units)


def test_trajectories_of_lists_and_of_three_rows_are_scored_alike(examples):
    reference, estimate = (read_nerf(examples / file) for file in FILES["nerf"])
    expected = evaluate(reference, estimate).to_dict()
    lists = Trajectory(estimate.keys.tolist(), estimate.poses.tolist())
    short = Trajectory(reference.keys.tolist(), reference.poses[:, :3])
    assert evaluate(reference, lists).to_dict() == expected
    assert evaluate(short, estimate).to_dict() == expected


@pytest.mark.parametrize("invert", [False, True])
def test_estimates_of_three_rows_are_scored_alike(examples, invert):
    reference, estimate = (read_tum(examples / file) for file in TUM)
    rows = Trajectory(estimate.keys, estimate.poses[:, :3])
    options = {"invert": invert, "t_offset": "auto"} if not invert else {"invert": True}
    assert evaluate(reference, rows, **options).to_dict() == (
        evaluate(reference, estimate, **options).to_dict()
    )


def test_numbered_frames_may_be_missing(examples):
    """Of KITTI files every line has its partner; keys in memory tell which frames there are."""
    reference, estimate = (read_kitti(examples / file) for file in FILES["kitti"])
    found = Trajectory(estimate.keys[::2], estimate.poses[::2])
    failed, ignored = (evaluate(reference, found, missing=name) for name in ("fail", "ignore"))
    assert (len(failed.matches.keys), failed.matches.missing) == (40, 20)
    assert (len(ignored.matches.keys), ignored.matches.missing) == (20, 20)
    assert failed.ras == pytest.approx(ignored.ras / 2)


def test_frames_that_were_due_as_stamps(examples, tum, tmp_path):
    reference, estimate = (read_tum(examples / file) for file in TUM)
    stamps = estimate.keys[:30] + 1e-4
    np.savetxt(tmp_path / "frames.txt", stamps, fmt="%.6f")
    in_memory = evaluate(reference, estimate, frames=stamps).to_dict()
    from_file = tum(frames=tmp_path / "frames.txt").to_dict()
    assert in_memory.pop("name") == "estimate"
    assert from_file.pop("name") == "estimate.txt"
    assert in_memory.pop("file") == ""
    assert from_file.pop("file").endswith(TUM[1])
    assert [note.split(": ", 1)[1] for note in in_memory.pop("notes")] == [
        note.split(": ", 1)[1] for note in from_file.pop("notes")
    ]
    assert in_memory == from_file


def test_what_is_wrong_with_trajectories_is_a_value_error(examples):
    reference, estimate = (read_tum(examples / file) for file in TUM)
    for wrong, reason in (
        (Trajectory(estimate.keys, estimate.poses[:5]), "poses"),
        (Trajectory(np.array(["a", "b"]), estimate.poses[:2]), "not of the same format"),
        (Trajectory(estimate.keys[:0], estimate.poses[:0]), "the estimate has no poses"),
    ):
        with pytest.raises(ValueError, match=reason):
            evaluate(reference, wrong)


def test_a_table_of_pandas(tum):
    pandas = pytest.importorskip("pandas")
    plain, other = tum(metrics="auc@30:vggt,TAS"), tum(registration="pcr99", repeat=3)
    table = plain.to_frame()
    assert isinstance(table, pandas.DataFrame)
    assert len(table) == 1
    row = table.iloc[0].to_dict()
    printed = plain.to_dict()
    assert row["auc@30:vggt"] == printed["metrics"]["auc@30:vggt"]
    assert {key: row[key] for key in ("name", "TAS", "PAS", "half_distance", "ATE", "n")} == {
        key: printed[key] for key in ("name", "TAS", "PAS", "half_distance", "ATE", "n")
    }
    assert not any(isinstance(value, (list, dict)) for value in row.values())
    assert set(table) - {"auc@30:vggt"} == set(other.to_frame())
    assert list(pandas.concat([table, other.to_frame()])["TAS"]) == [plain.tas, other.tas]


def test_without_pandas_the_table_says_what_to_install(tum, monkeypatch):
    found = tum()
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError) as caught:
        found.to_frame()
    assert str(caught.value) == 'pandas is not installed: pip install "alignscores[tables]"'


def test_profiles_of_cameras_in_one_place_are_over_units_of_d():
    """From a sixteenth of it to four of it, which are all hit where nothing is off."""
    poses = np.tile(np.eye(4), (12, 1, 1))
    poses[:, :3, :3] = Rotation.random(12, rng=0).as_matrix()
    both = [Trajectory(np.arange(12), poses) for _ in range(2)]
    found = evaluate(*both, unit=3.0, alignment="none").profiles
    np.testing.assert_allclose(found.units, 3.0 * 2.0 ** np.arange(-4, 3))
    assert found.tas.tolist() == [1.0] * 7


def test_profiles_have_a_hundred_thresholds(tum):
    """So that a score is a number of hundredths of the cameras."""
    found = tum()
    hundredths = found.profiles.tas * 100 * len(found.matches.keys)
    np.testing.assert_allclose(hundredths, np.round(hundredths), atol=1e-6)
    assert len(np.unique(hundredths)) > 20


def test_what_takes_the_estimate_to_the_reference():
    """Twice as large, turned about z and moved; a camera has no position, and one no rotation."""
    rng = np.random.default_rng(0)
    gt, est = np.tile(np.eye(4), (2, 12, 1, 1))
    gt[:, :3, :3], gt[:, :3, 3] = Rotation.random(12, rng=rng).as_matrix(), rng.random((12, 3))
    world = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    est[:, :3, :3] = world @ gt[:, :3, :3]
    est[:, :3, 3] = 2 * gt[:, :3, 3] @ world.T + [1, 2, 3]
    est[2, :3, 3] = est[5, :3, :3] = np.nan
    found = evaluate(*(Trajectory(np.arange(12), poses) for poses in (gt, est)), unit=0.1)
    entry = found.to_dict()
    assert found.scale == entry["scale"] == pytest.approx(2)
    assert entry["alignment"]["scale"] == pytest.approx(0.5)
    np.testing.assert_allclose(entry["alignment"]["rotation"], world.T, atol=1e-9)
    np.testing.assert_allclose(entry["alignment"]["translation"], [-1, 0.5, -1.5], atol=1e-9)
    known = np.delete(np.arange(12), 2)
    np.testing.assert_allclose(found.positions[known], gt[known, :3, 3], atol=1e-9)
    assert np.isnan(found.positions[2]).all()
    counts = {"n": 12, "matched": 12, "missing": 0, "non_finite": 2, "duplicate": 0, "unmatched": 0}
    counts |= {"no_position": 1, "no_rotation": 1, "within_unit": 11 / 12, "within_10_deg": 11 / 12}
    assert {key: entry[key] for key in counts} == counts
    assert (entry["TAS"], entry["RAS"], entry["unit"]) == (11 / 12, 11 / 12, 0.1)
    assert (entry["TAS_sd"], entry["PAS_sd"], entry["body_rotation"]) == (None, None, None)
    in_parts = replace(found, parts=[Part("a", 7, found.result.tas.alignment), Part("b", 0, None)])
    assert in_parts.scale is None
    entry_of_parts = in_parts.to_dict()
    assert (entry_of_parts["scale"], entry_of_parts["alignment"]) == (None, None)
    assert entry_of_parts["parts"] == [
        {"name": "a", "n": 7, "alignment": entry["alignment"]},
        {"name": "b", "n": 0, "alignment": None},
    ]
    lost = replace(
        found, result=replace(found.result, tas=replace(found.result.tas, alignment=None))
    )
    assert lost.scale is None
    assert lost.to_dict()["alignment"] is None
    assert np.isnan(lost.positions).all()
    assert lost.positions.shape == (12, 3)


def test_no_infinite_number_is_in_the_json():
    assert [finite_or_none(one) for one in (None, np.nan, np.inf, -np.inf, 0.5)] == [None] * 4 + [
        0.5
    ]
    tiny = Similarity(1e-320, np.eye(3), np.ones(3))
    with np.errstate(all="ignore"):
        assert _alignment(tiny) is None
    assert _alignment(None) is None


def test_one_value_has_no_deviation():
    assert _sd([1.0]) is None
    assert _sd([1.0, 3.0]) == pytest.approx(np.sqrt(2))
    assert _sd([1.0, 2.0, 6.0]) == pytest.approx(np.sqrt(7))


def test_a_table_has_a_column_for_each_number(tum):
    found = tum(metrics="auc@30:vggt")
    frame, entry = found.to_frame(), found.to_dict()
    assert len(frame) == 1
    assert {"name", "TAS", "unit", "scale", "auc@30:vggt"} <= set(frame.columns)
    assert {"alignment", "parts", "metrics", "notes", "TAS_seeds"}.isdisjoint(frame.columns)
    assert frame["TAS"][0] == entry["TAS"]
    assert frame["auc@30:vggt"][0] == entry["metrics"]["auc@30:vggt"]


def test_profiles_are_computed_once(tum):
    found = tum()
    assert found.profiles is found.profiles
