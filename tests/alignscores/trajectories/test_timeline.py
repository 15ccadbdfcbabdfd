"""Keyframes, every frame and lost track: time is what an estimate answers for."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from alignscores import closest_pair_quartile, pas, tas, tas_distance
from alignscores.trajectories import timeline
from alignscores.trajectories.association import match
from alignscores.trajectories.files import Trajectory
from alignscores.trajectories.timeline import (
    due_rows,
    nearest_stamps,
    stand_in,
    usual_step,
)

N, RATE = 1200, 20


@pytest.fixture(scope="module")
def truth():
    """A minute."""
    return winding_path(N)


def winding_path(n):
    """A reference at 20 Hz."""
    times = np.arange(n) / RATE
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = np.transpose([10 * np.cos(times / 7), 8 * np.sin(times / 5), np.sin(times)])
    turns = np.transpose([0.3 * np.sin(times), 0.2 * np.cos(times / 3), times / 7])
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return Trajectory(times + 1.7e9, poses)


def of_rows(trajectory, rows):
    return Trajectory(trajectory.keys[rows], trajectory.poses[rows])


def keyframes(rng, n=N, longest=54):
    """Rows at irregular steps of 2 to 54 frames: 0.1 to 2.7 s."""
    rows = np.cumsum(rng.integers(2, longest, n)) - 2
    return rows[rows < n]


def noisy(truth, seed, sigma=0.05):
    """Noise and drift on every pose."""
    rng, shape = np.random.default_rng(seed), (len(truth.keys), 3)
    poses = truth.poses.copy()
    poses[:, :3, 3] += rng.normal(scale=sigma, size=shape)
    poses[:, :3, 3] += np.cumsum(rng.normal(scale=sigma / 20, size=shape), axis=0)
    turns = Rotation.from_rotvec(rng.normal(scale=0.02, size=shape))
    poses[:, :3, :3] = turns.as_matrix() @ poses[:, :3, :3]
    return Trajectory(truth.keys, poses)


def scores(truth, estimate, unit):
    """TAS and half-score distance of an estimate that answers for all frames of the reference."""
    matches = match(truth, estimate, missing="fail", step=1 / RATE)
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    score = tas(gt, est, unit=unit, registration="refined").score
    return score, tas_distance(gt, est)


@pytest.mark.parametrize("step", [1, 2, 7, 20, 100])
def test_a_perfect_estimate_thinned_to_any_rate_is_perfect(truth, step):
    matches = match(truth, of_rows(truth, slice(step // 2, None, step)), missing="fail")
    assert matches.missing == matches.lost == 0
    assert pas(matches.gt_poses, matches.est_poses, unit=1.0).score == 1


def test_a_perfect_estimate_thinned_at_random_or_to_keyframes_is_perfect(truth):
    rng = np.random.default_rng(0)
    for rows in (np.flatnonzero(rng.random(N) < 0.3), keyframes(rng)):
        for step in (None, 1 / RATE):
            matches = match(truth, of_rows(truth, rows), missing="fail", step=step)
            assert matches.lost == 0
            assert pas(matches.gt_poses, matches.est_poses, unit=1.0).score == 1
            if step:
                assert len(matches.keys) == N


@pytest.mark.parametrize("step", [1, 4, 20])
@pytest.mark.parametrize("start", [0.0, 0.45, 0.9])
def test_a_tenth_of_the_time_costs_a_tenth(truth, step, start):
    rows = np.arange(0, N, step)
    kept = rows[(rows < start * N) | (rows >= (start + 0.1) * N)]
    matches = match(truth, of_rows(truth, kept), missing="fail", step=1 / RATE, max_gap=2.0)
    assert matches.lost == pytest.approx(0.1, abs=1.01 * step / N)
    assert pas(matches.gt_poses, matches.est_poses, unit=1.0).score == 1 - matches.lost


def test_a_frame_that_is_lost_keeps_its_place(truth):
    first = Trajectory(*(one[: len(one) // 2] for one in truth))
    matches = match(truth, first, missing="fail")
    lost = matches.est_rows < 0
    assert lost.sum() > len(truth.keys) / 3
    assert np.array_equal(matches.gt_poses[lost], truth.poses[matches.gt_rows[lost]])


def test_frames_dropped_at_random_cost_nothing(truth):
    kept = np.flatnonzero(np.random.default_rng(1).random(N) < 0.9)
    assert match(truth, of_rows(truth, kept), missing="fail").lost == 0


def test_all_frames_and_keyframes_of_one_estimate_score_alike():
    """In the mean over seeds, on the same d; keyframes are every fifth frame, or irregular."""
    truth = winding_path(3 * N)
    unit = closest_pair_quartile(truth.poses[:, :3, 3])
    differences, ratios = [], []
    for seed in range(3):
        estimate, rng = noisy(truth, seed), np.random.default_rng([seed, 1])
        score, half = scores(truth, estimate, unit)
        for rows in (slice(None, None, 5), keyframes(rng, n=3 * N, longest=20)):
            thinned_score, thinned_half = scores(truth, of_rows(estimate, rows), unit)
            differences.append(thinned_score - score)
            ratios.append(thinned_half / half)
    for kind in (0, 1):
        assert np.mean(differences[kind::2]) == pytest.approx(0, abs=0.02)
        assert np.mean(ratios[kind::2]) == pytest.approx(1, abs=0.05)


def test_poses_are_compared_with_the_reference_at_their_own_time(truth):
    times = truth.keys[:-1] + 0.017
    slerp = Slerp(truth.keys, Rotation.from_matrix(truth.poses[:, :3, :3]))
    poses = np.tile(np.eye(4), (N - 1, 1, 1))
    poses[:, :3, :3] = slerp(times).as_matrix()
    for axis in range(3):
        poses[:, axis, 3] = np.interp(times, truth.keys, truth.poses[:, axis, 3])
    between = Trajectory(times, poses)
    matches = match(truth, between, missing="fail")
    np.testing.assert_allclose(matches.gt_poses, poses[matches.est_rows], atol=1e-9)
    nearest = match(truth, between, missing="fail", sync="nearest", t_max_diff=0.02)
    np.testing.assert_array_equal(nearest.gt_poses[0], truth.poses[0])
    with pytest.raises(ValueError, match="no time stamps in common"):
        match(truth, between, sync="nearest")


def test_a_sparse_reference_is_not_interpolated(truth):
    """Over a second the camera may have gone anywhere."""
    sparse = of_rows(truth, slice(None, None, RATE))
    matches = match(sparse, Trajectory(truth.keys + 0.004, truth.poses), missing="fail")
    assert matches.lost == 0
    np.testing.assert_array_equal(matches.gt_poses, sparse.poses)
    assert matches.unmatched == N - len(sparse.keys)


def test_frames_need_their_own_poses(truth):
    frames = truth.keys[::10]
    for rows in (slice(None, None, 20), slice(0, N // 2)):
        matches = match(truth, of_rows(truth, rows), missing="fail", frames=frames)
        assert (len(matches.keys), matches.lost) == (len(frames), 0.5)
    covered = match(truth, of_rows(truth, slice(None, None, 20)), frames=frames, max_gap=1.1)
    assert covered.lost == 0


def test_the_time_that_is_due_can_be_said(truth):
    limits = {"t_start": truth.keys[200], "t_end": truth.keys[999]}
    estimate = of_rows(truth, slice(240, None))
    matches = match(truth, estimate, missing="fail", **limits, max_gap=0.5)
    assert (len(matches.keys), matches.keys[0]) == (800, truth.keys[200])
    assert matches.lost == pytest.approx(0.05, abs=1e-3)
    with pytest.raises(ValueError, match=r"due with t_start 0.0* s and t_end 1.0* s: the ref"):
        match(truth, estimate, t_start=0, t_end=1)


def test_one_pose_covers_no_more_than_itself(truth):
    matches = match(truth, of_rows(truth, slice(600, 601)), missing="fail")
    assert (matches.matched, len(matches.keys)) == (1, N)


def test_frames_that_were_due_at_a_step():
    stamps = np.arange(1000) / 100
    assert due_rows(stamps, 0.01).tolist() == list(range(1000))
    assert due_rows(stamps, np.inf).tolist() == list(range(1000))
    assert due_rows(stamps, 0.05).tolist() == list(range(0, 1000, 5))
    with_gap = np.delete(stamps, slice(200, 300))
    assert len(due_rows(with_gap, 0.05)) == pytest.approx(180, abs=1)
    late = np.append(stamps, 1e9)  # one stamp that is wrong by years
    assert len(due_rows(late, 0.05)) == 201


def test_ends_of_a_long_gap_stand_for_half_a_step(truth):
    kept = np.r_[0:100:4, 500:N:4]
    standing = stand_in(
        truth,
        np.arange(N),
        of_rows(truth, kept),
        t_max_diff=0.01,
        max_gap=None,
        interpolate=True,
    )
    lost = np.flatnonzero(standing.est_rows < 0)
    assert usual_step(truth.keys[kept]) == pytest.approx(0.2)
    assert lost[0] in (98, 99)  # 0.1 s after the last pose, up to rounding
    assert lost[-1] in (497, 498)


def with_gap(n, step, gap):
    """Stamps of n poses, with a gap before the last one, and moments near its start."""
    stamps = np.append(np.arange(n - 1) * step, (n - 2) * step + gap)
    return stamps, stamps[-2]


@pytest.mark.parametrize(
    ("n", "step", "gap", "max_gap", "covered"),
    [
        # By default 10 usual steps and at least a second; of eight poses or fewer a second.
        *[(12, 0.5, 5.0, None, True), (12, 0.5, 5.25, None, False), (9, 0.5, 5.0, None, True)],
        *[(8, 0.5, 1.5, None, False), (8, 0.5, 1.0, None, True), (3, 0.5, 1.0, None, True)],
        *[(12, 1 / 16, 1.0, None, True), (12, 1 / 16, 1.125, None, False)],
        *[(12, 0.5, 2.0, 2.0, True), (12, 0.5, 2.125, 2.0, False), (3, 0.5, 2.0, 2.0, True)],
        *[(12, 0.5, 0.75, 0.5, False), (12, 0.5, 0.75, 0.0, False)],
    ],
)
def test_poses_cover_the_time_between_them_within_the_largest_gap(n, step, gap, max_gap, covered):
    stamps, start = with_gap(n, step, gap)
    due = start + np.array([0.0, 0.5, 1.0]) * gap
    nearest, stands = timeline._covered(stamps, due, 0.01, max_gap)
    assert nearest.tolist() == [n - 2, n - 2, n - 1]
    assert stands.tolist() == [True, covered, True]


@pytest.mark.parametrize(
    ("max_gap", "t_max_diff", "reach"),
    [(None, 0.01, 0.25), (0.25, 0.01, 0.125), (0.0, 0.0625, 0.0625), (None, 0.75, 0.75)],
)
def test_at_the_ends_of_a_long_gap_a_pose_stands_for_half_a_step(max_gap, t_max_diff, reach):
    """Or for as long as stamps are taken for the same."""
    stamps, start = with_gap(12, 0.5, 8.0)
    due = start + np.array([reach, reach + 0.001, 8 - reach - 0.001, 8 - reach])
    nearest, stands = timeline._covered(stamps, due, t_max_diff, max_gap)
    assert nearest.tolist() == [10, 10, 11, 11]
    assert stands.tolist() == [True, False, False, True]


def test_the_time_before_the_first_pose_and_after_the_last_one_is_a_gap():
    stamps = np.arange(5.0)
    near = np.array([-1.0, -0.7, 4.7, 5.0])
    assert timeline._covered(stamps, near, 0.01, 1.0)[1].tolist() == [True] * 4
    far = np.array([-1.25, -0.7, 4.7, 5.25])
    assert timeline._covered(stamps, far, 0.01, 1.0)[1].tolist() == [False] * 4
    alone = timeline._covered(np.zeros(1), np.array([-2.0, 0.25, 2.0]), 0.25, None)
    assert alone[1].tolist() == [False, True, False]


def along_x(stamps):
    """A trajectory that has its stamps squared, so that interpolation shows."""
    poses = np.tile(np.eye(4), (len(stamps), 1, 1))
    poses[:, 0, 3] = np.square(stamps)
    return Trajectory(np.array(stamps, dtype=float), poses)


def compared(reference, times, *, t_max_diff=0.01, interpolate=True):
    """The x at which each pose is compared; None where it has no reference."""
    found, known = timeline._reference_at(reference, np.array(times), 0.05, t_max_diff, interpolate)
    return [x if there else None for x, there in zip(found[:, 0, 3], known, strict=True)]


@pytest.mark.parametrize(
    ("gap", "step", "t_max_diff", "near"),
    [
        # Two poses of the reference are near within 0.1 s, up to what is taken for the same ...
        *[(0.1, 0.01, 0.0, True), (0.105, 0.01, 0.01, True), (0.1 + 0.01, 0.01, 0.01, True)],
        *[(0.115, 0.01, 0.01, False), (0.14, 0.01, 0.0, False)],
        # ... or within a step of the estimate and a tenth.
        *[(1.1, 1.0, 0.01, True), (1.125, 1.0, 0.01, False), (0.5, 0.5, 0.01, True)],
    ],
)
def test_between_poses_that_are_near_the_reference_is_interpolated(gap, step, t_max_diff, near):
    reference = along_x([0.0, gap])
    found, known = timeline._reference_at(
        reference, np.array([gap / 2]), step, t_max_diff, interpolate=True
    )
    assert known.tolist() == [near]
    assert found[0, 0, 3] == pytest.approx(gap**2 / 2 if near else 0.0)


def test_the_reference_is_known_within_its_time_and_a_little_beyond():
    reference = along_x([1.0, 1.1, 1.2, 1.3])
    times = [0.985, 0.995, 1.05, 1.1, 1.15, 1.25, 1.305, 1.325]
    at = [None, 1.0, 1.105, 1.21, 1.325, 1.565, 1.69, None]
    assert compared(reference, times) == pytest.approx(at)
    nearest = [None, 1.0, None, 1.21, None, None, 1.69, None]
    assert compared(reference, times, interpolate=False) == pytest.approx(nearest)
    halves = compared(reference, times, interpolate=False, t_max_diff=0.06)
    assert halves[2] == pytest.approx(1.0)  # of two that are as near the earlier one


def test_a_pose_at_a_stamp_of_the_reference_is_compared_with_just_that(truth):
    found, known = timeline._reference_at(truth, truth.keys, 0.05, 0.01, interpolate=True)
    assert known.all()
    np.testing.assert_array_equal(found, truth.poses)


@pytest.mark.parametrize("start", [0.0, 0.5, 3.25])
def test_due_rows_count_steps_from_the_first_stamp(start):
    """Where the reference is denser by a tenth; up to a millionth of a step."""
    stamps = start + np.arange(12.0)
    for step, rows in ((1.0, list(range(12))), (1.09, list(range(12))), (2.0, [0, 2, 4, 6, 8, 10])):
        assert due_rows(stamps, step).tolist() == rows
    assert due_rows(stamps, 1.1).tolist() == [0, *range(2, 12)]
    assert due_rows(np.array([0, 1, 2 - 1.6e-6, 3, 4]), 2.0).tolist() == [0, 2, 4]
    assert due_rows(np.array([0, 1, 2 - 2.4e-6, 3, 4]), 2.0).tolist() == [0, 3, 4]


def test_the_usual_step_is_the_median_of_those_between_stamps():
    assert usual_step(np.array([0.0, 1.0, 1.0, 3.0, 8.0])) == 2.0
    assert usual_step(np.array([5.0, 5.0])) == np.inf


def test_the_nearest_stamp_is_the_earlier_one_of_two():
    nearest, distance = nearest_stamps(
        np.array([0.0, 1, 3]), np.array([-2.0, 0.5, 0.75, 2, 2.5, 9])
    )
    assert nearest.tolist() == [0, 0, 1, 1, 2, 2]
    assert distance.tolist() == [2, 0.5, 0.25, 1, 0.5, 6]


def test_what_stands_for_frames_by_hand():
    """Poses 0 and 2 stand for what is near them; pose 1 is in a gap of the reference."""
    reference = along_x([0.0, 1.0, 2.0, 9.0, 10.0])
    estimate = along_x([0.25, 5.5, 9.75])
    standing = stand_in(
        reference,
        np.array([0, 1, 2, 4]),
        estimate,
        t_max_diff=0.25,
        max_gap=1.0,
        interpolate=False,
    )
    assert standing.est_rows.tolist() == [0, -1, -1, 2]
    assert standing.gt_poses[:, 0, 3].tolist() == [0, 1, 4, 100]
    assert standing.unmatched == 1
    none = stand_in(
        reference,
        np.array([0, 1]),
        along_x([4.0, 6.0]),
        t_max_diff=0.25,
        max_gap=None,
        interpolate=False,
    )
    assert (none.est_rows.tolist(), none.unmatched) == ([-1, -1], 2)
    np.testing.assert_array_equal(none.gt_poses, reference.poses[:2])
