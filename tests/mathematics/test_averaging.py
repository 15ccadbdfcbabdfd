"""Rotations: the nearest one to a matrix, and angles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import nearest_rotations
from alignscores.averaging import quaternions_from_rotations, rotation_angles


@given(seed=st.integers(0, 10_000))
def test_no_rotation_is_nearer_to_a_matrix(seed):
    """To any, also to one with a negative determinant."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(3, 3))
    (nearest,) = nearest_rotations([matrix])
    np.testing.assert_allclose(nearest @ nearest.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(nearest) == pytest.approx(1)
    turns = Rotation.from_rotvec(10.0 ** rng.uniform(-3, 0.5, (300, 1)) * rng.normal(size=(300, 3)))
    distances = np.linalg.norm(turns.as_matrix() @ nearest - matrix, axis=(1, 2))
    assert np.linalg.norm(nearest - matrix) <= distances.min() + 1e-12


@pytest.mark.parametrize("angle", [0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 10, 90, 179, 179.999999, 180])
def test_angles_are_precise_at_both_ends(angle):
    """The arc cosine of the trace loses half of the digits there."""
    axes = np.random.default_rng(0).normal(size=(20, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    matrices = Rotation.from_rotvec(angle * axes, degrees=True).as_matrix()
    np.testing.assert_allclose(rotation_angles(matrices), angle, rtol=1e-9, atol=1e-13)


@given(seed=st.integers(0, 10_000), angle=st.sampled_from([0, 1e-9, 1e-3, 1, np.pi - 1e-9, np.pi]))
def test_quaternions_are_precise_at_half_turns(seed, angle):
    axis = np.random.default_rng(seed).normal(size=(1, 3))
    rotations = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    (quaternion,) = quaternions_from_rotations(rotations.as_matrix())
    assert abs(quaternion @ rotations.as_quat()[0]) == pytest.approx(1, abs=1e-15)
    np.testing.assert_allclose(
        Rotation.from_quat(quaternion).as_matrix(), rotations.as_matrix()[0], atol=1e-14
    )
