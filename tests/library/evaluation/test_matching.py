"""Estimated poses are matched to reference poses by time, by image name or by row.

What the rule of time promises is in test_time.py.
"""

import numpy as np
import pytest
from evo.core.sync import matching_time_indices

from alignscores import Settings
from alignscores.evaluation.match import match as match_poses
from alignscores.evaluation.reading import read_reference
from alignscores.io import Trajectory, TrajectoryWarning

# Every pose of the reference is expected, and takes the pose of its own moment.
AT_ITS_STAMP = {"sync": "nearest", "max_gap": 0.0, "rate": "all"}


def match(reference, estimate, *, missing="ignore", **settings):
    settings = Settings(missing="fail" if "frames" in settings else missing, **settings)
    return match_poses(read_reference(reference, settings), estimate, settings)


def trajectory(keys):
    """Poses that tell by their x coordinate which one they are."""
    poses = np.tile(np.eye(4), (len(keys), 1, 1))
    poses[:, 0, 3] = np.arange(len(keys))
    return Trajectory(np.asarray(keys), poses)


def pairs(matches):
    """Rows of the reference with those of the estimate; None for a camera that is missing."""
    est = [None if np.isnan(x) else int(x) for x in matches.est_poses[:, 0, 3]]
    return list(zip(matches.gt_rows.tolist(), est, strict=True))


def message_of(*args, **options):
    with pytest.raises(ValueError, match=r"\w") as caught:
        match(*args, **options)
    return str(caught.value)


@pytest.mark.filterwarnings("ignore:the reference has no pose for")
@pytest.mark.parametrize("digits", [2, 9])
@pytest.mark.parametrize(("start", "offset"), [(0.0, 0.1), (1.7e9, 0.0)])
def test_nearest_stamps_are_those_of_evo(digits, start, offset):
    """With few digits distances are equal, and many poses share the nearest one."""
    rng = np.random.default_rng(digits)
    options = {**AT_ITS_STAMP, "t_max_diff": 0.0249}
    for n_ref, n_est in rng.integers(2, 60, (30, 2)):
        ref, est = (np.unique(start + rng.uniform(0, 4, n).round(digits)) for n in (n_ref, n_est))
        est[rng.integers(len(est))] = ref[0]
        est = np.unique(est) - offset
        expected = list(zip(*matching_time_indices(ref, est, 0.0249, offset), strict=True))
        matches = match(trajectory(ref), trajectory(est + offset), **options)
        assert pairs(matches) == expected
        compared = matching_time_indices(est, ref, 0.0249, -offset)
        nearest = dict(zip(*compared, strict=True))
        assert matches.gt_poses[:, 0, 3].tolist() == [nearest[row] for _, row in expected]
        assert matches.unmatched == len(est) - len(nearest)


@pytest.mark.parametrize("whose", ["reference", "estimate"])
def test_stamps_out_of_order_are_sorted(whose):
    ordered, shuffled = trajectory([0.0, 1.0, 2.0]), trajectory([2.0, 0.0, 1.0])
    both = (shuffled, ordered) if whose == "reference" else (ordered, shuffled)
    with pytest.warns(TrajectoryWarning, match=rf"{whose} are not in order \(first at pose 2"):
        matches = match(*both)
    assert matches.keys.tolist() == [0.0, 1.0, 2.0]
    gt, est = matches.gt_poses[:, 0, 3].tolist(), matches.est_poses[:, 0, 3].tolist()
    in_order, as_in_file = [0, 1, 2], [1, 2, 0]
    assert (gt, est) == ((as_in_file, in_order) if whose == "reference" else (in_order, as_in_file))


STAMPS = np.arange(400) / 40  # 10 s


def test_a_wrong_stamp_makes_no_billions_of_frames():
    wrong = match(trajectory(STAMPS), trajectory(np.r_[-1e9, STAMPS[::4]]), missing="fail")
    assert (wrong.matched, wrong.unmatched) == (len(wrong.keys), 1)


def test_the_times_that_are_expected_include_both_ends():
    stamps = trajectory(np.arange(10.0))
    assert match(stamps, stamps, t_start=2.0, t_end=5.0).keys.tolist() == [2, 3, 4, 5]


@pytest.mark.parametrize(
    ("reference", "estimate", "expected"),
    [
        (["b", "a", "c", "d"], ["d", "x", "a"], [(0, None), (1, 2), (2, None), (3, 0)]),
        # Frame numbers are no rows, unless both count from 0.
        ([0, 5, 7], [5, 7, 9], [(0, None), (1, 0), (2, 1)]),
        ([1, 2, 3], [0, 1, 2], [(0, 1), (1, 2), (2, None)]),
        ([0, 1, 2], [0, 1, 2], [(0, 0), (1, 1), (2, 2)]),
        # Floats cannot resolve single nanoseconds.
        ((10**18 + np.arange(3)).tolist(), [10**18 + 2], [(0, None), (1, None), (2, 0)]),
    ],
)
def test_poses_are_matched_by_name_or_frame_number(reference, estimate, expected):
    assert pairs(match(trajectory(reference), trajectory(estimate), missing="fail")) == expected
    matched = [pair for pair in expected if pair[1] is not None]
    assert pairs(match(trajectory(reference), trajectory(estimate))) == matched


@pytest.mark.parametrize(
    ("reference", "estimate", "expected", "beginning"),
    [
        (["images/a.png", "b.png"], ["y/b.jpg", "a"], [(0, 1), (1, 0)], "images"),
        (["images/a.PNG", "x\\b.png"], ["X/B.png", "Images/a.png"], [(0, 1), (1, 0)], "images"),
        (["cam1/a.png", "cam2/a.png"], ["x/cam2/a.png", "y/cam1/a.png"], [(0, 1), (1, 0)], ""),
        # The longest ending that any two have in common, at last without the extension.
        (["x/a.png", "x/a.jpg"], ["a.jpg"], [(1, 0)], "images"),
        (["x/a.png", "x/a.jpg", "y/a.png"], ["q/x/a.png"], [(0, 0)], "images"),
        (["a/1", "a/2"], ["b/1", "c/2"], [(0, 0), (1, 1)], "images"),
    ],
)
def test_images_are_paired_by_the_ends_of_their_paths(reference, estimate, expected, beginning):
    with pytest.warns(
        TrajectoryWarning, match=f"^{beginning}.* matched by the end of their path: "
    ):
        matches = match(trajectory(reference), trajectory(estimate))
    assert pairs(matches) == expected


def test_images_of_other_cameras_and_names_that_are_not_unique_are_not_matched(recwarn):
    reference = [f"cam1/{i}.png" for i in range(9)] + [f"cam2/{i}.png" for i in range(8)]
    estimate = [f"cam1/{i}.png" for i in range(8)] + [f"cam2/{i}.png" for i in range(9)]
    del reference[16], estimate[15]
    assert (8, None) in pairs(match(trajectory(reference), trajectory(estimate), missing="fail"))
    sides = [f"{side}/{i}.png" for side in ("left", "right") for i in range(4)]
    matches = match(trajectory([*sides, "up/9.png"]), trajectory(["left/0.png", "9.png"]))
    assert pairs(matches) == [(0, 0)]  # where names are equal, endings are not looked at
    assert not recwarn.list
    message = message_of(trajectory(sides), trajectory(["0.png", "1.png"]))
    assert message == (
        "no image names in common: 2 images of the reference are '0.png', in different folders; "
        "name the images of both files alike"
    )


DATE = 1.7e9
SECONDS = DATE + np.arange(10)


@pytest.mark.parametrize(
    ("reference", "estimate", "hint"),
    [
        (SECONDS, SECONDS - DATE + 5, "(t_max_diff 0.01 s)"),
        (SECONDS, 5e-6 * np.arange(10), "; its stamps are 5e-06 s apart, those of no camera"),
        (5e-6 * np.arange(10), SECONDS, "; the reference's stamps are 5e-06 s apart, those of no"),
        (SECONDS, SECONDS + 0.25, "; the nearest ones are usually 0.2500 s apart: --t_off"),
    ],
)
def test_why_stamps_have_nothing_in_common(reference, estimate, hint):
    message = message_of(trajectory(reference), trajectory(estimate), sync="nearest")
    first, last = (f"{stamps[k]:.6f}" for stamps, k in ((reference, 0), (estimate, -1)))
    assert message.startswith(f"no time stamps in common: the reference goes from {first} to ")
    assert f" to {last} s (t_max_diff" in message
    assert hint in message


@pytest.mark.parametrize(
    ("timing", "message"),
    [
        ({"t_start": 11.0}, "no reference pose is expected with t_start 11.000000 s: the"),
        ({"t_start": 5, "t_end": 4}, "with t_start 5.000000 s and t_end 4.000000 s: the reference"),
        (
            {"frames": np.array([99.0, 98.0])},
            "no expected frame has a reference pose: the frames go from 98.000000 to 99.000000 s, "
            "the reference from 0.000000 to 9.975000 s (t_max_diff 0.01 s)",
        ),
    ],
)
def test_nothing_is_expected(timing, message):
    assert message in message_of(trajectory(STAMPS), trajectory(STAMPS), **timing)
