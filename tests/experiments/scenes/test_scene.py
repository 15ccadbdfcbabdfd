"""The paper's cameras, written out: their distributions, and the order in which they are drawn."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from experiments.scenes import make_scene


@pytest.mark.parametrize("geometry", ["cube", "line", "x_axis"])
def test_the_papers_cameras_are_drawn_as_they_always_were(geometry: str) -> None:
    """Results that were published from these seeds stay."""
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

    scene = make_scene(
        np.random.default_rng(11),
        geometry=geometry,
        volume=8.0,
        n_cameras=n,
        n_outliers=n_outliers,
        sigma_t=0.05,
        sigma_r_deg=4.0,
    )
    np.testing.assert_array_equal(scene.gt_rotations, gt_rotations)
    np.testing.assert_array_equal(scene.gt_positions, gt_positions)
    np.testing.assert_array_equal(scene.est_rotations, world @ rotations)
    np.testing.assert_array_equal(scene.est_positions, scale * positions @ world.T + origin)
