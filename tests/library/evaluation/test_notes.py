"""Notes on poses left out, gaps, scores that chance explains, mix-ups of convention."""

import json
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import evaluate
from alignscores.io import Trajectory
from tests.files import TUM, write_poses


def winding(seconds=40, rate=10):
    """Poses of a camera that moves and turns all the time."""
    times = np.arange(seconds * rate) / rate
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, 3] = np.transpose([10 * np.cos(times / 7), 8 * np.sin(times / 5), np.sin(times)])
    turns = np.transpose([0.3 * np.sin(times), 0.2 * np.cos(times / 3), times / 7])
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return Trajectory(times, poses)


TRUTH = winding()


def notes(*files, **settings):
    """Return the notes of an evaluation as they are printed."""
    return [str(note) for note in evaluate(*files, **settings).notes]


def without(lost):
    """Return the truth without the poses where `lost`, a function of the time, is true."""
    has_pose = ~lost(TRUTH.keys)
    return Trajectory(TRUTH.keys[has_pose], TRUTH.poses[has_pose])


def test_poses_without_a_reference(run, lines, write):
    late = [line.replace("17000000", "17000009", 1) for line in lines[:10]]
    code, _, err = run(*TUM[:2], write(lines + late))
    assert code == 0
    assert "est.txt: 9 of 48 poses have no reference pose near them in time\n" in err
    code, _, err = run("nerf", "nerf/estimate.json", "nerf/reference.json")
    assert code == 0
    assert "3 of 40 images are not in the reference; left out\n" in err


def test_a_lost_track_that_is_not_scored():
    """Otherwise lost frames would improve the score without a word."""
    half = without(lambda times: times >= 20)
    ignored, failed = (evaluate(TRUTH, half, missing=missing) for missing in ("ignore", "fail"))
    assert [str(note) for note in ignored.notes] == [
        "only 52% of the time is scored, since the rest is lost; --missing fail counts it as "
        "failures"
    ]
    assert ignored.pas == 1
    assert failed.pas == pytest.approx(0.525, abs=0.001)


def test_what_is_wrong_with_the_reference_is_noted_once(run, write, examples):
    reference = (examples / TUM[1]).read_text().splitlines()
    files = [TUM[2], TUM[2]]
    _, out, err = run("tum", write([*reference, reference[5]], "gt.txt"), *files, "--json")
    printed = json.loads(out)
    assert len(printed["notes"]) == 2
    assert "time stamps of the reference are not in order" in printed["notes"][0]
    assert printed["notes"][1] == "duplicate stamps or names in the reference, left out: 1"
    assert [result["notes"] for result in printed["results"]] == [[], []]
    assert err.splitlines() == [f"alignscores: note: {note}" for note in printed["notes"]]


ABSENT = "the reference has no pose for {} of the {}; nothing is expected there"


@pytest.mark.parametrize("how", ["rows of nan", "a gap"])
def test_nothing_is_expected_where_a_reference_has_no_pose(run, tmp_path, how):
    inside = (TRUTH.keys >= 10) & (TRUTH.keys < 20)
    if how == "a gap":
        reference = Trajectory(TRUTH.keys[~inside], TRUTH.poses[~inside])
    else:
        reference = Trajectory(TRUTH.keys, TRUTH.poses.copy())
        reference.poses[inside, :3] = np.nan
    for estimate in (TRUTH, reference):
        evaluation = evaluate(reference, estimate)
        assert (evaluation.pas, evaluation.lost, evaluation.to_dict()["n"]) == (1, 0, 300)
        assert ABSENT.format("25.3%", "time, in gaps above 0.2 s") in [
            str(note) for note in evaluation.notes
        ]
    assert notes(TRUTH, TRUTH) == []
    write_poses["tum"](tmp_path / "gt", *reference)
    err = run("tum", tmp_path / "gt", tmp_path / "gt", tmp_path / "gt")[2]
    assert err == f"alignscores: note: {ABSENT.format('25.3%', 'time, in gaps above 0.2 s')}\n"


def repeated(n):
    """Return the truth with n of its poses twice."""
    rows = np.sort(np.append(np.arange(len(TRUTH.keys)), np.arange(0, 2 * n, 2)))
    return Trajectory(TRUTH.keys[rows], TRUTH.poses[rows])


def test_duplicates_are_noted_or_refused():
    assert notes(TRUTH, repeated(3)) == []
    assert notes(TRUTH, repeated(20)) == [
        "20 of 420 poses have the time stamp of another one; the first one counts"
    ]
    other = repeated(3)
    other.poses[1, :3, 3] += 1  # of the first stamp
    for estimate in (other, Trajectory(other.keys[::-1], other.poses[::-1])):
        (note,) = (note for note in notes(TRUTH, estimate) if "in order" not in note)
        assert note.startswith("3 of 403 poses have the time stamp of another one, 1 with another")
    message = (
        "^100 of 500 poses of the estimate have the time stamp of another one; write stamps with "
        "all their digits, and each pose once$"
    )
    with pytest.raises(ValueError, match=message):
        evaluate(TRUTH, repeated(100))


def test_few_scored_poses_are_noted():
    note = "only 19 of its poses are scored; so few poses can fit by chance"
    for n, noted in ((19, True), (20, False)):
        rows = np.linspace(0, len(TRUTH.keys) - 1, n).round().astype(int)
        estimate = Trajectory(TRUTH.keys[rows], TRUTH.poses[rows])
        assert (note in notes(TRUTH, estimate, max_gap=4)) == noted


def test_ends_that_no_estimate_covers_are_noted(run, tmp_path):
    late, early = without(lambda times: times < 5), without(lambda times: times > 30)
    (note,) = notes(TRUTH, late)
    assert note == (
        "no estimate covers the first 4.0 s of the reference; they count as lost; if no system was "
        "run there, --t_start 4.000 leaves them out"
    )
    assert evaluate(TRUTH, late, t_start=4.0).pas == 1
    (note,) = notes(TRUTH, early)
    assert note.startswith("no estimate covers the last 8.9 s of the reference; they count as")
    for name, trajectory in (("gt", TRUTH), ("late", late), ("early", early)):
        write_poses["tum"](tmp_path / name, *trajectory)
    both = run("tum", tmp_path / "gt", tmp_path / "late", tmp_path / "early")[2]
    assert "no estimate covers" not in both
    twice = run("tum", tmp_path / "gt", tmp_path / "late", tmp_path / "late")[2]
    assert twice.count("no estimate covers the first 4.0 s") == 1


@pytest.mark.parametrize("stands", [True, False])
def test_the_score_of_a_camera_that_never_moves(stands):
    poses = TRUTH.poses.copy()
    if stands:
        poses[100:300, :3, 3] = poses[100, :3, 3]
    reference = Trajectory(TRUTH.keys, poses)
    fine, standing = evaluate(reference, reference), poses.copy()
    standing[:, :3, 3] = np.random.default_rng(0).normal(scale=1e-6, size=(len(poses), 3))
    standing[100:300, :3, 3] += poses[100, :3, 3]
    bad = evaluate(reference, Trajectory(TRUTH.keys, standing), alignment="rigid")
    chance = fine.to_dict()["chance"]
    assert (chance > 0.4) == stands
    assert fine.notes == []
    noted = [note.text for note in bad.notes if note.kind == "chance"]
    assert len(noted) == stands
    if stands:
        assert f"that of a camera that never moves, {chance:.2f}" in noted[0]
        assert noted[0].endswith("stays near one place for part of the time, or has few frames")


def test_quaternions_with_w_at_the_wrong_end(run, score, lines, write):
    """The note names the option that reads them."""
    fields = [line.split() for line in lines]
    path = write([" ".join([*field[:4], field[7], *field[4:7]]) for field in fields])
    files = *TUM[:2], path, "--est_format", "tum"
    assert "w at the wrong end" in (err := run(*files)[2])
    columns = "t x y z qw qx qy qz"
    assert f"; name their order with --est_columns '{columns}'\n" in err
    (mended,), (honest,) = score(*files, "--est_columns", columns), score(*TUM)
    assert mended["RAS"] == honest["RAS"]


def test_a_table_with_commas_and_w_last_is_no_euroc(score, lines, write):
    """Without a header, w is first only where stamps are whole nanoseconds."""
    path = write([line.replace(" ", ",") for line in lines], "est.csv")
    (result,), (honest,) = score(TUM[1], path), score(*TUM)
    assert result["RAS"] == honest["RAS"]


def test_clocks_of_positions_without_rotations_are_compared_by_speeds():
    """A camera that stands still has nothing to compare."""
    poses = TRUTH.poses.copy()
    poses[:, :3, :3] = np.nan
    evaluation = evaluate(TRUTH, Trajectory(TRUTH.keys - 0.2, poses))
    (note,) = [str(note) for note in evaluation.notes if note.kind == "clock"]
    assert "its clock is off: its speeds fit those of the reference best" in note
    assert "with an offset of 0.200 s, standard error" in note
    poses[:, :3, 3] = 1
    evaluation = evaluate(TRUTH, Trajectory(TRUTH.keys, poses))
    assert "clock" not in [note.kind for note in evaluation.notes]


def drive(n=60):
    """Poses of a camera that looks ahead, on a winding road; y is vertical."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    headings = np.sin(np.arange(n) / 8)
    poses[:, :3, :3] = Rotation.from_euler("y", headings[:, None]).as_matrix()
    poses[1:, :3, 3] = np.cumsum(poses[:-1, :3, 2], axis=0)
    return poses


@pytest.mark.parametrize("factor", [0.5, 0.985, 1.0, 1.03])
def test_a_wrong_scale_is_noted_below_the_table(run, kitti, factor):
    est = drive()
    est[:, :3, 3] *= factor
    files = "kitti", kitti(drive(), "gt.txt"), kitti(est, "est.txt")
    off = abs(factor - 1) > 0.02
    assert (f"scale: est.txt is {factor:g}x the reference" in run(*files)[1]) == off
    (result,) = json.loads(run(*files, "--json")[1])["results"]
    assert result["scale"] == pytest.approx(factor)
    assert result["alignment"]["scale"] == pytest.approx(factor)
    assert "scale:" not in run(*files, "--alignment", "rigid")[1]


def test_why_a_score_is_low():
    """In a sentence that says what fails, and where; none of a score of one half or more."""

    def low(estimate, **settings):
        return [
            str(note) for note in evaluate(TRUTH, estimate, **settings).notes if note.kind == "low"
        ]

    assert low(TRUTH) == []
    half = without(lambda times: (times > 5) & (times < 30))
    assert low(half) == ["PAS 0.43: 57% of the time lost, rotations fine"]
    start = without(lambda times: times >= 2)
    start.poses[:, :3, :3] = Rotation.random(len(start.keys), rng=0).as_matrix()
    (note,) = low(start)
    assert re.search(r"lost, \d\d+% of the rotations off by more than 10 degrees$", note)
    poses, stretch = TRUTH.poses.copy(), (TRUTH.keys > 10) & (TRUTH.keys < 22)
    poses[stretch, :3, 3] += np.random.default_rng(0).normal(0, 9, (stretch.sum(), 3))
    turns = Rotation.random(len(TRUTH.keys), rng=1).as_matrix()
    poses[:, :3, :3] = turns
    (note,) = low(Trajectory(TRUTH.keys, poses))
    assert "30% of the frames further off than d (most of them between 1" in note
    assert note.endswith("of the rotations off by more than 10 degrees")
    poses[:, :3, :3] = np.nan
    assert low(Trajectory(TRUTH.keys, poses)) == []
    poses[: len(poses) // 2, :3, 3] = np.random.default_rng(1).normal(0, 9, (len(poses) // 2, 3))
    (note,) = low(Trajectory(TRUTH.keys, poses))
    assert re.fullmatch(r"TAS 0.\d\d: \d\d% of the frames further off than d.*", note)


def test_poses_that_repeat_while_the_reference_moves_away():
    """ORB_SLAM3#619: the last pose again and again, for five seconds without tracking."""
    frozen, gap = TRUTH.poses.copy(), without(lambda times: (times > 10) & (times < 15))
    frozen[101:150] = frozen[100]
    evaluation = evaluate(TRUTH, Trajectory(TRUTH.keys, frozen))
    (note,) = [str(note) for note in evaluation.notes if note.kind == "frozen"]
    assert re.match(r"4\d of 400 poses repeat an earlier one, although the reference has", note)
    assert evaluation.pas <= evaluate(TRUTH, gap).pas
    still = TRUTH.poses.copy()
    still[100:150] = still[100]  # of both
    assert notes(Trajectory(TRUTH.keys, still), Trajectory(TRUTH.keys, still)) == []


@pytest.mark.parametrize("pose", [TRUTH.poses[100], np.eye(4)])
def test_a_reference_that_repeats_while_the_estimate_moves(pose):
    """The last pose again and again, or the identity, for five seconds without tracking."""
    held = TRUTH.poses.copy()
    held[101:150] = pose
    reference = Trajectory(TRUTH.keys, held)
    estimate = TRUTH._replace(poses=TRUTH.poses.copy())
    estimate.poses[:, :3, 3] *= 0.4
    (note,) = [note for note in evaluate(reference, estimate).notes if note.kind == "held"]
    assert re.search(
        r"of 400 poses of the reference repeat .* between 10.\d00 and 14.900 s", note.text
    )
    assert re.search(r"without them the PAS is 1.000 instead of 0.8\d\d: leave these", note.remedy)
    # An estimate may drift while the reference rests.
    at_rest = np.where(TRUTH.keys < 10, 0, TRUTH.keys - 10)
    positions = np.transpose(
        [5 - 5 * np.cos(at_rest / 3), 5 * np.sin(at_rest / 3) ** 2, 0 * at_rest]
    )
    resting = TRUTH._replace(poses=np.tile(np.eye(4), (400, 1, 1)))
    resting.poses[:, :3, 3] = positions
    drifting = resting._replace(poses=resting.poses.copy())
    drifting.poses[:, 2, 3] = np.minimum(TRUTH.keys, 10) / 4
    assert not [note for note in evaluate(resting, drifting).notes if note.kind == "held"]
