"""Cameras of a rig: d is the spacing of the path, not the baseline."""

import json
from pathlib import Path

import numpy as np
import pytest

from alignscores import Trajectory, closest_pair_quartile, compare, evaluate, tas
from alignscores.io import read_rig_frames

SHARED = Path(__file__).resolve().parents[4] / "shared"


def rig(name, n_cameras, baseline, seed=0, n=40):
    """Cameras on a path of unit steps, named by `name(camera, frame)`, and an estimate."""
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.normal((1, 0, 0), 1, (n, 3)), axis=0)
    names = [name(camera, frame) for camera in range(n_cameras) for frame in range(n)]
    poses = np.tile(np.eye(4), (n_cameras * n, 1, 1))
    for camera in range(n_cameras):
        offset = baseline * np.array([0, camera - (n_cameras - 1) / 2, 0])
        poses[camera * n : (camera + 1) * n, :3, 3] = path + offset
    noisy = poses.copy()
    noisy[:, :3, 3] += np.tile(rng.normal(scale=0.1, size=(n, 3)), (n_cameras, 1))
    return path, Trajectory(np.array(names), poses), Trajectory(np.array(names), noisy)


def in_folders(camera, frame):
    return f"cam{camera}/{frame:04}.png"


def flat(camera, frame):
    return f"cam{camera}_{frame:04}.png"


@pytest.mark.parametrize(("n_cameras", "baseline"), [(1, 0.0), (2, 0.12), (4, 0.05), (6, 0.0)])
@pytest.mark.parametrize(("name", "option"), [(in_folders, "auto"), (flat, r"_(\d+)\.png$")])
def test_d_is_the_spacing_of_the_path(n_cameras, baseline, name, option):
    path, truth, estimate = rig(name, n_cameras, baseline)
    evaluation = evaluate(truth, estimate, rig_frames=option)
    assert evaluation.result.tas.unit == pytest.approx(closest_pair_quartile(path))
    notes = [str(note) for note in evaluation.notes if note.kind == "rig"]
    assert len(notes) == (n_cameras > 1)
    assert all("each of 40 rig frames as one" in note for note in notes)


def test_rig_frames_can_be_counted_as_cameras():
    _, truth, estimate = rig(in_folders, 2, 0.12)
    evaluation = evaluate(truth, estimate, rig_frames="none")
    assert evaluation.result.tas.unit == pytest.approx(0.12)
    assert "rig" not in {note.kind for note in evaluation.notes}


def test_recordings_with_the_same_file_names_are_no_rig():
    """Their cameras are farther apart than those of a recording."""
    _, first, _ = rig(lambda _, frame: f"monday/{frame:04}.png", 1, 0.0)
    _, second, _ = rig(lambda _, frame: f"friday/{frame:04}.png", 1, 0.0, seed=1)
    keys = np.concatenate([first.keys, second.keys])
    truth = Trajectory(keys, np.concatenate([first.poses, second.poses]))
    evaluation = evaluate(truth, truth)
    assert evaluation.result.tas.unit == closest_pair_quartile(truth.positions)


@pytest.mark.parametrize(
    ("option", "problem"),
    [
        (r"\d+", "rig_frames needs one group in brackets"),
        ("(", "is not a regular expression"),
        (r"(x)_", "rig_frames: no name fits, such as 'cam0/0000.png'"),
    ],
)
def test_a_wrong_option_is_one_sentence(option, problem):
    _, truth, estimate = rig(in_folders, 2, 0.12)
    with pytest.raises(ValueError, match="rig_frames") as raised:
        evaluate(truth, estimate, rig_frames=option)
    assert problem in str(raised.value)


# --- labels of rows -------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["rows", "names", "times"])
def test_groups_label_the_rows_of_rig_frames(how):
    path, truth, estimate = rig(flat, 4, 0.05)
    groups, n = np.tile(np.arange(40), 4), len(truth.keys)
    if how == "names":
        evaluation = evaluate(truth, estimate, groups=groups)
    else:
        timed = {"times": np.arange(n) / 100, "rate": "all", "max_gap": 0} if how == "times" else {}
        evaluation = evaluate(truth.poses, estimate.poses, groups=groups, **timed)
    expected = tas(truth.positions, estimate.positions, groups=groups, registration="refined")
    assert evaluation.matches.unit == expected.unit == pytest.approx(closest_pair_quartile(path))
    assert evaluation.tas == pytest.approx(expected.score, abs=1e-3)


def test_a_number_of_cameras_groups_consecutive_rows(run, tmp_path):
    """For arrays, which have no names, by the command, too."""
    path, truth, estimate = rig(flat, 4, 0.05)
    by_frame = np.arange(160).reshape(4, 40).T.ravel()
    files = tmp_path / "truth.npy", tmp_path / "estimate.npy"
    for file, trajectory in zip(files, (truth, estimate), strict=True):
        np.save(file, trajectory.poses[by_frame])
    code, out, err = run("arrays", *files, "--rig_frames", 4, "--json")
    assert code == 0
    assert json.loads(out)["results"][0]["unit"] == pytest.approx(closest_pair_quartile(path))
    assert "d counts the cameras of each of 40 rig frames as one" in err
    code, _, err = run("arrays", *files, "--rig_frames", 3)
    assert code == 1
    assert "rig_frames 3: the reference has 160 poses, no multiple of it" in err


def test_groups_follow_the_rows_that_are_scored():
    """Rows without a pose, out of order or twice keep their labels."""
    _, truth, _ = rig(flat, 2, 0.12)
    order = np.random.default_rng(0).permutation(80)
    keys, poses = order / 100, truth.poses[order].copy()
    poses[order == 7] = np.nan
    keys, poses = np.append(keys, keys[0]), np.concatenate([poses, poses[:1]])
    groups = np.append(order % 40, 0)
    with np.errstate(all="ignore"):
        evaluation = evaluate(
            Trajectory(keys, poses), Trajectory(keys, poses), groups=groups, rate="all"
        )
    positions = truth.positions[np.arange(80) != 7]
    labels = np.delete(np.arange(80) % 40, 7)
    assert evaluation.matches.unit == pytest.approx(closest_pair_quartile(positions, groups=labels))


@pytest.mark.parametrize(
    ("reference", "groups", "problem"),
    [
        (np.tile(np.eye(4), (8, 1, 1)), [0, 1], "a label for each of the 8 rows of the reference"),
        ("tests/data/tum/reference.txt", [0, 1], "groups need a reference in memory"),
    ],
)
def test_wrong_groups_are_one_sentence(reference, groups, problem):
    with pytest.raises(ValueError, match=problem):
        evaluate(reference, reference, groups=groups)


# --- COLMAP's rig frames --------------------------------------------------------------------------


def model_of_rig(pycolmap, n_cameras):
    """Return a model of pycolmap, images of a rig of cameras named camera00000i_frame00000j.png."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig = 1, n_cameras
    options.num_frames_per_rig, options.num_points3D = 20, 20
    options.sensor_from_rig_translation_stddev = 0.01
    return pycolmap.synthesize_dataset(options)


@pytest.mark.parametrize("source", ["text", "binary", "memory"])
def test_rig_frames_of_a_colmap_model_count_as_one_camera(source, tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    model = model_of_rig(pycolmap, 3)
    frames = {image.name: image.frame_id for image in model.images.values()}
    if source != "memory":
        getattr(model, f"write_{source}")(tmp_path)
    reference = model if source == "memory" else tmp_path
    assert read_rig_frames(reference) == frames
    evaluation = evaluate(reference, reference)
    groups = [frames[name] for name in evaluation.reference.keys]
    positions = evaluation.reference.positions
    assert evaluation.matches.unit == closest_pair_quartile(positions, groups=groups)
    assert evaluation.matches.n_rig_frames == 20
    each = evaluate(reference, reference, rig_frames="none")
    assert each.matches.unit == closest_pair_quartile(positions)
    if source == "binary":
        compared = compare(str(tmp_path), {"same": str(tmp_path)}, format="colmap")
        assert compared.runs["unit"].to_list() == [evaluation.matches.unit]


def test_a_model_whose_frames_have_one_image_each_has_no_rig(tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    model = model_of_rig(pycolmap, 1)
    model.write_text(tmp_path)
    assert read_rig_frames(tmp_path) == read_rig_frames(model) == {}


def test_the_cameras_of_a_dome_are_not_one_camera():
    """They all look at once: there is one rig frame."""
    pycolmap = pytest.importorskip("pycolmap")
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig = 1, 12, 1
    options.num_points3D, options.sensor_from_rig_translation_stddev = 20, 1.0
    model = pycolmap.synthesize_dataset(options)
    evaluation = evaluate(model, model)
    assert len(set(read_rig_frames(model).values())) == 1
    assert evaluation.matches.unit == closest_pair_quartile(evaluation.reference.positions)


def test_too_few_rig_frames_are_one_sentence():
    _, truth, estimate = rig(flat, 4, 0.05)
    with pytest.raises(ValueError, match="2 of the reference's rig frames are expected"):
        evaluate(truth, estimate, groups=np.arange(160) % 2)


@pytest.mark.parametrize("encoding", ["text", "binary"])
def test_damaged_frames_are_one_sentence(encoding, tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    getattr(model_of_rig(pycolmap, 2), f"write_{encoding}")(tmp_path)
    file = tmp_path / ("frames.txt" if encoding == "text" else "frames.bin")
    file.write_bytes(file.read_bytes()[:-7])
    with pytest.raises(ValueError, match="--rig_frames none does without it") as raised:
        evaluate(tmp_path, tmp_path)
    assert str(raised.value).startswith(str(file))
    assert evaluate(tmp_path, tmp_path, rig_frames="none").tas == 1


# --- the note on a small d ------------------------------------------------------------------------


@pytest.mark.parametrize(("n_cameras", "baseline"), [(2, 0.12), (4, 0.05), (6, 1e-6)])
def test_a_note_speaks_where_d_is_the_baseline_of_a_rig(n_cameras, baseline):
    path, truth, estimate = rig(flat, n_cameras, baseline)
    (note,) = (note for note in evaluate(truth, estimate).notes if note.kind == "spacing")
    assert f"clumps of {n_cameras}" in note.text
    assert "--rig_frames" in note.remedy
    spacing = float(note.text.partition("about ")[2].split()[0])
    assert spacing == pytest.approx(closest_pair_quartile(path), rel=0.15)


@pytest.mark.parametrize("shape", ["path", "cube", "plane", "line", "laps", "clusters", "stops"])
def test_no_note_where_d_is_the_spacing(shape):
    n_notes = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        centres = rng.random((8, 3)) * 5
        positions = {
            "path": np.cumsum(rng.normal(size=(100, 3)), axis=0),
            "cube": rng.random((100, 3)),
            "plane": rng.random((100, 3)) * [1, 1, 0],
            "line": np.cumsum(rng.lognormal(0, 1, (100, 1)), axis=0) * [1, 2, 3],
            "laps": np.tile(np.arange(50)[:, None] * [1, 0, 0], (2, 1))
            + rng.normal(0, 0.4, (100, 3)),
            "clusters": centres[rng.integers(8, size=100)] + rng.normal(0, 0.1, (100, 3)),
            "stops": np.cumsum((rng.random((100, 1)) < 0.3) * rng.normal(size=(100, 3)), axis=0)
            + rng.normal(0, 1e-3, (100, 3)),
        }[shape]
        poses = np.tile(np.eye(4), (100, 1, 1))
        poses[:, :3, 3] = positions
        n_notes += any(note.kind == "spacing" for note in evaluate(poses, poses).notes)
    assert n_notes == 0


@pytest.mark.skipif(not SHARED.is_dir(), reason="no shared cases")
@pytest.mark.parametrize("rig", ["mono", "stereo_.12", "four_.05", "cubemap_0", "cubemap_jit_1e-6"])
def test_rigs_of_several_cameras_have_one_d(rig):
    folder = SHARED / "cases" / "46-camera-rigs" / rig
    evaluation = evaluate(folder / "ref", folder / "est")
    assert evaluation.matches.unit == pytest.approx(1.06, abs=0.01)
    assert evaluation.tas == pytest.approx(0.70, abs=0.005)
    assert evaluation.half_distance == pytest.approx(0.63, abs=0.005)
