"""The steps by which an estimate is scored, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Convention, closest_pair_quartile, evaluate, pas, tas, tas_distance
from alignscores.distance import smallest_unit
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


@pytest.mark.parametrize(
    ("est_rows", "repeated"),
    [([-1, -1, 0, 1, 2], False), ([0, 0, 1, 2], True), ([0, 1, 1, -1], True)],
)
def test_a_lost_camera_is_no_repeated_pose(est_rows, repeated):
    settings = Settings(format="tum", registration="pcr99")
    assert callable(scoring._registration(matches_of(est_rows), settings)) == repeated


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
    about_y = moved(gt @ np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]))
    for up, exact in (("y", True), ("z", False)):
        settings = Settings(format="tum", alignment="yaw", up=up)
        found = scoring._ate(matches_of([0, 1, 2, 3], moved(gt), about_y), settings)
        assert (found < 1e-9) == exact


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

    functions = {"ate:rmse": wrong, "kitti:rotation": infinite, "rpe@1m": value}
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
            "no value of ate:rmse: so few",
            "no value of kitti:rotation: it is not finite, with so many cameras lost",
        ],
    )
    assert scoring._metric_values(matches, None, settings, n_parts=2) == (
        {},
        ["no value of ate:rmse, kitti:rotation, rpe@1m: they need one world, not 2 parts"],
    )
    scores = Settings(format="tum", metrics=("TAS", "distance@0.9"))
    assert scoring._metric_values(matches, None, scores, n_parts=2) == ({}, [])


NAMES = np.array([f"{k:02}.png" for k in range(24)])


def scene(noise=0.05):
    """24 images and an estimate of 22 of them in another world, the fifth without a position."""
    rng = np.random.default_rng(0)
    gt = moved(rng.normal(size=(24, 3)))
    gt[:, :3, :3] = Rotation.random(24, rng=rng).as_matrix()
    world = Rotation.random(rng=rng).as_matrix()
    est = gt.copy()
    est[:, :3, 3] = 2 * (gt[:, :3, 3] + rng.normal(0, noise, (24, 3))) @ world.T + 5
    turns = Rotation.from_rotvec(rng.normal(0, 2, (24, 3)), degrees=True).as_matrix()
    est[:, :3, :3] = world @ turns @ gt[:, :3, :3]
    est[4, :3, 3] = np.nan
    lost = est.copy()
    lost[22:] = np.nan
    return Trajectory(NAMES, gt), Trajectory(NAMES[:22], est[:22]), lost


def test_an_estimate_has_the_scores_of_its_arrays():
    reference, estimate, est = scene()
    gt = reference.poses
    options = {"max_threshold": 0.5, "max_threshold_deg": 6.0, "weight": 0.3}
    group = {"alignment": "rigid"}
    metrics = "angle@0.6,distance@0.7,distance@0.03"
    found = evaluate(reference, estimate, seed=3, metrics=metrics, **options, **group)
    unit = closest_pair_quartile(gt[:, :3, 3])
    expected = pas(gt, est, rng=3, registration="refined", unit=unit, **options, **group)
    assert found.settings.format == "nerf"
    assert found.result.tas.unit == unit
    assert found.result.score == expected.score
    np.testing.assert_array_equal(found.result.tas.errors, expected.tas.errors)
    np.testing.assert_array_equal(found.result.ras.errors, expected.ras.errors)
    assert found.tas_seeds == [expected.tas.score]
    positions = gt[:, :3, 3], est[:, :3, 3]
    half = tas_distance(*positions, rng=3, **group)
    assert found.half_distance == pytest.approx(half, rel=1e-6)
    errors = np.sort(expected.ras.errors)
    assert found.half_angle == pytest.approx(smallest_unit(errors, 0.5, 100), rel=1e-3)
    assert found.metrics.keys() == {"angle@0.6", "distance@0.7"}  # a fit of few needs no accuracy
    assert found.metrics["angle@0.6"] == smallest_unit(errors, 0.6, 100)
    level = tas_distance(*positions, score=0.7, rng=3, **group)
    assert found.metrics["distance@0.7"] == pytest.approx(level, rel=1e-6)
    assert found.lost == pytest.approx(3 / 24)
    assert (found.name, found.file, found.parts) == ("estimate", "", [])
    assert found.reference.keys.tolist() == NAMES.tolist()
    assert found.estimate == estimate
    np.testing.assert_array_equal(found.matches.est_poses, est)
    (placed,) = found.part_positions
    np.testing.assert_array_equal(placed, est[:, :3, 3])
    assert found.part_of_camera.tolist() == [0] * 4 + [-1] + [0] * 17 + [-1] * 2
    assert found.body_rotation is None


def test_each_seed_has_its_tas():
    reference, estimate, est = scene()
    gt = reference.poses[:, :3, 3]
    found = evaluate(reference, estimate, registration="pcr99", seed=7, repeat=4, unit=0.5)
    options = {"registration": "pcr99", "unit": 0.5}
    seeds = [tas(gt, est[:, :3, 3], rng=seed, **options).score for seed in range(7, 11)]
    assert found.tas_seeds == seeds
    assert len(set(seeds)) > 1
    assert found.result.tas.score == seeds[0] != tas(gt, est[:, :3, 3], rng=0, **options).score


NOTES = "matching_notes", "_clock_notes", "swap_notes", "_convention_notes", "parts_notes"


@pytest.mark.parametrize("check", [True, False])
def test_notes_have_an_order_and_the_name(monkeypatch, check):
    for name in NOTES:
        monkeypatch.setattr(scoring, name, lambda *_, name=name: [name])
    monkeypatch.setattr(scoring, "_metric_values", lambda *_, **__: ({}, ["reasons"]))
    reference, estimate, _ = scene()
    said = ["_clock_notes"] * check + ["matching_notes"]
    said += ["swap_notes", "_convention_notes"] * check + ["parts_notes", "reasons"]
    found = scoring.score(reference, estimate, NERF, name="x", check=check)
    assert found.notes == [f"x: {note}" for note in said]
    assert scoring.score(reference, estimate, NERF, name="", check=check).notes == said


def test_notes_on_the_reference_come_first():
    reference, estimate, _ = scene()
    twice = Trajectory(
        np.append(reference.keys, "00.png"), np.concatenate([reference.poses, np.eye(4)[None]])
    )
    few = Trajectory(estimate.keys[:4], estimate.poses[:4])
    found = evaluate(twice, few, missing="ignore")
    assert found.notes[0] == "duplicates in the reference (of stamp or name), left out: 1"
    assert [note.split(":")[0] for note in found.notes[1:]] == ["estimate"] * 1


def in_parts(monkeypatch, *rows):
    """Return the evaluation of an estimate of which each part has these rows."""
    reference, estimate, _ = scene()
    parts = {
        str(k): Trajectory(estimate.keys[some], estimate.poses[some]) for k, some in enumerate(rows)
    }
    for k, part in enumerate(parts.values(), 1):
        part.poses[:, :3, 3] *= k
    monkeypatch.setattr(scoring, "read_parts", lambda *_: parts)
    settings = Settings(format="nerf", metrics="auc@30:vggt,TAS", unit=0.25)
    return reference, scoring.score(reference, "the/file", settings, name="x")


def test_an_estimate_in_parts(monkeypatch):
    _, found = in_parts(monkeypatch, range(5, 13), range(13, 19), range(20, 22))
    assert found.file == "the/file"
    assert [(part.name, part.n) for part in found.parts] == [("0", 8), ("1", 6), ("2", 0)]
    assert [part.alignment is None for part in found.parts] == [False, False, True]
    assert found.part_of_camera.tolist() == [-1] * 5 + [0] * 8 + [1] * 6 + [-1] * 5
    assert len(found.part_positions) == 3
    assert found.ate is None
    assert found.metrics == {}
    assert found.lost == pytest.approx(10 / 24)
    assert found.notes == [
        "x: in 3 parts, each aligned on its own: the scores are an upper bound of those of one "
        "model, and do not compare with those of fewer parts",
        "x: cannot be aligned, so that their cameras fail: the parts 2",
        "x: no value of auc@30:vggt: they need one world, not 3 parts",
    ]


def test_what_is_said_of_a_part_is_said_of_it_alone(monkeypatch):
    _, found = in_parts(monkeypatch, range(5, 7))
    assert found.notes[0].startswith("x: TAS is 0: the estimate cannot be aligned, since none of")
    assert found.parts == []
    _, found = in_parts(monkeypatch, range(5, 7), range(13, 15))
    assert [note.split(" ")[1] for note in found.notes] == ["in", "cannot", "no"]


@pytest.mark.parametrize(("n", "told"), [(4, True), (5, False)])
def test_a_few_cameras_have_no_half_score_distance(n, told):
    reference, estimate, _ = scene()
    few = Trajectory(NAMES[5 : 5 + n], reference.poses[5 : 5 + n])
    found = evaluate(few, estimate, unit=0.5)
    assert np.isnan(found.half_distance) == told
    notes = [note for note in found.notes if "no distance" in note]
    assert notes == [
        "estimate: no distance at a score of 0.5 for 4 cameras: it takes 5, since any alignment "
        "fits 2 of them exactly"
    ] * int(told)


@pytest.mark.parametrize("kind", ["names", "stamps", "rows"])
def test_trajectories_in_memory_are_like_a_format(kind):
    reference, estimate, _ = scene()
    keys = {"names": NAMES, "stamps": np.arange(24.0), "rows": np.arange(24)}[kind]
    n = 24 if kind == "rows" else 22
    whole = np.concatenate([estimate.poses, reference.poses[22:]])[:n]
    found = evaluate(reference._replace(keys=keys), Trajectory(keys[:n], whole))
    assert found.settings.format == {"names": "nerf", "stamps": "tum", "rows": "kitti"}[kind]
    form = "arrays" if kind != "names" else "colmap"
    given = evaluate(reference._replace(keys=keys), Trajectory(keys[:n], whole), format=form)
    assert given.settings.format == form


def test_metrics_get_the_stamps_of_the_poses(monkeypatch):
    asked = []

    def values(once, stamps, settings, *, n_parts):
        asked.append((once.est_rows.tolist(), stamps, n_parts))
        return {}, []

    monkeypatch.setattr(scoring, "_metric_values", values)
    reference, estimate, _ = scene()
    evaluate(reference, estimate, missing="ignore")
    assert asked == [(list(range(22)), None, 1)]
    stamped = [
        Trajectory(0.5 + np.arange(len(one.keys)), one.poses) for one in (reference, estimate)
    ]
    evaluate(*stamped, missing="ignore")
    np.testing.assert_array_equal(asked[1][1], 0.5 + np.arange(22))


def test_conventions_are_looked_at_if_nothing_else_is_said():
    reference, estimate, _ = scene()
    estimate.poses[:, 2, 3] *= -1
    said = "the positions fit the mirror image"
    assert said in scoring.score(reference, estimate, NERF, name="").notes[0]
    assert scoring.score(reference, estimate, NERF, name="", check=False).notes == []
