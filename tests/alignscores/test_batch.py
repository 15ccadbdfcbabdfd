"""Many scenes at once score as one by one, to the last bit, whatever the threads."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, pas, pas_batch, ras_batch, tas_batch


def ragged_scenes(count):
    """Scenes of 4 to 30 cameras with noise, outliers and missing cameras, some on a line."""
    rng = np.random.default_rng(count)
    scenes = []
    for number in range(count):
        n = int(rng.integers(4, 31))
        gt = np.tile(np.eye(4), (n, 1, 1))
        gt[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
        gt[:, :3, 3] = rng.random((n, 3)) * ([1, 0, 0] if number % 7 == 0 else 1)
        est = gt.copy()
        est[:, :3, 3] = 2 * gt[:, :3, 3] + rng.normal(scale=0.02, size=(n, 3))
        turns = Rotation.from_rotvec(rng.normal(scale=0.05, size=(n, 3)))
        est[:, :3, :3] = turns.as_matrix() @ gt[:, :3, :3]
        est[: n // 4, :3, 3] = rng.random((n // 4, 3))
        est[n - n // 5 :] = np.nan
        scenes.append((gt, est))
    return map(list, zip(*scenes, strict=True))


@pytest.fixture
def scenes():
    """Ground truth and estimate of five scenes of 12 cameras, (5, 12, 4, 4)."""
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (5, 12, 1, 1))
    gt[..., :3, :3] = Rotation.random(60, rng=rng).as_matrix().reshape(5, 12, 3, 3)
    gt[..., :3, 3] = rng.random((5, 12, 3))
    est = gt.copy()
    est[..., :3, 3] += rng.normal(scale=0.02, size=(5, 12, 3))
    return gt, est


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"registration": "refined"},
        {"registration": "refined", "alignment": "rigid", "unit": 1.0},
        {"alignment": "yaw", "up": "y", "unit": 2.0, "n_hypotheses": 100},
        {"rng": 3, "weight": 0.7, "max_threshold": 2.0, "max_threshold_deg": 5, "n_thresholds": 7},
    ],
)
@pytest.mark.filterwarnings("ignore::alignscores.AlignmentWarning")
def test_the_same_bits_as_one_by_one(options, threads):
    gt, est = ragged_scenes(40)
    batch = pas_batch(gt, est, threads=threads, **options)
    for number, (truth, estimate) in enumerate(zip(gt, est, strict=True)):
        expected, found = pas(truth, estimate, **options), batch[number]
        assert batch.score[number] == found.score == expected.score
        np.testing.assert_array_equal(found.tas.errors, expected.tas.errors)
        np.testing.assert_array_equal(found.ras.errors, expected.ras.errors)


def test_a_generator_goes_from_scene_to_scene():
    gt, est = ragged_scenes(20)
    one, other = np.random.default_rng(5), np.random.default_rng(5)
    batch = pas_batch(gt, est, rng=one, threads=2)
    loop = [pas(g, e, rng=other).score for g, e in zip(gt, est, strict=True)]
    np.testing.assert_array_equal(batch.score, loop)
    assert one.random() == other.random()


def test_poses_that_only_fill_up_a_scene(scenes):
    gt, est = scenes
    gt[1, 9:, :3], gt[3, 5:] = np.nan, np.nan
    est[1, :2] = np.nan
    batch = pas_batch(gt, est)
    assert batch.tas.n_cameras.tolist() == [12, 9, 12, 5, 12]
    assert batch.tas.n_lost.tolist() == batch.ras.n_lost.tolist() == [0, 2, 0, 0, 0]
    assert batch[1].score == pas(gt[1, :9], est[1, :9]).score
    assert batch[-1].score == batch.score[4] == pas(gt[4], est[4]).score
    with pytest.raises(IndexError):
        batch[5]


def test_positions_or_rotations_alone(scenes):
    gt, est = scenes
    both = pas_batch(gt, est, registration="refined")
    positions = tas_batch(gt[..., :3, 3], est[..., :3, 3], registration="refined")
    rotations = ras_batch(gt[..., :3, :3], est[..., :3, :3])
    np.testing.assert_array_equal(both.tas.errors, positions.errors)
    np.testing.assert_array_equal(both.ras.errors, rotations.errors)
    as_rotations = [Rotation.from_matrix(scene[:, :3, :3]) for scene in gt]
    np.testing.assert_array_equal(ras_batch(as_rotations, as_rotations).score, np.ones(5))


def test_a_scene_without_d_has_no_score(scenes):
    gt, est = (list(world) for world in scenes)
    gt[1], est[1] = gt[1][:3], est[1][:3]
    gt[2] = gt[2].copy()
    gt[2][:, :3, 3] = 0
    with pytest.warns(AlignmentWarning, match=r"undefined in 2 of 5 scenes, first in \[1\]"):
        batch = pas_batch(gt, est)
    assert np.isnan(batch.score).tolist() == [False, True, True, False, False]
    with pytest.raises(ValueError, match="at least 4 ground-truth cameras"):
        batch[1]
    with pytest.raises(ValueError, match="coincide with another one"):
        batch[2]


def test_warns_of_estimates_that_cannot_be_aligned(scenes):
    gt, est = scenes
    est[3] = np.nan
    with pytest.warns(AlignmentWarning) as warned:
        batch = pas_batch(gt, est)
    assert [str(warning.message).partition(" scenes")[0] for warning in warned] == [
        "TAS is 0 in 1 of 5",
        "RAS is 0 in 1 of 5",
    ]
    assert all(warning.filename == __file__ for warning in warned)
    assert batch.score[3] == batch[3].score == 0
    assert batch[3].tas.alignment is None
    assert np.isnan(batch.tas.scale[3])


@pytest.mark.parametrize("as_list", [False, True])
def test_errors_name_scene_and_row(scenes, as_list):
    gt, est = scenes
    worlds = {}
    for name, row, value in (
        ("gt_poses[2][4] is not finite", (0, 2, 4, 0, 3), np.inf),
        ("gt_poses[2][4] is not a rotation", (0, 2, 4, 0, 0), 7.0),
        ("est_poses[3][0] is not a rotation", (1, 3, 0, 0, 0), 7.0),
        ("est_poses[3][0] has the last row", (1, 3, 0, 3, 0), 1.0),
    ):
        worlds[name] = np.stack([gt, est])
        worlds[name][row] = value
    for message, (one, other) in worlds.items():
        pair = (list(one), list(other)) if as_list else (one, other)
        with pytest.raises(ValueError, match=rf"^{re.escape(message)}"):
            pas_batch(*pair)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda g, e: (g, e[:4]), "gt_poses has 5 scenes but est_poses 4"),
        (lambda g, e: (g, e[:, :4]), r"gt_poses\[0\] has 12 cameras but est_poses\[0\] has 4"),
        (lambda g, e: (g[:0], e[:0]), "gt_poses has no cameras"),
        (lambda g, e: (g[0], e[0]), r"gt_poses.* must have shape \(n, 4, 4\) or \(n, 3, 4\)"),
        (lambda _, e: ("poses", e), "gt_poses must hold real numbers"),
        (lambda _, e: ([None], e), r"gt_poses\[0\]"),
    ],
)
def test_refuses_what_are_no_scenes(scenes, change, message):
    with pytest.raises(ValueError, match=message):
        pas_batch(*change(*scenes))
