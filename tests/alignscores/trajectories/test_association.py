import numpy as np
import pandas
import pytest
from evo.core.sync import associate_trajectories, matching_time_indices
from evo.core.trajectory import PoseTrajectory3D

from alignscores.trajectories import association
from alignscores.trajectories.association import checked, in_order, match, present, unit_hint
from alignscores.trajectories.files import Trajectory, TrajectoryWarning

# Every pose of the reference is due, and takes the pose of its own moment.
AT_ITS_STAMP = {"sync": "nearest", "max_gap": 0.0, "step": 0.0}


def trajectory(keys):
    """Poses that tell by their x coordinate which one they are."""
    poses = np.tile(np.eye(4), (len(keys), 1, 1))
    poses[:, 0, 3] = np.arange(len(keys))
    return Trajectory(np.asarray(keys), poses)


def pairs(matches):
    """Rows of the reference with those of the estimate; None for a camera that is missing."""
    est = [None if np.isnan(x) else int(x) for x in matches.est_poses[:, 0, 3]]
    return list(zip(matches.gt_rows.tolist(), est, strict=True))


@pytest.mark.parametrize(("n_ref", "n_est"), [(200, 30), (30, 200), (50, 50)])
@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_time_stamps_are_associated_as_evo_does(n_ref, n_est, offset):
    rng = np.random.default_rng([n_ref, n_est])
    ref, est = (np.sort(rng.uniform(0, 10, n)) for n in (n_ref, n_est))
    # So far apart that no pose is anybody's nearest twice.
    ref, est = ref[np.diff(ref, prepend=-1) > 0.02], est[np.diff(est, prepend=-1) > 0.02] - offset
    matches = match(trajectory(ref), trajectory(est), t_offset=offset, **AT_ITS_STAMP)
    np.testing.assert_array_equal(matches.gt_poses, trajectory(ref).poses[matches.gt_rows])

    def evo_trajectory(stamps):
        poses = trajectory(stamps).poses
        return PoseTrajectory3D(poses_se3=list(poses), timestamps=stamps)

    theirs = associate_trajectories(
        evo_trajectory(ref), evo_trajectory(est), max_diff=0.01, offset_2=offset
    )
    expected = [traj.positions_xyz[:, 0].astype(int).tolist() for traj in theirs]
    assert 0 < matches.matched < min(len(ref), len(est))
    assert pairs(matches) == list(zip(*expected, strict=True))
    assert matches.missing == len(ref) - matches.matched
    assert matches.unmatched == len(est) - matches.matched
    assert matches.duplicate == 0


@pytest.mark.parametrize("digits", [2, 3, 9])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_nearest_stamps_are_those_of_evo(digits, start, offset):
    """With few digits distances are equal, and many poses share the nearest one."""
    rng = np.random.default_rng(digits)
    options = {**AT_ITS_STAMP, "t_max_diff": 0.0249, "t_offset": offset}
    for n_ref, n_est in rng.integers(2, 60, (30, 2)):
        ref, est = (np.unique(start + rng.uniform(0, 4, n).round(digits)) for n in (n_ref, n_est))
        est[rng.integers(len(est))] = ref[0]
        est = np.unique(est) - offset
        expected = list(zip(*matching_time_indices(ref, est, 0.0249, offset), strict=True))
        matches = match(trajectory(ref), trajectory(est), **options)
        assert pairs(matches) == expected
        compared = matching_time_indices(est, ref, 0.0249, -offset)
        nearest = dict(zip(*compared, strict=True))
        assert matches.gt_poses[:, 0, 3].tolist() == [nearest[row] for _, row in expected]
        assert matches.unmatched == len(est) - len(nearest)


def test_missing_cameras_fail_or_are_left_out():
    reference, estimate = trajectory([0.0, 1.0, 2.0, 3.0]), trajectory([1.001, 3.002, 9.0])
    ignore = match(reference, estimate, **AT_ITS_STAMP)
    fail = match(reference, estimate, missing="fail", **AT_ITS_STAMP)
    assert pairs(ignore) == [(1, 0), (3, 1)]
    assert pairs(fail) == [(0, None), (1, 0), (2, None), (3, 1)]
    for matches in (ignore, fail):
        counts = matches.matched, matches.missing, matches.unmatched, matches.duplicate
        assert counts == (2, 2, 1, 0)
    assert fail.keys.tolist() == [0, 1, 2, 3]


def test_each_frame_takes_the_closest_pose():
    few, many = trajectory([0.0, 1.0, 2.0, 3.0, 4.0]), trajectory([0.994, 1.001, 1.005, 2.0])
    matches = match(few, many, **AT_ITS_STAMP)
    assert pairs(matches) == [(1, 1), (2, 3)]
    assert (matches.duplicate, matches.unmatched, matches.missing) == (0, 0, 3)


def test_a_pose_stands_for_all_frames_around_it():
    few, many = trajectory([0.0, 1.0, 2.0, 3.0, 4.0]), trajectory([0.994, 1.001, 1.005, 2.0])
    matches = match(many, few, missing="fail", **AT_ITS_STAMP)
    assert pairs(matches) == [(0, 1), (1, 1), (2, 1), (3, 2)]
    assert matches.gt_poses[:, 0, 3].tolist() == [1, 1, 1, 3]  # the one nearest to the pose
    assert (matches.duplicate, matches.unmatched, matches.missing) == (0, 3, 0)


def test_duplicate_stamps_are_counted_and_the_first_is_used():
    matches = match(trajectory([0.0, 1.0, 2.0]), trajectory([0.0, 1.0, 1.0, 1.0, 2.0]))
    assert pairs(matches) == [(0, 0), (1, 1), (2, 4)]
    assert matches.duplicate == 2
    with pytest.warns(TrajectoryWarning, match="duplicates in the reference .*: 1"):
        matches = match(trajectory([0.0, 1.0, 1.0]), trajectory([0.0, 1.0]), missing="fail")
    assert pairs(matches) == [(0, 0), (1, 1)]


@pytest.mark.parametrize("whose", ["reference", "estimate"])
def test_stamps_out_of_order_are_sorted(whose):
    ordered, shuffled = trajectory([0.0, 1.0, 2.0]), trajectory([2.0, 0.0, 1.0])
    both = (shuffled, ordered) if whose == "reference" else (ordered, shuffled)
    with pytest.warns(TrajectoryWarning, match=rf"{whose} are not in order \(first at pose 2"):
        matches = match(*both)
    expected = [(1, 0), (2, 1), (0, 2)] if whose == "reference" else [(0, 1), (1, 2), (2, 0)]
    assert pairs(matches) == expected


@pytest.mark.parametrize(
    ("reference", "estimate"),
    [
        (trajectory([0.0, 1.0, 1.0, 2.0]), trajectory([0.0, 2.0])),
        (trajectory(["b", "c", "a", "b"]), trajectory(["a", "b"])),
    ],
    ids=["stamps", "names"],
)
def test_a_reference_in_order_matches_the_same_without_a_warning(reference, estimate):
    with pytest.warns(TrajectoryWarning, match="duplicates in the reference .*: 1"):
        ordered = in_order(reference)
    with pytest.warns(TrajectoryWarning):
        expected = match(reference, estimate, missing="fail", **AT_ITS_STAMP)
    matches = match(ordered, estimate, missing="fail", **AT_ITS_STAMP)
    assert matches.keys.tolist() == expected.keys.tolist()
    assert matches.est_rows.tolist() == expected.est_rows.tolist()
    assert (matches.matched, matches.missing) == (expected.matched, expected.missing) == (2, 1)
    np.testing.assert_array_equal(in_order(ordered).keys, ordered.keys)


STAMPS = np.arange(400) / 40  # 10 s


@pytest.mark.parametrize("times", [1.2, 3, 10])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_a_denser_reference_has_lost_what_the_gaps_of_the_estimate_last(times, start):
    """Frames at 3 Hz, of which none, or a tenth at the start, in the middle or at the end is lost;
    with a reference of more poses a second, between which the frames lie anywhere."""
    rng = np.random.default_rng(5)
    frames = start + np.arange(200) / 3 + rng.uniform(-0.01, 0.01, 200)
    reference = trajectory(np.arange(frames[0] - 0.1, frames[-1] + 0.1, 1 / (3 * times)))
    near = 0.5 / (3 * times)
    perfect = match(reference, trajectory(frames), missing="fail", t_max_diff=near)
    assert len(perfect.keys) == perfect.matched == pytest.approx(200, abs=1)
    assert perfect.missing == perfect.lost == 0
    for first in (0, 90, 180):
        last = first + 20
        gap = trajectory(np.delete(frames, slice(first, last)))
        matches = match(reference, gap, missing="fail", t_max_diff=near)
        assert matches.missing == pytest.approx(20, abs=1)
        assert matches.lost == pytest.approx(0.1, abs=0.01)
        assert len(matches.keys) == matches.matched + matches.missing
        lost = np.isnan(matches.est_poses[:, 0, 3])
        assert lost.sum() == matches.missing
        times_lost = matches.keys[lost]
        assert frames[first] - 0.2 < times_lost[0] < times_lost[-1] < frames[last - 1] + 0.2
        ignored = match(reference, gap, t_max_diff=near)
        assert ignored.matched == matches.matched


@pytest.mark.parametrize("step", [2, 3, 7])
def test_every_few_poses_of_a_reference_have_no_failure(step):
    matches = match(trajectory(STAMPS), trajectory(STAMPS[1::step]), missing="fail")
    assert (matches.missing, matches.matched) == (0, len(STAMPS[::step]))


def test_a_gap_of_a_denser_reference_is_no_failure_and_a_wrong_stamp_no_billions():
    reference = trajectory(np.r_[STAMPS, 60 + STAMPS])
    estimate = np.r_[STAMPS, 60 + STAMPS][::4]
    assert match(reference, trajectory(estimate), missing="fail").missing == 0
    wrong = match(reference, trajectory(np.r_[-1e9, estimate]), missing="fail")
    assert (wrong.matched, wrong.unmatched) == (200, 1)


def test_frames_say_what_was_to_be_estimated():
    reference = trajectory(STAMPS)
    frames = np.arange(0.0, 12, 0.5)  # four after the end of the reference
    kept = np.delete(frames, [2, 3, 23])
    options = {"missing": "fail", "t_max_diff": 0.004}
    matches = match(reference, trajectory(kept + 0.003), frames=frames, **options)
    lost = matches.keys[np.isnan(matches.est_poses[:, 0, 3])]
    assert lost.tolist() == [1.0, 1.5]
    after = [10.0, 10.5, 11.0, 11.5]
    assert (matches.matched, matches.missing) == (18, 2)
    assert matches.without_reference.tolist() == after
    late = match(reference, trajectory(kept - 5), frames=frames - 5, t_offset=5.0, **options)
    assert (late.matched, late.missing) == (18, 2)
    assert late.without_reference.tolist() == after
    exact = match(reference, trajectory(kept), frames=kept, missing="fail", t_max_diff=0)
    assert (exact.matched, exact.without_reference.tolist()) == (18, after[:3])


def covered(stamps, estimated):
    """(stamps of the reference, which of them are estimated) -> share that was not lost."""
    return 1 - match(trajectory(stamps), trajectory(stamps[estimated]), step=1 / 40).lost


@pytest.mark.parametrize(
    ("first", "last", "share"),
    [(100, 300, 0.5), (0, 200, 0.5), (200, 400, 0.5), (0, 0, 1.0), (180, 215, 1.0)],
    ids=["middle", "start", "end", "nothing", "less than a second"],
)
@pytest.mark.parametrize("step", [1, 3])
def test_what_is_covered_was_not_lost(first, last, share, step):
    """Wherever it was lost, and however densely it was to be estimated."""
    rows = np.arange(400)
    estimated = (rows % step == 0) & ((rows < first) | (rows >= last))
    assert covered(STAMPS, estimated) == pytest.approx(share, abs=2 * step / 400)
    assert covered(1e9 + STAMPS, estimated) == covered(STAMPS, estimated)


def test_keyframes_and_frames_dropped_here_and_there_lose_nothing():
    rng = np.random.default_rng(0)
    assert covered(STAMPS, rng.random(400) < 0.3) == 1.0
    keyframes = np.cumsum(rng.integers(10, 60, 12))  # up to 1.5 s apart
    assert covered(STAMPS, np.isin(np.arange(400), keyframes)) == 1.0


def test_a_gap_of_the_reference_is_no_loss():
    stamps = np.r_[STAMPS, 60 + STAMPS]
    assert covered(stamps, np.ones(800, dtype=bool)) == 1.0
    assert covered(stamps, np.arange(800) < 600) == pytest.approx(0.75, abs=0.002)
    lost_at_the_gap = (np.arange(800) < 300) | (np.arange(800) >= 500)
    assert covered(stamps, lost_at_the_gap) == 0.75


def test_names():
    reference, estimate = trajectory(["b", "a", "c", "d"]), trajectory(["d", "x", "a", "a"])
    matches = match(reference, estimate, missing="fail")
    assert pairs(matches) == [(0, None), (1, 2), (2, None), (3, 0)]
    counts = matches.matched, matches.missing, matches.unmatched, matches.duplicate
    assert counts == (2, 2, 1, 1)
    assert pairs(match(reference, estimate)) == [(1, 2), (3, 0)]


@pytest.mark.parametrize(
    ("reference", "estimate"),
    [
        (["images/a.png", "images/b.png", "c.png"], ["b.png", "a.png"]),
        (["images/a.png", "b.png", "x/c.png"], ["y/b.jpg", "a"]),
        (["images/cam1/a.png", "images/cam2/a.png", "c.png"], ["cam2/a.png", "cam1/a.png"]),
        (["images/a.PNG", "x\\b.png", "c.png"], ["X/B.png", "a.png"]),
        (["cam1/a.png", "cam2/a.png", "cam3/a.png"], ["x/cam2/a.png", "y/cam1/a.png"]),
    ],
)
def test_names_are_matched_by_their_longest_common_end(reference, estimate):
    with pytest.warns(TrajectoryWarning, match="^images are matched by the end of their path: "):
        matches = match(trajectory(reference), trajectory(estimate), missing="fail")
    assert pairs(matches) == [(0, 1), (1, 0), (2, None)]


def test_a_path_that_agrees_does_not_switch_that_off():
    reference = [*(f"images/{i}.png" for i in range(9)), "9.png"]
    estimate = [*(f"rgb/{i}.png" for i in range(9)), "9.png"]
    with pytest.warns(TrajectoryWarning, match="^9 of 10 images are matched by the end"):
        matches = match(trajectory(reference), trajectory(estimate))
    assert pairs(matches) == [(i, i) for i in range(10)]
    with pytest.warns(TrajectoryWarning, match="^8 of 9 images are matched by the end"):
        matches = match(trajectory(reference[:9]), trajectory([reference[0], *estimate[1:9]]))
    assert pairs(matches) == [(i, i) for i in range(9)]


def test_an_image_of_another_camera_takes_no_place(recwarn):
    """Though each of the two is the only one of its name."""
    reference = [f"cam1/{i}.png" for i in range(9)] + [f"cam2/{i}.png" for i in range(8)]
    estimate = [f"cam1/{i}.png" for i in range(8)] + [f"cam2/{i}.png" for i in range(9)]
    del reference[16], estimate[15]
    matches = match(trajectory(reference), trajectory(estimate), missing="fail")
    assert (8, None) in pairs(matches)
    assert not recwarn.list


def test_file_names_that_are_not_unique_are_not_matched(recwarn):
    left_and_right = [f"{side}/{i}.png" for side in ("left", "right") for i in range(4)]
    with pytest.raises(ValueError, match=r"no image names in common: .* that is unique"):
        match(trajectory(left_and_right), trajectory(["0.png", "1.png"]))
    some = match(trajectory([*left_and_right, "up/9.png"]), trajectory(["left/0.png", "3.png"]))
    assert pairs(some) == [(0, 0)]
    assert not recwarn.list


def test_frame_numbers():
    """Not row by row."""
    assert pairs(match(trajectory([0, 5, 7]), trajectory([5, 7, 9]))) == [(1, 0), (2, 1)]
    ns = 1_700_000_000_000_000_000 + 100 * np.arange(5)  # closer than floats tell apart
    matches = match(trajectory(ns), trajectory(ns[1:].astype(np.uint64)), missing="fail")
    assert pairs(matches) == [(0, None), (1, 0), (2, 1), (3, 2), (4, 3)]
    with pytest.raises(ValueError, match="no frame numbers in common: the reference has 3, the es"):
        match(trajectory([3, 4]), trajectory([5, 6]))


@pytest.mark.parametrize("keys", [[0.0, 1.0, 2.0], ["a", "b", "c"], [3, 7, 8]])
@pytest.mark.parametrize("kind", [list, tuple, pandas.Series, pandas.Index])
def test_keys_and_poses_of_other_types(keys, kind):
    poses = trajectory(keys).poses
    estimate = Trajectory(kind(keys[1:]), poses[1:])
    matches = match(Trajectory(kind(keys), poses[:, :3]), estimate, **AT_ITS_STAMP)
    assert pairs(matches) == [(1, 1), (2, 2)]
    np.testing.assert_array_equal(matches.gt_poses, poses[1:])
    assert in_order(Trajectory(kind(keys), poses[:, :3])).poses.shape == (3, 4, 4)


@pytest.mark.parametrize(
    ("keys", "poses", "message"),
    [
        ([None, "a"], np.ones((2, 4, 4)), "keys of the estimate must be a list of .* type object"),
        (np.array([3, 4], "M8[s]"), np.ones((2, 4, 4)), "keys of the estimate must be"),
        ([0.0, 1.0], np.ones((3, 4, 4)), r"poses of the estimate must .* not of shape \(3, 4, 4\)"),
        ([0.0, 1.0], np.ones((2, 3)), r"poses of the estimate must .* not of shape \(2, 3\)"),
        ([0.0, np.nan], np.ones((2, 4, 4)), "time stamp of pose 2 of the estimate is not finite"),
        ([], np.ones((0, 4, 4)), "the estimate has no poses"),
        ([0, 1], np.ones((2, 4, 4)), "are time stamps .* those of the estimate frame numbers"),
    ],
)
def test_what_is_no_trajectory(keys, poses, message):
    with pytest.raises(ValueError, match=message):
        match(trajectory([0.0, 1.0]), Trajectory(keys, poses))


def test_a_folder_is_no_second_one_by_as_many_images():
    with pytest.warns(TrajectoryWarning, match="by the end of their path: 'a/1.png' and 'b/1.png'"):
        matches = match(trajectory(["a/1.png", "a/2.png"]), trajectory(["b/1.png", "c/2.png"]))
    assert matches.matched == 1


def test_a_folder_is_the_one_with_the_most_images_in_common():
    """Whatever comes first: the other folder's image is another one of the same name."""
    reference = trajectory(["all/a/1.png", "all/b/2.png", "all/b/3.png"])
    with pytest.warns(TrajectoryWarning, match="by the end of their path"):
        matches = match(reference, trajectory(["x/1.png", "x/2.png", "x/3.png"]))
    assert pairs(matches) == [(1, 1), (2, 2)]


def test_clocks_without_a_moment_in_common_are_told():
    with pytest.raises(ValueError, match="no time stamps in common") as caught:
        match(trajectory([0.0, 1.0, 2.0]), trajectory([5.0, 6.0, 7.0]))
    assert "goes from 0.000000 to 2.000000 s, the estimate from 5.000000 to 7.000000 s (t_" in str(
        caught.value
    )


def test_stamps_as_far_apart_as_they_may_be_match():
    stamps = np.arange(3.0)
    matches = match(trajectory(stamps), trajectory(stamps + 0.25), t_max_diff=0.25, **AT_ITS_STAMP)
    assert matches.lost == 0
    assert matches.unmatched == 0


def test_rows():
    estimate = trajectory([0, 1, 2])
    estimate.poses[1] = np.nan
    matches = match(trajectory([0, 1, 2]), estimate)
    assert pairs(matches) == [(0, 0), (1, None), (2, 2)]
    assert (matches.matched, matches.missing, matches.non_finite) == (3, 0, 1)


@pytest.mark.parametrize(
    ("reference", "estimate", "message"),
    [
        (
            [0.0, 1.0],
            [5.0],
            "no time stamps in common: the reference .* from 0.0.* to 1.0.* from 5",
        ),
        (["a"], ["b"], "no image names in common: the reference has 'a', the estimate 'b'"),
        ([0, 1], [0, 1, 2], "the reference has 2 poses, the estimate 3: .* row by row"),
        ([0, 1], ["a", "b"], "not of the same format"),
    ],
)
def test_nothing_in_common(reference, estimate, message):
    with pytest.raises(ValueError, match=message):
        match(trajectory(reference), trajectory(estimate))


def test_other_units_and_origins_of_time_are_named():
    seconds = 1.7e9 + np.arange(10)
    for reference, estimate, message in (
        (seconds * 1e9, seconds, "those of the reference seem to be in nanoseconds: write them"),
        (seconds, seconds * 1e9, "those of the estimate seem to be in nanoseconds: write them"),
        (seconds * 1e9, seconds * 1e9 + 1e6, "both seem to be in nanoseconds: write them in sec"),
        (seconds, seconds * 1e3, "those of the estimate seem to be in milliseconds: write them"),
        (seconds * 1e6, seconds, "those of the reference seem to be in microseconds: write them"),
        (seconds, seconds - 1.7e9 + 5, "estimate seem to count from its start: --t_offset auto fi"),
        (seconds, seconds - 1.7e9 + 5, r"--t_offset 1699999995.000 lets both begin together"),
        (seconds, seconds + 1e6, r"t_max_diff 0.01 s\)$"),
        (seconds - 4e9, seconds, r"t_max_diff 0.01 s\)$"),
        # that began when a count from a start and a date look alike
        ([9.99e7, 1.001e8], seconds, r"t_max_diff 0.01 s\)$"),
    ):
        with pytest.raises(ValueError, match=message):
            match(trajectory(reference), trajectory(estimate), sync="nearest")


def test_stamps_between_those_of_the_reference_are_told_apart_from_other_clocks():
    reference, estimate = trajectory(STAMPS), trajectory(STAMPS + 1 / 80)
    with pytest.raises(
        ValueError, match=r"are usually 0\.0125 s apart: --t_offset .* --t_max_diff"
    ):
        match(reference, estimate, sync="nearest")
    assert match(reference, estimate, sync="nearest", t_max_diff=0.013).lost == 0
    assert match(reference, estimate, sync="nearest", t_offset=-1 / 80).lost == 0


@pytest.mark.parametrize("whose", ["reference", "estimate"])
def test_stamps_that_are_all_the_same(whose):
    both = {"reference": trajectory(STAMPS), "estimate": trajectory(STAMPS)}
    both[whose] = trajectory(np.ones(5))
    with pytest.raises(ValueError, match=f"^all 5 time stamps of the {whose} are the same$"):
        match(**both)
    both[whose] = trajectory(np.ones(2))
    with pytest.raises(ValueError, match=f"^all 2 time stamps of the {whose} are the same$"):
        match(**both)


@pytest.mark.parametrize(
    "limits", [{"t_start": 11.0}, {"t_end": -1.0}, {"t_start": 5.0, "t_end": 4.0}]
)
def test_limits_within_which_nothing_is_due(limits):
    expected = " and ".join(f"{name} {value:.6f} s" for name, value in limits.items())
    with pytest.raises(ValueError, match=f"no reference pose is due with {expected}: the refere"):
        match(trajectory(STAMPS), trajectory(STAMPS), **limits)


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        *(("t_max_diff", -1), ("t_max_diff", "a"), ("t_max_diff", np.inf), ("t_offset", np.nan)),
        *(("max_gap", -1), ("t_start", "a"), ("t_end", np.inf)),
    ],
)
def test_impossible_settings(setting, value):
    with pytest.raises(ValueError, match=f"{setting} must be a finite number of seconds, not"):
        match(trajectory([0.0]), trajectory([0.0]), **{setting: value})
    with pytest.raises(ValueError, match=r"missing must be one of .*, not 'skip'"):
        match(trajectory(["a"]), trajectory(["a"]), missing="skip")


DATE = 1.7e9
SECOND, MS, NS = "seconds", "milliseconds", "nanoseconds"


@pytest.mark.parametrize(
    ("reference", "estimate", "hint"),
    [
        (DATE + np.arange(9), DATE + np.arange(9), None),
        # The size tells, whatever the durations are.
        ((DATE + np.arange(9)) * 1e9, DATE + np.arange(3), ("reference", NS)),
        (DATE + np.arange(9), (DATE + np.arange(3)) * 1e3, ("estimate", MS)),
        ((DATE + np.arange(9)) * 1e9, (DATE + np.arange(9)) * 1e3, ("both", MS)),
        # Of stamps since a start the durations do, which are alike up to a factor of two.
        ([0, 2, 10], [0, 3, 5000], None),
        *[
            ([0, 2, 10], [0, 3, 5001], ("estimate", MS)),
            ([0, 2, 10], [0, 3, 19999], ("estimate", MS)),
        ],
        *[([0, 2, 10], [0, 3, 20000], None), ([0, 3, 8000], [50, 57, 58], ("reference", MS))],
        ([0, 3, 4000], [50, 57, 58], None),
        ([0, 30, 9e6], [0, 5, 10], ("reference", "microseconds")),
        ([0, 5, 10], [1, 2, 9], None),
    ],
)
@pytest.mark.parametrize("whose", ["estimate", "frames"])
def test_stamps_in_another_unit(reference, estimate, hint, whose):
    found = unit_hint(np.array(reference, float), np.array(estimate, float), whose)
    if hint is None:
        assert found == ""
        return
    who, unit = hint
    those = {"both": "both seem", "estimate": f"those of the {whose} seem"}
    said = those.get(who, f"those of the {who} seem")
    assert found == f"; {said} to be in {unit}: write them in seconds"


APART = (
    "; the nearest ones are usually {} s apart: --t_offset moves those of the estimate, a larger "
    "--t_max_diff takes them for the same"
)
FROM_START = (
    "; those of the {} seem to count from its start: --t_offset auto finds the offset, --t_offset "
    "{} lets both begin together"
)


@pytest.mark.parametrize(
    ("reference", "estimate", "offset", "hint"),
    [
        (
            [0, 5, 9],
            DATE + np.array([2.5, 5, 9]),
            0,
            FROM_START.format("reference", "-1700000002.500"),
        ),
        (
            DATE + np.array([2.5, 5, 9]),
            [1, 5, 9],
            0,
            FROM_START.format("estimate", "1700000001.500"),
        ),
        # Counted from a start is what ends before 1e8 s, and a date what begins after them.
        ([1e8 - 4e5, 1e8 - 1e5, 1e8 + 3e5], DATE + np.array([0, 3e5, 7e5]), 0, ""),
        ([-3, 0, 5], [1e8, 1e8 + 4, 1e8 + 9], 0, ""),
        ([1e8 - 8, 1e8 - 4, 1e8], [1e8 + 1, 1e8 + 5, 1e8 + 8], 0, ""),
        ([-1.5e8 - 9, -1.5e8 - 4, -1.5e8], DATE + np.array([0, 4, 9]), 0, ""),
        # Between its ends, both included, it is the usual distance from the reference.
        ([0, 1, 2, 3, 4], [0, 2.25, 9, 10], 0, APART.format("0.1250")),
        ([0, 1, 2, 3, 4], [-7, 2.25, 4], 0, APART.format("0.1250")),
        ([0, 1, 2, 3, 4], [0.25, 2.5, 3.75], 0, APART.format("0.2500")),
        ([0, 1, 2, 3, 4], [9.375, 7.125, 60], -6, APART.format("0.2500")),
        ([0, 1, 2, 3, 4], [7, 8, 9], 0, ""),
    ],
)
def test_why_stamps_have_nothing_in_common(reference, estimate, offset, hint):
    stamps = np.array(reference, float), np.array(estimate, float)
    assert association._stamps_hint(*stamps, offset) == hint


def test_the_unit_comes_first():
    stamps = np.arange(9.0), (DATE + np.arange(9)) * 1e9
    assert association._stamps_hint(*stamps, 0.0) == unit_hint(*stamps) != ""


def message_of(*args, **options):
    with pytest.raises(ValueError, match=r"\w") as caught:
        match(*args, **options)
    return str(caught.value)


def test_messages_of_times_without_a_pose():
    reference, estimate = trajectory([1.0, 2.0, 3.0, 4.0]), trajectory([1.5, 2.5, 3.5])
    assert message_of(reference, estimate, t_start=7) == (
        "no reference pose is due with t_start 7.000000 s: the reference goes from 1.000000 to "
        "4.000000 s"
    )
    frames = np.array([9.0, 8.0, 7.5])
    assert message_of(reference, estimate, frames=frames, t_offset=0.25, t_max_diff=0.02) == (
        "no due frame has a reference pose: the frames go from 7.500000 to 9.000000 s, the "
        "reference from 1.000000 to 4.000000 s (t_offset 0.25 s, t_max_diff 0.02 s)"
    )
    seconds = trajectory(DATE + np.arange(9))
    said = message_of(seconds, seconds, frames=(DATE + np.arange(9)) * 1e9)
    assert said.endswith("; those of the frames seem to be in nanoseconds: write them in seconds")
    assert message_of(reference, trajectory([11.0, 12.0, 14.0]), t_offset=0.5) == (
        "no time stamps in common: the reference goes from 1.000000 to 4.000000 s, the estimate "
        "from 11.000000 to 14.000000 s (t_offset 0.5 s, t_max_diff 0.01 s)"
    )


def test_the_times_that_are_due_include_both_ends():
    stamps = np.arange(10.0)
    options = {"t_start": 2.0, "t_end": 5.0, "step": 1.0}
    assert match(trajectory(stamps), trajectory(stamps), **options).keys.tolist() == [2, 3, 4, 5]


def test_by_time_what_is_missing_has_no_row():
    matches = match(trajectory([0.0, 1.0, 2.0]), trajectory([2.0]), missing="fail", **AT_ITS_STAMP)
    assert matches.est_rows.tolist() == [-1, -1, 0]
    assert matches.without_reference.tolist() == []
    by_name = match(trajectory(["a", "b"]), trajectory(["b"]), missing="fail")
    assert by_name.est_rows.tolist() == [-1, 0]
    assert by_name.without_reference.tolist() == []


def test_each_frame_needs_its_own_pose_unless_a_gap_is_given():
    stamps = np.arange(40) / 4
    kept = trajectory(np.delete(stamps, [7, 20]))
    options = {"frames": stamps, "missing": "fail"}
    assert match(trajectory(stamps), kept, **options).missing == 2
    assert match(trajectory(stamps), kept, **options, max_gap=0.5).missing == 0


def test_keys_that_count_rows_in_one_of_both_are_frame_numbers():
    assert pairs(match(trajectory([1, 2, 3]), trajectory([0, 1, 2]))) == [(0, 1), (1, 2)]
    assert pairs(match(trajectory([0, 1, 2]), trajectory([1, 2, 3]))) == [(1, 0), (2, 1)]
    rows = match(trajectory([0, 1]), trajectory([0, 1]))
    assert (rows.duplicate, rows.unmatched, rows.missing) == (0, 0, 0)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_poses_of_any_numbers_become_floats(kind):
    poses = np.tile(np.eye(4, dtype=kind), (2, 1, 1))
    found = checked(Trajectory(np.arange(2), poses), "estimate").poses
    assert found.dtype == np.float64
    assert np.shares_memory(found, poses) == (kind is np.float64)


def test_a_row_of_nan_is_not_there_unless_all_are():
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[1, :3] = np.nan
    poses[2, :3, :3] = np.nan
    poses[3, 0, 0] = np.nan
    assert present(poses).tolist() == [True, False, True, True]
    poses[:, :3] = np.nan
    assert present(poses).all()


def test_of_many_poses_with_the_same_stamp_the_first_one_counts():
    stamps = np.random.default_rng(0).integers(5, size=500).astype(float)
    with pytest.warns(TrajectoryWarning, match="^the time stamps of the estimate are not in order"):
        matches = match(trajectory(np.arange(5.0)), trajectory(stamps), **AT_ITS_STAMP)
    assert pairs(matches) == [(k, stamps.tolist().index(k)) for k in range(5)]
    assert matches.duplicate == 495


@pytest.mark.parametrize(
    ("reference", "estimate", "expected", "said"),
    [
        # The longest end, then shorter ones, at last without the ending of the file.
        (["x/a.png", "x/a.jpg"], ["a.jpg"], [(1, 0)], "images"),
        (["x/a.png", "x/a.jpg"], ["y/a.jpg", "y/a.png"], [(0, 1), (1, 0)], "images"),
        (["x/a.png", "x/b.png"], ["y/a.JPG", "y/b.jpg"], [(0, 0), (1, 1)], "images"),
        (["p/x/a.png", "p/y/a.png"], ["x/a.png", "y/a.png"], [(0, 0), (1, 1)], "images"),
        (["x/a.png", "y/a.png"], ["p/y/a.png", "p/x/a.png"], [(0, 1), (1, 0)], "images"),
        (["a.png"], ["q/p/x/a.png"], [(0, 0)], "images"),
        (["q/p/x/a.png", "c"], ["a.png", "d"], [(0, 0)], "images"),
        (["x/a.png", "x/a.jpg", "y/a.png"], ["q/x/a.png"], [(0, 0)], "images"),
        # Besides some that are equal; a whole path needs no more of its folder.
        (["a", "y/b"], ["y/b", "y/a"], [(0, 1), (1, 0)], "1 of 2 images"),
        (["y/b", "y/a"], ["a", "y/b"], [(0, 1), (1, 0)], "1 of 2 images"),
        (
            ["c", "p/a.png", "b.png"],
            ["c", "b.png", "x/p/a.png"],
            [(0, 0), (1, 2), (2, 1)],
            "1 of 3 images",
        ),
        (["a/1", "a/2", "a/3"], ["a/1", "b/2", "b/3"], [(0, 0), (1, 1), (2, 2)], "2 of 3 images"),
        # A folder is another one by more images than either shares with a third.
        (
            ["r/a/1", "r/a/2", "r/b/3", "r/b/4"],
            ["s/a/1", "s/c/2", "s/c/3", "s/c/4"],
            [(0, 0), (2, 2), (3, 3)],
            "images",
        ),
        (
            ["r/b/1", "r/b/2", "r/c/3", "r/d/4"],
            ["s/b/1", "s/b/2", "s/b/3", "s/e/4"],
            [(0, 0), (1, 1), (3, 3)],
            "images",
        ),
    ],
)
def test_images_are_paired_by_the_ends_of_their_paths(reference, estimate, expected, said):
    with pytest.warns(TrajectoryWarning) as caught:
        matches = match(trajectory(reference), trajectory(estimate))
    assert pairs(matches) == expected
    by_end = [(i, j) for i, j in expected if reference[i] != estimate[j]]
    first, second = reference[by_end[0][0]], estimate[by_end[0][1]]
    assert [str(one.message) for one in caught] == [
        f"{said} are matched by the end of their path: {first!r} and {second!r}"
    ]
