"""An evaluation in memory has the scores of its arrays, and an order of its notes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Trajectory, closest_pair_quartile, evaluate, pas, ras, tas, tas_distance

NAMES = np.array([f"{k:02}.png" for k in range(24)])


def scene(noise=0.05):
    """24 images and an estimate of 22 of them in another world, the fifth without a position."""
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (24, 1, 1))
    gt[:, :3, 3] = rng.normal(size=(24, 3))
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
    evaluation = evaluate(reference, estimate, seed=3, **options, **group)
    unit = closest_pair_quartile(gt[:, :3, 3])
    expected = pas(gt, est, rng=3, registration="refined", unit=unit, **options, **group)
    assert evaluation.result.tas.unit == unit
    assert evaluation.result.score == expected.score
    np.testing.assert_array_equal(evaluation.result.tas.errors, expected.tas.errors)
    np.testing.assert_array_equal(evaluation.result.ras.errors, expected.ras.errors)
    positions = gt[:, :3, 3], est[:, :3, 3]
    half = tas_distance(*positions, rng=3, **group)
    assert evaluation.half_distance == pytest.approx(half, rel=1e-6)
    at_half = ras(gt[:, :3, :3], est[:, :3, :3], max_threshold_deg=evaluation.half_angle)
    assert at_half.score == pytest.approx(0.5, abs=0.01)
    assert evaluation.lost == pytest.approx(3 / 24)
    drawn = evaluate(reference, estimate, registration="pcr99", seed=3, repeat=2, **options)
    assert drawn.tas_seeds == [tas(*positions, rng=s, max_threshold=0.5).score for s in (3, 4)]
    np.testing.assert_array_equal(evaluation.matches.est_poses, est)


def test_by_pcr99_a_pose_that_answers_for_many_frames_does_not_fit_itself():
    """The score is that of the poses, each once."""
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (400, 1, 1))
    poses[:, :3, 3] = np.cumsum(rng.normal(size=(400, 3)), axis=0)
    rows = np.arange(5, 400, 10)
    scattered = poses[rows]
    scattered[:, :3, 3] += 0.3 * rng.normal(size=(40, 3))
    stamps = np.arange(400) / 10
    keyframes = Trajectory(stamps[rows], scattered)
    options = {"unit": 3.0, "registration": "pcr99"}
    once = [tas(poses[rows, :3, 3], scattered[:, :3, 3], rng=s, **options).score for s in range(10)]
    scored = evaluate(Trajectory(stamps, poses), keyframes, **options).tas
    assert scored == pytest.approx(np.mean(once), abs=0.002)


def test_what_cannot_be_aligned_by_any_seed_has_one_note():
    reference, estimate, _ = scene()
    names = estimate.keys[:8]
    line = estimate.poses[:8].copy()
    line[:, :3, 3] = np.outer([0, 1, 0, 1, 0, 1, 0, 1], np.ones(3))
    notes = evaluate(reference, Trajectory(names, line), registration="pcr99").notes
    assert sum("cannot be aligned" in note.text for note in notes) == 1


def test_a_position_of_a_run_that_diverged_is_far_off_however_far():
    reference, estimate, _ = scene()
    scores = []
    for far in (1e6, 1e200):
        estimate.poses[7, :3, 3] = far
        scores.append(evaluate(reference, estimate, alignment="rigid").pas)
    assert scores[0] == scores[1]


def test_a_single_frame_of_a_given_d_has_scores():
    reference, _, _ = scene()
    keys = np.arange(8) / 30
    turned = np.diag([-1.0, -1.0, 1.0, 1.0]) @ reference.poses[:8]
    pair = Trajectory(keys, reference.poses[:8]), Trajectory(keys, turned)
    evaluation = evaluate(*pair, unit=0.1, rate=1, alignment="rigid")
    assert (len(evaluation.matches.keys), evaluation.pas) == (1, 1)


def test_few_poses_of_many_frames_have_no_half_score_distance():
    """A similarity fits two of four random ones, and with them half of the frames."""
    rng, stamps = np.random.default_rng(0), np.arange(0, 7, 0.1)
    gt, est = (np.tile(np.eye(4), (n, 1, 1)) for n in (len(stamps), 4))
    gt[:, :3, 3] = np.column_stack([stamps, np.sin(stamps), np.cos(stamps)])
    est[:, :3, 3] = rng.normal(size=(4, 3))
    evaluation = evaluate(Trajectory(stamps, gt), Trajectory(stamps[5::20], est))
    assert evaluation.lost == 0
    assert np.isnan(evaluation.half_distance)
    assert any("no distance at a score of 0.5 for 4 cameras" in str(n) for n in evaluation.notes)


@pytest.mark.parametrize("key_type", ["names", "stamps", "rows"])
def test_trajectories_in_memory_are_like_a_format(key_type):
    reference, estimate, _ = scene()
    keys = {"names": NAMES, "stamps": np.arange(24.0), "rows": np.arange(24)}[key_type]
    n = 24 if key_type == "rows" else 22
    whole = np.concatenate([estimate.poses, reference.poses[22:]])[:n]
    evaluation = evaluate(Trajectory(keys, reference.poses), Trajectory(keys[:n], whole))
    assert (
        evaluation.settings.format == {"names": "nerf", "stamps": "tum", "rows": "kitti"}[key_type]
    )
    format_name = "arrays" if key_type != "names" else "colmap"
    evaluation = evaluate(
        Trajectory(keys, reference.poses), Trajectory(keys[:n], whole), format=format_name
    )
    assert evaluation.settings.format == format_name
