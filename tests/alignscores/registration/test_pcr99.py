"""PCR-99 against a plain triple loop, its search for triplets, and its degenerate triangles.

All with the kernel as it is installed: test_kernel.py shows that NumPy computes the same bits.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.registration import hypotheses, kernel, pcr99, refined
from alignscores.registration.hypotheses import cheapest, three_point_similarities
from alignscores.registration.pcr99 import prescreened_triplets


class Hypothesis(NamedTuple):
    cost: float
    scale: float
    rotation: np.ndarray
    translation: np.ndarray


def naive_hypothesis(a, b):
    """Similarity from three ground-truth points (rows of a) and three estimated ones (b)."""
    rotation = np.zeros((3, 3))
    firsts = [(corners[1] - corners[0]) / math.dist(corners[1], corners[0]) for corners in (a, b)]
    normals = [np.cross(corners[1] - corners[0], corners[2] - corners[0]) for corners in (a, b)]
    if any(math.hypot(*normal) < 1e-9 for normal in normals):  # flat: smallest rotation
        normals = [np.cross(*firsts)] * 2
    axes = []
    for first, normal in zip(firsts, normals, strict=True):
        normal = normal / math.hypot(*normal)
        axes.append((first, normal, np.cross(first, normal)))
    for gt_axis, est_axis in zip(*axes, strict=True):
        rotation += np.outer(est_axis, gt_axis)
    a_mean, b_mean = sum(a) / 3, sum(b) / 3
    numerator = sum((b[k] - b_mean) @ rotation @ (a[k] - a_mean) for k in range(3))
    scale = numerator / sum((a[k] - a_mean) @ (a[k] - a_mean) for k in range(3))
    return scale, rotation, b_mean - scale * rotation @ a_mean


def naive_pcr99(gt, est, rank, prescreen=0.1):
    """The cheapest of all hypotheses and the number of triplets that passed (unordered)."""
    best, passed = Hypothesis(math.inf, 0, np.eye(3), np.zeros(3)), set()
    for triplet in itertools.permutations(range(len(gt)), 3):
        pairs = list(itertools.combinations(triplet, 2))
        edges = [(math.dist(est[i], est[j]), math.dist(gt[i], gt[j])) for i, j in pairs]
        if any(0 in edge for edge in edges):
            continue
        rho = [math.log(b / a) for b, a in edges]
        if max(rho) - min(rho) > prescreen:
            continue
        passed.add(frozenset(triplet))
        scale, rotation, translation = naive_hypothesis(gt[list(triplet)], est[list(triplet)])
        errors = [
            math.hypot(*((est[i] - translation) / scale - rotation @ gt[i])) for i in range(len(gt))
        ]
        cost = sorted(errors)[rank - 1]
        if cost < best.cost:
            best = Hypothesis(cost, scale, rotation, translation)
    return best, len(passed)


def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize(
    ("n", "outliers", "sigma", "rank"),
    [
        (4, 0, 0.03, 4),
        (5, 1, 0.02, 4),
        (7, 2, 0.05, 4),
        (8, 4, 0.01, 3),
        (9, 2, 0.1, 5),
        (10, 3, 0.05, 7),
        (10, 0, 0.2, 10),
        (11, 5, 0.03, 1),
        (9, 2, 1e-9, 5),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_cheapest_of_all_hypotheses(noisy_scene, n, outliers, sigma, rank, seed):
    """Where all triplets are enumerated, the result is that of a plain triple loop."""
    gt, est = noisy_scene(n, outliers, sigma, seed)
    expected, n_passed = naive_pcr99(gt, est, rank)
    alignment, n_used = pcr99(gt, est, rank=rank, n_hypotheses=1000, rng=rng())
    assert n_used == 3 * n_passed
    if n_passed == 0:
        assert alignment is None
        return
    errors = np.sort(alignment.position_errors(gt, est))
    assert errors[rank - 1] == pytest.approx(expected.cost, rel=1e-7, abs=1e-13)
    if rank > 1:  # the smallest error is often one that vanishes, for many hypotheses
        assert alignment.scale == pytest.approx(expected.scale, rel=1e-9)
        np.testing.assert_allclose(alignment.rotation, expected.rotation, atol=1e-9)
        np.testing.assert_allclose(alignment.translation, expected.translation, atol=1e-8)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("noise_off_the_line", [0.005, 0.1])
def test_cheapest_of_all_hypotheses_on_a_partly_straight_path(noise_off_the_line, seed):
    """Flat triangles take part: with more noise off the line than on it they are the cheapest."""
    generator = np.random.default_rng(seed)
    gt = np.zeros((9, 3))
    gt[:7, 0] = np.arange(7)
    gt[7:] = generator.uniform(0, 5, (2, 3))
    noise = generator.normal(0, 0.001, (9, 3))
    noise[7:] *= noise_off_the_line / 0.001
    est = 2 * Rotation.from_euler("xyz", [1.0, 0.5, 2.0]).apply(gt + noise)
    expected, n_passed = naive_pcr99(gt, est, 6)
    alignment, n_used = pcr99(gt, est, rank=6, n_hypotheses=1000, rng=rng())
    assert alignment is not None
    assert n_used == 3 * n_passed
    cost = np.sort(alignment.position_errors(gt, est))[5]
    assert cost == pytest.approx(expected.cost, rel=1e-7)


@pytest.mark.parametrize("sine", [0.1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_nearly_flat_triangle(sine):
    """As long as there is a normal it counts: the spin about the long edges is right."""
    gt = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 2 * sine, 0.0]])
    turn = Rotation.from_euler("xyz", [1.0, 0.5, 2.0])
    scale, rotation, _ = single(gt, 3 * turn.apply(gt))
    assert scale == pytest.approx(3)
    np.testing.assert_allclose(rotation, turn.as_matrix(), atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_three_point_similarities_from_their_definition(noisy_scene, seed):
    """Each hypothesis is the one of the mathematics, for triplets in any order."""
    gt, est = noisy_scene(12, 4, 0.1, seed)
    triplets = np.array(list(itertools.permutations(range(12), 3))[seed::7]).T
    scale, rotation, translation, _ = three_point_similarities(gt.T.copy(), est.T.copy(), triplets)
    for h, triplet in enumerate(triplets.T):
        expected = naive_hypothesis(gt[triplet], est[triplet])
        assert scale[h] == pytest.approx(expected[0], rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(rotation[h], expected[1], atol=1e-9)
        np.testing.assert_allclose(translation[h], expected[2], atol=1e-7)


@pytest.mark.parametrize("world", [0, 1])
def test_flat_triangle(world):
    """Below a sine of a millionth in either world a triangle has no normal."""
    for sine, is_flat in ((1.1e-6, False), (0.9e-6, True)):
        corners = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]] * 2)
        corners[world, 2, 1] = sine
        gt, est = corners.swapaxes(1, 2)
        assert three_point_similarities(gt, est, np.array([[0], [1], [2]]))[3] == is_flat


TRIANGLE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 3.0, 0.5]])


def triangle_with_edges(ij, ik, jk):
    x = (ij**2 + ik**2 - jk**2) / (2 * ij)
    return np.array([[0.0, 0.0, 0.0], [ij, 0.0, 0.0], [x, math.sqrt(ik**2 - x**2), 0.0]])


@pytest.mark.parametrize("copies", [1, 10, 100], ids=["enumerated", "small", "large"])
@pytest.mark.parametrize(
    "log_ratios",
    [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1), (0.5, -0.5, 0)],
)
def test_prescreen_threshold(copies, log_ratios):
    """A triangle whose log edge ratios spread by less than 0.1 passes, by more it does not.

    With copies, all triangles that are none (two corners coincide) must be passed over too.
    """
    edges = np.array([math.dist(TRIANGLE[i], TRIANGLE[j]) for i, j in ((0, 1), (0, 2), (1, 2))])
    for spread, passes in ((0.0999, True), (0.1001, False)):
        est = triangle_with_edges(*(7 * edges * np.exp(spread * np.array(log_ratios))))
        gt, est = (np.repeat(corners, copies, axis=0) for corners in (TRIANGLE, est))
        alignment, n_used = pcr99(gt, est, rank=3, n_hypotheses=50, rng=rng())
        assert (alignment is not None) == passes
        assert n_used == (0 if not passes else 3 if copies == 1 else 50)


@pytest.mark.parametrize("n", [20, 256, 1000])
def test_collects_the_number_of_hypotheses_asked_for(noisy_scene, n):
    """Random sampling delivers exactly as many as asked for."""
    gt, est = noisy_scene(n, n // 3, 0.01, 1)
    for asked in (1, 17, 1000):
        alignment, n_used = pcr99(gt, est, rank=n // 10, n_hypotheses=asked, rng=rng())
        assert alignment is not None
        assert n_used == asked
        assert alignment.scale == pytest.approx(2.5, rel=0.5)


def test_more_hypotheses_cost_less(noisy_scene):
    """The alignment is the best of the hypotheses, so that its cost falls with their number."""
    gt, est = noisy_scene(100, 30, 0.03, 4)
    costs = []
    for asked in (1, 10, 100, 1000):
        total = 0.0
        for seed in range(10):
            generator = np.random.default_rng(seed)
            alignment, _ = pcr99(gt, est, rank=10, n_hypotheses=asked, rng=generator)
            total += float(np.sort(alignment.position_errors(gt, est))[9])
        costs.append(total)
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < costs[0] / 2


@pytest.mark.parametrize(
    ("n", "asked", "enumerated"),
    [(19, 1000, True), (20, 1000, False), (20, 1139, False), (20, 1140, True)],
)
def test_enumeration_ends_at_the_number_of_hypotheses(noisy_scene, n, asked, enumerated):
    """comb(n, 3) <= n_hypotheses: the random generator is not touched; beyond, it is."""
    gt, est = noisy_scene(n, 0, 1e-6, 0)
    generator = rng()
    _, n_used = pcr99(gt, est, rank=4, n_hypotheses=asked, rng=generator)
    assert (generator.random() == rng().random()) == enumerated
    assert n_used == (3 * math.comb(n, 3) if enumerated else asked)


def single(gt, est):
    """The hypothesis from the first three rows."""
    triplet = np.array([[0], [1], [2]])
    scale, rotation, translation, _ = three_point_similarities(gt.T.copy(), est.T.copy(), triplet)
    return float(scale[0]), rotation[0], translation[0]


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


@pytest.mark.parametrize("bend", [1e-3, 0.05, 0.2])
@pytest.mark.parametrize("flat", ["gt", "est"])
def test_triplet_that_is_flat_in_one_world_only(flat, bend):
    """First edge onto first edge, and the least-squares scale about the centroids."""
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    for axis in (1, 2):
        bent = line.copy()
        bent[2, axis] = bend
        tilt = Rotation.from_euler("xyz", [0.3, 0.7, 1.1])
        gt, est = (line, 3 * tilt.apply(bent)) if flat == "gt" else (bent, 3 * tilt.apply(line))
        scale, rotation, translation = single(gt, est)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(rotation @ [1, 0, 0], tilt.apply([1, 0, 0]), atol=1e-9)
        a, b = gt - gt.mean(axis=0), est - est.mean(axis=0)
        assert scale == pytest.approx(np.sum(b * (a @ rotation.T)) / np.sum(a * a), rel=1e-9)
        expected = est.mean(axis=0) - scale * rotation @ gt.mean(axis=0)
        np.testing.assert_allclose(translation, expected, atol=1e-9)


def test_first_edge_matters_and_its_sense_does_not():
    """The first axis is the first edge: three hypotheses a triangle, neither one nor six."""
    gt = rng().random((3, 3))
    est = gt + rng().normal(0, 0.05, (3, 3))
    distinct = {
        tuple(single(gt[list(order)], est[list(order)])[1].round(9).ravel())
        for order in itertools.permutations(range(3))
    }
    assert len(distinct) == 3


DIFFICULT = {
    "plain": (0.03, 1.0, 0.0),
    "nearly exact": (1e-9, 1.0, 0.0),
    "exact": (0.0, 1.0, 0.0),
    "far outliers": (0.03, 1e12, 0.0),
    "very far outliers": (0.03, 1e100, 0.0),
    "off the origin": (0.03, 1.0, 1e3),
    "tiny": (0.03, 1.0, 0.0),
    "of two scales": (0.03, 1e20, 0.0),  # the far outliers agree with each other
}


@pytest.mark.parametrize("kind", DIFFICULT)
@pytest.mark.parametrize(("n", "straight"), [(60, False), (60, True), (700, False)])
def test_the_cheapest_hypothesis_is_chosen(noisy_scene, kind, n, straight):
    """Its cost is the smallest of the costs by their definition; a flat one wins no tie."""
    sigma, reach, offset = DIFFICULT[kind]
    gt, est = noisy_scene(n, n // 3, sigma, 5)
    if straight:
        gt[: n // 2, 1:], est[: n // 2, 1:] = 0, 0
    est[:: n // 10] *= reach
    if kind == "of two scales":
        est[::5] = reach * gt[::5]
    gt, est, rank = gt.T + offset, est.T + offset, n // 10
    if kind == "tiny":
        gt, est = 1e-25 * gt, 1e-25 * est
    with np.errstate(all="ignore"):
        triplets = prescreened_triplets(gt, est, 1000, rng())
        scale, rotation, translation, flat = three_point_similarities(gt, est, triplets)
        residuals = (est - translation[..., None]) / scale[:, None, None] - rotation @ gt
        costs = np.sort(np.sum(residuals**2, axis=1), axis=1)[:, rank - 1]
        tie = 1e-14 * float(np.max(np.sum(gt**2, axis=0)))
        best = cheapest(gt, est, scale, rotation, translation, flat, rank, tie)
    assert flat.any() == straight
    assert costs[best] <= costs[~flat].min() * (1 + 1e-9) + tie
    assert costs[best] <= costs.min() * (1 + 1e-9) + 2 * tie
    if flat[best]:
        assert costs[best] < costs[~flat].min()


def test_first_of_equally_cheap_hypotheses(noisy_scene):
    """Of several that are the same the first is taken, but one of a flat triangle never."""
    gt, est = (points.T for points in noisy_scene(50, 10, 0.03, 0))
    with np.errstate(all="ignore"):
        triplets = np.repeat(prescreened_triplets(gt, est, 20, rng()), 3, axis=1)
    *similarities, flat = three_point_similarities(gt, est, triplets)
    best = cheapest(gt, est, *similarities, flat, 5, 0.0)
    assert best % 3 == 0
    flat[best] = True
    assert cheapest(gt, est, *similarities, flat, 5, 1e-15) == best + 1


@pytest.mark.parametrize("rank", [0, 31, -1, 4.0])
def test_rank_that_no_cameras_have(noisy_scene, rank):
    gt, est = noisy_scene(30, 5, 0.03, 0)
    with pytest.raises(ValueError, match=f"rank must be .*, not {rank}"):
        pcr99(gt, est, rank=rank, n_hypotheses=10, rng=rng())


@pytest.mark.parametrize("shape", [(29, 3), (31, 3), (30, 2), (30, 4), (30,), (3, 30)])
@pytest.mark.parametrize("swapped", [False, True])
def test_positions_that_do_not_belong_together(shape, swapped):
    """Refused before anything is read beyond an array's end."""
    positions = [np.ones((30, 3)), np.ones(shape)]
    if swapped:
        positions.reverse()
    for register in (pcr99, refined):
        with pytest.raises(ValueError, match=r"must be \(n, 3\) arrays of the same length"):
            register(*positions, rank=4, threshold=1.0, n_hypotheses=10, rng=rng())
    with pytest.raises(ValueError, match=r"have the shapes \(30, 2\) and \(30, 2\)"):
        pcr99(*2 * [np.ones((30, 2))], rank=4, n_hypotheses=10, rng=rng())


@pytest.mark.parametrize("register", [pcr99, refined])
def test_numbers_of_any_type(register):
    """Whole numbers whose squares would overflow, and single precision."""
    generator = rng()
    gt = generator.integers(-60_000, 60_000, (40, 3))
    est = 2 * gt + generator.integers(-500, 500, (40, 3))
    for dtype in (np.int32, np.float32):
        (a, n_a), (b, n_b) = (
            register(
                *(gt.astype(kind), est.astype(kind)),
                **{"rank": 4, "threshold": 1e3, "n_hypotheses": 200, "rng": rng()},
            )
            for kind in (dtype, np.float64)
        )
        assert n_a == n_b == (400 if register is refined else 200)  # of up to 60 cameras
        assert a.scale == b.scale == pytest.approx(2, rel=0.1)
        np.testing.assert_array_equal(a.translation, b.translation)


def test_chunks_of_hypotheses(noisy_scene, monkeypatch):
    """How many NumPy evaluates at once changes no bit, be it one at a time."""
    monkeypatch.setattr(kernel, "LIBRARY", None)
    gt, est = noisy_scene(300, 100, 0.03, 0)
    scales = set()
    for chunk in (1, 300, 1000, 1 << 14, 1 << 20):
        monkeypatch.setattr(hypotheses, "ERRORS_AT_ONCE", chunk)
        alignment, _ = pcr99(gt, est, rank=30, n_hypotheses=100, rng=rng())
        scales.add((alignment.scale, alignment.translation.tobytes()))
    assert len(scales) == 1


@pytest.mark.parametrize("prescreen", [0.03, 0.1, 0.3, math.inf])
def test_prescreen_keeps_the_triplets_within_its_threshold(prescreen):
    """But never those with coincident cameras."""
    generator = np.random.default_rng(4)
    gt = generator.normal(size=(11, 3))
    est = 3 * gt + 0.3 * generator.normal(size=gt.shape)
    gt[3], est[5] = gt[2], est[4]
    _, passed = naive_pcr99(gt, est, 4, prescreen)
    _, n_used = pcr99(gt, est, rank=4, n_hypotheses=1000, rng=generator, prescreen=prescreen)
    assert 0 < passed <= 165 - 9 - 9
    assert n_used == 3 * passed
    assert (passed == 165 - 9 - 9) == (prescreen == math.inf)
