"""Cameras of a rig: d is the spacing of the path, not the baseline."""

import numpy as np
import pytest

from alignscores import Trajectory, closest_pair_quartile, evaluate


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
        ("(", "is no regular expression"),
        (r"(x)_", "rig_frames: no name fits, such as 'cam0/0000.png'"),
    ],
)
def test_a_wrong_option_is_one_sentence(option, problem):
    _, truth, estimate = rig(in_folders, 2, 0.12)
    with pytest.raises(ValueError, match="rig_frames") as raised:
        evaluate(truth, estimate, rig_frames=option)
    assert problem in str(raised.value)
