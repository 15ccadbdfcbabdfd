"""The steps by which an estimate is scored, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Convention
from alignscores.evaluation import scoring
from alignscores.evaluation.settings import Settings
from alignscores.similarity import Similarity
from alignscores.trajectories.association import Matches
from alignscores.trajectories.files import Trajectory
from alignscores.trajectories.timing import LEAST_GAIN

TUM, NERF = Settings(format="tum"), Settings(format="nerf")


def moved(positions):
    positions = np.array(positions, dtype=float)
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    return poses


def matches_of(est_rows, gt=None, est=None):
    rows = np.array(est_rows)
    places = np.arange(len(rows))[:, None] * [1.0, 2.0, 3.0]
    gt = moved(places) if gt is None else gt
    return Matches(
        keys=np.arange(len(rows)),
        gt_poses=gt,
        est_poses=gt.copy() if est is None else est,
        gt_rows=np.arange(len(rows)),
        est_rows=rows,
        matched=int(np.sum(rows >= 0)),
        missing=int(np.sum(rows < 0)),
        unmatched=0,
        duplicate=0,
        non_finite=0,
        lost=0.0,
        due_rows=np.arange(len(rows)),
        without_reference=np.empty(0),
    )


def test_each_pose_counts_once_and_lost_cameras_in_proportion():
    """Of 6 cameras with 3 poses, and 4 lost ones: half of these, evenly spread."""
    matches = matches_of([-1, 0, 0, 1, 1, 1, -1, -1, 2, -1])
    once = scoring._each_pose_once(matches)
    assert once.est_rows.tolist() == [-1, 0, 1, 2, -1]
    rows = [0, 1, 3, 8, 9]
    np.testing.assert_array_equal(once.gt_poses, matches.gt_poses[rows])
    np.testing.assert_array_equal(once.est_poses, matches.est_poses[rows])
    same = matches_of([-1, 0, 1, -1])
    assert scoring._each_pose_once(same) is same
    assert scoring._each_pose_once(matches_of([0, 0, 1])).est_rows.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("copies", "rank", "asked"),
    [
        ([1] * 8, 5, None),
        *[([3] * 8, 13, 4), ([3] * 8, 15, 5), ([3] * 8, 24, 8), ([2] * 3, 4, 3), ([2] * 4, 3, 4)],
    ],
)
def test_by_pcr99_a_repeated_pose_does_not_fit_itself(monkeypatch, copies, rank, asked):
    """Its rank is of those that differ, at least 4 of them, at most all."""
    n = len(copies)
    est_rows = np.repeat(np.arange(n), copies)[::-1]
    settings = Settings(format="tum", registration="pcr99")
    found = scoring._registration(matches_of([-1, *est_rows]), settings)
    if asked is None:
        assert found == "pcr99"
        return
    assert scoring._registration(matches_of(est_rows), TUM) == "refined"
    calls = []

    def pcr99(gt, est, *, rank, n_hypotheses):
        calls.append((gt[:, 0].tolist(), est[:, 0].tolist(), rank, n_hypotheses))
        return "found"

    monkeypatch.setattr(scoring, "pcr99", pcr99)
    gt = est_rows[:, None] * [2.0, 3.0, 4.0]
    assert found(gt, gt / 2, rank=rank, n_hypotheses=7) == "found"
    backwards = np.arange(n)[::-1].astype(float)
    assert calls == [((2 * backwards).tolist(), backwards.tolist(), asked, 7)]


def test_why_there_is_no_d():
    words = "d cannot be derived: {}; --unit sets it"
    for gt, reason in (
        (np.zeros((3, 3)), "the reference has 3 of the 4 poses that it takes"),
        (
            np.zeros((4, 3)),
            "at least three quarters of the reference poses coincide with another one",
        ),
    ):
        with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
            scoring._derived_unit(gt)
        assert str(caught.value) == words.format(reason)
    assert scoring._derived_unit(np.arange(12.0).reshape(4, 3)) == pytest.approx(np.sqrt(27))


def test_parts_with_the_cameras_that_they_count():
    alignments = [Similarity(1.0, np.eye(3), np.zeros(3)), None]
    of_parts = [SimpleNamespace(tas=SimpleNamespace(alignment=one)) for one in alignments]
    scores = SimpleNamespace(part_of=np.array([0, 1, 1, -1, 1, 0]), of_parts=of_parts)
    found = scoring._described_parts(["a", "b"], scores)
    assert [(part.name, part.n, part.alignment) for part in found] == [
        ("a", 2, alignments[0]),
        ("b", 3, None),
    ]
    assert scoring._described_parts(["a"], scores) == []


def test_an_estimate_as_it_was_scored():
    turn = Rotation.from_rotvec([0, 0, 1.0]).as_matrix()
    given = Trajectory(np.array([1.0, 2.0]), moved([[1, 2, 3], [4, 5, 6]]))
    found = scoring._as_scored(given, 0.5, turn, TUM)
    assert found.keys.tolist() == [1.5, 2.5]
    np.testing.assert_allclose(found.poses[:, :3, :3], [turn.T] * 2)
    names = Trajectory(np.array(["a", "b"]), given.poses)
    assert scoring._as_scored(names, 0.0, None, NERF) == names


def test_the_ate_is_of_the_estimated_cameras():
    gt = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    est = gt + np.array([[3, 0, 0], [0, 4, 0], [np.nan, 0, 0], [0, 0, 0]])
    both = matches_of([0, 1, 2, 3], moved(gt), moved(est))
    settings = Settings(format="tum", alignment="none")
    assert scoring._ate(both, settings) == pytest.approx(np.sqrt(25 / 3))
    assert scoring._ate(matches_of([0], moved([[0, 0, 0]]), moved([[np.nan, 0, 0]])), TUM) is None
    turned = moved(gt @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]) * 2)
    of_turned = matches_of([0, 1, 2, 3], moved(gt), turned)
    assert scoring._ate(of_turned, TUM) == pytest.approx(0, abs=1e-9)
    assert scoring._ate(of_turned, Settings(format="tum", alignment="yaw")) > 0.1


def test_clocks_are_noted(monkeypatch):
    stamped = Trajectory(np.arange(4.0), moved(np.zeros((4, 3))))
    asked = []

    def offset_notes(*given):
        asked.append(given)
        return ["off"]

    monkeypatch.setattr(scoring, "offset_notes", offset_notes)
    assert scoring._clock_notes(stamped, stamped, 2.0, TUM) == ["off"]
    assert asked == [(stamped, stamped, 2.0)]
    auto = Settings(format="tum", t_offset="auto")
    assert scoring._clock_notes(stamped, stamped, 0.25, auto) == [
        "time offset of 0.2500 s found, and added to its stamps"
    ]
    assert scoring._clock_notes(stamped, stamped, 0.0, auto) == [
        f"no time offset at which its positions fit {LEAST_GAIN:g} times as well"
    ]
    rows = Trajectory(np.arange(4), stamped.poses)
    assert scoring._clock_notes(rows, rows, 2.0, Settings(format="arrays")) == []
    assert scoring._clock_notes(stamped, stamped, 2.0, NERF) == []


@pytest.mark.parametrize("notes", [[], ["a note"]])
@pytest.mark.parametrize("n_parts", [1, 2])
def test_alignments_are_noted_of_what_has_no_other_convention(monkeypatch, notes, n_parts):
    turn = np.diag([1.0, -1, -1])
    found = Convention(body_rotation=turn)
    settings = Settings(format="tum", body_rotation="auto", invert=True)
    matches, result = matches_of([0, 1, 2]), object()

    def convention_notes(one, *, invert, applied):
        assert one is found
        assert (invert, applied) == (True, True)
        return notes

    def alignment_notes(positions, of):
        np.testing.assert_array_equal(positions, matches.gt_poses[:, :3, 3])
        assert of is result
        return ["apart"]

    monkeypatch.setattr(scoring, "convention_notes", convention_notes)
    monkeypatch.setattr(scoring, "alignment_notes", alignment_notes)
    scores = SimpleNamespace(of_parts=[None] * n_parts, result=result)
    expected = notes or (["apart"] if n_parts == 1 else [])
    assert scoring._convention_notes(matches, found, scores, settings) == expected


@pytest.mark.parametrize("inverted", [True, False])
@pytest.mark.parametrize("rotations_inverted", [True, False])
@pytest.mark.parametrize("option", ["auto", "none"])
def test_a_frame_is_taken_out_of_poses_the_right_way_round(inverted, rotations_inverted, option):
    turn = np.diag([1.0, -1, -1])
    found = Convention(inverted=inverted, rotations_inverted=rotations_inverted, body_rotation=turn)
    settings = Settings(format="tum", body_rotation=option)
    taken = option == "auto" and not inverted and not rotations_inverted
    assert scoring._body_rotation(found, settings) is (turn if taken else None)


def test_the_convention_is_that_of_the_largest_part(monkeypatch):
    matches = matches_of([0, 0, 1, -1])
    small, large = matches.gt_poses + np.nan, 2 * matches.gt_poses
    small[0] = 1.0
    asked = []

    def find_convention(gt, est, *, quaternions):
        asked.append((gt[:, 0, 3].tolist(), est[:, 0, 3].tolist(), quaternions))
        return "found"

    monkeypatch.setattr(scoring, "find_convention", find_convention)
    assert scoring._convention(matches, [small, large], TUM, True) == "found"
    assert scoring._convention(matches, [small, large], NERF, True) == "found"
    auto = Settings(format="tum", body_rotation="auto")
    assert scoring._convention(matches, [large], auto, False) == "found"
    once = [0, 2, 3]
    assert asked == [(once, [0, 4, 6], quaternions) for quaternions in (True, False, True)]
    asked.clear()
    unchecked = scoring._convention(matches, [large], TUM, False)
    assert isinstance(unchecked, Convention)
    assert asked == []


def test_poses_of_parts_are_those_of_the_names():
    whole = Trajectory(np.array(["a", "b", "c"]), moved([[1, 0, 0], [2, 0, 0], [3, 0, 0]]))
    matches = matches_of([2, -1, 0])
    parts = [
        Trajectory(whole.keys[:1], whole.poses[:1]),
        Trajectory(whole.keys[2:], 2 * whole.poses[2:]),
    ]
    first, second = scoring._poses_of_parts(parts, whole, matches)
    np.testing.assert_array_equal(first[:, 0, 3], [np.nan, np.nan, 1])
    np.testing.assert_array_equal(second[:, 0, 3], [6, np.nan, np.nan])
    (alone,) = scoring._poses_of_parts(parts[:1], whole, matches)
    assert alone is matches.est_poses


def test_the_reference_is_no_part_beside_others():
    reference = Trajectory(np.array(["a", "b"]), moved([[1, 0, 0], [2, 0, 0]]))
    same = Trajectory(reference.keys.copy(), reference.poses.copy())
    other = Trajectory(reference.keys, 2 * reference.poses)
    named = Trajectory(np.array(["a", "c"]), reference.poses)
    parts = {"0": same, "1": other, "2": named}
    assert list(scoring._without_reference(parts, reference)) == ["1", "2"]
    assert scoring._without_reference({"0": same}, reference) == {"0": same}


def test_metrics_that_have_no_value_are_told(monkeypatch):
    def value(*arrays, rng, stamps):
        assert [array.shape for array in arrays] == [(3, 3), (3, 3, 3)] * 2
        assert (rng, stamps) == (5, "stamps")
        return 0.25

    def infinite(*_, **__):
        return np.inf

    def wrong(*_, **__):
        raise ValueError("so few")

    functions = {"rpe@1m": value, "kitti:rotation": infinite, "ate:rmse": wrong}
    real = scoring.metric

    class Stand:
        def __init__(self, name):
            self.family, self.name = real(name).family, name

        def __call__(self, *arrays, **options):
            return functions[self.name](*arrays, **options)

    settings = Settings(format="tum", seed=5, metrics=(*functions, "TAS", "distance@0.9"))
    monkeypatch.setattr(scoring, "metric", Stand)
    matches = matches_of([0, 1, 2])
    assert scoring._metric_values(matches, "stamps", settings, n_parts=1) == (
        {"rpe@1m": 0.25},
        [
            "no value of kitti:rotation: it is not finite, with so many cameras lost",
            "no value of ate:rmse: so few",
        ],
    )
    assert scoring._metric_values(matches, None, settings, n_parts=2) == (
        {},
        ["no value of rpe@1m, kitti:rotation, ate:rmse: they need one world, not 2 parts"],
    )
    scores = Settings(format="tum", metrics=("TAS", "distance@0.9"))
    assert scoring._metric_values(matches, None, scores, n_parts=2) == ({}, [])
