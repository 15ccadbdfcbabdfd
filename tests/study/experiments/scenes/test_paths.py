"""Camera paths have the stated shape, spacing and viewing directions."""

import numpy as np
import pytest
from scipy import stats

from experiments.scenes.paths import BEND, PATHS

STEPPED = (
    "line",
    "ray",
    "x_axis",
    "random_walk",
    "orbit",
    "helix",
    "survey",
    "car",
)  # by unit steps
FREE = ("cube", "line", "ray", "x_axis", "random_walk", "uneven")  # of random rotation


def path(name, n=100, seed=0):
    """Return positions, viewing directions and directions of the image's top."""
    rotations, positions = PATHS[name](np.random.default_rng(seed), n, 1.0)
    return positions, rotations[:, :, 2], -rotations[:, :, 1]


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("n", [4, 5, 23, 100])
def test_every_path_is_of_so_many_proper_cameras_and_the_same_for_a_seed(name, n):
    rotations, positions = PATHS[name](np.random.default_rng(3), n, 1.0)
    assert (rotations.shape, positions.shape) == ((n, 3, 3), (n, 3))
    np.testing.assert_allclose(rotations.transpose(0, 2, 1) @ rotations, [np.eye(3)] * n, atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0)
    again = PATHS[name](np.random.default_rng(3), n, 1.0)
    np.testing.assert_array_equal(again[0], rotations)
    np.testing.assert_array_equal(again[1], positions)


@pytest.mark.parametrize("name", STEPPED)
def test_neighbours_along_a_path_are_a_unit_apart(name):
    positions, _, _ = path(name, n=87)
    np.testing.assert_allclose(np.linalg.norm(np.diff(positions, axis=0), axis=1), 1.0)


@pytest.mark.parametrize("name", FREE)
def test_rotations_are_uniform_where_none_is_natural(name):
    _, view, top = path(name, n=2000)
    for component in np.concatenate([view, top], axis=1).T:
        assert stats.kstest(component, stats.uniform(-1, 2).cdf).pvalue > 1e-3


def test_an_orbit_is_a_closed_circle_that_looks_at_its_centre():
    positions, view, top = path("orbit")
    radii = np.linalg.norm(positions, axis=1)
    np.testing.assert_allclose(radii, radii[0])
    assert np.linalg.norm(positions[-1] - positions[0]) == pytest.approx(1.0)
    np.testing.assert_allclose(view, -positions / radii[0], atol=1e-12)
    np.testing.assert_allclose(top, np.tile([0, 0, 1], (100, 1)), atol=1e-12)


def test_a_car_drives_straight_and_turns_by_right_angles_either_way():
    turns = []
    for seed in range(50):
        positions, view, top = path("car", seed=seed)
        steps = np.diff(positions, axis=0)
        np.testing.assert_allclose(view[:-1], steps, atol=1e-12)  # looks where it goes
        np.testing.assert_allclose(top, np.tile([0, 0, 1], (100, 1)), atol=1e-12)
        assert (positions[:, 2] == 0).all()
        angles = np.degrees(np.arcsin(np.cross(steps[:-1], steps[1:])[:, 2])).round(9)
        assert set(np.abs(angles)) == {0.0, 90 / BEND}
        bends = np.flatnonzero(np.diff((angles != 0).astype(int), prepend=0) == 1)
        for start in bends[:-1]:
            np.testing.assert_array_equal(angles[start : start + BEND], angles[start])
            assert steps[start] @ steps[start + BEND] == pytest.approx(0, abs=1e-9)
        turns += [angles[start] > 0 for start in bends]
        straights = np.diff(bends) - BEND
        assert ((straights >= 5) & (straights <= 15)).all()
    assert 0.4 < np.mean(turns) < 0.6
