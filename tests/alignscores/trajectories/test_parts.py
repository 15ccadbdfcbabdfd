"""Estimates in parts: which part counts a camera, and how the scores of the parts combine."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import pas
from alignscores.profile import searched_profile
from alignscores.trajectories.parts import (
    assign_cameras,
    combine,
    combine_tas,
    errors_of_parts,
    in_one_world,
)

CAMERAS = [range(20), range(15, 32), range(32, 38), range(38, 40)]  # 5 shared, 2 too few


@pytest.fixture
def scene(noisy_scene, noisy_rotations):
    """Ground truth, and its estimate in four worlds of their own."""
    gt, poses = np.tile(np.eye(4), (2, 42, 1, 1))
    gt[:, :3, 3], poses[:, :3, 3] = noisy_scene(42, 2, 0.02, 0)
    gt[:, :3, :3], poses[:, :3, :3] = noisy_rotations(42, 0, 3, 0)
    worlds = Rotation.random(len(CAMERAS), rng=0).as_matrix()
    parts = np.full((len(CAMERAS), *poses.shape), np.nan)
    for index, (part, cameras, world) in enumerate(zip(parts, CAMERAS, worlds, strict=True), 1):
        part[cameras] = poses[cameras]
        part[:, :3, :3] = world @ part[:, :3, :3]
        part[:, :3, 3] = index * part[:, :3, 3] @ world.T + index
    return gt, parts


@pytest.mark.parametrize(
    ("sizes", "expected"),
    [
        ([[1, 1, 1, 0], [1, 1, 1, 1]], [1, 1, 1, 1]),
        ([[1, 1, 1, 0], [0, 1, 1, 1]], [0, 0, 0, 1]),  # of equally large ones the first
        ([[1, 1, 0, 0], [0, 1, 1, 1], [1, 0, 0, 0]], [-1, 1, 1, 1]),
        ([[1, 1, 0, 0], [0, 0, 0, 0]], [-1, -1, -1, -1]),
    ],
)
def test_parts_that_count_cameras(sizes, expected):
    parts = [np.where(np.array(part)[:, None, None], np.eye(4), np.nan) for part in sizes]
    assert assign_cameras(parts).tolist() == expected


@pytest.mark.parametrize("registration", ["pcr99", "refined"])
def test_the_scores_are_those_of_the_errors_camera_by_camera(scene, registration):
    gt, parts = scene
    part_of = assign_cameras(parts)
    results = [pas(gt, part, weight=0.3, registration=registration) for part in parts[:3]]
    whole = combine(results, part_of)
    for kind, steps in (("tas", whole.tas.unit), ("ras", 10.0)):
        errors = [
            getattr(results[k], kind).errors[i] if k >= 0 else np.inf for i, k in enumerate(part_of)
        ]
        below = np.less.outer(errors, steps * np.arange(1, 101) / 100)
        assert getattr(whole, kind).score == pytest.approx(below.mean(), abs=1e-12)
        np.testing.assert_array_equal(getattr(whole, kind).errors, errors)
    assert whole.score == pytest.approx(0.3 * whole.tas.score + 0.7 * whole.ras.score)
    assert combine_tas([result.tas for result in results], part_of).score == whole.tas.score
    # In the world of the ground truth the errors are the distances and angles that are left.
    poses = in_one_world(parts[:3], results, part_of)
    distances = np.linalg.norm(poses[:38, :3, 3] - gt[:38, :3, 3], axis=1)
    np.testing.assert_allclose(distances, whole.tas.errors[:38], atol=1e-9)
    turns = Rotation.from_matrix(poses[:38, :3, :3].transpose(0, 2, 1) @ gt[:38, :3, :3])
    np.testing.assert_allclose(np.degrees(turns.magnitude()), whole.ras.errors[:38], atol=1e-6)
    assert np.isnan(poses[38:, :3]).all()


def test_the_profile_of_the_whole_is_that_of_its_parts(scene):
    """At each unit no less than that of the parts aligned there, of 38 of 42 cameras."""
    gt, positions = scene[0], scene[1][:3, :, :3, 3]
    units, part_of = np.array([0.02, 0.05, 0.1, 0.5]), assign_cameras(scene[1])
    errors_at = errors_of_parts(gt[:, :3, 3], positions, part_of, rng=0)
    profile = searched_profile(errors_at, units, n_thresholds=100)
    for unit, score in zip(units, profile.scores, strict=True):
        results = [pas(gt, part, unit=unit, registration="refined") for part in scene[1][:3]]
        assert score >= combine(results, part_of).tas.score - 2e-3
    assert profile.unit_at(0.9) < np.inf == profile.unit_at(0.95)
    assert 0.02 < profile.half < 0.1


def test_the_parts_bound_every_model_merged_from_them(scene):
    """Here by random similarities near the true ones; with the alignments of the best score."""
    gt, parts = scene[0], scene[1][:3]
    results = [pas(gt, part, registration="refined") for part in parts]
    part_of, rng = assign_cameras(parts), np.random.default_rng(0)
    merged = in_one_world(parts, results, part_of)
    for index in range(3):
        merged[part_of == index, :3, 3] *= rng.normal(1, 0.01)
        merged[part_of == index, :3, 3] += rng.normal(0, 0.01, 3)
    whole = pas(gt, merged, registration="refined")
    assert whole.tas.score <= combine(results, part_of).tas.score + 1e-3
