"""Factories of poses for the tests of the baselines."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def _poses(rotations, positions):
    if isinstance(rotations, Rotation):
        rotations = rotations.as_matrix()
    return np.concatenate([rotations, np.asarray(positions, float)[:, :, None]], axis=2)


@pytest.fixture(scope="session")
def poses():
    """(rotations, positions) -> (n, 3, 4) camera-to-world poses."""
    return _poses


@pytest.fixture(scope="session")
def another_world():
    """(poses, seed, scale=, offset=) -> the poses after a random similarity of their world."""

    def transform(poses, seed, *, scale=2.5, offset=10.0):
        rng = np.random.default_rng([seed, 1])
        turn = Rotation.random(rng=rng).as_matrix()
        positions = scale * (poses[:, :, 3] @ turn.T + offset * rng.uniform(-1, 1, 3))
        return _poses(turn @ poses[:, :, :3], positions)

    return transform


@pytest.fixture(scope="session")
def scene(another_world):
    """(n, outliers, sigma_t, sigma_r_deg, seed) -> ground truth in a unit cube and estimate.

    The estimate lives in another world; its last cameras are outliers.
    """

    def make(n, outliers, sigma_t, sigma_r_deg, seed):
        rng = np.random.default_rng([seed, n, outliers])
        rotations = Rotation.random(n, rng=rng).as_matrix()
        positions = rng.random((n, 3)) - 0.5
        noise = Rotation.from_rotvec(rng.normal(0, sigma_r_deg, (n, 3)), degrees=True)
        est_rotations = noise.as_matrix() @ rotations
        est_positions = positions + rng.normal(0, sigma_t, (n, 3))
        if outliers:
            est_rotations[-outliers:] = Rotation.random(outliers, rng=rng).as_matrix()
            est_positions[-outliers:] = rng.uniform(-5, 5, (outliers, 3))
        estimate = _poses(est_rotations, est_positions)
        return _poses(rotations, positions), another_world(estimate, seed)

    return make
