"""Rotation averaging: projection, chordal mean, L1 mean, TLUD mean and angles."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores.averaging import (
    chordal_mean,
    geodesic_l1_mean,
    nearest_rotations,
    project_to_rotation,
    rotation_angles,
    tlud_mean,
)

SEEDS = st.integers(0, 10_000)


def about_z(*degrees):
    return Rotation.from_rotvec([[0, 0, angle] for angle in degrees], degrees=True).as_matrix()


def z_angle(rotation):
    """Angle of a rotation that is one about z."""
    assert rotation[2, 2] == pytest.approx(1)
    return math.degrees(math.atan2(rotation[1, 0], rotation[0, 0]))


@given(seed=SEEDS)
def test_projection_is_the_nearest_rotation(seed):
    """Of any matrix, also of one with a negative determinant: a rotation, and none is nearer."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(3, 3))
    nearest = project_to_rotation(matrix)
    np.testing.assert_allclose(nearest_rotations([matrix])[0], nearest, atol=1e-12)
    np.testing.assert_allclose(nearest @ nearest.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(nearest) == pytest.approx(1)
    turns = Rotation.from_rotvec(10.0 ** rng.uniform(-3, 0.5, (300, 1)) * rng.normal(size=(300, 3)))
    distances = np.linalg.norm(turns.as_matrix() @ nearest - matrix, axis=(1, 2))
    assert np.linalg.norm(nearest - matrix) <= distances.min() + 1e-12


@pytest.mark.parametrize(
    ("degrees", "median"),
    [([0, 10, 50], 10), ([-80, 0, 1, 2, 90], 1), ([5, 5, 5, 70, 80], 5), ([0, 1, 2, 3, 120], 2)],
)
def test_l1_mean_about_one_axis_is_the_median(degrees, median):
    """The sum of angles about one axis is minimal at the median, outliers or not."""
    rotations = about_z(*degrees)
    mean = geodesic_l1_mean(rotations, chordal_mean(rotations), max_steps=3000)
    assert z_angle(mean) == pytest.approx(median, abs=0.1)


def test_tlud_truncates():
    """Three that agree beat four that are spread wide, whatever the distance between the groups."""
    for far in (60, 120, 180):
        rotations = about_z(0, 1, 2, far, far + 40, far + 80, far + 120)
        assert z_angle(tlud_mean(rotations)) == pytest.approx(1, abs=0.2)


@given(seed=SEEDS)
def test_tlud_is_equivariant(noisy_rotations, seed):
    """Turning all rotations, from either side, turns their average; their order does not matter."""
    _, est = noisy_rotations(20, 5, 5, seed)
    rng = np.random.default_rng(seed)
    relative = est[:1] @ Rotation.from_rotvec(rng.normal(0, 0.1, (20, 3))).as_matrix()
    left, right = Rotation.random(2, rng=rng).as_matrix()
    mean = tlud_mean(relative)
    np.testing.assert_allclose(tlud_mean(left @ relative @ right), left @ mean @ right, atol=1e-9)
    np.testing.assert_allclose(tlud_mean(rng.permutation(relative)), mean, atol=1e-9)


@pytest.mark.parametrize("angle", [0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 10, 90, 179, 179.999999, 180])
def test_rotation_angles(angle):
    """Precise at both ends, where the arc cosine of the trace loses half of the digits."""
    axes = np.random.default_rng(0).normal(size=(20, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    matrices = Rotation.from_rotvec(angle * axes, degrees=True).as_matrix()
    np.testing.assert_allclose(rotation_angles(matrices), angle, rtol=1e-9, atol=1e-13)
