"""PCR-99 against its definition in NumPy; prescreening, flat triangles, input."""

import itertools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import Similarity, tas
from alignscores.registration import pcr99

# --- the definition -------------------------------------------------------------------------------


def draw_triplets(gt, est, n_wanted, rng, prescreen=0.1):
    """Triplets (H, 3) whose log edge ratios differ by at most a threshold; NumPy's generator."""
    n = len(gt)
    if math.comb(n, 3) <= n_wanted:  # all, each with its three first edges
        i, j, k = np.array(list(itertools.combinations(range(n), 3))).reshape(-1, 3).T
        triplets = np.hstack([[i, j, k], [j, k, i], [k, i, j]]).T
        return triplets[are_similar(gt, est, triplets, prescreen)]
    kept, n_drawn, batch = np.empty((0, 3), int), 0, 2 * n_wanted
    while len(kept) < n_wanted and n_drawn < 1000 * n_wanted:
        triplets = rng.integers(n, size=(3, batch)).T
        kept = np.vstack([kept, triplets[are_similar(gt, est, triplets, prescreen)]])
        n_drawn += batch
        more = 1.1 * (n_wanted - len(kept)) * n_drawn / max(1, len(kept))
        batch = min(65536, 64 + int(more))
    return kept[:n_wanted]


def are_similar(gt, est, triplets, threshold):
    edges = triplets[:, [0, 0, 1]], triplets[:, [1, 2, 2]]
    a, b = (np.linalg.norm(p[edges[0]] - p[edges[1]], axis=-1) for p in (gt, est))
    rho = np.log(b / a)
    return np.isfinite(rho).all(axis=1) & (np.ptp(rho, axis=1) <= threshold)


def frames(corners):
    """The axes of triangles (H, 3, 3), as columns, and which are flat."""
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    first = edge_1 / np.linalg.norm(edge_1, axis=1, keepdims=True)
    normal = np.cross(first, edge_2)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    flat = length[:, 0] <= 1e-6 * np.linalg.norm(edge_2, axis=1)
    normal = normal / length
    return np.stack([first, normal, np.cross(first, normal)], axis=2), flat


def fit_triplets(gt, est, triplets):
    """Scale, rotation and translation of each triplet, frame to frame, and which are flat."""
    a, b = gt[triplets], est[triplets]
    (gt_frames, gt_flat), (est_frames, est_flat) = frames(a), frames(b)
    rotation, flat = est_frames @ gt_frames.swapaxes(1, 2), gt_flat | est_flat
    for h in np.flatnonzero(flat):  # the smallest rotation from line to line
        rotation[h] = smallest_rotation(gt_frames[h, :, 0], est_frames[h, :, 0])
    a_mean, b_mean = a.mean(axis=1), b.mean(axis=1)
    turned = (a - a_mean[:, None]) @ rotation.swapaxes(1, 2)
    scale = np.sum((b - b_mean[:, None]) * turned, axis=(1, 2)) / np.sum(turned**2, axis=(1, 2))
    translation = b_mean - scale[:, None] * np.einsum("hij,hj->hi", rotation, a_mean)
    return scale, rotation, translation, flat


def smallest_rotation(a, b):
    axis, cosine = np.cross(a, b), a @ b
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + cross + cross @ cross / (1 + cosine)


def pcr99_by_definition(gt, est, rank, n_hypotheses, rng, prescreen=0.1):
    triplets = draw_triplets(gt, est, n_hypotheses, rng, prescreen)
    scale, rotation, translation, flat = fit_triplets(gt, est, triplets)
    aligned = (est - translation[:, None]) / scale[:, None, None]
    squares = np.sum((aligned - gt @ rotation.swapaxes(1, 2)) ** 2, axis=2)
    costs = np.sort(squares, axis=1)[:, rank - 1]
    costs += flat * 64 * np.finfo(float).eps * np.max(np.sum(gt**2, axis=1))
    best = np.lexsort([flat, costs])[0]
    return Similarity(scale[best], rotation[best], translation[best]), len(triplets)


KINDS = ["cube", "axis", "oblique line", "plane", "helix", "clusters", "straight then bend"]
SEARCHES = [  # cameras, hypotheses, prescreening; all triplets where no more exist, then no numbers
    (7, 1000, 0.1),
    (7, 35, math.inf),
    (7, 34, 0.3),
    (19, 1000, 0.03),
    (20, 1000, 0.1),
    (60, 1000, 0.3),
    (400, 1000, 0.1),
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "n_hypotheses", "prescreen"), SEARCHES)
@pytest.mark.filterwarnings("ignore:(divide|invalid):RuntimeWarning")
def test_definition(cloud, kind, n, n_hypotheses, prescreen):
    """The same triplets from the same seed, never with coincident cameras; the same choice."""
    for seed in range(3):
        gt = cloud(kind, n, seed)
        gt -= np.median(gt, axis=0)
        noise = np.random.default_rng(seed)
        est = 2.5 * Rotation.random(rng=noise).apply(gt + noise.normal(0, 0.01, gt.shape))
        est[: n // 4] = noise.uniform(-1, 1, (n // 4, 3))
        gt[1] = gt[0]
        ours, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
        options = {"rank": max(4, n // 10), "n_hypotheses": n_hypotheses, "prescreen": prescreen}
        found, n_used = pcr99(gt, est, **options, rng=ours)
        expected, n_expected = pcr99_by_definition(gt, est, **options, rng=theirs)
        assert n_used == n_expected
        assert ours.random() == theirs.random()
        assert found.scale == pytest.approx(expected.scale, rel=1e-12)
        np.testing.assert_allclose(found.rotation, expected.rotation, rtol=0, atol=1e-11)
        size = np.abs(est).max()
        np.testing.assert_allclose(found.translation, expected.translation, atol=1e-11 * size)


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


@pytest.mark.parametrize("kind", DIFFICULT)
@pytest.mark.parametrize(("n", "straight"), [(60, False), (60, True), (700, False)])
@pytest.mark.filterwarnings("ignore:(divide|invalid|overflow):RuntimeWarning")
def test_single_precision_rejects_no_cheaper_hypothesis(noisy_scene, kind, n, straight):
    """The cost of the choice is the lowest, whatever the numbers."""
    sigma, reach, offset, unit = DIFFICULT[kind]
    gt, est = noisy_scene(n, n // 3, sigma, 5)
    if straight:
        gt[: n // 2, 1:], est[: n // 2, 1:] = 0, 0
    if kind == "far, in both worlds":
        gt[:: n // 10] *= reach
    est[:: n // 10] *= reach
    if kind == "of two scales":
        est[::5] = reach * gt[::5]
    gt, est, rank = unit * gt + offset, unit * est + offset, n // 10
    found, _ = pcr99(gt, est, rank=rank, n_hypotheses=1000, rng=rng())
    expected, _ = pcr99_by_definition(gt, est, rank, 1000, rng())
    a, b = (np.sort(one.position_errors(gt, est))[rank - 1] for one in (found, expected))
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
    found, n_used = pcr99(gt, est, rank=6, n_hypotheses=1000, rng=rng(), alignment=alignment)
    triplets = draw_triplets(gt, est, 1000, rng())
    assert n_used == len(triplets)
    assert found.scale == 1
    if alignment == "yaw":
        np.testing.assert_allclose(found.rotation[2], [0, 0, 1], atol=1e-12)
        fits = [Similarity.fit(gt[t], est[t], alignment="yaw") for t in triplets]
        costs = [np.sort(fit.position_errors(gt, est))[5] for fit in fits]
        cost = np.sort(found.position_errors(gt, est))[5]
        assert cost == pytest.approx(min(costs), rel=1e-9)
    np.testing.assert_allclose(found.rotation, turn.as_matrix(), atol=0.1)


# --- degenerate triangles -------------------------------------------------------------------------


def single(gt, est):
    """The best of the three hypotheses from three cameras."""
    found, n_used = pcr99(gt, est, rank=3, n_hypotheses=1, rng=rng(), prescreen=math.inf)
    assert n_used == 3
    return found.scale, found.rotation, found.translation


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


@pytest.mark.parametrize("kind", [np.random.PCG64, np.random.MT19937, np.random.Philox])
def test_a_generator_goes_on(noisy_scene, kind):
    """Of whatever kind it is: its state decides, and the next call gets other numbers."""
    gt, est = noisy_scene(50, 10, 0.03, 0)
    a, b = (np.random.Generator(kind(1)) for _ in range(2))
    first, second = (tas(gt, est, rng=a).score for _ in range(2))
    assert first == tas(gt, est, rng=b).score != second


def test_too_many_hypotheses(noisy_scene):
    gt, est = noisy_scene(30_000, 10, 0.03, 0)  # with as many triplets
    with pytest.raises(MemoryError, match="no memory for 1099511627776 hypotheses"):
        tas(gt, est, n_hypotheses=4 * 10**12)
