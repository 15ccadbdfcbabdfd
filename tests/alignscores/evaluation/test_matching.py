"""A reference and an estimate, read and matched as the settings say."""

import numpy as np
import pytest

from alignscores.evaluation import matching
from alignscores.evaluation.matching import (
    files_below,
    match_estimate,
    read_parts,
    read_reference,
    step_of_frames,
)
from alignscores.evaluation.settings import Settings
from alignscores.trajectories.files import Trajectory
from alignscores.trajectories.timing import TimeOffset

TUM = Settings(format="tum")


def trajectory(keys):
    """Poses that tell by their x coordinate which one they are."""
    poses = np.tile(np.eye(4), (len(keys), 1, 1))
    poses[:, 0, 3] = np.arange(len(keys))
    return Trajectory(np.asarray(keys), poses)


STAMPED = trajectory(np.arange(5.0))


def write_stamps(path, stamps):
    path.write_text("".join(f"{stamp} 0 0 0 0 0 0 1\n" for stamp in stamps))
    return path


def test_files_of_a_model_or_of_models(tmp_path):
    for name in ("b.txt", "a.txt", "0/c.txt", "0/deeper/d.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    found = [path.relative_to(tmp_path).as_posix() for path in files_below(str(tmp_path))]
    assert found == ["0/c.txt", "a.txt", "b.txt"]
    assert list(files_below(tmp_path / "a.txt")) == [tmp_path / "a.txt"]
    assert list(files_below(tmp_path / "none")) == [tmp_path / "none"]


def test_a_reference_is_complete_and_in_order(write):
    rows = ["2 1 2 3 0 0 0 1", "1 4 5 6 0 0 0 1"]
    with pytest.warns(UserWarning, match="not in order"):
        found = read_reference(write(rows), TUM)
    assert found.keys.tolist() == [1, 2]
    with pytest.raises(ValueError, match="line 2: the pose is not finite"):
        read_reference(write([rows[1], "3 nan 2 3 0 0 0 1"]), TUM)
    given = trajectory([1.0, 2.0, 3.0])
    assert read_reference(given, TUM).keys.tolist() == [1, 2, 3]
    given.poses[1, 0, 3] = np.nan
    with pytest.raises(ValueError, match=r"^pose 2 of the reference is not finite$"):
        read_reference(given, TUM)


def test_estimates_may_be_inverted(write):
    path = write(["1 1 2 3 0 0 0 1", "2 nan 2 3 0 0 0 1"])
    (part,) = read_parts(path, TUM).values()
    assert part.poses[0, :3, 3].tolist() == [1, 2, 3]
    (inverted,) = read_parts(path, Settings(format="tum", invert=True)).values()
    assert inverted.poses[0, :3, 3].tolist() == [-1, -2, -3]
    given = trajectory([1.0, 2.0])
    assert list(read_parts(given, TUM)) == [""]
    assert read_parts(given, TUM)[""].poses is given.poses


def test_the_step_of_frames_is_that_of_the_densest_estimate(tmp_path):
    slow = write_stamps(tmp_path / "slow.txt", [0, 2, 4, 6])
    fast = write_stamps(tmp_path / "fast.txt", [0, 0.5, 1, 7])
    broken = tmp_path / "broken.txt"
    broken.write_text("x\n")
    lost = tmp_path / "lost.txt"
    lost.write_text("0 0 0 0 0 0 0 1\n1" + " nan" * 7 + "\n3 0 0 0 0 0 0 1\n")
    assert step_of_frames([slow, broken, fast], TUM) == 0.5
    assert step_of_frames([slow], TUM) == 2
    assert step_of_frames([lost], TUM) == 3
    assert step_of_frames([], TUM) is None
    assert step_of_frames([broken], TUM) is None
    assert step_of_frames([slow], Settings(format="tum", frames=(0.0, 1.0))) is None
    assert step_of_frames([slow], Settings(format="kitti")) is None


@pytest.mark.parametrize(("n_ref", "n_est", "enough"), [(5, 4, True), (5, 3, False), (3, 3, True)])
def test_it_takes_four_poses_or_all(n_ref, n_est, enough):
    settings = Settings(format="tum", missing="ignore", t_max_diff=0.25, max_gap=0, t_end=9)
    both = trajectory(np.arange(float(n_ref))), trajectory(np.arange(float(n_est)))
    if enough:
        matches, offset = match_estimate(*both, settings)
        assert (matches.matched, offset) == (n_est, 0.0)
        return
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        match_estimate(*both, settings)
    assert str(caught.value) == (
        "only 3 of 3 poses could be matched to the reference, and it takes 4 (--missing ignore, "
        "--t_max_diff 0.25, --t_offset 0.0, --max_gap 0.0, --t_end 9.0)"
    )


def test_too_few_images_or_rows():
    settings = Settings(format="nerf", missing="ignore")
    with pytest.raises(ValueError, match=r"takes 4 \(--missing ignore\)$"):
        match_estimate(trajectory(["a", "b", "c", "d"]), trajectory(["a", "b"]), settings)
    rows = trajectory([0, 1])
    assert match_estimate(rows, rows, Settings(format="kitti"))[1] == 0.0


def test_how_poses_are_matched():
    """Each setting of time, with a step that is given."""
    stamps = np.arange(100) / 10
    reference, estimate = trajectory(stamps), trajectory(stamps[10:90:2] + 1.04)

    def rows(step=None, **changes):
        changes = {"t_offset": -1.0, "t_max_diff": 0.05, **changes}
        matches, offset = match_estimate(
            reference, estimate, Settings(format="tum", **changes), step
        )
        assert offset == changes["t_offset"]
        return len(matches.keys), matches.matched

    assert rows() == (50, 50)
    assert rows(step=0.1) == (100, 100)
    assert rows(step=0.1, max_gap=0.0) == (100, 40)
    assert rows(step=0.1, max_gap=0.0, t_max_diff=0.07) == (100, 80)
    assert rows(step=0.1, max_gap=0.0, missing="ignore") == (40, 40)
    assert rows(step=0.1, t_start=2.0, t_end=2.9) == (10, 10)
    assert rows(frames=tuple(stamps[8:30:2] + 1)) == (11, 10)


def test_poses_are_compared_where_they_are_or_with_the_nearest():
    reference, estimate = trajectory(np.arange(9.0) / 10), trajectory(np.arange(2, 7) / 10 + 0.025)
    for sync, first in (("interpolate", 2.25), ("nearest", 2.0)):
        settings = Settings(format="tum", sync=sync, missing="ignore", t_max_diff=0.03)
        matches, _ = match_estimate(reference, estimate, settings)
        assert matches.gt_poses[0, 0, 3] == pytest.approx(first)


@pytest.mark.parametrize(
    ("found", "used"),
    [
        *[(TimeOffset(0.03, 0.5), 0.03), (TimeOffset(-0.03, 0.5), -0.03)],
        *[(TimeOffset(0.031, 1.2), 0.031), (TimeOffset(-0.031, 1.19), 0.0)],
        *[(TimeOffset(0.044, 1.19), 0.0), (TimeOffset(9.0, np.inf), 9.0)],
    ],
)
def test_a_time_offset_is_used_if_it_is_small_or_the_positions_fit_better(monkeypatch, found, used):
    truth, estimate = trajectory(np.arange(5.0)), trajectory(np.arange(4.0))

    def find_offset(reference, other):
        assert reference is truth
        assert other is estimate
        return found

    monkeypatch.setattr(matching, "find_offset", find_offset)
    assert matching._time_offset(truth, estimate, "auto") == used


def test_a_time_offset_that_is_given_is_used():
    found = matching._time_offset(STAMPED, STAMPED, 3)
    assert (type(found), found) == (float, 3.0)


def test_without_stamps_there_is_no_time_offset():
    rows = Trajectory(np.arange(4), STAMPED.poses[:4])
    assert matching._time_offset(rows, rows, "auto") == 0.0


def test_where_no_time_offset_fits_the_unit_may_be_another():
    few = STAMPED
    message = "no time offset makes its positions fit those of the reference; --t_offset X sets one"
    with pytest.raises(ValueError, match=rf"^{message}$"):
        matching._time_offset(few, few, "auto")
    late = Trajectory(1.7e9 + few.keys, few.poses)
    other = Trajectory(late.keys * 1e9, few.poses)
    with pytest.raises(ValueError, match=rf"^{message}; those of the estimate seem to be in nano"):
        matching._time_offset(late, other, "auto")


@pytest.mark.parametrize("form", ["tum", "arrays"])
def test_names_are_no_time_stamps(form):
    named = trajectory(["a", "b", "c", "d"])
    message = f"^format={form} has time stamps, not names: leave it out$"
    with pytest.raises(ValueError, match=message):
        match_estimate(named, named, Settings(format=form))
    for rightly in ("nerf", "kitti"):
        assert match_estimate(named, named, Settings(format=rightly))[0].matched == 4
