"""Estimation errors have the stated distribution, and levels that compare."""

import numpy as np
import pytest
from scipy import stats

from alignscores import pas
from baselines import ate
from experiments.scenes import ERRORS, PATHS, make_scene

SIGMA_T, SIGMA_R = 0.05, 0.02
TOGETHER = ("drift", "scale_drift", "bias")  # cameras err together


def errors(name, geometry="car", n=1000, seed=0):
    """Return rotation vectors, displacements and the true cameras."""
    rng = np.random.default_rng(seed)
    rotations, positions = PATHS[geometry](rng, n, 1.0)
    turns, shifts = ERRORS[name](rng, rotations, positions, SIGMA_T, SIGMA_R)
    return turns, shifts, rotations, positions


def rms(vectors):
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


@pytest.mark.parametrize("geometry", ["car", "cube"])
@pytest.mark.parametrize("name", ERRORS)
def test_sigma_is_the_root_mean_square_of_every_model(name, geometry):
    draws = [errors(name, geometry, n=400, seed=seed) for seed in range(40)]
    shifts = np.array([rms(shifts) for _, shifts, *_ in draws]) / (np.sqrt(3) * SIGMA_T)
    turns = np.array([rms(turns) for turns, *_ in draws]) / SIGMA_R
    # The fourth moment of Student's t does not exist: its root mean square converges slowly.
    assert np.sqrt((shifts**2).mean()) == pytest.approx(1, rel=0.1 if name == "student_t" else 0.02)
    assert np.sqrt((turns**2).mean()) == pytest.approx(1, rel=0.1 if name == "student_t" else 0.03)
    if name in TOGETHER:
        np.testing.assert_allclose(shifts, 1)


@pytest.mark.parametrize("name", ERRORS)
def test_without_noise_the_estimate_is_perfect_and_a_seed_gives_the_same(name):
    settings = {"geometry": "car", "error": name, "n_cameras": 30, "n_outliers": 0}
    scene = make_scene(np.random.default_rng(5), **settings, sigma_t=0.0, sigma_r_deg=0.0)
    assert pas(scene.gt_poses, scene.est_poses).score == 1.0
    assert ate(scene.gt_positions, scene.est_positions) < 1e-12
    first, second = (
        make_scene(np.random.default_rng(5), **settings, sigma_t=0.1, sigma_r_deg=3.0)
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.est_poses, second.est_poses)
    assert ate(first.gt_positions, first.est_positions) > 1e-4


def test_heavy_tails_are_those_of_students_t_and_common_to_position_and_rotation():
    turns, shifts, *_ = errors("student_t", n=3000)
    unit = 1 / np.sqrt(3)  # variance 1 with 3 degrees of freedom
    for component in shifts.T:
        assert stats.kstest(component, stats.t(3, scale=unit * SIGMA_T).cdf).pvalue > 1e-3
    angles = np.linalg.norm(turns, axis=1)
    half = stats.t(3, scale=unit * SIGMA_R)
    assert stats.kstest(angles, lambda a: 2 * half.cdf(a) - 1).pvalue > 1e-3
    # The length of a displacement over the true scale follows F: one factor for all three axes.
    lengths = (shifts**2).sum(axis=1) / (3 * (unit * SIGMA_T) ** 2)
    assert stats.kstest(lengths, stats.f(3, 3).cdf).pvalue > 1e-3
    assert stats.kendalltau(np.linalg.norm(shifts, axis=1), angles).statistic > 0.15
    plain_turns, plain_shifts, *_ = errors("gaussian", n=3000)
    independent = stats.kendalltau(
        np.linalg.norm(plain_shifts, axis=1), np.linalg.norm(plain_turns, axis=1)
    )
    assert abs(independent.statistic) < 0.05


def test_drift_is_a_random_walk_from_the_first_camera_on():
    for turns, shifts, *_ in (errors("drift", seed=seed) for seed in range(5)):
        for walk in (turns, shifts):
            assert (walk[0] == 0).all()
            steps = np.diff(walk, axis=0)
            spread = steps.std()
            assert stats.kstest(steps.ravel() / spread, stats.norm.cdf).pvalue > 1e-3
            neighbours = np.corrcoef(steps[1:].ravel(), steps[:-1].ravel())[0, 1]
            assert abs(neighbours) < 0.08
    # The variance grows in proportion to the distance travelled.
    ends = np.array([errors("drift", n=100, seed=seed)[1][[25, 99]] for seed in range(400)])
    quarter, end = (ends**2).sum(axis=2).mean(axis=0)
    assert end / quarter == pytest.approx(99 / 25, rel=0.2)


def test_bias_is_constant_in_the_camera_frame():
    turns, shifts, rotations, _ = errors("bias")
    for vectors in (turns, shifts):
        rotated = np.einsum("nji,nj->ni", rotations, vectors)
        np.testing.assert_allclose(rotated, np.tile(rotated[0], (1000, 1)), atol=1e-12)
