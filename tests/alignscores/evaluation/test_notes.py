"""What is noted: poses left out, scores that do not compare, mix-ups of convention."""

import json
import warnings
from contextlib import suppress
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Convention, evaluate
from alignscores.evaluation import notes
from alignscores.evaluation.settings import Settings
from alignscores.similarity import Similarity
from alignscores.trajectories.files import (
    Trajectory,
    TrajectoryWarning,
    inverse_poses,
    read_colmap,
    read_kitti,
)
from alignscores.trajectories.files.vslamlab import HEADER as VSLAMLAB
from alignscores.trajectories.timing import TimeOffset
from alignscores.validation import AlignmentWarning

from ..conftest import write_poses

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"
KITTI = "kitti", "kitti/reference.txt", "kitti/estimate.txt"


def test_poses_without_a_reference(run, lines, write):
    late = [line.replace("17000000", "17000009", 1) for line in lines[:10]]
    code, _, err = run(*TUM[:2], write(lines + late))
    assert code == 0
    assert "est.txt: 9 of 48 poses have no reference pose near them in time\n" in err
    assert "of the time, the rest" not in err
    code, _, err = run("nerf", "nerf/estimate.json", "nerf/reference.json")
    assert code == 0
    assert "3 of 40 images are not in the reference; left out (it has all of" in err


@pytest.mark.parametrize(
    ("kept", "share"), [(range(19), 52), ([*range(10), *range(30, 38)], 48), (range(20, 38), 45)]
)
def test_a_lost_track(run, lines, write, kept, share):
    """Else lost frames would silently improve the score, be they in the middle or at an end."""
    est = write([lines[row] for row in kept])
    _, _, err = run(*TUM[:2], est, "--missing", "ignore")
    note = f"est.txt: the track covers only {share}% of the time, the rest is not scored"
    assert err == f"alignscores: note: {note}; --missing fail counts it as failures\n"
    assert run(*TUM[:2], est, "--missing", "fail")[2] == ""


def test_a_lost_track_where_the_reference_is_denser(run, score, tum):
    """A motion capture system has poses that no camera could have."""
    files = "tum", tum(400, 100, "gt.txt"), tum(40, 10, "est.txt", lost=(10, 30))
    _, _, err = run(*files, "--missing", "ignore")
    assert "the track covers only 50%" in err
    assert err.endswith("; --missing fail counts it as failures\n")
    (result,) = score(*files, "--missing", "fail")
    assert (result["n"], result["missing"], result["lost"]) == (40, 20, 0.5)
    assert run(*files, "--missing", "fail")[2] == ""
    tum(400, 10, "gt.txt")
    assert run(*files, "--missing", "fail")[2] == ""


def test_what_is_wrong_with_the_reference_is_noted_once(run, write, examples):
    reference = (examples / TUM[1]).read_text().splitlines()
    files = [TUM[2], TUM[2]]
    _, out, err = run("tum", write([*reference, reference[5]], "gt.txt"), *files, "--json")
    printed = json.loads(out)
    assert len(printed["notes"]) == 2
    assert "time stamps of the reference are not in order" in printed["notes"][0]
    assert printed["notes"][1] == "duplicates in the reference (of stamp or name), left out: 1"
    assert [result["notes"] for result in printed["results"]] == [[], []]
    assert err.splitlines() == [f"alignscores: note: {note}" for note in printed["notes"]]
    _, out, _ = run(*TUM[:2], *files, "--json")
    assert json.loads(out)["results"] == printed["results"]


@pytest.mark.parametrize("missing", ["ignore", "fail"])
def test_estimates_of_one_reference_have_one_d(run, tum, missing):
    """Though keyframes are farther apart."""
    reference = tum(400, 10, "gt.txt")
    both = tum(400, 10, "est.txt"), tum(40, 1, "est_keyframes.txt")
    code, out, err = run("tum", reference, *both, "--json", "--missing", missing)
    assert (code, err) == (0, "")
    printed = json.loads(out)
    assert printed["ranked_by"] == "PAS"
    first, second = printed["results"]
    assert first["unit"] == second["unit"]
    assert first["n"] == second["n"] == 400
    assert first["half_distance"] == pytest.approx(second["half_distance"], rel=0.2)


@pytest.mark.parametrize("missing", ["ignore", "fail"])
def test_estimates_of_some_images_have_the_d_of_all(run, examples, write, missing):
    content = json.loads((examples / "nerf/estimate.json").read_text())
    content["frames"] = content["frames"][::4]
    few = write(json.dumps(content), "few.json")
    files = ["nerf", "nerf/reference.json", "nerf/estimate.json", few]
    _, out, err = run(*files, "--missing", missing, "--json")
    assert err == ""
    results = {result["name"]: result for result in json.loads(out)["results"]}
    assert results["few.json"]["unit"] == results["estimate.json"]["unit"]
    if missing == "fail":
        assert list(results) == ["estimate.json", "few.json"]


def test_real_keyframes_and_all_frames_stand_in_one_table(run, real):
    files = [real / f"fr2_desk_{name}.txt" for name in ("groundtruth", "ORB", "ORB_kf_mono")]
    _, out, err = run("tum", *files, "--json")
    frames, keyframes = json.loads(out)["results"]
    assert [result["name"][9:-4] for result in (frames, keyframes)] == ["ORB", "ORB_kf_mono"]
    assert frames["unit"] == keyframes["unit"] == pytest.approx(0.00819, rel=0.05)
    assert frames["n"] == keyframes["n"]
    assert max(frames["lost"], keyframes["lost"]) < 0.15
    assert keyframes["half_distance"] == pytest.approx(frames["half_distance"], rel=1)
    assert err.count("duplicates in the reference") == 1
    assert "ORB.txt: the track covers" not in err


def test_mix_ups(run, kitti, examples, lines, write):
    """Besides those that options take out; see test_scoring.py."""
    poses = read_kitti(examples / KITTI[2]).poses
    mirrored, transposed = poses.copy(), poses.copy()
    mirrored[:, 1, 3] *= -1
    _, _, err = run(*KITTI[:2], kitti(mirrored))
    assert "the positions fit the mirror image of the reference" in err
    transposed[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    _, _, err = run(*KITTI[:2], kitti(transposed))
    assert "the rotations seem to be world-to-camera, but the positions are camera centres" in err
    translations = poses.copy()
    translations[:, :3, 3] = inverse_poses(poses)[:, :3, 3]
    _, _, err = run(*KITTI[:2], kitti(translations))
    assert "the positions seem to be world-to-camera translations t, but the rotations R are" in err


WRONG_END = "the quaternions seem to have w at the wrong end"


@pytest.mark.parametrize(
    ("form", "separator", "header"),
    [("tum", " ", "#"), ("euroc", " ", "#"), ("vslamlab", ",", VSLAMLAB)],
)
def test_quaternions_with_w_at_the_wrong_end(run, lines, write, form, separator, header):
    if form != "tum":  # in nanoseconds
        lines = [line.replace(".", "", 1).replace(" ", "000 ", 1) for line in lines]
    fields = [line.split() for line in lines]
    shifted = [separator.join([*line[:4], line[7], *line[4:7]]) for line in fields]
    assert WRONG_END in run(*TUM[:2], write([header, *shifted]), "--est_format", form)[2]


def test_quaternions_of_a_model_with_w_at_the_wrong_end(run, examples, tmp_path):
    names, poses = read_colmap(examples / "colmap/estimate")
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).inv().as_quat()[:, [3, 0, 1, 2]]
    poses[:, :3, :3] = Rotation.from_quat(quaternions).inv().as_matrix()
    write_poses["colmap"](tmp_path / "model", names, poses)
    assert WRONG_END in run("colmap", "colmap/reference", tmp_path / "model")[2]


def test_a_time_offset(run, score, tmp_path):
    def tum(rate, offset, name):
        times = np.arange(20, 1980 if "est" in name else 2000, 100 / rate) / 100
        path = [np.sin(times), np.cos(1.7 * times), np.sin(0.3 * times**1.5)]
        rotations = [np.zeros((3, len(times)))], [np.ones(len(times))]
        np.savetxt(tmp_path / name, np.vstack([times - offset, path, *map(np.vstack, rotations)]).T)
        return tmp_path / name

    reference = tum(50, 0, "gt.txt")
    ignore = "--missing", "ignore"  # both ends of the reference have no frame
    (honest,) = score("tum", reference, tum(10, 0, "est.txt"), *ignore)
    assert honest["notes"] == []
    for offset, code in ((0.2, 0), (-1.7e9, 1)):
        files = "tum", reference, tum(10, offset, "est_off.txt"), *ignore
        found, _, err = run(*files)
        assert found == code
        assert ("count from its start: --t_offset auto" if code else "--t_offset 0.200, or") in err
        (result,) = score(*files, "--t_offset", "auto")
        assert f"time offset of {offset:.4f} s found" in result["notes"][0]
        assert result["PAS"] == pytest.approx(honest["PAS"], abs=0.02)
    few = tmp_path / "few.txt"
    few.write_text("".join(files[2].read_text().splitlines(True)[:9]))
    code, _, err = run("tum", reference, few, *ignore, "--t_offset", "auto")
    assert code == 1
    assert "no time offset makes its positions fit" in err


def test_no_time_offset_is_made_up_on_an_orbit(run, score, tmp_path):
    """A circle, turned about its middle, fits at any offset."""
    times = np.arange(120) / 10
    path = np.transpose([np.cos(times / 2), np.sin(times / 2), np.zeros(120), *np.zeros((3, 120))])
    for name, noise in (("gt.txt", 0), ("est.txt", 0.01)):
        errors = np.random.default_rng(0).normal(scale=noise, size=(120, 3))
        poses = path + np.pad(errors, ((0, 0), (0, 3)))
        np.savetxt(tmp_path / name, np.column_stack([times, poses, np.ones(120)]))
    files = "tum", tmp_path / "gt.txt", tmp_path / "est.txt"
    (plain,) = score(*files)
    (found,) = score(*files, "--t_offset", "auto")
    assert found["TAS"] == plain["TAS"]
    assert "no time offset at which its positions fit 1.2 times" in found["notes"][0]


def test_swapped_files(run, tmp_path):
    gt, est = (tmp_path / name for name in ("gt.txt", "est.txt"))
    times = np.arange(400) / 40
    path = np.column_stack([np.sin(times), np.cos(times), times, np.zeros((400, 3)), np.ones(400)])
    np.savetxt(gt, np.column_stack([times, path]))
    path[:, :3] -= path[0, :3]
    np.savetxt(est, np.column_stack([times, path])[::4])
    assert "swapped" not in run("tum", gt, est)[2]
    assert "reference and estimate seem swapped" in run("tum", est, gt)[2]


def drive(n=60, *, turning=True):
    """Poses of a camera that looks ahead, on a winding road or a straight one; y is vertical."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    headings = np.sin(np.arange(n) / 8) if turning else np.zeros(n)
    poses[:, :3, :3] = Rotation.from_euler("y", headings[:, None]).as_matrix()
    poses[1:, :3, 3] = np.cumsum(poses[:-1, :3, 2], axis=0)
    return poses


def moved(poses, body, noise=0.01):
    """The same in another world, with noise, and seen in another frame of the body."""
    frame, world = np.eye(4), np.eye(4)
    frame[:3, :3], world[:3, :3] = body.as_matrix(), Rotation.from_euler("y", 1).as_matrix()
    est = world @ poses @ frame
    est[:, :3, 3] += np.random.default_rng(0).normal(scale=noise, size=(len(est), 3)) + 4
    return est


APART = "positions and rotations are aligned by rotations that differ by "


@pytest.mark.parametrize(
    ("degrees", "alignment", "expected"),
    [
        (15, ["similarity"], APART + "15."),
        (15, ["rigid"], APART + "15."),
        (15, ["yaw", "--up=-y"], APART + "15."),
        (15, ["none"], None),
        (3, ["similarity"], None),
    ],
)
def test_a_camera_that_is_mounted_otherwise_than_calibrated(
    run, kitti, degrees, alignment, expected
):
    """On a flat road its heading is taken for that of the world, so that no score counts it."""
    body = Rotation.from_euler("y", degrees, degrees=True)
    files = kitti(drive(), "gt.txt"), kitti(moved(drive(), body))
    _, out, err = run("kitti", *files, "--alignment", *alignment, "--json")
    (result,) = json.loads(out)["results"]
    if expected is None:
        assert err == ""
    else:
        assert (result["RAS"], err.count("\n")) == (1, 1)
        assert expected in err
        assert err.endswith("look at the calibration between camera and body\n")


def test_where_positions_fix_no_rotation_the_two_are_not_compared(run, kitti):
    """On a straight road the spin about it is free; and noise as large as the bends turns it."""
    straight, body = drive(turning=False), Rotation.from_euler("y", 15, degrees=True)
    for gt, noise in ((straight, 0.01), (drive(), 8)):
        assert APART not in run("kitti", kitti(gt, "gt.txt"), kitti(moved(gt, body, noise)))[2]


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("alignment", [["rigid"], ["yaw", "--up", "y"]])
def test_two_positions_fix_no_rotation(run, kitti, alignment, n):
    """Though so few fit exactly, as the rotations of all do."""
    est = moved(drive(), Rotation.from_euler("y", 15, degrees=True), noise=0)
    est[n:, :3, 3] = np.nan
    files = kitti(drive(), "gt.txt"), kitti(est)
    code, _, err = run("kitti", *files, "--alignment", *alignment)
    assert (code, APART in err) == (0, False)


@pytest.mark.parametrize("wrong", ["positions", "rotations", "all rotations alike"])
def test_where_one_of_the_two_is_bad_it_has_no_alignment_to_compare(run, kitti, wrong):
    est, rng = moved(drive(), Rotation.identity()), np.random.default_rng(1)
    if wrong == "positions":
        est[:, :3, 3] += rng.normal(scale=3, size=(len(est), 3))
    elif wrong == "rotations":
        est[:, :3, :3] = Rotation.random(len(est), rng=rng).as_matrix()
    else:
        est[:, :3, :3] = np.eye(3)
    assert APART not in run("kitti", kitti(drive(), "gt.txt"), kitti(est))[2]


def test_another_convention_explains_why_the_two_differ(run, kitti):
    body = Rotation.from_euler("x", 180, degrees=True)  # OpenGL's axes
    files = kitti(drive(), "gt.txt"), kitti(moved(drive(), body))
    _, _, err = run("kitti", *files)
    assert "--body_rotation auto takes it out" in err
    assert APART not in err
    assert APART not in run("kitti", *files, "--body_rotation", "auto")[2]
    result = evaluate(*files, format="kitti").result
    turn = Rotation.from_matrix(result.tas.alignment.rotation.T @ result.ras.alignment)
    assert np.degrees(turn.magnitude()) > 90


@pytest.mark.parametrize("factor", [0.5, 0.97, 0.985, 1.0, 1.015, 1.03, 2.0])
def test_a_scale_that_is_off_is_told_below_the_table(run, kitti, factor):
    est = drive()
    est[:, :3, 3] *= factor
    files = "kitti", kitti(drive(), "gt.txt"), kitti(drive(), "right.txt"), kitti(est, "est.txt")
    line = (
        f"scale: est.txt {factor:g} times the reference's, taken out; --alignment rigid counts it"
    )
    _, out, _ = run(*files)
    assert (line in out.splitlines()) == (abs(factor - 1) > 0.02)
    results = {one["name"]: one for one in json.loads(run(*files, "--json")[1])["results"]}
    assert results["est.txt"]["scale"] == pytest.approx(factor)
    assert results["est.txt"]["alignment"]["scale"] == pytest.approx(1 / factor)
    if abs(factor - 1) > 0.02:
        _, out, _ = run(*files, "--alignment", "rigid")
        assert "scale:" not in out
        (right, wrong) = json.loads(run(*files, "--alignment", "rigid", "--json")[1])["results"]
        assert (right["scale"], wrong["scale"]) == (1, 1)
        assert wrong["TAS"] < right["TAS"] == 1


def test_images_have_no_metric_scale_to_be_off(run):
    _, out, _ = run("nerf", "nerf/reference.json", "nerf/estimate.json")
    assert "scale:" not in out


def stamped(n, unit=1.0):
    return Trajectory((1.7e9 + np.arange(n)) * unit, np.tile(np.eye(4), (n, 1, 1)))


def matched(unmatched=0, missing=0, lost=0.0, without_reference=0):
    return SimpleNamespace(
        unmatched=unmatched,
        missing=missing,
        lost=lost,
        without_reference=np.zeros(without_reference),
    )


COVERS = "the track covers only {} of the time, the rest is not scored; --missing fail counts it as"


@pytest.mark.parametrize(
    ("form", "missing", "counts", "expected"),
    [
        *[("tum", "ignore", {"unmatched": 10}, []), ("nerf", "ignore", {"lost": 0.9}, [])],
        (
            "tum",
            "ignore",
            {"unmatched": 11},
            ["11 of 100 poses have no reference pose near them in time"],
        ),
        (
            "tum",
            "ignore",
            {"without_reference": 2},
            ["2 of the --frames have no reference pose within --t_max_diff; left out"],
        ),
        *[("tum", "ignore", {"lost": 0.1}, []), ("tum", "fail", {"lost": 0.9}, [])],
        ("tum", "ignore", {"lost": 0.11}, [COVERS.format("89%") + " failures"]),
        (
            "tum",
            "ignore",
            {"unmatched": 99, "without_reference": 1, "lost": 0.75},
            [
                "99 of 100 poses have no reference pose near them in time",
                "1 of the --frames have no reference pose within --t_max_diff; left out",
                COVERS.format("25%") + " failures",
            ],
        ),
        ("nerf", "fail", {"missing": 1}, []),
        (
            "nerf",
            "fail",
            {"unmatched": 1, "missing": 1},
            ["1 of 100 images are not in the reference; left out"],
        ),
        (
            "nerf",
            "fail",
            {"unmatched": 3},
            [
                "3 of 100 images are not in the reference; left out (it has all of the "
                "reference's, too: the reference comes first)"
            ],
        ),
    ],
)
def test_what_did_not_match(form, missing, counts, expected):
    settings = Settings(format=form, missing=missing)
    found = notes.matching_notes(matched(**counts), stamped(90), stamped(100), settings)
    assert found == expected


def test_poses_that_do_not_match_may_be_in_another_unit():
    one, other = stamped(100), stamped(100, 1e9)
    (found,) = notes.matching_notes(matched(50), one, other, Settings(format="tum"))
    assert found.endswith(
        "time; those of the estimate seem to be in nanoseconds: write them in seconds"
    )


def turned_apart(degrees):
    """Results whose two alignments differ by an angle, with positions and errors beside."""
    turn = Rotation.from_rotvec([0, degrees, 0], degrees=True).as_matrix()
    world = Rotation.from_rotvec([0.5, 1, 2]).as_matrix()
    positions = np.array([[3.0, 0, 0], [-3, 0, 0], [0, 2, 0], [0, -2, 0], [99, 99, 99]]) + 7
    tas = SimpleNamespace(
        alignment=Similarity(2.0, world, np.ones(3)), errors=np.array([0.1, 0.1, 0, 0.1, np.inf])
    )
    ras = SimpleNamespace(alignment=world @ turn, errors=np.array([0.0, 5.0, 5.0, np.inf, np.inf]))
    return positions, SimpleNamespace(tas=tas, ras=ras)


def test_alignments_that_differ_are_told():
    positions, result = turned_apart(6.04)
    assert notes.alignment_notes(positions, result) == [
        "positions and rotations are aligned by rotations that differ by 6.0 degrees, which "
        "neither score counts: look at the calibration between camera and body"
    ]
    assert notes.alignment_notes(*turned_apart(4.9)) == []
    for kind in "tas", "ras":
        positions, result = turned_apart(6)
        getattr(result, kind).alignment = None
        assert notes.alignment_notes(positions, result) == []
    positions, result = turned_apart(6)
    result.ras.errors[1:3] = 5.1
    assert notes.alignment_notes(positions, result) == []
    positions, result = turned_apart(6)
    result.tas.errors[:4] = 0.13
    assert notes.alignment_notes(positions, result) == []


def test_alignments_differ_by_more_than_the_bound(monkeypatch):
    positions, result = turned_apart(6)
    turn = result.tas.alignment.rotation.T @ result.ras.alignment
    apart = float(notes.rotation_angles(turn[None])[0])
    for bound, told in ((apart, 0), (apart - 1e-9, 1)):
        monkeypatch.setattr(notes, "APART_DEG", bound)
        assert len(notes.alignment_notes(positions, result)) == told


@pytest.mark.parametrize(("error", "fixed"), [(0.1232, True), (0.1233, False)])
def test_positions_fix_a_rotation_of_five_degrees_beside_their_errors(error, fixed):
    """The square root of 2 from a line, in the mean of squares, times its sine."""
    positions = np.array([[3.0, 0, 0], [-3, 0, 0], [0, 2, 0], [0, -2, 0]]) + 7
    assert notes._fix_rotation(positions, np.array([0, error, error, 9])) is fixed


def test_three_positions_may_fix_a_rotation():
    positions = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert notes._fix_rotation(positions, np.zeros(3)) is True
    assert notes._fix_rotation(positions[:2], np.zeros(2)) is False
    on_a_line = np.array([[1.0, 0, 0], [2, 0, 0], [3, 0, 0]])
    assert notes._fix_rotation(on_a_line, np.zeros(3)) is False


def test_scales_that_are_off():
    scales = {
        "a": 1.0201,
        "b": 1.0199,
        "c": None,
        "d": 1 / 1.0201,
        "e": 1 / 1.0199,
        "f": 1234.5,
    }
    said = (
        "scale: a 1.02, d 0.98, f 1.23e+03 times the reference's, taken out; --alignment rigid "
        "counts it"
    )
    assert notes.scale_note(scales, Settings(format="tum")) == said
    assert notes.scale_note({"b": 1.0, "c": None}, Settings(format="tum")) == ""
    assert notes.scale_note(scales, Settings(format="tum", alignment="rigid")) == ""
    assert notes.scale_note(scales, Settings(format="colmap")) == ""


def test_parts_are_told():
    aligned = Similarity(1.0, np.eye(3), np.zeros(3))
    parts = [SimpleNamespace(name=name, alignment=aligned) for name in ("0", "1", "2")]
    in_parts = (
        "in 3 parts, each aligned on its own: the scores are an upper bound of those of one model, "
        "and do not compare with those of fewer parts"
    )
    assert notes.parts_notes([]) == []
    assert notes.parts_notes(parts) == [in_parts]
    parts[0].alignment = parts[2].alignment = None
    lost = "cannot be aligned, so that their cameras fail: the parts 0, 2"
    assert notes.parts_notes(parts) == [in_parts, lost]


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        *[(None, []), (TimeOffset(0.25, 1.4), [])],
        (
            TimeOffset(-0.25, 1.5),
            [
                "its time stamps seem to be off: -0.250 s more and the positions fit 1.5 times as "
                "well; --t_offset 1.750, or auto"
            ],
        ),
    ],
)
def test_clocks_that_differ_are_told(monkeypatch, found, expected):
    reference, estimate = stamped(5), stamped(4)

    def offset(ref, est):
        assert ref is reference
        np.testing.assert_array_equal(est.keys, estimate.keys + 2)
        assert est.poses is estimate.poses
        return found

    monkeypatch.setattr(notes, "find_offset", offset)
    assert notes.offset_notes(reference, estimate, 2.0) == expected


GAIN = "(RAS 0.12 as it is, 0.99 so)"
FRAME = (
    "the camera's frame is turned by a constant rotation against the reference's, 180 deg about x, "
    "as OpenGL's camera axes to OpenCV's"
)


@pytest.mark.parametrize(
    ("found", "invert", "applied", "expected"),
    [
        ({}, False, False, []),
        (
            {"inverted": True},
            False,
            False,
            [f"the poses in the file seem to be world-to-camera {GAIN}; add --invert"],
        ),
        (
            {"inverted": True, "frame": True},
            True,
            False,
            [
                "the poses in the file seem to be camera-to-world, not world-to-camera, and "
                f"{FRAME} {GAIN}; leave out --invert, with --body_rotation auto"
            ],
        ),
        (
            {"quaternions_shifted": True, "rotations_inverted": True, "frame": True},
            False,
            False,
            [f"the quaternions seem to have w at the wrong end {GAIN}; reorder them in the file"],
        ),
        (
            {"rotations_inverted": True},
            False,
            False,
            [
                "the rotations seem to be world-to-camera, but the positions are camera centres "
                f"{GAIN}; transpose the rotations in the file"
            ],
        ),
        (
            {"rotations_inverted": True, "frame": True},
            False,
            False,
            [
                "the rotations seem to be world-to-camera, but the positions are camera centres, "
                f"and {FRAME} {GAIN}; transpose the rotations in the file"
            ],
        ),
        ({"frame": True}, False, False, [f"{FRAME} {GAIN}; --body_rotation auto takes it out"]),
        ({"frame": True}, False, True, [f"{FRAME} {GAIN}; taken out"]),
        (
            {"positions_inverted": True, "mirrored": True},
            False,
            False,
            [
                "the positions seem to be world-to-camera translations t, but the rotations R are "
                "camera-to-world; write the camera centres -R t into the file",
                "the positions fit the mirror image of the reference: one axis is flipped or two "
                "are swapped, as in a left-handed world; no rotation mends that, correct the "
                "export",
            ],
        ),
    ],
)
def test_what_is_said_of_a_convention(found, invert, applied, expected):
    flags = {key: value for key, value in found.items() if key != "frame"}
    body = np.diag([1.0, -1.0, -1.0]) if "frame" in found else None
    one = Convention(**flags, body_rotation=body, ras=0.123, corrected_ras=0.987)
    assert notes.convention_notes(one, invert=invert, applied=applied) == expected


def warn_of_much():
    for _ in range(2):
        warnings.warn("twice", AlignmentWarning, stacklevel=1)
    warnings.warn("a\x07b", TrajectoryWarning, stacklevel=1)
    warnings.warn("another", UserWarning, stacklevel=1)


def collected(warn):
    with notes.collected_warnings() as found:
        warn()
    return found


def test_own_warnings_become_notes_each_once():
    """Others are issued, as from where they came."""
    with pytest.warns(UserWarning, match="^another$") as caught:
        found = collected(warn_of_much)
    assert found == ["twice", "a\\x07b"]
    assert [(one.category, one.filename) for one in caught] == [(UserWarning, __file__)]


def test_an_error_leaves_the_notes_before_it():
    with suppress(KeyError), notes.collected_warnings() as found:
        warnings.warn("before", AlignmentWarning, stacklevel=1)
        raise KeyError
    assert found == ["before"]


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ValueError(" two \n lines"), "two lines"),
        *[(KeyError(), "KeyError"), (MemoryError("x"), "there is not enough memory for it")],
    ],
)
def test_why(error, message):
    assert notes.why(error) == message
