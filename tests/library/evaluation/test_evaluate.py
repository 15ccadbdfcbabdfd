"""One estimate from its options to its scores, and what cannot be scored."""

import numpy as np
import pytest

from alignscores import closest_pair_quartile, evaluate
from alignscores.io import (
    Trajectory,
    inverse_poses,
    read_kitti,
    read_stamps,
    read_tum,
)
from tests.files import AT_STAMPS, KITTI, TUM

PAPER = "--registration", "pcr99"
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def test_d_can_be_given(score):
    (result,) = score(*TUM, "--unit", 2.5)
    assert result["unit"] == 2.5
    (plain,) = score(*TUM)
    assert result["TAS"] > plain["TAS"]
    for unit in (1e-4, 2.5, 1e4):  # the half-score distance knows nothing of it
        (result,) = score(*TUM, "--unit", unit)
        assert result["half_distance"] == pytest.approx(plain["half_distance"], rel=2e-3)


def test_expected_frames(run, score, tum, write):
    """At a rate, at each pose of the reference, or at given stamps; d is theirs."""
    files = "tum", tum(2000, 100, "gt.txt"), tum(40, 2, "est.txt", lost=(10, 20))
    stamps = read_tum(files[1]).keys
    for options, n, lost in (
        ((), 200, 0.175),  # 5.5 s between two poses, 2 s covered
        (("--rate", 2), 40, 0.175),
        (("--rate", "all"), 2000, 0.175),
        (("--max_gap", 5.5), 200, 0),
        (("--max_gap", 0, "--rate", 2), 40, 0.26),
        (("--t_start", 10, "--t_end", 14.999), 50, 0),
    ):
        (result,) = score(*files, *options)
        assert result["n"] == pytest.approx(n, abs=1)
        assert result["lost"] == pytest.approx(lost, abs=0.03)
    times = np.arange(0, 20.5, 0.5)
    for content in (
        ["# t file", *(f"{time} rgb/{time}.png" for time in times)],
        ["t,file", *(f"{time:.3f},a.png" for time in times)],
    ):
        frames = "--frames", write(content, "frames.txt")
        (result,) = score(*files, *frames, "--max_gap", 0)
        assert (result["expected"], result["matched"]) == (40, 30)
        assert "1 of the --frames have no reference pose within" in result["notes"][0]["text"]
        (result,) = score(*files, *frames)
        assert result["matched"] == pytest.approx(33, abs=1)
        unit = closest_pair_quartile(read_tum(files[1]).poses[np.isin(stamps, times), :3, 3])
        assert result["unit"] == unit
    ns = [f"{time * 1e9 + 1.7e18:.0f}" for time in times]
    assert (read_stamps(write(["#t", *ns], "ns.csv")) - 1.7e9).tolist() == times.tolist()
    assert "no expected frame has a reference" in run(*files, "--frames", write(ns, "ns.csv"))[2]


def test_inverted_poses_score_as_the_right_ones(score, run, kitti, examples):
    (honest,) = score(*KITTI)
    path = kitti(inverse_poses(read_kitti(examples / KITTI[2]).poses))
    code, _, err = run(*KITTI[:2], path)
    assert code == 0
    assert "the poses of estimate.txt seem to be world-to-camera" in err
    assert "; --est_invert corrects it\n" in err
    (inverted,) = score(*KITTI[:2], path, "--invert")
    assert inverted["PAS"] == pytest.approx(honest["PAS"], abs=1e-9)
    assert inverted["notes"] == []
    (result,) = score(*KITTI[:2], path)  # never silently
    assert result["RAS"] < honest["RAS"] / 3
    assert "; leave out --est_invert\n" in run(*KITTI, "--invert")[2]


@pytest.mark.parametrize("inverted", [False, True])
def test_a_rotation_of_the_camera_frame_is_removed(score, run, kitti, examples, inverted):
    (honest,) = score(*KITTI)
    poses = read_kitti(examples / KITTI[2]).poses @ OPENGL
    files = *KITTI[:2], kitti(inverse_poses(poses) if inverted else poses)
    options = ["--invert"] if inverted else []
    _, _, err = run(*files)
    assert "the camera frame of estimate.txt is rotated against that of reference.txt" in err
    assert "180 deg about x, as OpenGL's camera axes to OpenCV's" in err
    assert ("; --est_invert --body_rotation auto corrects it\n" in err) == inverted
    if not inverted:
        _, _, err = run(*files, "--invert")
        assert "; leave out --est_invert, and add --body_rotation auto\n" in err
    (plain,) = score(*files, *options)
    assert plain["body_rotation"] is None
    assert plain["RAS"] < honest["RAS"] / 3
    (corrected,) = score(*files, *options, "--body_rotation", "auto")
    assert corrected["RAS"] == pytest.approx(honest["RAS"], abs=1e-9)
    assert corrected["TAS"] == pytest.approx(honest["TAS"], abs=1e-9)
    assert corrected["body_rotation"] == OPENGL[:3, :3].tolist()
    assert "was removed" in corrected["notes"][0]["text"]
    # Where nothing is found nothing is applied.
    (unchanged,) = score(*KITTI, "--body_rotation", "auto")
    note, *others = unchanged["notes"]
    assert note["text"].startswith("no rotation of the camera frame was removed")
    assert unchanged | {"notes": others} == honest


def test_too_few_matches_are_an_error_of_matching(run, score, write, lines):
    """Not one of the unit: --unit would hide it."""
    early = [line.replace("17000000", "17000009", 1) for line in lines[3:]]
    files = *TUM[:2], write([*lines[:3], *early])
    for options in ([], ["--unit", 1], ["--missing", "ignore"]):
        code, out, err = run(*files, *options, "--t_max_diff", 0.02, *AT_STAMPS)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert "est.txt: only 3 of 38 poses could be matched" in err
        assert "--t_max_diff 0.02" in err


def test_where_there_is_no_d_the_option_is_named(run, score, kitti, examples):
    poses = read_kitti(examples / KITTI[1]).poses
    standing = poses.copy()
    standing[5:, :3, 3] = poses[5, :3, 3]
    for path, reason in (
        (kitti(poses[:3], "few.txt"), "3 of the reference's poses are expected; at least 4 are"),
        (kitti(standing, "stands.txt"), "three quarters of the reference poses coincide"),
    ):
        code, out, err = run("kitti", path, path)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert f"{path}: d cannot be derived: " in err
        assert reason in err
        assert err.endswith("--unit sets it\n")
        (result,) = score("kitti", path, path, "--unit", 0.1)
        assert result["TAS"] == 1.0
    far = poses.copy()
    far[7, :3, 3] = 0, 1e10, 0
    path = kitti(far, "far.txt")
    reason = "the reference's pose 7, (0, 1e+10, 0), is far away from the others; leave it out, or"
    assert f"{path}: d cannot be derived: {reason} --unit sets it" in run("kitti", path, path)[2]
    four = kitti(standing[-4:], "four.txt")
    assert "the reference stands still: all of its 4 poses" in run("kitti", four, four)[2]


def test_what_cannot_be_aligned(score, examples, kitti):
    poses = read_kitti(examples / KITTI[1]).poses
    poses[:, :3, 3] = 1
    (result,) = score(*KITTI[:2], kitti(poses))
    assert result["TAS"] == 0
    assert result["ate"] is result["half_distance"] is None
    assert "".join(note["text"] for note in result["notes"]).count("TAS is 0") == 1


STAMPS = np.arange(20) / 10
STILL = np.tile(np.eye(4), (20, 1, 1))


@pytest.mark.parametrize("whose", ["reference", "estimate"])
@pytest.mark.parametrize(
    ("keys", "poses", "reason"),
    [
        (np.where(STAMPS > 0.4, np.nan, STAMPS), STILL, "stamp of pose 6 of the {} is not finite"),
        (np.full(20, 3.0), STILL, "all 20 time stamps of the {} are the same"),
        (STAMPS[:, None], STILL, "the keys of the {} .* not an array of shape"),
        (STAMPS, STILL[:15], "the poses of the {} must have shape .* not "),
        ([None, *"abc"], STILL[:4], "keys of the {} must be a list of .* type object"),
        (STAMPS, STILL.astype(str), "{}.poses must hold real numbers"),
        (STAMPS, [[1.0], [2.0, 3.0]], "{}.poses is not a regular array"),
        (STAMPS[:0], STILL[:0], "the {} has no poses"),
    ],
)
def test_malformed_trajectories_are_refused(whose, keys, poses, reason):
    poses = poses if isinstance(poses, list) else poses.copy()
    sound, malformed = Trajectory(STAMPS, STILL), Trajectory(keys, poses)
    pair = (malformed, sound) if whose == "reference" else (sound, malformed)
    for t_offset in (0.0, "auto"):
        with pytest.raises(ValueError, match=reason.format(whose)):
            evaluate(*pair, t_offset=t_offset)


def test_a_reference_of_nan_alone_is_refused():
    with pytest.raises(ValueError, match=r"^the reference has no pose that is finite$"):
        evaluate(Trajectory(STAMPS, np.full_like(STILL, np.nan)), Trajectory(STAMPS, STILL))


def test_models_in_memory(examples):
    """A COLMAP model is scored as its folder, as reference, as estimate and as both."""
    pycolmap = pytest.importorskip("pycolmap")
    paths = [examples / "colmap" / name for name in ("reference", "estimate")]
    models = [pycolmap.Reconstruction(str(path)) for path in paths]
    expected = evaluate(*paths, format="colmap")
    for pair in (models, (models[0], paths[1]), (paths[0], models[1])):
        assert evaluate(*pair, format="colmap").pas == expected.pas
    with pytest.raises(ValueError, match="the Reconstruction: the model has no registered image"):
        evaluate(pycolmap.Reconstruction(), models[1])
