"""Mix-ups in either file: named with the file, the option and both scores, or not at all.

The cases are small files in the format and with the fault of public reports, in ``shared/cases``.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from alignscores import Trajectory, compare, evaluate
from alignscores.io import inverse_poses, read_kitti, read_tum
from alignscores.show.tables import conditions
from tests.files import write_stamped

CASES = Path(__file__).resolve().parents[4] / "shared" / "cases"
KINDS = {"inverted", "inverted rotations", "inverted positions", "quaternions", "mirrored"}
KINDS |= {"frame", "clock"}
KINDS |= {"increments", "units", "vertical"}


@pytest.fixture
def case(monkeypatch):
    """(name) -> go to the folder of a case; skip where it is not there."""

    def case(name):
        if not (CASES / name).is_dir():
            pytest.skip(f"no case {name} at {CASES}")
        monkeypatch.chdir(CASES / name)

    return case


HINTS = [  # case, reference, estimate, what the hint says, settings that follow it, TAS, RAS
    (
        "36-w2c-reference",
        "g_w2c.npz",
        "e_c2w.npz",
        "poses of g_w2c.npz",
        "--ref_invert",
        {"ref_invert": True},
        0.877,
        0.927,
    ),
    (
        "36-w2c-reference",
        "a_w2c.npz",
        "a_e_w2c.npz",
        "both",
        "--ref_invert --est_invert",
        {"ref_invert": True, "est_invert": True},
        0.877,
        0.927,
    ),
    (
        "21-w-first-no-header",
        "bus_outside.txt",
        "svin.txt",
        "quaternions of bus_outside.txt",
        "--ref_columns 't x y z qw qx qy qz'",
        {"ref_columns": "t x y z qw qx qy qz"},
        0.752,
        0.835,
    ),
    (
        "29-both-shifted-to-zero",
        "j_gt.txt",
        "j_est.txt",
        "offset of 1.35",
        "--t_offset auto",
        {"t_offset": "auto"},
        0.81,
        0.92,
    ),
    (
        "30-ms-since-start",
        "c_gt_ms.txt",
        "c_est_ms.txt",
        "ms in both c_gt_ms.txt and c_est_ms",
        "--columns 't_ms x y z qx qy qz qw'",
        {"columns": "t_ms x y z qx qy qz qw"},
        0.745,
        0.849,
    ),
    (
        "30-ms-since-start",
        "c_gt_us.txt",
        "c_estk_us.txt",
        "us in both c_gt_us.txt and c_estk_us",
        "--columns 't_us x y z qx qy qz qw'",
        {"columns": "t_us x y z qx qy qz qw"},
        0.763,
        0.865,
    ),
    (
        "15-replica-flip",
        "traj.txt",
        "est_rows.txt",
        "180 deg about x",
        "--body_rotation auto",
        {"body_rotation": "auto"},
        0.855,
        0.95,
    ),
]


@pytest.mark.parametrize("row", HINTS, ids=lambda row: f"{row[0]} {row[1]}")
def test_a_hint_names_the_file_and_its_remedy_gives_the_right_scores(case, command, row):
    name, reference, estimate, what, option, settings, tas, ras = row
    case(name)
    code, _, err = command(reference, estimate)
    (hint,) = [line for line in err.splitlines() if "corrected)" in line]
    assert code == 0
    assert what in hint
    assert f"corrected); {option}" in hint or f"with {option}" in hint
    evaluation = evaluate(reference, estimate, **settings)
    assert evaluation.tas == pytest.approx(tas, abs=0.025)
    assert evaluation.ras == pytest.approx(ras, abs=0.025)
    assert f"{evaluation.pas:.3f} corrected" in hint


@pytest.mark.parametrize(
    ("name", "files", "words"),
    [
        (
            "09-unity-left-handed",
            "unity.txt colmap.txt",
            "the reference, or the estimate, is left-handed",
        ),
        ("10-relative-poses", "gt.txt relative_n.txt", "rows of relative_n.txt seem to be motions"),
        (
            "10-relative-poses",
            "gt_rel.txt relative.txt",
            "rows of both gt_rel.txt and relative",
        ),
        ("18-nine-poses-flipped", "traj_1.txt traj_2.txt", "under alignments 179 deg apart"),
    ],
)
def test_mistakes_that_no_option_corrects_are_noted(case, name, files, words):
    case(name)
    notes = [str(note) for note in evaluate(*files.split()).notes]
    assert sum(words in note for note in notes) == 1
    assert not any("--invert" in note or "body_rotation" in note for note in notes)


@pytest.mark.parametrize(
    ("name", "files", "words"),
    [
        ("03-whole-second-stamps", "gt.txt est_full.txt", "216 of 240 poses"),
        ("04-two-runs-in-one-file", "gt.txt results.txt", "hold several runs"),
        ("10-relative-poses", "gt.txt relative.txt", "motions from frame to frame"),
        ("12-gtsam-key-stamps", "gt.txt robot0.txt", "count by one"),
        ("30-ms-since-start", "c_gt_s.txt c_est_ms.txt", "only 1 of 600 poses .* 't_ms x y z qx"),
        ("26-clock-far-off", "gt.txt est.txt", "offset of -90569539.4(8[7-9]|9[0-7])"),
    ],
)
def test_what_can_hardly_be_matched_is_refused_with_a_remedy(case, name, files, words):
    case(name)
    with pytest.raises(ValueError, match=words):
        evaluate(*files.split())


def test_poses_between_the_stamps_of_a_sparse_reference_are_refused_with_a_remedy(case):
    """All keyframes of a lidar miss the fixes of a GNSS at 1 Hz."""
    case("19-gt-1hz")
    keys, poses = read_tum("lio_10hz.txt")
    rows = np.abs(keys - np.round(keys)) > 0.2
    keyframes = Trajectory(keys[rows], poses[rows])
    with pytest.raises(ValueError, match=r"no time stamps in common.* --sync interpolate") as error:
        evaluate("gt_1hz.txt", keyframes, alignment="rigid")
    interpolated = evaluate("gt_1hz.txt", keyframes, alignment="rigid", sync="interpolate")
    assert f"(PAS {interpolated.pas:.3f} corrected)" in str(error.value)


def test_a_huge_largest_difference_matches_one_pose_which_is_refused(case):
    case("35-huge-t_max_diff")
    for missing in ("fail", "ignore"):
        with pytest.raises(ValueError, match="t_max_diff is in seconds"):
            evaluate("k_gt.txt", "k_est.txt", t_max_diff=1e25, missing=missing)
    evaluation = evaluate("k_gt.txt", "k_est.txt", t_offset="auto")
    assert (evaluation.tas, evaluation.ras) == pytest.approx((0.83, 0.95), abs=0.02)
    assert evaluation.t_offset == pytest.approx(-12345.6, abs=0.02)


def test_one_pose_throughout_has_failed(case, command):
    case("25-static-estimate")
    evaluation = evaluate("gt.txt", "static.txt")
    assert (evaluation.tas, evaluation.ras, evaluation.pas) == (0, 0, 0)
    assert "all poses are identical" in command("gt.txt", "static.txt")[2]


def test_without_a_finite_pose_there_is_one_note(tum, write):
    reference = tum(100, 10, "gt.txt")
    rows = [line.split()[0] for line in reference.read_text().splitlines()]
    lost = write([f"{stamp} nan nan nan nan nan nan nan" for stamp in rows], "lost.txt")
    found = evaluate(reference, lost)
    assert (found.tas, found.lost) == (0, 1)
    assert found.notes[0].text == "it has no finite pose"
    assert not any("cannot be aligned" in note.text for note in found.notes)
    assert compare(reference, [lost]).runs["status"].tolist() == ["failed"]


def test_constant_rotations_are_scored_unless_the_reference_has_none(tum, write, command):
    reference = tum(100, 10, "gt.txt")
    rows = [line.split()[:4] for line in reference.read_text().splitlines()]
    constant = write([" ".join([*row, "0 0 0 1"]) for row in rows], "constant.txt")
    code, _, err = command(reference, constant)
    assert code == 0
    assert "if it has none, --est_columns 't x y z' scores the positions" in err
    assert evaluate(reference, constant).ras < 0.3
    assert not evaluate(reference, constant, est_columns="t x y z").has_rotations
    assert not evaluate(constant, reference).has_rotations


@pytest.mark.parametrize(
    ("name", "files", "ate"),
    [
        ("08-utm-identity", "Alpha_gt.txt est.txt", 0.078),
        ("19-gt-1hz", "gt_1hz.txt lio_10hz.txt", 0.0835),
    ],
)
def test_a_sparse_reference_is_compared_at_its_own_stamps(case, name, files, ate):
    case(name)
    evaluation = evaluate(*files.split(), alignment="rigid")
    assert evaluation.ate == pytest.approx(ate, abs=5e-4)
    assert "sparse" in [note.kind for note in evaluation.notes]


def test_keyframes_between_the_poses_of_a_sparse_reference(case):
    """The note has what --sync interpolate gives; the frames are not at 10 Hz."""
    case("19-gt-1hz")
    keys, poses = read_tum("lio_10hz.txt")
    keyframes = Trajectory(keys[6::7], poses[6::7])
    evaluation = evaluate("gt_1hz.txt", keyframes, alignment="rigid")
    (note,) = [note for note in evaluation.notes if note.kind == "sparse"]
    remedied = evaluate("gt_1hz.txt", keyframes, alignment="rigid", sync="interpolate")
    assert note.remedy == (
        f"--sync interpolate raises the PAS from {evaluation.pas:.3f} to {remedied.pas:.3f}; its "
        "errors then include the straight lines"
    )
    assert "180 frames at the reference's own stamps, gaps" in conditions([evaluation])[0]


def test_an_estimate_is_interpolated_at_the_stamps_of_a_sparse_reference():
    """It has no pose at these; evo would find nothing, or poses up to 0.05 s apart."""
    times = np.arange(1200) / 10
    poses = np.tile(np.eye(4), (1200, 1, 1))
    poses[:, :3, 3] = np.transpose([40 * np.cos(times / 4), 40 * np.sin(times / 4), times / 3])
    reference = Trajectory(times[::10], poses[::10])
    late = Trajectory(times[:-1] + 0.05, (poses[:-1] + poses[1:]) / 2)
    late.poses[:, :3, :3] = np.eye(3)
    evaluation = evaluate(reference, late, alignment="rigid")
    assert evaluation.ate < 0.01
    assert evaluation.lost < 0.02


def winding(rng):
    """Return stamps and poses of a hand-held camera."""
    times = np.arange(900) / 20
    waves, phases = rng.uniform(0.3, 2, (6, 3)), rng.uniform(0, 6, (6, 3))
    waves = np.sin(times[:, None, None] * waves + phases).transpose(1, 0, 2)
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(0.4 * waves[:3].sum(axis=0)).as_matrix()
    poses[:, :3, 3] = waves[3:].sum(axis=0)
    return times, poses


def disturbed(poses, rng):
    """Return poses with noise, in another frame."""
    n, frame = len(poses), np.eye(4)
    frame[:3, :3], frame[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    noisy = poses.copy()
    noise = Rotation.from_rotvec(rng.normal(0, 0.005, (n, 3))).as_matrix()
    noisy[:, :3, :3] = noise @ poses[:, :3, :3]
    noisy[:, :3, 3] += rng.normal(0, 0.03, (n, 3))
    return frame @ noisy


def reordered(poses):
    changed = poses.copy()
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    changed[:, :3, :3] = Rotation.from_quat(np.roll(quaternions, 1, axis=1)).as_matrix()
    return changed


MISTAKES = {"inverted": inverse_poses, "quaternions": reordered}


@pytest.mark.parametrize("seed", range(3))
def test_right_pairs_have_no_hint_and_wrong_ones_are_named(seed):
    rng = np.random.default_rng([seed, 70])
    times, truth = winding(rng)
    rows = np.sort(rng.permutation(len(times))[: 900 // rng.integers(1, 5)])
    reference, estimate = Trajectory(times, truth), disturbed(truth, rng)[rows]

    def hints(reference, estimate):
        return [note for note in evaluate(reference, estimate).notes if note.kind in KINDS]

    assert hints(reference, Trajectory(times[rows], estimate)) == []
    for mistake, change in MISTAKES.items():
        (hint,) = hints(reference, Trajectory(times[rows], change(estimate)))
        assert hint.kind == mistake
        assert "of the estimate seem" in hint.text
        (hint,) = hints(Trajectory(times, change(truth)), Trajectory(times[rows], estimate))
        assert hint.kind == mistake
        assert "of the reference seem" in hint.text
    for late in (-0.05, 0.4, 1.2):
        (hint,) = hints(reference, Trajectory(times[rows] + late, estimate))
        assert hint.kind == "clock"
        evaluation = evaluate(reference, Trajectory(times[rows] + late, estimate), t_offset="auto")
        assert evaluation.t_offset == pytest.approx(-late, abs=0.005)


def test_laps_that_repeat_are_not_certain():
    """One lap of a reference with three; stamps as they are have no time in common."""
    times = np.arange(1800) / 20
    poses = np.tile(np.eye(4), (1800, 1, 1))
    angle = 2 * np.pi * times / 30
    heading = np.transpose([0 * angle, 0 * angle, np.sin(angle) + 0.3 * np.cos(3 * angle)])
    poses[:, :3, :3] = Rotation.from_rotvec(heading).as_matrix()
    poses[:, :3, 3] = np.transpose([np.cos(angle), np.sin(2 * angle), 0 * angle])
    estimate = Trajectory(times[600:1200] + 1000, poses[600:1200])
    with pytest.raises(ValueError, match="with certainty: the best are"):
        evaluate(Trajectory(times, poses), estimate, t_offset="auto")


def test_an_estimate_in_millimetres_is_named_where_the_scale_counts():
    rng = np.random.default_rng(3)
    times, truth = winding(rng)
    estimate = disturbed(truth, rng)
    estimate[:, :3, 3] *= 1000
    evaluation = evaluate(Trajectory(times, truth), Trajectory(times, estimate), alignment="rigid")
    (hint,) = [note for note in evaluation.notes if note.kind == "units"]
    assert "the positions of the estimate seem to be in mm" in hint.text


@pytest.mark.parametrize("units", [1e3, 1e2, 1e1, 39.3701, 3.28084])
def test_units_of_length_are_named_where_only_a_short_part_is_accurate(units):
    """The scale shows them; the score gains in one stretch of time only."""
    rng = np.random.default_rng(3)
    times, truth = winding(rng)
    estimate = truth.copy()
    estimate[80:, :3, 3] += 0.1 * rng.normal(size=(820, 3))
    pair = Trajectory(times, truth), Trajectory(times, estimate)
    assert hints(*pair, alignment="rigid", unit=0.05) == []
    estimate[:, :3, 3] *= units
    (hint,) = hints(*pair, alignment="rigid", unit=0.05)
    assert "the positions of the estimate seem to be in" in hint.text


@pytest.mark.parametrize("seed", range(6))
def test_noisy_cameras_that_look_ahead_are_no_motions(seed):
    """Their product would hide the noise, which adds up."""
    rng = np.random.default_rng(seed)
    _, truth = winding(rng)
    truth[:, :3, :3] = Rotation.from_rotvec(0.1 * truth[:, :3, 3]).as_matrix()
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.3, (len(truth), 3))
    pair = (truth[::3], estimate[::3]) if seed % 2 else (truth, estimate)
    assert hints(*pair, unit=0.5) == []


@pytest.mark.parametrize("sigma", [0.05, 0.1, 0.2])
def test_noisy_positions_far_from_the_origin_are_no_motions(sigma):
    """Their product would hide the noise: steps are as long as the origin is far."""
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (80, 1, 1))
    gt[:, :3, 3] = rng.random((80, 3)) + 5
    est = gt.copy()
    est[:, :3, 3] += rng.normal(scale=sigma, size=(80, 3))
    stamps = np.arange(80) / 10
    evaluation = evaluate(Trajectory(stamps, gt), Trajectory(stamps, est))
    assert "increments" not in {note.kind for note in evaluation.notes}


def test_a_unit_of_time_shows_in_the_durations_of_both_files():
    """At 300 Hz steps in milliseconds are those of a camera, too."""
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    estimate = disturbed(truth, rng)
    with pytest.raises(ValueError, match="seem to be ms in the estimate"):
        evaluate(Trajectory(times / 15, truth), Trajectory(times / 15 * 1e3, estimate))


@pytest.mark.parametrize(("unit", "seconds"), [("minutes", 60), ("hours", 3600), ("days", 86400)])
def test_stamps_in_minutes_and_larger_units_are_named(write, unit, seconds):
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    times += 1.7e9
    rows = np.column_stack([times / seconds, truth[:, :3, 3]])
    estimate = write([" ".join(f"{x:.17g}" for x in row) for row in rows], "est.txt")
    reference = Trajectory(times, truth)
    with pytest.raises(ValueError, match=f"seem to be {unit} in est.txt") as caught:
        evaluate(reference, estimate)
    assert str(caught.value).endswith(f"--est_columns 't_{unit} x y z' names the unit")
    assert evaluate(reference, estimate, est_columns=f"t_{unit} x y z").tas == 1
    with pytest.raises(ValueError, match=f"seem to be {unit} in the estimate.*; write seconds$"):
        evaluate(reference, Trajectory(times / seconds, disturbed(truth, rng)))


def test_units_and_clocks_that_differ_both_are_named_together():
    rng = np.random.default_rng(9)
    times, truth = winding(rng)
    reference = Trajectory(times * 1e3, truth)
    with pytest.raises(ValueError, match=r"seem to be ms in the reference.* offset of -17\d+\.\d"):
        evaluate(reference, Trajectory(1.7e9 + times, disturbed(truth, rng)))


@pytest.mark.parametrize(
    ("reference", "estimate", "option"),
    [
        ("x y z q", "x y z w", "--est_columns 'x y z qw qx qy qz'"),
        ("x y z w", "x y z q", "--ref_columns 'x y z qw qx qy qz'"),
        ("t x y z q", "t y x z", "--est_columns 't y x z'"),
        ("t y x z", "t x y z q", "--ref_columns 't y x z'"),
    ],
)
def test_an_option_names_the_columns_that_the_file_has(write, reference, estimate, option):
    rng = np.random.default_rng(3)
    times, truth = winding(rng)
    paths = []
    for name, poses in ((reference, truth), (estimate, disturbed(truth, rng))):
        quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
        columns = {"t": times, "q": quaternions, "w": np.roll(quaternions, 1, axis=1)}
        columns |= dict(zip("xyz", poses[:, :3, 3].T, strict=True))
        rows = np.column_stack([columns[letter] for letter in name.split()])
        paths.append(write([" ".join(map(str, row)) for row in rows], f"{len(paths)}.txt"))
    (hint,) = [str(n) for n in evaluate(*paths).notes if n.kind in KINDS]
    assert option in hint


def test_an_inversion_of_the_wrong_file_is_left_out():
    rng = np.random.default_rng(4)
    times, truth = winding(rng)
    pair = Trajectory(times, inverse_poses(truth)), Trajectory(times, disturbed(truth, rng))
    (hint,) = [str(n) for n in evaluate(*pair, invert=True).notes if n.kind == "inverted"]
    assert "the wrong one of the reference and the estimate is inverted" in hint
    assert hint.endswith("--ref_invert corrects it; leave out --est_invert")


def test_of_two_files_that_may_be_inverted_each_has_its_remedy_and_score():
    """In one frame, inverse poses of one file may as well be true ones of the other."""
    rng = np.random.default_rng(4)
    times, truth = winding(rng)
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.02, (len(truth), 3))
    pair = Trajectory(times, truth), Trajectory(times, estimate)
    (hint,) = hints(*pair, ref_invert=True)
    scores = [evaluate(*pair, ref_invert=both, invert=both).pas for both in (True, False)]
    assert f", {scores[0]:.3f} corrected); --est_invert corrects it; or the poses" in str(hint)
    assert str(hint).endswith(f"(PAS {scores[1]:.3f} corrected); leave out --ref_invert")


def test_of_an_orbit_only_the_file_whose_inversion_can_be_scored_is_named():
    """Most of its inverse poses are at the same place."""
    rng = np.random.default_rng(1)
    turn = Rotation.from_rotvec(np.linspace(0, 6, 100)[:, None] * [0, 0, 1]).as_matrix()
    truth = np.tile(np.eye(4), (100, 1, 1))
    truth[:, :3, :3], truth[:, :3, 3] = turn, turn @ [3.0, 0, 0.5]
    truth[::5, :3, 3] *= 1.3
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.01, (100, 3))
    (hint,) = hints(truth, inverse_poses(estimate))
    assert hint.text.startswith("the poses of the estimate seem to be world-to-camera")
    assert hint.remedy == "--est_invert corrects it"


def test_a_camera_frame_beside_transposed_rotations_has_its_remedy():
    rng = np.random.default_rng(4)
    times, truth = winding(rng)
    estimate = disturbed(truth, rng) @ np.diag([1.0, -1.0, -1.0, 1.0])
    transposed = estimate.copy()
    transposed[:, :3, :3] = estimate[:, :3, :3].swapaxes(1, 2)
    (hint,) = hints(Trajectory(times, truth), Trajectory(times, transposed))
    assert "and the camera frame of the estimate is rotated" in hint.text
    assert hint.remedy == "transpose them in the file, and add --body_rotation auto"
    corrected = evaluate(
        Trajectory(times, truth), Trajectory(times, estimate), body_rotation="auto"
    )
    assert f"{corrected.pas:.3f} corrected" in hint.text


def test_the_hint_on_a_clock_names_an_offset_that_was_given():
    rng = np.random.default_rng(5)
    times, truth = winding(rng)
    pair = Trajectory(times, truth), Trajectory(times - 100, disturbed(truth, rng))
    (hint,) = [str(n) for n in evaluate(*pair, t_offset=99.5).notes if n.kind == "clock"]
    assert " s instead of 99.500 s, standard error" in hint


def with_w(index, poses):
    """Return what is read of quaternions with w at an index, if it is expected at the other end."""
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    changed = poses.copy()
    shift = 1 if index == 0 else -1
    changed[:, :3, :3] = Rotation.from_quat(np.roll(quaternions, shift, axis=1)).as_matrix()
    return changed


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("orders", [(0, 0), (3, 3), (0, 3), (3, 0)])
def test_w_at_the_wrong_end_in_both_files_is_named(orders, inverted):
    """Tables with a header often have w first, TUM's files last."""
    rng = np.random.default_rng(5)
    times, truth = winding(rng)
    estimate = disturbed(truth, rng)
    right = evaluate(Trajectory(times, truth), Trajectory(times, estimate)).pas
    files = (truth, estimate)
    files = [inverse_poses(poses) for poses in files] if inverted else files
    reference, estimate = (with_w(index, poses) for index, poses in zip(orders, files, strict=True))
    (hint,) = hints(Trajectory(times, reference), Trajectory(times, estimate))
    possibilities = str(hint).split("; or ")
    (both,) = [text for text in possibilities if "the quaternions of both" in text]
    names = ("qw qx qy qz", "", "", "qx qy qz qw")
    true_orders = " and ".join(dict.fromkeys(names[index] for index in orders))
    assert f"{right:.3f} corrected); reorder them, since they are {true_orders}" in both
    assert ("the poses of both the reference and the estimate" in both) == inverted


@pytest.mark.parametrize("sides", [["reference"], ["estimate"], ["reference", "estimate"]])
@pytest.mark.parametrize("inverted", [False, True])
def test_positions_of_another_convention_than_rotations_are_named(sides, inverted):
    """World-to-camera translations with camera-to-world rotations, or the other way round."""
    rng = np.random.default_rng(5)
    times, truth = winding(rng)
    pair = {"reference": truth, "estimate": disturbed(truth, rng)}
    right = evaluate(*(Trajectory(times, poses) for poses in pair.values())).pas
    for side in sides:
        wrong = inverse_poses(pair[side]) if inverted else pair[side].copy()
        wrong[:, :3, 3] = inverse_poses(wrong)[:, :3, 3]
        pair[side] = wrong
    options = {f"{side[:3]}_invert": True for side in sides if inverted}
    (hint,) = hints(*(Trajectory(times, poses) for poses in pair.values()), **options)
    files = "both the reference and the estimate" if len(sides) == 2 else f"the {sides[0]}"
    seem = "camera centres" if inverted else "world-to-camera translations"
    (possibility,) = [text for text in str(hint).split("; or ") if seem in text]
    assert f"the positions of {files} seem to be {seem}, rotations not" in possibility
    assert f"{right:.3f} corrected" in possibility
    assert "-R t, in their place" in possibility


def hints(reference, estimate, **settings):
    """Return the hints on mistakes in either file."""
    notes = evaluate(reference, estimate, **settings).notes
    return [note for note in notes if note.kind in KINDS]


def increments(poses):
    return np.concatenate([poses[:1], inverse_poses(poses[:-1]) @ poses[1:]])


def test_motions_are_named_among_lost_rows():
    rng = np.random.default_rng(6)
    _, truth = winding(rng)
    estimate = increments(disturbed(truth, rng))
    estimate[300:340] = estimate[-50:] = np.nan
    (hint,) = hints(truth, estimate)
    assert "the rows of the estimate seem to be motions from frame to frame" in hint.text


@pytest.mark.parametrize("inverse", [False, True])
def test_motions_that_lead_away_from_their_row_are_multiplied_from_the_identity(inverse):
    rng = np.random.default_rng(6)
    _, truth = winding(rng)
    estimate = disturbed(truth, rng)
    right = evaluate(truth, estimate).pas
    away = increments(estimate)[1:]
    away = inverse_poses(away) if inverse else away
    names = np.char.add("frame_", np.arange(1000, 1000 + len(truth)).astype(str))
    for keys in (np.arange(len(truth)), names):
        poses = Trajectory(keys, np.concatenate([away, np.eye(4)[None]]))
        (hint,) = hints(Trajectory(keys, truth), poses)
        factors = "the product of their inverses" if inverse else "their product"
        assert hint.remedy == f"write {factors}, pose by pose, starting from the identity"
        assert f"{right:.3f} corrected" in str(hint)
    for pair in ((truth, away), (away, truth)):  # without a last row
        with pytest.raises(ValueError, match=r"motions from frame .* starting from the identity"):
            evaluate(*pair)


def test_quaternions_of_poses_that_were_inverted_are_reordered_before_that(write):
    """Of hloc's world-to-camera poses, whose positions are then wrong, too."""
    rng = np.random.default_rng(12)
    _, truth = winding(rng)
    pair = truth[::9], disturbed(truth, rng)[::9]
    files = []
    for name, poses, shift in zip(("gt.txt", "est.txt"), pair, (1, 0), strict=True):
        written = inverse_poses(poses)
        quaternions = np.roll(Rotation.from_matrix(written[:, :3, :3]).as_quat(), shift, axis=1)
        rows = np.column_stack([quaternions, written[:, :3, 3]]).tolist()
        lines = [f"{i}.jpg {' '.join(map(str, row))}" for i, row in enumerate(rows)]
        files.append(write(lines, name))
    notes = evaluate(*files, format="hloc").notes
    (hint,) = [str(note) for note in notes if note.kind in KINDS]
    assert "the quaternions of est.txt seem to have w at the wrong end" in hint
    assert f"{evaluate(*pair).pas:.3f} corrected" in hint


@pytest.mark.parametrize("side", ["reference", "estimate"])
def test_world_to_camera_poses_with_w_first_are_named(side, write):
    """COLMAP's rows in a table: neither remedy helps alone."""
    rng = np.random.default_rng(12)
    times, truth = winding(rng)
    pair = {"reference": truth[::9], "estimate": disturbed(truth, rng)[::9]}
    right = evaluate(*(Trajectory(times[::9], poses) for poses in pair.values())).pas
    files = []
    for name, poses in pair.items():
        written = inverse_poses(poses) if name == side else poses
        quaternions = Rotation.from_matrix(written[:, :3, :3]).as_quat()
        quaternions = np.roll(quaternions, int(name == side), axis=1)
        rows = np.column_stack([times[::9], written[:, :3, 3], quaternions]).tolist()
        files.append(write([" ".join(map(str, row)) for row in rows], f"{name}.txt"))
    (hint,) = [note for note in evaluate(*files).notes if note.kind in KINDS]
    assert f"the quaternions of {side}.txt seem to have w at the wrong end, and the" in hint.text
    assert f"the poses of {side}.txt seem to be world-to-camera" in hint.text
    assert f"{right:.3f} corrected" in hint.text
    option, order = f"{side[:3]}_invert", f"{side[:3]}_columns"
    assert f"--{order} 't x y z qw qx qy qz', then --{option} corrects it" in hint.remedy
    option = "invert" if side == "estimate" else option
    corrected = evaluate(*files, **{option: True, order: "t x y z qw qx qy qz"})
    assert corrected.pas == pytest.approx(right, abs=1e-6)


def test_a_lever_arm_along_the_way_is_no_clock():
    """Of positions only: at 1 m/s, 3 cm ahead are 30 ms early."""
    rng = np.random.default_rng(13)
    times = np.arange(0, 60, 0.05)
    heading = 2 * np.sin(times / 4) + np.sin(times / 1.7)
    speed = 1 + 0.3 * np.sin(times) + 0.3 * np.sin(times / 3)
    way = np.transpose([np.cos(heading), np.sin(heading), 0 * heading])
    truth = np.tile(np.eye(4), (len(times), 1, 1))
    truth[:, :3, 3] = np.cumsum(0.05 * speed[:, None] * way, axis=0)
    ahead = truth.copy()
    ahead[:, :3, 3] += 0.03 * way + rng.normal(0, 0.002, (len(times), 3))
    assert hints(Trajectory(times, truth), Trajectory(times, ahead)) == []


def test_motions_are_named_where_their_product_is_noisy():
    rng = np.random.default_rng(6)
    _, truth = winding(rng)
    estimate = disturbed(truth, rng)
    estimate[:, :3, 3] += rng.normal(0, 0.25, (len(truth), 3))
    assert hints(truth, estimate, unit=0.5) == []
    (hint,) = hints(truth, increments(estimate), unit=0.5)
    assert "the rows of the estimate seem to be motions from frame to frame" in hint.text


def test_motions_in_both_files_are_named_among_outliers():
    rng = np.random.default_rng(7)
    _, truth = winding(rng)
    estimate = disturbed(truth, rng)
    estimate[5::60, :3, :3] = Rotation.random(15, rng=rng).as_matrix()
    (hint,) = hints(increments(truth), increments(estimate))
    assert "rows of both the reference and the estimate" in hint.text


def drifting(poses, rng):
    """Return poses from motions with errors, which add up."""
    motions = increments(poses)
    noise = Rotation.from_rotvec(rng.normal(0, 0.0005, (len(poses), 3))).as_matrix()
    motions[:, :3, :3] = motions[:, :3, :3] @ noise
    motions[:, :3, 3] += rng.normal(0, 0.01, (len(poses), 3))
    for row in range(1, len(poses)):
        motions[row] = motions[row - 1] @ motions[row]
    return motions


@pytest.mark.parametrize("timed", [True, False])
def test_motions_in_both_files_are_named_where_the_estimate_drifts_and_has_outliers(timed):
    rng = np.random.default_rng(7)
    times, truth = winding(rng)
    estimate = disturbed(drifting(truth, rng), rng)
    lost = rng.permutation(len(times))[: len(times) // 4]
    estimate[lost, :3, :3] = Rotation.random(len(lost), rng=rng).as_matrix()
    keys = times if timed else np.arange(len(times))
    right = evaluate(Trajectory(keys, truth), Trajectory(keys, estimate)).pas
    files = (Trajectory(keys, increments(poses)) for poses in (truth, estimate))
    (hint,) = hints(*files)
    (motions,) = [text for text in str(hint).split("; or ") if "seem to be motions" in text]
    assert "rows of both the reference and the estimate" in motions
    (score,) = re.findall(r"([0-9.]+) corrected\); write their product, pose by pose", motions)
    assert float(score) == pytest.approx(right, abs=0.01)


@pytest.mark.parametrize("degrees", [0.1, 1.0, 3.0])
def test_drifting_cameras_that_hardly_rotate_are_no_motions(degrees):
    """As on a slider; as motions, they would turn as slowly as cameras."""
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    vectors = Rotation.from_matrix(truth[:, :3, :3]).as_rotvec()
    truth[:, :3, :3] = Rotation.from_rotvec(np.radians(degrees) * vectors).as_matrix()
    truth = inverse_poses(truth[:1]) @ truth
    estimate = drifting(truth, rng)
    for sigma in (0.0, 0.3, 1.0):
        noisy = estimate.copy()
        noisy[:, :3, 3] += rng.normal(0, sigma, (len(truth), 3))
        assert hints(Trajectory(times, truth), Trajectory(times, noisy)) == []


@pytest.mark.parametrize("rate", [2, 10, 30])
@pytest.mark.parametrize("degrees", [1, 5])
def test_noisy_cameras_that_hardly_rotate_are_no_motions(rate, degrees):
    """Where rotations are good and the noise of positions is independent, products hide it."""
    rng = np.random.default_rng(9)
    times = np.arange(40 * rate) / rate
    vectors = np.radians(degrees) * np.sin(0.2 * times[:, None] + [0, 1, 2])
    truth = np.tile(np.eye(4), (len(times), 1, 1))
    truth[:, :3, :3] = Rotation.from_rotvec(vectors).as_matrix()
    truth[:, :3, 3] = np.cumsum(np.cos(0.3 * times[:, None] + [0, 2, 4]), axis=0) / rate
    for sigma in (0.02, 0.1, 0.5):
        noisy = truth.copy()
        noisy[:, :3, 3] += rng.normal(0, sigma, (len(truth), 3))
        turns = Rotation.from_rotvec(rng.normal(0, 2e-4, (len(truth), 3))).as_matrix()
        noisy[:, :3, :3] = turns @ noisy[:, :3, :3]
        for keys in (times, np.arange(len(times))):
            assert hints(Trajectory(keys, truth), Trajectory(keys, noisy)) == []


def test_a_camera_frame_is_named_on_a_flat_road_if_nothing_is_aligned():
    """Where rotations are aligned, the alignment takes it; no score counts it then."""
    rng = np.random.default_rng(9)
    times = np.arange(400) / 10
    truth = np.tile(np.eye(4), (len(times), 1, 1))
    truth[:, :3, :3] = Rotation.from_euler("z", np.sin(0.2 * times)[:, None]).as_matrix()
    truth[:, :3, 3] = np.cumsum(truth[:, :3, 0], axis=0)
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.1, (len(times), 3))
    turns = Rotation.from_rotvec(rng.normal(0, 0.02, (len(times), 3))).as_matrix()
    estimate[:, :3, :3] = turns @ estimate[:, :3, :3]
    right = evaluate(truth, estimate, alignment="none").pas
    assert hints(truth, estimate, alignment="none") == []
    estimate[:, :3, :3] = estimate[:, :3, :3] @ Rotation.from_euler("z", 0.7).as_matrix()
    (hint,) = hints(truth, estimate, alignment="none")
    assert "the camera frame of the estimate is rotated against that of the reference" in hint.text
    corrected = evaluate(truth, estimate, alignment="none", body_rotation="auto")
    assert corrected.pas == pytest.approx(right, abs=0.02)
    assert hints(truth, estimate) == []


@pytest.mark.parametrize("shift", [-1, 1, 4])
def test_frames_that_are_numbered_from_another_one_are_named(shift):
    rng = np.random.default_rng(8)
    _, truth = winding(rng)
    numbers, estimate = np.arange(len(truth)), disturbed(truth, rng)
    assert hints(Trajectory(numbers, truth), Trajectory(numbers, estimate)) == []
    (hint,) = hints(Trajectory(numbers, truth), Trajectory(numbers - shift, estimate))
    assert f"its frames are off by {abs(shift)}" in hint.text
    assert f"if its frame 0 is frame {shift}" in hint.text


def test_frames_of_a_video_with_noise_are_counted_from_the_right_one():
    """At 100 Hz a camera hardly turns within some frames."""
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    fine = np.linspace(times[0], times[-1], 5 * len(truth))
    poses = np.tile(np.eye(4), (len(fine), 1, 1))
    poses[:, :3, :3] = Slerp(times, Rotation.from_matrix(truth[:, :3, :3]))(fine).as_matrix()
    poses[:, :3, 3] = CubicSpline(times, truth[:, :3, 3])(fine)
    estimate = disturbed(poses, rng)
    turns = Rotation.from_rotvec(np.radians(2) * rng.normal(size=(len(poses), 3)))
    estimate[:, :3, :3] = estimate[:, :3, :3] @ turns.as_matrix()
    numbers = np.arange(len(poses))
    (hint,) = hints(Trajectory(numbers, poses), Trajectory(numbers - 9, estimate))
    assert "if its frame 0 is frame 9" in hint.text


def test_quaternions_with_w_first_of_a_camera_at_rest_are_corrected():
    """Turns about x are half turns if they are read with w last."""
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    truth[:100, :3, :3] = Rotation.from_euler("x", 40, degrees=True).as_matrix()
    w_first = np.roll(Rotation.from_matrix(truth[:, :3, :3]).as_quat(), 1, axis=1)
    misread = truth.copy()
    misread[:, :3, :3] = Rotation.from_quat(w_first).as_matrix()
    (hint,) = hints(Trajectory(times, truth), Trajectory(times, misread))
    assert "the quaternions of the estimate seem to have w at the wrong end" in hint.text
    assert "1.000 corrected" in hint.text


@pytest.mark.parametrize("late", [-7.5, 3.3])
def test_poses_that_are_late_and_inverted_are_named_together(late):
    """Neither remedy helps alone."""
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    estimate = disturbed(truth, rng)
    inverted = Trajectory(times + late, inverse_poses(estimate))
    (hint,) = hints(Trajectory(times, truth), inverted)
    assert hint.text.startswith("its clock is off")
    assert "; and the poses of the estimate seem to be world-to-camera" in hint.text
    assert hint.remedy == "--t_offset auto adds it; --est_invert corrects it"
    corrected = evaluate(Trajectory(times, truth), inverted, t_offset="auto", invert=True).pas
    assert f"{corrected:.3f} corrected" in hint.text
    assert corrected > 0.5


def test_rows_without_the_first_one_are_named():
    """Both count from 0: they are refused, and the reason says what fits."""
    rng = np.random.default_rng(8)
    _, truth = winding(rng)
    with pytest.raises(ValueError, match=r"if its frame 0 is frame 1 .* corrected"):
        evaluate(truth, disturbed(truth, rng)[1:])


def test_unrelated_paths_are_no_mirror_images():
    """Chance makes this pair more alike if one is mirrored."""
    rng = np.random.default_rng(35)
    steps = rng.normal(size=(4, 300, 3)).cumsum(axis=1)
    paths = np.tile(np.eye(4), (2, 300, 1, 1))
    paths[:, :, :3, :3] = (
        Rotation.from_rotvec(0.05 * steps[::2].reshape(-1, 3)).as_matrix().reshape(2, 300, 3, 3)
    )
    paths[:, :, :3, 3] = steps[1::2]
    assert hints(*paths) == []


def test_motions_along_a_corridor_are_named():
    rng = np.random.default_rng(15)
    times, truth = winding(rng)
    truth[:, :3, 3] = 0.02 * truth[:, :3, 3] + np.outer(times, [1.0, 0, 0])
    (hint,) = hints(truth, increments(disturbed(truth, rng)))
    assert "the rows of the estimate seem to be motions from frame to frame" in hint.text


def test_a_straight_path_of_named_images_shows_no_motions():
    """A product of many poses may be nearly straight, and all straight paths are alike."""
    times, keys = np.arange(60) / 10, np.char.add("image_", np.arange(60).astype(str))
    circle, straight = np.tile(np.eye(4), (2, 60, 1, 1))
    circle[:, :3, :3] = Rotation.from_rotvec(np.outer(times, [0, 0, 1])).as_matrix()
    circle[:, :3, 3] = np.transpose([1 + np.cos(times), 2 + np.sin(times), 0 * times - 2])
    heading = 0.02 * np.sin(times)
    straight[:, :3, :3] = Rotation.from_rotvec(np.outer(heading, [0, 0, 1])).as_matrix()
    straight[:, :3, 3] = np.transpose([8 * times, 8 * heading, 0 * times])
    assert hints(Trajectory(keys, circle), Trajectory(keys, straight)) == []


@pytest.mark.parametrize("seed", [17, 23, 30, 31])
def test_unrelated_turns_are_no_camera_frame(seed):
    """Some constant rotation makes short walks alike, but not that of one half the other half."""
    rng = np.random.default_rng(seed)
    paths = np.tile(np.eye(4), (2, 60, 1, 1))
    turns = 0.02 * rng.normal(size=(2, 60, 3)).cumsum(axis=1).reshape(-1, 3)
    paths[:, :, :3, :3] = Rotation.from_rotvec(turns).as_matrix().reshape(2, 60, 3, 3)
    paths[:, :, :3, 3] = 0.1 * rng.normal(size=(2, 60, 3)).cumsum(axis=1)
    assert hints(*paths) == []


def test_a_reference_in_hours_has_no_motions_to_compare():
    rng = np.random.default_rng(14)
    times, truth = winding(rng)
    reference = Trajectory(times / 3600, truth)
    with pytest.raises(ValueError, match=r"no time stamps in common: .* from 0\.0+ to 0\.01"):
        evaluate(reference, Trajectory(1e6 + times, disturbed(truth, rng)))


def test_a_single_pose_has_no_unit_of_time():
    _, truth = winding(np.random.default_rng(14))
    times = np.arange(float(len(truth)))
    with pytest.raises(ValueError, match=r"only 1 of 1 poses could be matched .*\)$"):
        evaluate(Trajectory(times, truth), Trajectory(times[:1], truth[:1]))


def test_a_left_handed_path_near_a_plane_is_named_by_its_rotations():
    """Mirrored positions fit as well; rotations fit no other convention."""
    rng = np.random.default_rng(9)
    _, truth = winding(rng)
    truth[:, 2, 3] *= 0.005
    vectors = Rotation.from_matrix(truth[:, :3, :3]).as_rotvec() * [0.02, 0.03, 1.0]
    truth[:, :3, :3] = Rotation.from_rotvec(vectors).as_matrix()
    estimate = disturbed(truth, rng)
    right = evaluate(truth, estimate).pas
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    (hint,) = hints(truth, mirror @ estimate @ mirror)
    assert hint.kind == "mirrored"
    assert f"{right:.3f} corrected" in str(hint)


def test_swapped_axes_of_positions_and_rotations_are_named():
    """In another camera frame only rotations would fit."""
    rng = np.random.default_rng(9)
    times, truth = winding(rng)
    swap = np.eye(4)[[1, 0, 2, 3]]
    swapped = swap @ disturbed(truth, rng) @ swap
    (hint,) = hints(Trajectory(times, truth), Trajectory(times, swapped))
    assert hint.kind == "mirrored"
    assert "with x and y swapped in its positions and rotations, the reference fits" in hint.remedy


def test_conventions_that_fit_as_well_are_all_named():
    """About one axis, transposed rotations and shifted quaternions are much the same."""
    rng = np.random.default_rng(10)
    times, truth = winding(rng)
    turns = Rotation.from_rotvec(np.outer(1.2 * np.sin(times / 2) + 0.3 * times, [0, 0, 1]))
    truth[:, :3, :3] = turns.as_matrix()
    transposed = disturbed(truth, rng)
    transposed[:, :3, :3] = transposed[:, :3, :3].swapaxes(1, 2)
    (hint,) = hints(Trajectory(times, truth), Trajectory(times, transposed))
    assert {"inverted rotations", "inverted", "quaternions"} & {hint.kind}
    assert "world-to-camera, positions not" in str(hint)


@pytest.mark.parametrize("alignment", ["similarity", "yaw", "none"])
@pytest.mark.parametrize("seed", range(5))
def test_a_drift_of_the_height_is_no_mirror(seed, alignment):
    """Of a road, which is nearly a plane."""
    rng = np.random.default_rng(seed)
    times = np.arange(1500) / 10
    heading = 2 * np.sin(times / 15) + np.sin(times / 6)
    steps = np.transpose([np.cos(heading), np.sin(heading)])
    truth = np.tile(np.eye(4), (1500, 1, 1))
    truth[:, :3, :3] = Rotation.from_rotvec(np.outer(heading, [0, 0, 1])).as_matrix()
    truth[:, :2, 3] = steps.cumsum(axis=0)
    truth[:, 2, 3] = np.sin(times / 20)
    estimate = truth.copy()
    estimate[:, 2, 3] += 0.05 * rng.normal(size=1500).cumsum()
    pair = Trajectory(times, truth), Trajectory(times, estimate)
    assert hints(*pair, alignment=alignment) == []


def test_a_reference_that_stands_still_is_refused_as_such():
    rng = np.random.default_rng(11)
    times, truth = winding(rng)
    frozen = np.tile(truth[0], (len(truth), 1, 1))
    with pytest.raises(ValueError, match="the reference stands still"):
        evaluate(Trajectory(times, frozen), Trajectory(times, disturbed(truth, rng)))


def test_mirrored_positions_of_a_camera_that_rests_are_named():
    """Most of the time all alignments fit."""
    rng = np.random.default_rng(8)
    _, truth = winding(rng)
    truth = np.concatenate([truth[:1].repeat(1200, axis=0), truth])
    times, estimate = np.arange(len(truth)) / 20, disturbed(truth, rng)
    truth[:, :2, 3] = truth[:, 1::-1, 3]
    reference, estimate = (Trajectory(times, poses) for poses in (truth, estimate))
    reference.poses[:, :3, :3] = estimate.poses[:, :3, :3] = np.eye(3)
    (hint,) = hints(reference, estimate)
    assert "are mirror images" in hint.text


def test_a_camera_mounted_at_a_small_angle_is_named():
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    estimate = disturbed(truth, rng)
    estimate[:, :3, :3] = estimate[:, :3, :3] @ Rotation.from_rotvec([0.23, 0, 0]).as_matrix()
    (hint,) = hints(Trajectory(times, truth), Trajectory(times, estimate))
    assert "the camera frame of the estimate is rotated" in hint.text
    assert " deg about (1.00, 0.0" in hint.text
    assert hint.remedy.startswith("--body_rotation auto removes it")


def test_files_of_the_same_name_are_named_with_their_folders(tmp_path):
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    for folder, poses in (("truth", truth), ("mine", inverse_poses(disturbed(truth, rng)))):
        (tmp_path / folder).mkdir()
        write_stamped(tmp_path / folder / "poses.txt", times, poses)
    notes = evaluate(tmp_path / "truth/poses.txt", tmp_path / "mine/poses.txt").notes
    (hint,) = [note.text for note in notes if note.kind == "inverted"]
    assert "the poses of mine/poses.txt seem to be world-to-camera" in hint


def test_keyframes_that_miss_a_sparse_reference_are_not_late():
    """A clock that agrees within its error is no remedy, even if some stamps meet then."""
    rng = np.random.default_rng(8)
    times, truth = winding(rng)
    reference = Trajectory(times[::20] + 0.03, truth[::20])
    with pytest.raises(ValueError, match="--sync interpolate compares") as refusal:
        evaluate(reference, Trajectory(times[::14], disturbed(truth, rng)[::14]), t_max_diff=0.005)
    assert "its clock is off" not in str(refusal.value)


def test_transposed_rotations_are_named_where_the_alignment_counts_their_frame():
    """Their camera frames take the place of the coordinate frames; a free rotation hides that."""
    rng = np.random.default_rng(5)
    _, truth = winding(rng)
    turns = 0.05 * Rotation.from_matrix(truth[:, :3, :3]).as_rotvec()
    ahead = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    truth[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix() @ ahead
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.03, (len(truth), 3))
    yaw = np.eye(4)
    yaw[:3, :3] = Rotation.from_euler("z", 0.3).as_matrix()
    right = evaluate(truth, yaw @ estimate, alignment="yaw").pas
    pair = [truth.copy(), yaw @ estimate]
    for poses in pair:
        poses[:, :3, :3] = poses[:, :3, :3].swapaxes(1, 2)
    (hint,) = hints(*pair, alignment="yaw")
    text = "rotations of both the reference and the estimate seem to be world-to-camera"
    assert text in str(hint)
    assert f"{right:.3f} corrected" in str(hint)
    assert hints(truth, yaw @ estimate, alignment="yaw") == []


@pytest.mark.parametrize(("alignment", "axes"), [("yaw", "xy"), ("none", "y")])
def test_the_mirror_is_named_where_the_alignment_does_not_rotate_freely(alignment, axes):
    """A yaw of 180 degrees takes x negated to y negated, but not to z negated."""
    rng = np.random.default_rng(6)
    _, truth = winding(rng)
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.02, (len(truth), 3))
    right = evaluate(truth, estimate, alignment=alignment).pas
    estimate[:, "xyz".index(axes[0]), 3] *= -1
    (hint,) = hints(truth, estimate, alignment=alignment)
    assert re.search(f"with [{axes}] negated in its positions, the reference fits", hint.remedy)
    assert f"{right:.3f} corrected" in str(hint)


@pytest.mark.parametrize("alignment", ["similarity", "yaw"])
def test_inverse_poses_near_one_point_are_no_better_fit(alignment):
    """Around an object the inverse positions are all alike, and so have small errors."""
    rng = np.random.default_rng(7)
    angles = np.linspace(0, 4 * np.pi, 160)
    heights = 0.4 * np.sin(angles / 2)
    positions = np.transpose([2 * np.cos(angles), 2 * np.sin(angles), heights])
    ahead = -positions / np.linalg.norm(positions, axis=1, keepdims=True)
    right = np.cross(ahead, [0.0, 0, 1])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    truth = np.tile(np.eye(4), (len(angles), 1, 1))
    truth[:, :3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=-1)
    truth[:, :3, 3] = positions
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.02, (len(truth), 3))
    wrong = reordered(inverse_poses(estimate))
    (hint,) = hints(truth, wrong, alignment=alignment)
    assert "the quaternions of the estimate seem to have w at the wrong end" in hint.text
    assert "the poses of the estimate seem to be world-to-camera" in hint.text
    score = evaluate(truth, estimate, alignment=alignment).pas
    assert f"{score:.3f} corrected" in str(hint)


def test_a_coordinate_frame_that_the_alignment_counts_is_no_camera_frame():
    """On a plane both rotate poses alike, but only a coordinate frame rotates positions."""
    times, truth = climbing(0.0)
    turned = truth.copy()
    turn = Rotation.from_euler("z", 0.7).as_matrix()
    turned[:, :3, :3], turned[:, :3, 3] = turn @ truth[:, :3, :3], truth[:, :3, 3] @ turn.T
    assert hints(Trajectory(times, truth), Trajectory(times, turned), alignment="none") == []


@pytest.mark.parametrize("alignment", ["similarity", "none"])
def test_an_imu_some_degrees_off_a_common_frame_is_removed_as_it_is(alignment):
    rng = np.random.default_rng(5)
    _, truth = winding(rng)
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 0.02, (len(truth), 3))
    right = evaluate(truth, estimate, alignment=alignment).pas
    axes = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    mounting = Rotation.from_rotvec([0.05, -0.06, 0.04]).as_matrix() @ axes
    estimate[:, :3, :3] = estimate[:, :3, :3] @ mounting
    (hint,) = hints(truth, estimate, alignment=alignment)
    assert hint.remedy == "--body_rotation auto removes it"
    corrected = evaluate(truth, estimate, alignment=alignment, body_rotation="auto")
    assert corrected.pas == pytest.approx(right, abs=0.01)


def test_a_tilt_of_the_coordinate_frame_is_no_camera_frame():
    """Of cameras that turn little, where a yaw leaves the tilt."""
    times, truth = winding(np.random.default_rng(5))
    turns = 0.15 * Rotation.from_matrix(truth[:, :3, :3]).as_rotvec()
    truth[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    tilted = truth.copy()
    tilted[:, :3, :3] = Rotation.from_euler("x", 0.25).as_matrix() @ truth[:, :3, :3]
    assert hints(Trajectory(times, truth), Trajectory(times, tilted), alignment="yaw") == []


@pytest.mark.parametrize("seed", range(2))
def test_the_file_whose_format_allows_the_mistake_is_named(write, seed):
    """Shifting the quaternions of the other file, too, makes rotations fit as well."""
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(150, 3))
    positions *= 3 / np.linalg.norm(positions, axis=1, keepdims=True)
    ahead = -positions / 3
    right = np.cross(ahead, [0.0, 0, 1])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    truth = np.tile(np.eye(4), (150, 1, 1))
    truth[:, :3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=-1)
    truth[:, :3, 3] = positions
    estimate = truth.copy()
    estimate[:, :3, :3] = estimate[:, :3, :3] @ Rotation.from_rotvec([0.02, 0.02, 0]).as_matrix()
    estimate[:, :3, 3] += rng.normal(0, 0.01, (150, 3))

    def table(poses, scalar_first):
        inverse = inverse_poses(poses)
        quaternions = Rotation.from_matrix(inverse[:, :3, :3]).as_quat(scalar_first=scalar_first)
        rows = np.hstack([quaternions, inverse[:, :3, 3]]).tolist()
        return [f"{n:03}.png {' '.join(map(str, row))}" for n, row in enumerate(rows)]

    result = write(table(estimate, True), "estimate.txt")
    score = evaluate(write(table(truth, True), "right.txt"), result).pas
    (hint,) = hints(write(table(truth, False), "reference.txt"), result)
    assert "the quaternions of reference.txt seem to have w at the wrong end" in hint.text
    assert f"{score:.3f} corrected" in hint.text
    assert hint.remedy == "reorder them, since they are qx qy qz qw"


def test_an_offset_that_motions_leave_open_is_named_by_the_score():
    """The turns repeat, the positions do not."""
    rng = np.random.default_rng(4)
    times = np.arange(2400) / 20
    rates = 0.6 * np.sin(np.outer(times, 2 * np.pi / 20 * np.array([2, 3, 7]))).sum(axis=1)
    truth = np.tile(np.eye(4), (len(times), 1, 1))
    truth[:, :3, :3] = Rotation.from_euler("z", np.cumsum(rates)[:, None] / 20).as_matrix()
    truth[:, :3, 3] = np.cumsum(truth[:, :3, 0] * 0.2, axis=0) + np.outer(times, [0, 0.5, 0.1])
    estimate = truth.copy()
    noise = Rotation.from_rotvec(rng.normal(0, 0.01, (len(times), 3))).as_matrix()
    estimate[:, :3, :3] = noise @ truth[:, :3, :3]
    estimate[:, :3, 3] += rng.normal(0, 0.05, (len(times), 3))
    late = Trajectory(times[40:-40] + 0.8, estimate[40:-40])
    reference = Trajectory(times, truth)
    with pytest.raises(ValueError, match="with certainty: the best are"):
        evaluate(reference, late._replace(keys=late.keys + 1000), t_offset="auto")
    (hint,) = hints(reference, late)
    assert hint.kind == "clock"
    seconds = float(re.fullmatch(r"--t_offset (\S+) raises the score", hint.remedy)[1])
    assert seconds == pytest.approx(-0.8, abs=0.02)
    assert hints(reference, late._replace(keys=late.keys - 0.8)) == []


def climbing(slope):
    """Return stamps and poses of a car whose camera looks where it drives, and shakes."""
    times = np.arange(1500) / 10
    heading = 2 * np.sin(times / 15) + np.sin(times / 6)
    turns = np.transpose([heading, slope * np.sin(times / 8)])
    body = Rotation.from_euler("ZY", turns)
    shaking = Rotation.from_rotvec(np.random.default_rng(9).normal(0, 0.05, (1500, 3)))
    poses = np.tile(np.eye(4), (1500, 1, 1))
    poses[:, :3, :3] = (body * shaking).as_matrix()
    poses[1:, :3, 3] = body.as_matrix()[:-1, :, 0].cumsum(axis=0)
    return times, poses


def test_heights_that_fit_better_mirrored_are_no_mirror_if_the_camera_looks_ahead():
    """Small errors of the pitch lead to such heights; S-PTAM on KITTI 00 has them."""
    times, truth = climbing(0.02)
    _, estimate = climbing(-0.02)
    assert hints(Trajectory(times, truth), Trajectory(times, estimate)) == []
    wrong = truth.copy()
    wrong[:, 2, 3] *= -1
    (hint,) = hints(Trajectory(times, truth), Trajectory(times, wrong))
    assert hint.kind == "mirrored"


@pytest.mark.parametrize(("first", "n"), [(1899, 2331), (1958, 2299), (2036, 2323)])
def test_a_road_whose_heights_are_wrong_has_no_mirror(real, first, n):
    truth, estimate = (read_kitti(real / f"KITTI_00_{name}.txt").poses for name in ("gt", "SPTAM"))
    rows = np.s_[first : first + n]
    assert [hint.kind for hint in hints(truth[1:][rows], estimate[rows])] == []


def test_the_order_of_quaternions_beside_names_is_corrected_by_columns(write):
    """Where qw is near 1 and positions are small, the first four numbers look like a quaternion."""
    rng = np.random.default_rng(8)
    _, truth = winding(rng)
    truth, names = truth[::10], [f"{i:03}.png" for i in range(90)]
    truth[:, :3, 3] *= 0.05
    noise = Rotation.from_rotvec(rng.normal(0, 0.005, (90, 3))).as_matrix()
    estimate = truth.copy()
    estimate[:, :3, :3] = noise @ truth[:, :3, :3]
    estimate[:, :3, 3] += rng.normal(0, 0.001, (90, 3))

    def table(poses, order):
        quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()[:, order]
        numbers = np.hstack([poses[:, :3, 3], quaternions])
        rows = zip(names, numbers.tolist(), strict=True)
        return "".join(f"{name} {' '.join(map(str, row))}\n" for name, row in rows)

    reference = write(table(truth, [0, 1, 2, 3]), "reference.txt")
    right = evaluate(reference, write(table(estimate, [0, 1, 2, 3]), "right.txt"))
    w_first = write(table(estimate, [3, 0, 1, 2]), "w_first.txt")
    (hint,) = hints(reference, w_first)
    assert "--est_columns 'name x y z qw qx qy qz'" in hint.remedy
    followed = evaluate(reference, w_first, est_columns="name x y z qw qx qy qz")
    assert followed.pas == right.pas


def ring(*, turns, height, target, sigma):
    """Return cameras around a target, and an estimate of them in other coordinates."""
    rng, n = np.random.default_rng(0), 120
    angles = np.linspace(0, 2 * np.pi * turns, n)
    positions = 2 * np.column_stack([np.cos(angles), np.sin(angles), np.full(n, height)])
    ahead = np.array(target) - positions
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right, axis=1)[:, None]
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=2)
    poses[:, :3, 3] = positions
    error = np.tile(np.eye(4), (n, 1, 1))
    error[:, :3, :3] = Rotation.from_rotvec(np.radians(0.4) * rng.normal(size=(n, 3))).as_matrix()
    error[:, :3, 3] = rng.normal(scale=sigma, size=(n, 3))
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_euler("xyz", [60, 20, 100], degrees=True).as_matrix()
    frame[:3, 3] = 1, 2, 3
    return poses, frame @ poses @ error


@pytest.mark.parametrize("sides", ["--ref_invert", "--est_invert", "--ref_invert --est_invert"])
@pytest.mark.parametrize(
    "scene",
    [
        {"turns": 0.5, "height": 0.0, "target": (0.2, 0.2, 0.0), "sigma": 0.02},
        {"turns": 0.5, "height": 0.4, "target": (0.2, 0.2, 0.0), "sigma": 0.02},
        {"turns": 0.5, "height": 1.0, "target": (0.2, 0.2, 0.0), "sigma": 0.02},
        {"turns": 1.0, "height": 1.0, "target": (1.6, 1.6, 0.0), "sigma": 0.02},
    ],
)
def test_of_cameras_around_a_target_the_inverted_file_is_named(scene, sides):
    # The translations of world-to-camera poses are a small ring, which fits a large one.
    names = np.array([f"{i:03d}.jpg" for i in range(120)])
    poses, estimate = ring(**scene)
    reference = inverse_poses(poses) if "--ref_invert" in sides else poses
    estimate = inverse_poses(estimate) if "--est_invert" in sides else estimate
    (hint,) = hints(Trajectory(names, reference), Trajectory(names, estimate))
    assert f"{sides} corrects it" in re.split("; or |; ", hint.remedy)


def test_a_reference_whose_cameras_look_at_one_point_is_refused_with_its_inversion():
    names = np.array([f"{i:03d}.jpg" for i in range(120)])
    poses, estimate = ring(turns=1.0, height=0.5, target=(0.0, 0.0, 0.0), sigma=0.01)
    reference = Trajectory(names, inverse_poses(poses))
    with pytest.raises(ValueError, match=r"PAS 0\.8\d\d corrected\); --ref_invert corrects it"):
        evaluate(reference, Trajectory(names, estimate))


@pytest.mark.parametrize("unit", ["ms", "us"])
def test_a_slow_recording_in_small_units_is_no_fast_one_in_smaller_ones(tmp_path, unit):
    # 400 poses at 1 Hz, which would last 0.4 s in the next smaller unit.
    rng = np.random.default_rng(5)
    truth = winding(rng)[1][:400]
    stamps = np.arange(400) * {"ms": 1e3, "us": 1e6}[unit]
    files = tmp_path / "gt.txt", tmp_path / "est.txt"
    for file, poses in zip(files, (truth, disturbed(truth, rng)), strict=True):
        write_stamped(file, stamps, poses)
    named = evaluate(*files, columns=f"t_{unit} x y z qx qy qz qw")
    scored = evaluate(*files)
    assert scored.pas == pytest.approx(named.pas, abs=0.01)
    assert [note for note in scored.notes if note.kind in KINDS] == []


def test_translations_beside_good_rotations_of_cameras_that_look_at_one_point_are_named():
    """They all lie near one point, in metres near any other position there."""
    names = np.array([f"{i:03d}.jpg" for i in range(120)])
    poses, estimate = ring(turns=1.0, height=0.5, target=(0.05, 0.0, 0.0), sigma=0.02)
    poses[:, :3, 3] = inverse_poses(poses)[:, :3, 3]
    (hint,) = hints(Trajectory(names, poses), Trajectory(names, estimate))
    assert "positions of the reference seem to be world-to-camera translations" in hint.text


def counted(keys, side, n):
    """Return both trajectories, one of them with the numbers of its n poses for stamps."""
    rng = np.random.default_rng(12)
    truth = winding(rng)[1][: len(keys)]
    pair = [Trajectory(keys, truth), Trajectory(keys, disturbed(truth, rng))]
    pair[side] = Trajectory(np.arange(n).astype(keys.dtype), pair[side].poses[:n])
    return pair


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("keys", [np.arange(600) * 5, np.arange(600) / 30])
@pytest.mark.parametrize("n", [600, 550])
def test_poses_that_are_counted_beside_stamps_or_numbers_of_frames_are_named(keys, side, n):
    (hint,) = hints(*counted(keys, side, n))
    assert f"of {('the reference', 'the estimate')[side]} seem to count its poses" in hint.text


@pytest.mark.parametrize("side", [0, 1])
def test_poses_that_are_counted_beside_stamps_since_1970_are_refused_as_such(side):
    name = ("the reference", "the estimate")[side]
    with pytest.raises(ValueError, match=f"time stamps of {name} seem to count its poses"):
        hints(*counted(1.7e9 + np.arange(600) / 10, side, 550))


NED = np.array([[0.0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]])  # and back


@pytest.mark.parametrize("side", [0, 1])
def test_a_file_with_z_down_is_named_where_the_alignment_keeps_the_vertical_axis(side):
    times, truth = winding(np.random.default_rng(5))
    pair = [truth, truth.copy()]
    pair[side] = NED @ pair[side]
    reference, estimate = (Trajectory(times, poses) for poses in pair)
    (hint,) = hints(reference, estimate, alignment="yaw")
    assert "the vertical axis of the estimate seems to be -z, that of the reference z" in hint.text
    assert hints(reference, estimate, alignment="rigid") == []


def test_two_files_with_y_up_have_their_option():
    times, truth = winding(np.random.default_rng(5))
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler("y", 70, degrees=True).as_matrix()
    pair = Trajectory(times, truth), Trajectory(times, turn @ truth)
    (hint,) = hints(*pair, alignment="yaw")
    assert hint.remedy == "--up y names it"
    assert hints(*pair, alignment="yaw", up="y") == []


def test_seconds_of_a_sparse_reference_do_not_count_its_poses():
    """At 1 Hz, between poses at 2 Hz that miss its stamps, of a camera that hardly turns."""
    times, truth = winding(np.random.default_rng(5))
    turns = 0.05 * Rotation.from_matrix(truth[:, :3, :3]).as_rotvec()
    truth[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    reference = Trajectory(times[::20], truth[::20])
    estimate = Trajectory(times[5::10], truth[5::10])
    with pytest.raises(ValueError, match="miss the stamps of the reference") as caught:
        evaluate(reference, estimate)
    assert "count" not in str(caught.value)
