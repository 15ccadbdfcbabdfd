"""Files of other programs: their content, and the message if they are broken."""

import json
import shutil

import numpy as np
import pycolmap
import pytest
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

from alignscores.io import read_nerf, read_tum
from tests.files import FILES, TUM

SCORES = "TAS", "RAS", "PAS", "ate", "half_distance", "lost"


@pytest.fixture
def expected(score):
    """The scores of the same poses in TUM files."""
    (result,) = score("tum", *FILES["tum"])
    return {name: pytest.approx(result[name], abs=1e-6) for name in SCORES}


@pytest.fixture
def same(score, expected):
    """(arguments) -> the notes; the scores must be those of the TUM files."""

    def same(*arguments):
        (result,) = score(*arguments)
        assert {name: result[name] for name in SCORES} == expected
        return result["notes"]

    return same


@pytest.fixture
def trajectories(examples):
    """The poses of the reference and of the estimate."""
    return [read_tum(examples / file) for file in FILES["tum"]]


def test_cameras_of_nerfstudio_are_read(run, score, examples, tmp_path):
    """What `ns-export cameras` writes: a list of frames, with absolute paths or others."""
    (expected,) = score("nerf", *FILES["nerf"])
    files = []
    for number, file in enumerate(FILES["nerf"]):
        frames = json.loads((examples / file).read_text())["frames"]
        exported = [
            {
                "file_path": ["/data/scene/images/", "images/"][number] + frame["file_path"],
                "transform": frame["transform_matrix"][:3],
            }
            for frame in frames
        ]
        files.append(tmp_path / f"transforms_{number}.json")
        files[-1].write_text(json.dumps(exported))
    (result,) = score("nerf", *files)
    assert result["TAS"] == expected["TAS"]
    assert result["RAS"] == expected["RAS"]
    assert len(read_nerf(files[0]).keys) == 40
    files[1].write_text(json.dumps([{"file_path": "a.png", "transform": [[1, 2], [3, 4]]}]))
    assert run("nerf", *files)[2] == (
        f"alignscores: error: {files[1]}: frames[0]: needs a file_path and a transform_matrix of "
        "4 x 4 numbers\n"
    ).replace(": frames[0]", ", frames[0]")


@pytest.mark.parametrize("rows", [3, 4])
def test_arrays_with_stamps(same, run, trajectories, tmp_path, rows):
    files = [tmp_path / "reference.npz", tmp_path / "estimate.npz"]
    for file, (stamps, poses) in zip(files, trajectories, strict=True):
        np.savez(file, extrinsics=poses[:, :rows], t=stamps, intrinsics=np.eye(3), name="scene")
    assert same("arrays", *files) == []
    assert "detected format: arrays\n" in run(*files)[2]
    assert same("arrays", files[0], FILES["tum"][1], "--est_format", "tum") == []


def test_arrays_without_stamps_go_by_rows(run, score, trajectories, tmp_path):
    poses = trajectories[0].poses
    files = [tmp_path / "reference.npy", tmp_path / "estimate.npy"]
    np.save(files[0], poses)
    lost = poses.astype(np.float32)
    lost[:10] = np.nan
    np.save(files[1], lost)
    (result,) = score("arrays", *files)
    assert (result["n"], result["no_position"], result["TAS"]) == (40, 10, 0.75)
    np.save(files[1], poses[1:])
    assert "the reference has 40 poses, the estimate 39, and both count" in run(*files)[2]
    np.save(files[1], np.concatenate([poses[1:], np.full((1, 4, 4), np.nan)]))
    assert "stamps seem to be off" not in run("arrays", *files)[2]  # a row is no time


def bag(path, storage, trajectories):
    """Write a bag with both trajectories by evo, and return its path."""
    if storage == "ROS 1":
        writer = file_interface.Rosbag1Writer(path)
    else:
        plugin = file_interface.ros2_bag_storage_plugin(storage)
        writer = file_interface.Rosbag2Writer(path, version=9, storage_plugin=plugin)
    with writer as opened:
        for topic, (stamps, poses) in zip(("/gt", "/odom"), trajectories, strict=False):
            finite = np.isfinite(poses).all(axis=(1, 2))
            written = PoseTrajectory3D(poses_se3=list(poses[finite]), timestamps=stamps[finite])
            file_interface.write_bag_trajectory(opened, written, topic, "map")
    return path


TOPICS = "--ref_topic", "/gt", "--est_topic", "/odom"


@pytest.mark.parametrize(
    ("storage", "name", "file"),
    [
        ("ROS 1", "run.bag", ""),
        ("SQLITE3", "run", ""),
        ("SQLITE3", "run", "run.db3"),
        ("MCAP", "run", ""),
        ("MCAP", "run", "run.mcap"),
    ],
)
def test_bags_score_as_the_text_files_of_their_poses(
    same, run, trajectories, tmp_path, storage, name, file
):
    path = bag(tmp_path / name, storage, trajectories) / file
    assert same("bag", path, path, *TOPICS, "--t_offset", 0) == []
    assert same("bag", path, FILES["tum"][1], "--est_format", "tum", *TOPICS[:2]) == []
    options = *TOPICS, "--save_aligned", tmp_path / "aligned.txt"
    assert "note: detected format: bag\n" in run(path, path, *options)[2]
    assert len(read_tum(tmp_path / "aligned.txt").keys) > 30
    code, out, err = run("bag", path, path, *TOPICS[:2])
    assert (code, out) == (1, "")
    assert err == (
        f"alignscores: error: {path}: has /gt, /odom; --ref_topic and --est_topic name one\n"
    )
    err = run("bag", path, path, "--ref_topic", "/none")[2]
    assert err.startswith(f"alignscores: error: {path}: is not a readable bag (")
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["run.bag", "run.mcap", "run.db3"])
def test_broken_bags(run, trajectories, tmp_path, name):
    storage = {"bag": "ROS 1", "mcap": "MCAP", "db3": "SQLITE3"}[name.partition(".")[2]]
    path = bag(tmp_path / (name if storage == "ROS 1" else "run"), storage, trajectories)
    file = path if path.is_file() else path / name
    for content in (file.read_bytes()[: file.stat().st_size // 2], b"nonsense", b""):
        file.write_bytes(content)
        code, out, err = run("bag", file, file, *TOPICS)
        assert (code, out) == (1, "")
        assert err.startswith(f"alignscores: error: {file}: is not a readable bag (")
        assert err.count("\n") == 1
    assert "cannot be read (No such file" in run("bag", tmp_path / "none.bag", file)[2]


def test_names_with_blanks_in_a_text_model(score, examples, tmp_path):
    """COLMAP writes them as they are, to the end of the line."""
    model = tmp_path / "model"
    shutil.copytree(examples / FILES["colmap"][0], model)
    written = pycolmap.Reconstruction(str(model))
    for image in written.images.values():
        image.name = f"my photos/a b {image.name}"
    written.write_text(str(model))
    (result,) = score("colmap", model, model)
    assert (result["n"], result["TAS"], result["notes"]) == (40, 1.0, [])


@pytest.mark.parametrize("format_name", FILES)
def test_the_format_is_recognised(run, format_name):
    files = FILES[format_name]
    code, out, err = run(*files, "--json")
    assert code == 0
    assert json.loads(out)["format"] == format_name
    assert f"note: detected format: {format_name}" in err


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        (("tum/reference.txt", "none.txt"), "none.txt: cannot be read (No such file or directory)"),
        (("none.txt", "tum/estimate.txt"), "none.txt: cannot be read (No such file or directory)"),
        (
            (".", "tum/estimate.txt"),
            ".: is a folder with no COLMAP model, bag or matrices in .txt files; name",
        ),
        ((__file__, "x"), f"{__file__}: its header names no x, y, z "),
    ],
)
def test_what_is_not_recognised(run, files, reason):
    code, out, err = run(*files)
    assert (code, out) == (1, "")
    assert f"alignscores: error: {reason}" in err
    assert "Traceback" not in err


def test_each_estimate_has_the_format_that_is_recognised(run, score):
    """One that has none does not stop the others."""
    code, out, err = run(*TUM[1:], "none.txt", "euroc/data.csv", "--json")
    assert code == 1
    assert "error: none.txt: cannot be read" in err
    assert "note: euroc/data.csv: detected format: euroc\n" in err
    results = json.loads(out)["results"]
    expected = score(*TUM) + score("tum", TUM[1], "euroc/data.csv", "--est_format", "euroc")
    assert [result["PAS"] for result in results] == [result["PAS"] for result in expected]
