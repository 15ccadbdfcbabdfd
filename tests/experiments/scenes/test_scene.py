"""Synthetic cameras have the stated distributions."""

from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from alignscores.averaging import rotation_angles, tlud_mean
from experiments.scenes import Scene, make_scene

DEFAULTS: dict[str, Any] = {
    "geometry": "cube",
    "volume": 1.0,
    "n_cameras": 2000,
    "n_outliers": 0,
    "sigma_t": 0.05,
    "sigma_r_deg": 3.0,
}


def scene_of(seed: int = 0, **settings: Any) -> Scene:
    return make_scene(np.random.default_rng(seed), **{**DEFAULTS, **settings})


def world_of(scene: Scene) -> tuple[float, np.ndarray, np.ndarray]:
    """Similarity between the worlds, from a scene without noise: least squares over all cameras."""
    gt, est = scene.gt_positions, scene.est_positions
    gt_c, est_c = gt - gt.mean(0), est - est.mean(0)
    scale = float(np.sqrt((est_c**2).sum() / (gt_c**2).sum()))
    rotation = est_c.T @ gt_c @ np.linalg.inv(gt_c.T @ gt_c) / scale
    return scale, rotation, est.mean(0) - scale * rotation @ gt.mean(0)


@pytest.mark.parametrize("volume", [1.0, 8.0, 0.125])
def test_cube_is_uniform_and_centred(volume: float) -> None:
    positions = scene_of(volume=volume).gt_positions / np.cbrt(volume)
    assert np.abs(positions).max() <= 0.5
    for axis in positions.T:
        assert stats.kstest(axis, stats.uniform(-0.5, 1).cdf).pvalue > 1e-3


def test_line_has_unit_steps_and_a_random_direction() -> None:
    directions = []
    for seed in range(300):
        positions = scene_of(seed, geometry="line", n_cameras=11).gt_positions
        steps = np.diff(positions, axis=0)
        np.testing.assert_allclose(steps, np.tile(steps[0], (10, 1)), atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(steps, axis=1), 1.0)
        np.testing.assert_allclose(positions.mean(0), 0.0, atol=1e-12)
        directions.append(steps[0])
    # A uniformly random direction has uniform components.
    for component in np.array(directions).T:
        assert stats.kstest(component, stats.uniform(-1, 2).cdf).pvalue > 1e-3


def test_position_noise_is_normal_in_ground_truth_units() -> None:
    noisy, exact = scene_of(sigma_t=0.05), scene_of(sigma_t=0.0)
    scale, rotation, translation = world_of(exact)
    noise = (noisy.est_positions - translation) @ rotation / scale - noisy.gt_positions
    assert stats.kstest(noise.ravel(), stats.norm(0, 0.05).cdf).pvalue > 1e-3


def test_rotation_noise_has_a_normal_angle_about_a_uniform_axis() -> None:
    noisy, exact = scene_of(sigma_r_deg=4.0), scene_of(sigma_r_deg=0.0)
    # Perturbations multiply from the left: R^ = world * noise * R.
    world = exact.est_rotations @ exact.gt_rotations.transpose(0, 2, 1)
    np.testing.assert_allclose(world, np.broadcast_to(world[0], world.shape), atol=1e-12)
    noise = world[0].T @ noisy.est_rotations @ noisy.gt_rotations.transpose(0, 2, 1)
    assert stats.kstest(rotation_angles(noise), stats.halfnorm(0, 4.0).cdf).pvalue > 1e-3
    axes = np.stack([noise[:, 2, 1] - noise[:, 1, 2], noise[:, 0, 2] - noise[:, 2, 0]])
    axes /= np.linalg.norm(noise - noise.transpose(0, 2, 1), axis=(1, 2)) / np.sqrt(2)
    for component in axes:
        assert stats.kstest(component, stats.uniform(-1, 2).cdf).pvalue > 1e-3


def test_outliers_are_random_cameras_in_a_cube_of_side_ten_and_of_random_rotation() -> None:
    scene = scene_of(geometry="line", n_outliers=1500, sigma_t=0.0, sigma_r_deg=0.0)
    # Without noise all inliers share one rotation between the worlds.
    between = scene.est_rotations @ scene.gt_rotations.transpose(0, 2, 1)
    world = between[np.argmin(rotation_angles(tlud_mean(between).T @ between))]
    angles = rotation_angles(world.T @ between)
    outliers = angles > 1e-6
    assert outliers.sum() == 1500
    assert stats.kstest(np.flatnonzero(outliers) / 2000, stats.uniform.cdf).pvalue > 1e-3

    theta = np.radians(angles[outliers])
    assert stats.kstest(theta, lambda a: (a - np.sin(a)) / np.pi).pvalue > 1e-3

    gt, est = scene.gt_positions, scene.est_positions
    gt_step, est_step = gt[~outliers][[0, -1]], est[~outliers][[0, -1]]
    scale = np.linalg.norm(est_step[1] - est_step[0]) / np.linalg.norm(gt_step[1] - gt_step[0])
    positions = (est - est_step[0]) @ world / scale + gt_step[0]
    np.testing.assert_allclose(positions[~outliers], gt[~outliers], atol=1e-9)
    for axis in positions[outliers].T:
        assert stats.kstest(axis, stats.uniform(-5, 10).cdf).pvalue > 1e-3


def test_worlds_differ_in_scale_rotation_and_origin() -> None:
    worlds = [world_of(scene_of(seed, n_cameras=20, sigma_t=0.0)) for seed in range(400)]
    scales = np.array([scale for scale, _, _ in worlds])
    origins = np.array([origin for _, _, origin in worlds])
    assert stats.kstest(np.log10(scales), stats.uniform(-1, 2).cdf).pvalue > 1e-3
    assert stats.kstest(origins.ravel(), stats.uniform(-100, 200).cdf).pvalue > 1e-3
    cosines = np.array([rotation[0, 0] for _, rotation, _ in worlds])
    assert stats.kstest(cosines, stats.uniform(-1, 2).cdf).pvalue > 1e-3


@pytest.mark.parametrize("geometry", ["cube", "line", "x_axis"])
def test_the_papers_setting_draws_in_the_order_it_always_had(geometry: str) -> None:
    """Results that were published from these seeds stay: the same calls, written out again."""
    n, n_outliers = 30, 7
    rng = np.random.default_rng(11)
    gt_rotations = Rotation.random(n, rng=rng).as_matrix()
    if geometry == "cube":
        gt_positions = rng.uniform(-1.0, 1.0, size=(n, 3))  # volume 8
    else:
        along = rng.standard_normal(3) if geometry == "line" else np.array([1.0, 0, 0])
        gt_positions = (np.arange(n) - 14.5)[:, None] * along / np.linalg.norm(along)
    axes = rng.standard_normal((n, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.radians(4.0) * rng.standard_normal((n, 1))
    rotations = Rotation.from_rotvec(angles * axes).as_matrix() @ gt_rotations
    positions = gt_positions + 0.05 * rng.standard_normal((n, 3))
    outliers = rng.choice(n, size=n_outliers, replace=False)
    positions[outliers] = rng.uniform(-5.0, 5.0, size=(n_outliers, 3))
    rotations[outliers] = Rotation.random(n_outliers, rng=rng).as_matrix()
    world = Rotation.random(rng=rng).as_matrix()
    scale = np.exp(rng.uniform(np.log(0.1), np.log(10.0)))
    origin = rng.uniform(-100, 100, size=3)

    cameras = {"n_cameras": n, "n_outliers": n_outliers, "sigma_r_deg": 4.0}
    scene = scene_of(11, geometry=geometry, volume=8.0, **cameras)
    np.testing.assert_array_equal(scene.gt_rotations, gt_rotations)
    np.testing.assert_array_equal(scene.gt_positions, gt_positions)
    np.testing.assert_array_equal(scene.est_rotations, world @ rotations)
    np.testing.assert_array_equal(scene.est_positions, scale * positions @ world.T + origin)
