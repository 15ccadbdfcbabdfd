"""Time is the measure: the scores of keyframes, of all frames and of interrupted tracks."""

from contextlib import nullcontext, suppress

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.tools import file_interface
from scipy.spatial.transform import Rotation, Slerp

from alignscores import closest_pair_quartile, evaluate
from alignscores.evaluation.scoring import score
from alignscores.evaluation.settings import Settings
from alignscores.io import Trajectory, read_tum

N, RATE = 2401, 20  # two minutes


def winding_path(n=N, rate=RATE):
    times = np.arange(n) / rate
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = np.transpose([10 * np.cos(times / 7), 8 * np.sin(times / 5), np.sin(times)])
    turns = np.transpose([0.3 * np.sin(times), 0.2 * np.cos(times / 3), times / 7])
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return Trajectory(times, poses)


TRUTH = winding_path()


def of_rows(trajectory, rows):
    return Trajectory(trajectory.keys[rows], trajectory.poses[rows])


def keyframes(seed, n, longest):
    """Rows at irregular steps of 2 to so many frames."""
    rows = np.cumsum(np.random.default_rng(seed).integers(2, longest + 1, n)) - 2
    return rows[rows < n]


def noisy(truth, seed):
    """Noise and drift on every pose."""
    rng, shape = np.random.default_rng(seed), (len(truth.keys), 3)
    poses = truth.poses.copy()
    poses[:, :3, 3] += rng.normal(scale=0.05, size=shape)
    poses[:, :3, 3] += np.cumsum(rng.normal(scale=0.003, size=shape), axis=0)
    turns = Rotation.from_rotvec(rng.normal(scale=0.02, size=shape))
    poses[:, :3, :3] = turns.as_matrix() @ poses[:, :3, :3]
    return Trajectory(truth.keys, poses)


def unchecked(truth, estimate, **settings):
    """Score as a comparison does all but the first runs: without looking for mistakes, sooner."""
    return score(truth, estimate, Settings(**settings), name="estimate", check=False)


def scored(estimates, *, truth=TRUTH, **settings):
    """Return the results of estimates, by their names."""
    return {
        name: unchecked(truth, estimate, **settings).to_dict()
        for name, estimate in estimates.items()
    }


def thinned(trajectory, seconds):
    """Keep a pose whenever so many seconds have passed."""
    rows, last = [], -np.inf
    for row, stamp in enumerate(trajectory.keys):
        if stamp - last >= seconds - 1e-6:
            rows.append(row)
            last = stamp
    return of_rows(trajectory, rows)


def bursts(trajectory, seconds, n):
    """Keep bursts of so many poses."""
    first = np.searchsorted(trajectory.keys, thinned(trajectory, seconds).keys)
    rows = np.unique(first[:, None] + np.arange(n))
    return of_rows(trajectory, rows[rows < len(trajectory.keys)])


def at_random(trajectory, share):
    drawn = np.random.default_rng(0).random(len(trajectory.keys)) < share
    return of_rows(trajectory, drawn)


def without(trajectory, start, end):
    """Drop the poses of a piece, given as shares of the time."""
    elapsed = (trajectory.keys - TRUTH.keys[0]) / np.ptp(TRUTH.keys)
    return of_rows(trajectory, (elapsed < start) | (elapsed > end))


@pytest.mark.parametrize("reference_rate", [5, 200])
def test_perfect_estimates_score_one_at_any_rate(reference_rate):
    truth = winding_path(40 * reference_rate, reference_rate)
    rows = {f"every {s} s": slice(None, None, round(s * reference_rate)) for s in (0.2, 0.6, 1.8)}
    rows["random"] = np.flatnonzero(np.random.default_rng(0).random(len(truth.keys)) < 0.5)
    rows["keyframes"] = keyframes(0, len(truth.keys), longest=2 * reference_rate)
    ends = 0, len(truth.keys) - 1
    rows = {
        name: np.union1d(np.arange(len(truth.keys))[subset], ends) for name, subset in rows.items()
    }
    results = scored({name: of_rows(truth, subset) for name, subset in rows.items()}, truth=truth)
    assert set(results) == set(rows)
    for result in results.values():
        assert result["PAS"] == 1
        assert result["half_distance"] < 1e-6  # m; the files are rounded
        assert result["lost"] == 0


@pytest.mark.parametrize("step", [1, 5, 30])
def test_losing_a_tenth_of_the_time_costs_a_tenth(step):
    estimate = of_rows(TRUTH, slice(None, None, step))
    pieces = {"start": (-1, 0.1), "middle": (0.45, 0.55), "end": (0.9, 2)}
    results = scored({name: without(estimate, *piece) for name, piece in pieces.items()})
    for result in results.values():
        assert result["PAS"] == pytest.approx(0.9, abs=0.02)
        assert result["lost"] == pytest.approx(1 - result["PAS"], abs=1e-9)


def test_a_pose_covers_half_the_largest_gap_on_either_side():
    """Four poses within 0.15 s count as one here."""
    for pose, max_gap, covered in ((1200, 2, 2), (1200, 5, 5), (0, 2, 1), (N - 4, 2, 1)):
        evaluation = unchecked(TRUTH, of_rows(TRUTH, range(pose, pose + 4)), max_gap=max_gap)
        assert evaluation.lost * N / RATE == pytest.approx(N / RATE - covered - 0.15, abs=0.2)


def test_with_a_largest_gap_of_zero_each_frame_needs_a_pose():
    estimates = {"all": TRUTH, "half": of_rows(TRUTH, slice(0, None, 4))}  # of 10 Hz
    results = scored(estimates, max_gap=0)
    assert [results[name]["lost"] for name in estimates] == [0, pytest.approx(0.5, abs=1e-3)]
    assert scored(estimates, max_gap=0, rate="all")["half"]["lost"] == pytest.approx(0.75, abs=1e-3)


def test_d_and_the_number_of_frames_depend_only_on_the_reference():
    for step in (1, 7, 100):
        evaluation = unchecked(TRUTH, of_rows(noisy(TRUTH, 0), slice(None, None, step)))
        assert len(evaluation.matches.keys) == N // 2 + 1
        assert evaluation.result.tas.unit == closest_pair_quartile(TRUTH.poses[::2, :3, 3])
    assert len(evaluate(TRUTH, TRUTH, rate="all").matches.keys) == N
    assert len(evaluate(TRUTH, TRUTH, rate=1).matches.keys) == N // RATE + 1
    assert len(evaluate(TRUTH, TRUTH, frames=TRUTH.keys[::50]).matches.keys) == N // 50 + 1


def standing(n, step_deg=0.0):
    """A path with the camera standing for 20 s in the middle, or turning on the spot."""
    rows = np.concatenate([np.arange(n // 2), np.full(400, n // 2), np.arange(n // 2, n)])
    poses = TRUTH.poses[rows].copy()
    turns = np.cumsum((np.diff(rows, prepend=-1) == 0) * step_deg)
    axes = turns[:, None] * [0.0, 0.0, 1.0]
    poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(axes, degrees=True).as_matrix()
    return Trajectory(np.arange(len(poses)) / RATE, poses)


@pytest.mark.parametrize(("step_deg", "lost"), [(0.0, 0.0), (0.01, 0.0), (1.0, 0.18)])
def test_a_gap_in_which_the_reference_stands_still_is_covered(step_deg, lost):
    truth = standing(1600, step_deg)
    estimate = of_rows(truth, np.setdiff1d(np.arange(2000), np.arange(801, 1199)))
    (result,) = scored({"estimate": estimate}, truth=truth).values()
    assert result["lost"] == pytest.approx(lost, abs=0.01)
    assert result["PAS"] == pytest.approx(1 - lost, abs=0.01)


def test_poses_are_compared_with_the_reference_at_their_own_time():
    times = np.arange(0.013, 119.99, 0.31)
    slerp = Slerp(TRUTH.keys, Rotation.from_matrix(TRUTH.poses[:, :3, :3]))
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, :3] = slerp(times).as_matrix()
    axes = [np.interp(times, TRUTH.keys, axis) for axis in TRUTH.poses[:, :3, 3].T]
    poses[:, :3, 3] = np.transpose(axes)
    estimate = {"between": Trajectory(times, poses)}
    assert scored(estimate)["between"]["PAS"] == 1
    nearest = scored(estimate, sync="nearest", t_max_diff=0.03)["between"]
    assert 0.5 < nearest["PAS"] < 1


def euroc_runs(real, *runs):
    """Yield ground truth and estimate of real runs."""
    for run in runs:
        folder = real / "euroc" / run.split("/")[0]
        yield read_tum(folder / "groundtruth.txt"), read_tum(real / "euroc" / f"{run}.txt")


def check_that_fewer_poses_gain_nothing(truth, estimate):
    full = unchecked(truth, estimate).pas
    subsets = [thinned(estimate, seconds) for seconds in (0.3, 1.0, 1.9)]
    subsets += [
        bursts(estimate, 1.5, 3),
        *(at_random(estimate, share) for share in (0.9, 0.2, 0.05)),
    ]
    for subset in subsets:
        assert unchecked(truth, subset).pas <= full + 0.02


def check_that_a_pose_more_makes_no_jump(truth, estimate):
    """From 4 matched poses to 40, each added in the middle of the longest gap."""
    rows, pas = [0, len(estimate.keys) - 1], []
    while len(rows) < 40:
        longest = int(np.argmax(np.diff(estimate.keys[rows])))
        middle = estimate.keys[rows[longest : longest + 2]].mean()
        row = int(np.argmin(np.abs(estimate.keys - middle)))
        if row in rows:
            break
        rows = sorted([*rows, row])
        with nullcontext() if len(rows) >= 8 else suppress(ValueError):  # fewer than 4 matched
            pas.append(unchecked(truth, of_rows(estimate, rows)).pas)
    changes = np.diff(pas)
    assert changes.max() <= 0.05
    assert changes.min() >= -0.02


def test_of_made_runs_fewer_poses_gain_nothing_and_one_makes_no_jump():
    estimate = noisy(TRUTH, 0)
    check_that_fewer_poses_gain_nothing(TRUTH, estimate)
    check_that_a_pose_more_makes_no_jump(TRUTH, estimate)


def test_of_real_runs_fewer_poses_gain_nothing(real):
    runs = "MH_01/vislam_ba/0", "V1_03/vislam_rp/0", "V2_02/vio_mono/0"
    for truth, estimate in euroc_runs(real, *runs):
        check_that_fewer_poses_gain_nothing(truth, estimate)


def test_of_real_runs_without_a_stop_a_pose_more_makes_no_jump(real):
    """One pose covers all of a stop, such as the 20 s of MH_01."""
    for truth, estimate in euroc_runs(real, "MH_03/vio_stereo/0", "V1_03/vislam_ba/0"):
        check_that_a_pose_more_makes_no_jump(truth, estimate)


def test_ate_and_rpe_of_keyframes_equal_those_of_evo(real):
    files = real / "fr2_desk_groundtruth.txt", real / "fr2_desk_ORB_kf_mono.txt"
    names = "ate:rmse:sim3", "rpe@1f"
    evaluation = evaluate(*files, format="tum", sync="nearest", metrics=names)

    def statistic(metric):
        metric.process_data((reference, estimate))
        return metric.get_statistic(metrics.StatisticsType.rmse)

    read = map(file_interface.read_tum_trajectory_file, files)
    reference, estimate = sync.associate_trajectories(*read)
    estimate.align(reference, correct_scale=True)
    rpe = statistic(metrics.RPE(metrics.PoseRelation.translation_part))
    assert evaluation.value("rpe@1f") == pytest.approx(rpe, rel=1e-9)
    ape = statistic(metrics.APE(metrics.PoseRelation.translation_part))
    assert evaluation.value("ATE") == pytest.approx(ape, rel=1e-9)
    assert evaluation.value("ate:rmse:sim3") == pytest.approx(ape, rel=1e-9)


def test_all_poses_count_for_the_ate_whatever_frames_are_expected():
    estimate = noisy(TRUTH, 0)
    ates = {unchecked(TRUTH, estimate, rate=rate).ate for rate in (1, 10, "all")}
    assert len(ates) == 1


@pytest.mark.parametrize("rows", [[0, 100, 300, 301, 302, N - 1], range(200, 320)])
@pytest.mark.parametrize("settings", [{}, {"missing": "ignore"}, {"max_gap": 0.25}])
@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_a_pose_that_is_not_finite_is_one_that_is_left_out(rows, settings, value):
    truth = noisy(TRUTH, 0)
    poses = truth.poses.copy()
    poses[list(rows), :3] = value
    left_out = of_rows(truth, np.setdiff1d(np.arange(N), rows))
    estimates = {"not finite": Trajectory(truth.keys, poses), "left out": left_out}
    not_finite, left_out = scored(estimates, **settings).values()
    for name in ("TAS", "RAS", "PAS", "half_distance", "lost", "unit"):
        assert not_finite[name] == left_out[name]


def test_an_estimate_of_nan_alone_scores_zero():
    poses = np.full_like(TRUTH.poses, np.nan)
    assert scored({"nan": Trajectory(TRUTH.keys, poses)})["nan"]["PAS"] == 0


@pytest.mark.parametrize("start", [0.0, 1.7e9])  # stamps since 1970 are rounded to some 1e-7 s
def test_a_pose_that_a_reference_lacks_is_interpolated_by_any_clock(start):
    truth = of_rows(TRUTH, range(0, 800, 2))  # as dense as the expected frames
    truth = Trajectory(truth.keys + start, truth.poses)
    single = of_rows(truth, np.setdiff1d(np.arange(400), range(10, 400, 17)))
    evaluation = evaluate(single, truth)
    assert evaluation.matches.unmatched == 0
    assert evaluation.notes == []


@pytest.mark.parametrize("name", ["t_max_diff", "max_gap", "t_offset"])
def test_seconds_that_the_recording_has_not(name):
    """Nanoseconds, for example. An offset may be as large as the clocks are apart."""
    seconds = float(np.ptp(TRUTH.keys))
    message = (
        f"{name} is in seconds, and 5e\\+07 s are longer than the recording of {seconds:.6g} s"
    )
    with pytest.raises(ValueError, match=message):
        evaluate(TRUTH, TRUTH, **{name: 5e7})
    assert evaluate(TRUTH, TRUTH, **{name: 0.02}).pas > 0.9
    late = TRUTH._replace(keys=TRUTH.keys - 1.7e9)
    assert evaluate(TRUTH, late, t_offset=1.7e9).pas == 1.0
    short = TRUTH._replace(keys=TRUTH.keys[:12], poses=TRUTH.poses[:12])
    assert evaluate(short, short).pas == 1.0  # of 1.1 s; the default gap is 2 s


@pytest.mark.parametrize("step", [2, 5])
def test_poses_are_compared_at_the_stamps_of_a_reference_that_weaves_between_them(step):
    """The longer the steps, the longer is d; straight lines are off by less of it."""
    truth = winding_path()
    truth.poses[:, 0, 3], truth.poses[:, 1, 3] = 8 * truth.keys, 2 * np.sin(truth.keys / 1.5)
    truth.poses[:, 2, 3] = 0
    reference = of_rows(truth, slice(None, None, step * RATE))
    evaluation = evaluate(reference, truth, alignment="rigid")
    assert evaluation.ate < 1e-6
    (note,) = (note for note in evaluation.notes if note.kind == "sparse")
    assert note.text.startswith("the reference is too sparse to be interpolated: straight lines")


def test_a_refusal_counts_the_poses_of_the_file():
    """Of a sparse reference only those at its stamps are compared."""
    reference = of_rows(TRUTH, slice(None, None, 2 * RATE))
    estimate = Trajectory(np.arange(400) / 1e4 + 4, TRUTH.poses[:400])
    with pytest.raises(ValueError, match=r"^only 1 of 400 poses could be matched"):
        evaluate(reference, estimate)
