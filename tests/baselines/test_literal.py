"""The literal frames of triangles: PCR-99 but on a line, where the "rotation" is none."""

import numpy as np
import pytest

from alignscores.registration import pcr99
from baselines import literal_frames


def test_triangles_with_a_normal_are_registered_as_by_pcr99():
    rng = np.random.default_rng(0)
    gt = rng.normal(size=(40, 3))
    est = 3 * gt[:, [1, 2, 0]] + rng.normal(scale=0.1, size=gt.shape)
    found, n_found = literal_frames(gt, est, rank=4, n_hypotheses=50, rng=np.random.default_rng(1))
    same, n_same = pcr99(gt, est, rank=4, n_hypotheses=50, rng=np.random.default_rng(1))
    assert found is not None
    assert same is not None
    assert n_found == n_same
    assert found.scale == pytest.approx(same.scale)
    np.testing.assert_allclose(found.rotation, same.rotation, atol=1e-9)
    np.testing.assert_allclose(found.translation, same.translation, atol=1e-9)


def test_on_a_line_the_matrix_is_no_rotation_as_a_rule():
    rng = np.random.default_rng(0)
    distances = []
    for seed in range(20):
        direction = rng.normal(size=3)
        gt = np.arange(-20, 21)[:, None] * direction / np.linalg.norm(direction)
        est = gt + rng.normal(scale=0.05, size=gt.shape)
        generator = np.random.default_rng(seed)
        found, _ = literal_frames(gt, est, rank=4, n_hypotheses=200, rng=generator)
        assert found is not None
        distances.append(np.abs(found.rotation @ found.rotation.T - np.eye(3)).max())
    assert np.median(distances) > 1e-3
