"""The scores as the paper states them against the fast ones, and the readings of flat triangles."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import paper, pas, ras, tas

SIZES = [12, 19, 20, 45, 100, 100, 150, 200, 100, 60]


@pytest.mark.parametrize("seed", range(20))
def test_the_scores_of_the_paper_are_those_of_the_kernel(noisy_scene, noisy_rotations, seed):
    """Exactly, where no triangle is flat: the same triplets from the same seed."""
    n = SIZES[seed % len(SIZES)]
    outliers, sigma = seed % 4 * n // 6, 0.01 + 0.02 * (seed % 5)
    c, c_est = noisy_scene(n, outliers, sigma, seed)
    R, R_est = noisy_rotations(n, outliers, 1.0 + seed % 7, seed)
    if seed % 5 == 4:
        c_est[: n // 5], R_est[: n // 4] = np.nan, np.nan
    assert paper.tas(c, c_est, seed) == tas(c, c_est, rng=seed).score
    assert paper.ras(R, R_est) == ras(R, R_est).score
    gt, est = (np.concatenate([a, b[:, :, None]], axis=2) for a, b in ((R, c), (R_est, c_est)))
    assert paper.pas(R, c, R_est, c_est, seed) == pas(gt, est, rng=seed).score


@pytest.mark.parametrize("shape", ["axis", "oblique line"])
@pytest.mark.parametrize("seed", range(3))
def test_on_a_line_the_scores_agree_but_for_rounding(cloud, another_world, shape, seed):
    """Several alignments fit equally well there, and rounding decides between them."""
    c = cloud(shape, 100, seed)
    c_est = another_world(c + np.random.default_rng(seed).normal(0, 0.05, c.shape), seed)
    assert paper.tas(c, c_est, seed) == pytest.approx(tas(c, c_est, rng=seed).score, abs=0.005)
    assert paper.tas(c, 2 * c, seed) == 1


def test_perfect_estimates_score_1(noisy_rotations):
    R, _ = noisy_rotations(30, 0, 0, 0)
    assert paper.ras(R, Rotation.random(rng=np.random.default_rng(1)).as_matrix() @ R) == 1
    assert paper.ras(R, R) == 1
    assert paper.ras(R, np.full_like(R, np.nan)) == 0


def test_an_estimate_that_cannot_be_aligned_scores_0(cloud):
    c = cloud("cube", 30, 0)
    assert paper.tas(c, np.ones_like(c)) == 0
    assert paper.tas(c, np.full_like(c, np.nan)) == 0


# --- literal frames -------------------------------------------------------------------------------


def test_triangles_with_a_normal_are_registered_as_by_pcr99(noisy_scene):
    gt, est = noisy_scene(40, 10, 0.03, 0)
    literal = tas(gt, est, rng=1, registration=paper.literal_frames)
    assert literal.score == tas(gt, est, rng=1).score == paper.tas(gt, est, 1)
    assert literal.registration == "literal_frames"


def test_on_a_line_the_matrix_of_literal_frames_is_no_rotation_as_a_rule():
    rng = np.random.default_rng(0)
    distances = []
    for seed in range(20):
        direction = rng.normal(size=3)
        gt = np.arange(-20, 21)[:, None] * direction / np.linalg.norm(direction)
        est = gt + rng.normal(scale=0.05, size=gt.shape)
        generator = np.random.default_rng(seed)
        fitted, _ = paper.literal_frames(gt, est, rank=4, n_hypotheses=200, rng=generator)
        assert fitted is not None
        distances.append(np.abs(fitted.rotation @ fitted.rotation.T - np.eye(3)).max())
    assert np.median(distances) > 1e-3
