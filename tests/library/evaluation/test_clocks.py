"""A constant offset between two clocks, found by rotation rates or speeds."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import evaluate
from alignscores.io import Trajectory, read_tum

TIMES = np.arange(1200) / 20


def walk(seed=0):
    """A minute of a hand-held camera, at 20 Hz."""
    rng = np.random.default_rng(seed)
    waves = rng.uniform(0.3, 3, (6, 3)), rng.uniform(0, 6, (6, 3))
    turns, moves = (
        sum(np.sin(TIMES[:, None] * speed + phase) for speed, phase in zip(*part, strict=True))
        for part in ([wave[:3] for wave in waves], [wave[3:] for wave in waves])
    )
    poses = np.tile(np.eye(4), (len(TIMES), 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(0.4 * turns).as_matrix()
    poses[:, :3, 3] = moves
    return Trajectory(TIMES, poses)


def with_noise(poses, sigma, seed=1):
    rng, noisy = np.random.default_rng(seed), poses.copy()
    turns = Rotation.from_rotvec(rng.normal(0, sigma, (len(poses), 3))).as_matrix()
    noisy[:, :3, :3] = turns @ poses[:, :3, :3]
    noisy[:, :3, 3] += rng.normal(0, sigma, (len(poses), 3))
    return noisy


def disturbed(truth, late, step=1, sigma=0.01):
    poses = with_noise(truth.poses, sigma)
    return Trajectory((truth.keys + late)[::step], poses[::step])


def offset(truth, estimate, **settings):
    """Return the offset that was added to the stamps, and the notes on it."""
    evaluation = evaluate(truth, estimate, t_offset="auto", **settings)
    added = evaluation.estimate.keys[0] - np.asarray(estimate.keys)[0]
    return added, [str(note) for note in evaluation.notes if note.kind == "clock"]


@pytest.mark.parametrize("step", [1, 10])  # all frames, and one in half a second
@pytest.mark.parametrize("late", [0.137, -0.05, 5.25, 1.6e9])
def test_an_offset_is_found_within_5_ms(late, step):
    truth = walk()
    added, (note,) = offset(truth, disturbed(truth, late, step))
    assert added == pytest.approx(-late, abs=0.005)
    assert note.startswith("time offset of")


def test_no_offset_is_found_where_there_is_none():
    truth = walk()
    for step in (1, 10, 60):  # one in 3 s: too few to compare
        added, (note,) = offset(truth, disturbed(truth, 0.0, step, sigma=0.03))
        assert added == 0
        assert note.startswith("no time offset added: ")


def test_a_noisy_reference_is_not_late():
    """Interpolation averages its noise, most so between its stamps."""
    truth = walk()
    exact = truth._replace(keys=2 * truth.keys)
    for seed in range(5):
        reference = exact._replace(poses=with_noise(exact.poses, 0.03, seed))
        notes = evaluate(reference, exact).notes
        assert [str(note) for note in notes if note.kind == "clock"] == []


def test_an_offset_of_a_few_seconds_is_found():
    truth = walk()
    reference, estimate = (
        Trajectory(keys[:80], poses[:80]) for keys, poses in (truth, disturbed(truth, 0.137))
    )
    added, _ = offset(reference, estimate)
    assert added == pytest.approx(-0.137, abs=0.005)


def test_unrelated_motions_of_a_few_seconds_show_no_offset():
    """They may be alike for a second or two."""
    for seed in range(20):
        first, second = (
            Trajectory(TIMES[:80], walk(2 * seed + part).poses[:80]) for part in range(2)
        )
        added, (note,) = offset(first, second)
        assert added == 0
        assert "none is certain" in note


def test_frames_and_scale_do_not_matter():
    truth = walk()
    estimate = disturbed(truth, 0.137)
    turn = Rotation.from_rotvec([1.0, 2.0, 3.0]).as_matrix()
    poses = estimate.poses.copy()
    poses[:, :3, :3] = turn @ poses[:, :3, :3] @ turn
    poses[:, :3, 3] = 7 * poses[:, :3, 3] @ turn.T + 100
    added, _ = offset(truth, Trajectory(estimate.keys, poses))
    assert added == pytest.approx(-0.137, abs=0.005)


def test_a_clock_that_is_off_is_noted_with_the_option_that_corrects_it():
    truth = walk()
    assert not any(note.kind == "clock" for note in evaluate(truth, disturbed(truth, 0.0)).notes)
    notes = evaluate(truth, disturbed(truth, 0.137)).notes
    (note,) = [str(note) for note in notes if note.kind == "clock"]
    seconds = float(note.split("offset of ")[1].split()[0])
    assert seconds == pytest.approx(-0.137, abs=0.005)
    settled = evaluate(truth, disturbed(truth, 0.137), t_offset=seconds)
    assert not any(note.kind == "clock" for note in settled.notes)


def test_motions_that_fit_nowhere_are_refused_if_the_clocks_have_no_time_in_common():
    other = walk(7)
    with pytest.raises(
        ValueError, match=r"no time offset makes its motions .* with certainty.*; --t_offset X"
    ):
        evaluate(walk(), Trajectory(other.keys + 1000, other.poses), t_offset="auto")


def test_frames_that_are_matched_by_their_numbers_have_no_clock():
    """Whole stamps match frame numbers; an option that adds seconds would change nothing."""
    truth = walk()
    reference = Trajectory(np.arange(len(TIMES), dtype=float), truth.poses)
    shifted = Trajectory(np.arange(len(TIMES)) + 1, truth.poses)
    for settings in ({}, {"t_offset": "auto"}):
        evaluation = evaluate(reference, shifted, **settings)
        assert evaluation.pas < 1
        assert not any(note.kind == "clock" for note in evaluation.notes)
    names = Trajectory(np.arange(len(TIMES)).astype(str), truth.poses)
    with pytest.raises(ValueError, match="the reference has image names"):
        evaluate(names, truth, format="tum", t_offset="auto")


def test_real_runs_have_the_known_offsets(real):
    folder = real / "euroc/V2_02"
    truth = read_tum(folder / "groundtruth.txt")
    for system, late in (("vislam_ba", 0.0), ("vislam_rp", 0.05), ("vio_stereo", 0.0)):
        added, _ = offset(truth, read_tum(folder / system / "0.txt"))
        assert added == pytest.approx(-late, abs=0.002)


@pytest.mark.parametrize(("rate", "digits"), [(10, 16), (100, 8), (30, 9)])
def test_a_constant_speed_without_noise_fits_at_any_offset(rate, digits):
    """So none is certain: what differs is the rounding of a file."""
    stamps = 1.7e9 + np.arange(400) / rate
    line = 0.5 * (stamps - stamps[0])[:, None] * [1, 0.3, 0]
    turned = np.add(Rotation.from_quat([0.771, -0.29, -0.251, -0.509]).apply(line), [1, 2, -5])
    files = [np.tile(np.eye(4), (len(stamps), 1, 1)) for _ in range(2)]
    for poses, positions in zip(files, (line, turned), strict=True):
        poses[:, :3, 3] = positions.round(digits)
    reference, estimate = (Trajectory(stamps, poses) for poses in files)
    assert offset(reference, estimate, unit=0.05)[0] == 0
    assert not [n for n in evaluate(reference, estimate, unit=0.05).notes if n.kind == "clock"]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("step", "share"), [(1, 0.4), (1, 0.5), (15, 0.3), (50, 0)])
def test_outliers_leave_an_offset_certain(step, share, seed):
    """Also of keyframes, and where they spoil more than half of the motions."""
    truth = walk()
    estimate = disturbed(truth, 0.4, step)
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(estimate.keys)) < share
    estimate.poses[wrong, :3, :3] = Rotation.random(int(wrong.sum()), rng=rng).as_matrix()
    added, _ = offset(truth, estimate)
    assert added == pytest.approx(-0.4, abs=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_outliers_leave_an_offset_by_speeds_certain(seed):
    """Each spoils the two motions that it belongs to."""
    truth = walk()
    estimate = disturbed(truth, 0.4)
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(estimate.keys)) < 0.1
    estimate.poses[wrong, :3, 3] += rng.normal(0, 3, (int(wrong.sum()), 3))
    estimate.poses[:, :3, :3] = np.eye(3)
    added, _ = offset(truth, estimate)
    assert added == pytest.approx(-0.4, abs=0.02)


def test_a_camera_that_rests_for_most_of_the_time_has_a_clock():
    """Most of its motions are equal."""
    times = np.arange(2000) / 20
    rates = np.where(times % 30 < 10, np.sin(times) + np.sin(2.3 * times), 0.0)
    poses = np.tile(np.eye(4), (2000, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("z", np.cumsum(rates)[:, None] / 20).as_matrix()
    poses[:, 0, 3] = np.cumsum(np.abs(rates)) / 20
    added, _ = offset(Trajectory(times, poses), Trajectory(times + 0.7, poses))
    assert added == pytest.approx(-0.7, abs=0.01)


@pytest.mark.parametrize("bias", [0.005, 0.02])  # in rad/s
def test_the_bias_of_a_gyroscope_is_no_offset(bias):
    """In a bend that gets tighter, both add to the angles by which a car turns."""
    times = np.arange(200) / 10
    rate = 0.05 + 0.2 * (1 - np.cos(np.pi * times / 20))
    drives = np.tile(np.eye(4), (2, len(times), 1, 1))
    for drive, turning in zip(drives, (rate, rate + bias), strict=True):
        heading = np.cumsum(turning / 10)
        drive[:, :3, :3] = Rotation.from_euler("z", heading[:, None]).as_matrix()
        drive[:, :3, 3] = 0.8 * np.cumsum(drive[:, :3, 0], axis=0)
    estimate = disturbed(Trajectory(times, drives[1]), 0, sigma=0.003)
    assert offset(Trajectory(times, drives[0]), estimate)[0] == 0
    notes = evaluate(Trajectory(times, drives[0]), estimate).notes
    assert "clock" not in {note.kind for note in notes}


def test_speeds_show_what_rotations_leave_open():
    """A car on a straight road, whose rotations are noise."""
    truth = walk()
    straight = truth.poses.copy()
    straight[:, :3, :3] = np.eye(3)
    straight[:, 0, 3] = np.cumsum(2 + np.sin(TIMES) + 0.5 * np.sin(2.7 * TIMES))
    truth = Trajectory(TIMES, disturbed(Trajectory(TIMES, straight), 0).poses)
    noisy = disturbed(Trajectory(TIMES, straight), 3.2)
    turns = Rotation.from_rotvec(np.random.default_rng(3).normal(0, 0.03, (len(TIMES), 3)))
    noisy.poses[:, :3, :3] = turns.as_matrix()
    added, _ = offset(truth, noisy)
    assert added == pytest.approx(-3.2, abs=0.02)


def test_noise_of_keyframes_moves_an_offset_by_no_more_than_its_error_says():
    """Noise enlarges the angles between poses, but not in a direction: vectors show that."""
    off, errors = [], []
    for seed in range(8):
        rng, truth = np.random.default_rng([seed, 1]), walk(seed)
        steps = rng.integers(3, 24, 200)
        rows = np.cumsum(steps)[np.cumsum(steps) < len(TIMES)]
        noise = Rotation.from_rotvec(rng.normal(0, 0.05, (len(rows), 3))).as_matrix()
        poses = truth.poses[rows].copy()
        poses[:, :3, :3] = noise @ poses[:, :3, :3]
        added, (note,) = offset(truth, Trajectory(truth.keys[rows] + 7.3, poses))
        off.append(abs(added + 7.3))
        errors.append(float(note.split("standard error ")[1].split()[0]))
    assert (np.array(off) <= np.maximum(0.005, 3.5 * np.array(errors))).all()
    assert np.median(off) < 0.005


@pytest.mark.parametrize("span", [6, 15, 60])  # seconds
def test_unrelated_motions_have_no_certain_offset(span):
    """However well one of many offsets happens to fit for a while."""
    for seed in range(10):
        n = 20 * span
        reference, other = walk(seed), disturbed(walk(seed + 100), 0)
        estimate = Trajectory(other.keys[:n] + 5000, other.poses[:n])
        with pytest.raises(ValueError, match="no time offset makes its motions"):
            evaluate(reference, estimate, t_offset="auto")


def test_drift_of_the_heading_is_not_taken_for_an_offset():
    """Around an object both turn displacements; positions only, which do not say which it is."""
    for seed in (1, 7):
        rng = np.random.default_rng(seed)
        phases = rng.uniform(0, 6, 3)
        angle = 3 * np.sin(0.25 * TIMES + phases[0]) + np.sin(0.6 * TIMES + phases[1])
        height = 0.4 * np.sin(0.5 * TIMES + phases[2])
        path = np.transpose([4 * np.cos(angle), 4 * np.sin(angle), height])
        drift = Rotation.from_rotvec(np.outer(TIMES / 60, [0, 0, 0.3]))
        files = [np.tile(np.eye(4), (len(TIMES), 1, 1)) for _ in range(2)]
        files[0][:, :3, 3] = path
        files[1][:, :3, 3] = drift.apply(path) + rng.normal(0, 0.02, path.shape)
        added, _ = offset(Trajectory(TIMES, files[0]), Trajectory(TIMES + 2, files[1]))
        assert added == pytest.approx(-2, abs=0.012)


def test_a_certain_offset_that_raises_no_score_is_noted():
    truth = walk()
    added, (note,) = offset(truth, disturbed(truth, 0.008), max_threshold_deg=90, max_threshold=50)
    assert added == 0
    assert note.startswith("no time offset added: -0.0080 s (standard error 0.000")
    assert note.endswith("fits its motions best, but does not raise the score clearly")
