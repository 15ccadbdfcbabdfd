"""PCR-99 against its definition in `alignscores.paper`; prescreening, flat triangles, input."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Similarity, paper, tas
from alignscores.registration import pcr99

# --- the definition -------------------------------------------------------------------------------


SHAPES = ["cube", "axis", "oblique line", "plane", "helix", "clusters", "straight then bend"]
SEARCHES = [  # cameras, hypotheses, prescreening; all triplets where no more exist, then no numbers
    (7, 1000, 0.1),
    (7, 35, math.inf),
    (7, 34, 0.3),
    (19, 1000, 0.03),
    (20, 1000, 0.1),
    (60, 1000, 0.3),
    (400, 1000, 0.1),
]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("n", "n_hypotheses", "prescreen"), SEARCHES)
def test_it_is_the_registration_written_out_in_the_paper_module(
    cloud, shape, n, n_hypotheses, prescreen
):
    """The same triplets from the same seed, never with coincident cameras; the same choice."""
    for seed in range(3):
        gt = cloud(shape, n, seed)
        gt -= np.median(gt, axis=0)
        noise = np.random.default_rng(seed)
        est = 2.5 * Rotation.random(rng=noise).apply(gt + noise.normal(0, 0.01, gt.shape))
        est[: n // 4] = noise.uniform(-1, 1, (n // 4, 3))
        gt[1] = gt[0]
        ours, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
        options = {"rank": max(4, n // 10), "n_hypotheses": n_hypotheses, "prescreen": prescreen}
        fitted, n_used = pcr99(gt, est, **options, rng=ours)
        expected, n_expected = paper.pcr99(gt, est, **options, rng=theirs)
        assert n_used == n_expected
        assert ours.random() == theirs.random()
        assert fitted.scale == pytest.approx(expected.scale, rel=1e-12)
        np.testing.assert_allclose(fitted.rotation, expected.rotation, rtol=0, atol=1e-11)
        size = np.abs(est).max()
        np.testing.assert_allclose(fitted.translation, expected.translation, atol=1e-11 * size)


DIFFICULT = {
    "nearly exact": (1e-9, 1.0, 0.0, 1.0),
    "exact": (0.0, 1.0, 0.0, 1.0),
    "far outliers": (0.03, 1e12, 0.0, 1.0),
    "very far outliers": (0.03, 1e100, 0.0, 1.0),
    "of two scales": (0.03, 1e20, 0.0, 1.0),  # the far outliers agree with each other
    "off the origin": (0.03, 1.0, 1e3, 1.0),
    "tiny": (0.03, 1.0, 0.0, 1e-25),
    "far, in both worlds": (0.03, 1e6, 0.0, 1.0),
}


@pytest.mark.parametrize("difficulty", DIFFICULT)
@pytest.mark.parametrize(("n", "straight"), [(60, False), (60, True), (700, False)])
def test_single_precision_rejects_no_cheaper_hypothesis(noisy_scene, difficulty, n, straight):
    """The cost of the choice is the lowest, whatever the numbers."""
    sigma, reach, offset, unit = DIFFICULT[difficulty]
    gt, est = noisy_scene(n, n // 3, sigma, 5)
    if straight:
        gt[: n // 2, 1:], est[: n // 2, 1:] = 0, 0
    if difficulty == "far, in both worlds":
        gt[:: n // 10] *= reach
    est[:: n // 10] *= reach
    if difficulty == "of two scales":
        est[::5] = reach * gt[::5]
    gt, est, rank = unit * gt + offset, unit * est + offset, n // 10
    fitted, _ = pcr99(gt, est, rank=rank, n_hypotheses=1000, rng=rng())
    expected, _ = paper.pcr99(gt, est, rank=rank, n_hypotheses=1000, rng=rng())
    a, b = (np.sort(each.position_errors(gt, est))[rank - 1] for each in (fitted, expected))
    assert a <= b * (1 + 1e-6) + 1e-11 * unit * max(1, offset)


def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("alignment", ["rigid", "yaw"])
def test_without_a_scale_the_same_triplets_are_fitted(noisy_scene, alignment, seed):
    """No hypothesis of three cameras is cheaper, by the least-squares fit within the group."""
    gt, _ = noisy_scene(12, 0, 0, seed)
    generator = np.random.default_rng(seed)
    turn = Rotation.from_rotvec([0.2, 0.1, 1.0] if alignment == "rigid" else [0, 0, 1.0])
    est = 1 + turn.apply(gt + generator.normal(0, 0.01, gt.shape))
    est[:3] = generator.uniform(-1, 1, (3, 3))
    fitted, n_used = pcr99(gt, est, rank=6, n_hypotheses=1000, rng=rng(), alignment=alignment)
    triplets = paper.prescreened_triplets(gt, est, 1000, 0.1, rng()).T
    assert n_used == len(triplets)
    assert fitted.scale == 1
    if alignment == "yaw":
        np.testing.assert_allclose(fitted.rotation[2], [0, 0, 1], atol=1e-12)
        fits = [Similarity.fit(gt[t], est[t], alignment="yaw") for t in triplets]
        costs = [np.sort(fit.position_errors(gt, est))[5] for fit in fits]
        cost = np.sort(fitted.position_errors(gt, est))[5]
        assert cost == pytest.approx(min(costs), rel=1e-9)
    np.testing.assert_allclose(fitted.rotation, turn.as_matrix(), atol=0.1)


# --- degenerate triangles -------------------------------------------------------------------------


def single(gt, est):
    """The best of the three hypotheses from three cameras."""
    fitted, n_used = pcr99(gt, est, rank=3, n_hypotheses=1, rng=rng(), prescreen=math.inf)
    assert n_used == 3
    return fitted.scale, fitted.rotation, fitted.translation


@pytest.mark.parametrize("sine", [0.1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_nearly_flat_triangle(sine):
    """As long as there is a normal it counts: the spin about the long edges is right."""
    gt = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 2 * sine, 0.0]])
    turn = Rotation.from_euler("xyz", [1.0, 0.5, 2.0])
    scale, rotation, _ = single(gt, 3 * turn.apply(gt))
    assert scale == pytest.approx(3)
    np.testing.assert_allclose(rotation, turn.as_matrix(), atol=1e-8)


DIRECTIONS = {
    "axis": [1.0, 0.0, 0.0],
    "other axis": [0.0, 0.0, 1.0],
    "oblique": [0.48, -0.6, 0.64],
    "opposite": [-1.0, 0.0, 0.0],
    "nearly opposite": [-1.0, 1e-9, 0.0],
    "nearly the same": [1.0, 0.0, 1e-9],
}


@pytest.mark.parametrize("est_direction", DIRECTIONS)
@pytest.mark.parametrize("gt_direction", ["axis", "other axis", "oblique"])
def test_collinear_triplet(gt_direction, est_direction):
    """A triangle without a normal gives the minimal rotation between the two directions."""
    a, b = np.array(DIRECTIONS[gt_direction]), np.array(DIRECTIONS[est_direction])
    b /= np.linalg.norm(b)
    steps = np.array([[0.0], [1.0], [3.0]])
    gt, est = steps * a + [1, 2, 3], 5 * steps * b - [3, 2, 1]
    scale, rotation, translation = single(gt, est)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(rotation @ a, b, atol=1e-9)
    assert scale == pytest.approx(5)
    np.testing.assert_allclose(scale * gt @ rotation.T + translation, est, atol=1e-7)
    angle = Rotation.from_matrix(rotation).magnitude()
    expected = math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
    assert angle == pytest.approx(expected, abs=1e-6)


# --- random numbers and memory --------------------------------------------------------------------


@pytest.mark.parametrize("bit_generator", [np.random.PCG64, np.random.MT19937, np.random.Philox])
def test_a_generator_goes_on(noisy_scene, bit_generator):
    """The state of any bit generator decides, and the next call gets other numbers."""
    gt, est = noisy_scene(50, 10, 0.03, 0)
    a, b = (np.random.Generator(bit_generator(1)) for _ in range(2))
    first, second = (tas(gt, est, rng=a).score for _ in range(2))
    assert first == tas(gt, est, rng=b).score != second


def test_too_many_hypotheses(noisy_scene):
    gt, est = noisy_scene(30_000, 10, 0.03, 0)  # with as many triplets
    with pytest.raises(MemoryError, match="not enough memory for 4000000000000 hypotheses"):
        tas(gt, est, n_hypotheses=4 * 10**12)
