"""TAS: the unit d, the perfect score, errors, thresholds, the cost's rank, lost cameras."""

import math
import warnings
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from alignscores import (
    AlignmentScore,
    AlignmentWarning,
    Similarity,
    TASResult,
    closest_pair_quartile,
    tas,
    translation,
)
from alignscores.registration import pcr99

Floats = NDArray[np.float64]
Cloud = Callable[[str, int, int], Floats]
World = Callable[..., Floats]
Scene = Callable[[int, int, float, int], tuple[Floats, Floats]]

both_registrations = pytest.mark.parametrize("registration", ["pcr99", "refined"])
SEEDS = st.integers(0, 10_000)


# --- the unit d -------------------------------------------------------------------------------


def naive_d(gt: Floats) -> float:
    """The rank-th of the sorted closest-neighbour distances, with exact arithmetic for the rank."""
    closest = sorted(
        min(math.dist(a, b) for j, b in enumerate(gt) if j != i) for i, a in enumerate(gt)
    )
    return closest[math.ceil(Fraction(3, 4) * len(gt)) - 1]


@pytest.mark.parametrize("n", [*range(4, 30), 100, 101, 102, 103])
def test_d_is_an_order_statistic(cloud: Cloud, n: int) -> None:
    """d against sorted distances, for every remainder of n modulo 4."""
    for kind in ("cube", "helix", "clusters", "oblique line"):
        gt = cloud(kind, n, 7)
        assert closest_pair_quartile(gt) == pytest.approx(naive_d(gt), rel=1e-12)
        assert tas(gt, gt).unit == closest_pair_quartile(gt)


@given(gt=arrays(np.int64, st.tuples(st.integers(4, 15), st.just(3)), elements=st.integers(-4, 4)))
def test_d_with_ties_and_duplicates(gt: NDArray[np.int64]) -> None:
    """On a coarse grid many distances tie or vanish: d is still that rank, or there is none."""
    expected = naive_d(gt.astype(float))
    if expected == 0:
        with pytest.raises(ValueError, match="unit="):
            closest_pair_quartile(gt)
    else:
        assert closest_pair_quartile(gt) == pytest.approx(expected, rel=1e-12)


@given(seed=SEEDS, n=st.integers(4, 60), exponent=st.floats(-9, 9))
def test_d_scales_with_the_ground_truth(seed: int, n: int, exponent: float) -> None:
    """d is a length of the ground truth: scaling, moving and reordering."""
    rng = np.random.default_rng(seed)
    gt = rng.random((n, 3))
    d = closest_pair_quartile(gt)
    scale = 10**exponent
    assert closest_pair_quartile(scale * gt) == pytest.approx(scale * d, rel=1e-12)
    assert closest_pair_quartile(rng.permutation(gt)) == d
    assert closest_pair_quartile(Rotation.random(rng=rng).apply(gt) + 5) == pytest.approx(d)


@both_registrations
@pytest.mark.parametrize(("n", "allowed"), [(4, 2), (8, 5), (9, 6), (30, 22), (100, 74)])
def test_duplicates_in_the_ground_truth(
    registration: str, cloud: Cloud, n: int, allowed: int
) -> None:
    """d exists while fewer than ceil(3n/4) cameras coincide with another one."""
    gt = cloud("cube", n, 0)
    gt[:allowed] = gt[0]
    assert tas(gt, gt, registration=registration).score == 1.0
    gt[allowed] = gt[0]
    with pytest.raises(ValueError, match=r"three quarters.*coincide.*unit="):
        tas(gt, gt, registration=registration)


# --- a perfect estimate -------------------------------------------------------------------------

KINDS = ["cube", "axis", "oblique line", "plane", "oblique plane", "helix", "clusters"]


@both_registrations
@pytest.mark.parametrize("n", [*range(4, 25), 44, 45, 100, 255, 256, 257, 1000])
@pytest.mark.parametrize("kind", KINDS)
def test_perfect_estimate(
    registration: str, cloud: Cloud, another_world: World, kind: str, n: int
) -> None:
    """Exactly 1, with errors at the level of rounding."""
    for seed in range(3):
        gt = cloud(kind, n, seed)
        for est in (gt, another_world(gt, seed)):
            result = tas(gt, est, rng=seed, registration=registration)
            assert result.score == 1.0
            assert result.errors.max() < 1e-6 * result.unit
            assert np.all(result.cumulative_frequency == n)


@both_registrations
@pytest.mark.parametrize("n", [4, 19, 20, 100, 1000])
@pytest.mark.parametrize("kind", KINDS)
def test_perfect_estimate_far_from_the_origin(
    registration: str, cloud: Cloud, another_world: World, kind: str, n: int
) -> None:
    """A world offset of a million units in either world or in both."""
    for seed in range(3):
        gt = cloud(kind, n, seed)
        far = 1e6 * np.random.default_rng(seed).uniform(-1, 1, 3)
        assert (
            tas(gt + far, another_world(gt, seed), rng=seed, registration=registration).score == 1.0
        )
        assert (
            tas(gt, another_world(gt, seed, offset=1e6), rng=seed, registration=registration).score
            == 1.0
        )
        assert (
            tas(
                gt + far,
                another_world(gt + far, seed, offset=1e6),
                rng=seed,
                registration=registration,
            ).score
            == 1.0
        )


@both_registrations
@pytest.mark.parametrize("n", [5, 100])
@pytest.mark.parametrize("gt_scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("est_scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("kind", KINDS)
def test_perfect_estimate_at_any_scale(
    registration: str,
    cloud: Cloud,
    another_world: World,
    kind: str,
    est_scale: float,
    gt_scale: float,
    n: int,
) -> None:
    """Nanometres against light seconds, and back."""
    gt = cloud(kind, n, 3)
    result = tas(
        gt_scale * gt, another_world(gt, 3, scale=est_scale), rng=3, registration=registration
    )
    assert result.score == 1.0
    assert result.alignment is not None
    assert result.alignment.scale == pytest.approx(est_scale / gt_scale, rel=1e-6)


@both_registrations
@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1e-80, 1e160, 1e200, 1e300])
@pytest.mark.parametrize("which", ["gt", "est", "both"])
@pytest.mark.parametrize("kind", ["cube", "axis"])
def test_perfect_estimate_at_absurd_scales(
    registration: str, cloud: Cloud, kind: str, which: str, scale: float
) -> None:
    """Where squares of coordinates under- or overflow."""
    gt = cloud(kind, 30, 0) / 30
    a = gt * scale if which != "est" else gt
    b = gt * scale if which != "gt" else gt
    assert tas(a, b, registration=registration).score == 1.0


@both_registrations
@pytest.mark.parametrize("n", [8, 16, 50, 100, 400])
@pytest.mark.parametrize("offset", [0.0, 100.0, 1e6])
def test_perfect_estimate_of_a_partly_straight_path(
    registration: str, cloud: Cloud, another_world: World, n: int, offset: float
) -> None:
    """Three cameras on the straight half tell nothing about the spin around it."""
    scores = []
    for seed in range(40):
        gt = cloud("straight then bend", n, seed)
        gt += offset * np.random.default_rng(seed).uniform(-1, 1, 3)
        scores.append(tas(gt, another_world(gt, seed), rng=seed, registration=registration).score)
    assert scores == [1.0] * 40


@both_registrations
def test_perfect_estimate_of_single_precision(
    registration: str, cloud: Cloud, another_world: World
) -> None:
    """Rounded to 32 bits the errors are far below the first threshold."""
    gt = cloud("cube", 100, 0)
    est = another_world(gt, 0).astype(np.float32)
    assert tas(gt.astype(np.float32), est, registration=registration).score == 1.0


# --- errors and thresholds ----------------------------------------------------------------------


def aligned(result: TASResult) -> tuple[float, Floats, Floats]:
    assert result.alignment is not None
    return result.alignment.scale, result.alignment.rotation, result.alignment.translation


@both_registrations
@given(seed=SEEDS, n=st.integers(4, 40), sigma=st.floats(0, 0.3))
def test_result_is_consistent(
    registration: str, noisy_scene: Scene, seed: int, n: int, sigma: float
) -> None:
    """Errors, thresholds, counts and score follow from the alignment by their definitions."""
    gt, est = noisy_scene(n, n // 5, sigma, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        result = tas(gt, est, rng=seed, registration=registration)
    np.testing.assert_allclose(result.thresholds, result.unit * np.arange(1, 101) / 100, rtol=1e-12)
    if result.alignment is None:
        assert np.isinf(result.errors).all()
    else:
        s, R, t = aligned(result)
        assert s > 0
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(R) == pytest.approx(1)
        for e, c, c_hat in zip(result.errors, gt, est, strict=True):
            assert e == pytest.approx(math.dist((c_hat - t) / s, R @ c), rel=1e-9, abs=1e-9)
        predicted = [s * R @ c + t for c in gt]
        np.testing.assert_allclose(result.alignment.apply(gt), predicted, atol=1e-9)
    counts = [sum(bool(e < t) for e in result.errors) for t in result.thresholds]
    assert result.cumulative_frequency.tolist() == counts
    per_camera = [sum(bool(e < t) for t in result.thresholds) / 100 for e in result.errors]
    assert result.score == pytest.approx(sum(per_camera) / n, abs=1e-12)
    assert 0 <= result.score <= 1
    assert float(result) == result.score


def test_errors_are_in_ground_truth_units(cloud: Cloud) -> None:
    """A camera that is 3 estimated units off is 0.3 ground-truth units off at scale 10."""
    gt = cloud("cube", 50, 0)
    est = 10 * gt + [100, 200, 300]
    est[7] += [0, 3, 0]
    result = tas(gt, est)
    s, R, t = aligned(result)
    assert s == pytest.approx(10)
    np.testing.assert_allclose(R, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(t, [100, 200, 300])
    np.testing.assert_allclose(result.errors, np.where(np.arange(50) == 7, 0.3, 0), atol=1e-9)
    assert result.alignment is not None
    np.testing.assert_allclose(result.alignment.apply(gt)[:7], est[:7])


@pytest.mark.parametrize(("distance", "share"), [(0.005, 1), (0.255, 0.75), (0.995, 0.01), (2, 0)])
def test_score_of_one_displaced_camera(distance: float, share: float) -> None:
    """A camera off by 0.255 d counts below 75 of the 100 thresholds, beyond d below none."""
    gt = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)  # d = 1
    est = gt.copy()
    est[20] += distance * np.array([0.6, 0.0, 0.8])
    assert tas(gt, est).score == pytest.approx((63 + share) / 64, abs=1e-12)


def test_thresholds_are_options(noisy_scene: Scene) -> None:
    """max_threshold is in units of d, unit replaces d, n_thresholds is their number."""
    gt, est = noisy_scene(100, 30, 0.03, 0)
    d = closest_pair_quartile(gt)
    default = tas(gt, est)
    wide = tas(gt, est, max_threshold=2, n_thresholds=200)
    np.testing.assert_allclose(wide.thresholds[:100], default.thresholds, rtol=1e-12)
    np.testing.assert_array_equal(wide.cumulative_frequency[:100], default.cumulative_frequency)
    assert wide.thresholds[-1] == pytest.approx(2 * d)

    by_hand = tas(gt, est, unit=2 * d)
    assert by_hand.unit == 2 * d
    np.testing.assert_allclose(by_hand.thresholds, 2 * default.thresholds, rtol=1e-12)
    assert by_hand.score == tas(gt, est, max_threshold=2).score > default.score

    single = tas(gt, est, n_thresholds=1)
    assert single.score == np.mean(default.errors < d)


def test_the_smaller_error_decides_not_its_place() -> None:
    """d comes from the ground truth alone, errors of outliers do not change it."""
    gt = np.random.default_rng(0).random((40, 3))
    est = gt.copy()
    est[:20] = 1e3 * np.random.default_rng(1).random((20, 3))
    result = tas(gt, est)
    assert result.unit == tas(gt, gt).unit
    assert result.score == 0.5


# --- m, the rank of the cost --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "m"), [(10, 4), (34, 4), (44, 4), (45, 5), (54, 5), (55, 6), (64, 6), (65, 7), (74, 7)]
)
@pytest.mark.parametrize("lost", [0, 2])
def test_m(n: int, m: int, lost: int) -> None:
    """m = max(4, round(n/10)) with halves up, of all n cameras, the lost ones too.

    k cameras fit a wrong similarity exactly, the others the right one with noise: the wrong one
    wins if and only if m <= k. With all triplets enumerated, nothing is random.
    """
    rng = np.random.default_rng(n)
    gt = rng.random((n, 3))
    for k in (m - 1, m):
        est = gt + rng.normal(0, 0.003, (n, 3))
        est[:k] = 9 * gt[:k] @ Rotation.from_euler("y", 80, degrees=True).as_matrix().T
        est[n - lost :] = np.nan
        s, _, _ = aligned(tas(gt, est, n_hypotheses=math.comb(n, 3)))
        assert s == pytest.approx(9 if k == m else 1, rel=0.1)


# --- lost cameras -------------------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("lost", [1, 10, 90, 96])
def test_lost_cameras_count(
    registration: str, cloud: Cloud, another_world: World, lost: int, value: float
) -> None:
    """A row that is not finite fails, the others are aligned without it: a perfect rest."""
    gt = cloud("cube", 100, 1)
    est = another_world(gt, 1)
    rows = np.random.default_rng(0).permutation(100)[:lost]
    est[rows, rows % 3] = value  # one coordinate is enough
    result = tas(gt, est, registration=registration)
    assert result.score == (100 - lost) / 100
    assert np.all(np.isinf(result.errors) == np.isin(np.arange(100), rows))


@given(seed=SEEDS, lost=st.integers(0, 59))
def test_losing_cameras_at_a_fixed_alignment(noisy_scene: Scene, seed: int, lost: int) -> None:
    """Strictly: with the alignment as it was, the score falls by the share of the lost camera."""
    gt, est = noisy_scene(60, 10, 0.02, seed)
    before = tas(gt, est)
    errors = before.errors.copy()
    errors[lost] = np.inf
    after = AlignmentScore(errors, before.thresholds)
    share = np.mean(before.errors[lost] < before.thresholds) / 60
    assert after.score == pytest.approx(before.score - share, abs=1e-12)
    assert after.score <= before.score


@given(seed=SEEDS, n=st.integers(6, 19))
def test_losing_a_bad_camera_of_few(noisy_scene: Scene, seed: int, n: int) -> None:
    """Strictly, where all triplets are enumerated and the lost camera is beyond the m-th error.

    The other hypotheses' costs cannot fall, and the winner, unless the camera is one of its three,
    keeps its own. (In general another winner, with a larger cost, may have the higher score.)
    """
    gt, est = noisy_scene(n, 1, 0.01, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        before = tas(gt, est)
    worst = int(np.argmax(before.errors))
    assume(before.alignment is not None)
    assume(before.errors[worst] > before.unit)  # clearly an outlier, no corner of the winner
    est[worst] = np.nan
    after = tas(gt, est)
    assert after.score == before.score
    np.testing.assert_allclose(np.delete(after.errors - before.errors, worst), 0, atol=1e-9)


def test_losing_cameras_up_to_sampling(noisy_scene: Scene) -> None:
    """In general only means over seeds compare: good cameras that are lost cost their share."""
    gt, est = noisy_scene(100, 30, 0.03, 0)
    lost = est.copy()
    lost[:20] = np.nan
    before = np.array([tas(gt, est, rng=seed).score for seed in range(60)])
    after = np.array([tas(gt, lost, rng=seed).score for seed in range(60)])
    error = np.hypot(before.std(), after.std()) / np.sqrt(60)
    assert after.mean() + 5 * error < before.mean()
    assert after.mean() == pytest.approx(before.mean() * 50 / 70, abs=0.02)


@both_registrations
@pytest.mark.parametrize("n", [30, 100])
def test_fewer_cameras_than_m(registration: str, cloud: Cloud, n: int) -> None:
    """Three to m estimated cameras: aligned by them alone."""
    gt = cloud("cube", n, 0)
    for left in (3, 4, 5, 9):
        est = np.full((n, 3), np.nan)
        est[:left] = 2 * gt[:left] + 1
        assert tas(gt, est, registration=registration).score == left / n


@pytest.mark.parametrize("seed", range(5))
def test_fewer_noisy_cameras_than_m(noisy_scene: Scene, seed: int) -> None:
    """Then the cost is the largest of their errors: m = 10 of 100 cameras, 6 of them estimated."""
    gt, est = noisy_scene(100, 0, 0.02, seed)
    est[6:] = np.nan
    result = tas(gt, est)
    expected, _ = pcr99(gt[:6], est[:6], rank=6, n_hypotheses=1000, rng=np.random.default_rng(0))
    assert expected is not None
    errors = expected.position_errors(gt[:6], est[:6])
    np.testing.assert_allclose(result.errors[:6], errors, rtol=1e-6, atol=1e-9)


# --- invariance -----------------------------------------------------------------------------------


@both_registrations
@given(seed=SEEDS, n=st.integers(4, 300), exponent=st.floats(-6, 6), offset=st.floats(0, 1000))
def test_similarity_of_the_estimate_changes_nothing(
    registration: str,
    noisy_scene: Scene,
    another_world: World,
    seed: int,
    n: int,
    exponent: float,
    offset: float,
) -> None:
    """The same seed draws the same triplets, so that the very same hypothesis wins."""
    gt, est = noisy_scene(n, n // 4, 0.02, seed)
    moved = another_world(est, seed + 1, scale=10**exponent, offset=offset)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        a, b = (
            tas(gt, est, rng=seed, registration=registration),
            tas(gt, moved, rng=seed, registration=registration),
        )
    assert a.n_hypotheses == b.n_hypotheses
    assert a.score == pytest.approx(b.score, abs=1e-12)
    np.testing.assert_allclose(a.errors, b.errors, rtol=1e-6, atol=1e-7)


@both_registrations
@pytest.mark.parametrize("kind", ["cube", "axis", "straight then bend"])
@pytest.mark.parametrize("n", [15, 100, 300])
def test_origin_of_either_world_changes_nothing(
    registration: str, cloud: Cloud, kind: str, n: int
) -> None:
    """A million units away the same hypothesis wins, flat or not, with the same errors."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        gt = cloud(kind, n, seed)
        noise = rng.normal(0, 0.001, gt.shape)
        noise[n // 2 :] *= 10  # off the straight half: there a flat triangle may be the cheapest
        est = gt + noise
        expected = tas(gt, est, rng=seed, registration=registration)
        for gt_origin, est_origin in ((1e6, 0), (0, 1e6), (1e6, -1e6)):
            result = tas(gt + gt_origin, est + est_origin, rng=seed, registration=registration)
            np.testing.assert_allclose(result.errors, expected.errors, rtol=0, atol=1e-6)
            assert result.n_hypotheses == expected.n_hypotheses
            assert result.unit == pytest.approx(expected.unit, rel=1e-6)


@both_registrations
@given(seed=SEEDS, n=st.integers(4, 19), exponent=st.floats(-6, 6))
def test_similarity_of_the_ground_truth_scales_the_errors(
    registration: str, noisy_scene: Scene, another_world: World, seed: int, n: int, exponent: float
) -> None:
    """Errors and d are lengths of the ground truth, the score is their ratio."""
    gt, est = noisy_scene(n, 1, 0.02, seed)
    scale = 10**exponent
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        a, b = (
            tas(gt, est, registration=registration),
            tas(another_world(gt, seed + 2, scale=scale), est, registration=registration),
        )
    assert a.score == pytest.approx(b.score, abs=1e-12)
    np.testing.assert_allclose(scale * a.errors, b.errors, rtol=1e-6, atol=1e-7 * scale)
    assert scale * a.unit == pytest.approx(b.unit, rel=1e-9)


@given(seed=SEEDS, n=st.integers(4, 19))
def test_order_of_few_cameras_changes_nothing(noisy_scene: Scene, seed: int, n: int) -> None:
    """Up to 19 cameras all triplets are used: TAS is that of the set of cameras, whatever rng."""
    gt, est = noisy_scene(n, n // 5, 0.02, seed)
    order = np.random.default_rng(seed).permutation(n)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        a, b = tas(gt, est, rng=1), tas(gt[order], est[order], rng=2)
    assert a.n_hypotheses == b.n_hypotheses
    assert a.score == pytest.approx(b.score, abs=1e-12)
    np.testing.assert_allclose(a.errors[order], b.errors, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("n", [20, 100, 300])
def test_order_of_many_cameras_changes_nothing_in_the_mean(noisy_scene: Scene, n: int) -> None:
    """Beyond, up to the sampling of triplets: the first cameras are not preferred."""
    gt, est = noisy_scene(n, 2 * n // 5, 0.02, 0)
    for order in (np.arange(n)[::-1], np.random.default_rng(0).permutation(n)):
        a = np.array([tas(gt, est, rng=seed).score for seed in range(60)])
        b = np.array([tas(gt[order], est[order], rng=seed).score for seed in range(60)])
        error = np.hypot(a.std(), b.std()) / np.sqrt(60)
        assert abs(a.mean() - b.mean()) < 4.5 * error + 1e-3


# --- randomness -----------------------------------------------------------------------------------


def same(a: TASResult, b: TASResult) -> bool:
    """Bit for bit."""
    equal = a.score == b.score and a.unit == b.unit and a.n_hypotheses == b.n_hypotheses
    for x, y in zip(aligned(a), aligned(b), strict=True):
        equal &= np.asarray(x).tobytes() == np.asarray(y).tobytes()
    return equal and a.errors.tobytes() == b.errors.tobytes()


@pytest.mark.parametrize("n", [15, 100, 500])
def test_same_rng_same_answer(noisy_scene: Scene, n: int) -> None:
    """An int, the equal SeedSequence and the equal Generator give the same bits, every time."""
    gt, est = noisy_scene(n, n // 4, 0.05, 1)
    first = tas(gt, est, rng=42)
    assert same(first, tas(gt, est, rng=42))
    assert same(first, tas(gt.copy(), est.copy(), rng=np.int64(42)))
    assert same(first, tas(gt, est, rng=np.random.SeedSequence(42)))
    assert same(first, tas(gt, est, rng=np.random.default_rng(42)))
    assert same(tas(gt, est), tas(gt, est, rng=0))


def test_other_rng_other_sample(noisy_scene: Scene) -> None:
    """Seeds matter from 20 cameras on, and a Generator moves on."""
    gt, est = noisy_scene(100, 30, 0.03, 1)
    assert len({tas(gt, est, rng=seed).score for seed in range(10)}) > 1
    assert len({tas(gt, est, rng=None).score for _ in range(10)}) > 1
    generator = np.random.default_rng(0)
    assert len({tas(gt, est, rng=generator).score for _ in range(10)}) > 1


def test_global_random_state_is_left_alone(noisy_scene: Scene) -> None:
    """No legacy global generator is used or seeded."""
    gt, est = noisy_scene(100, 30, 0.03, 1)
    before = np.random.get_state()[1].tobytes()  # noqa: NPY002
    tas(gt, est)
    assert np.random.get_state()[1].tobytes() == before  # noqa: NPY002


@pytest.mark.parametrize("asked", [1, 10, 999, 1140])
def test_number_of_hypotheses_is_reported(noisy_scene: Scene, asked: int) -> None:
    """As many as asked for, or three for every triplet that passes where all are used."""
    gt, est = noisy_scene(20, 0, 1e-6, 0)
    assert tas(gt, est, n_hypotheses=asked).n_hypotheses == (asked if asked < 1140 else 3 * 1140)


@both_registrations
def test_registration_is_named(registration: str, noisy_scene: Scene) -> None:
    """In the result; the default is the paper's."""
    gt, est = noisy_scene(50, 5, 0.03, 1)
    result = tas(gt, est, registration=registration)
    assert result.registration == registration
    assert f"registration='{registration}'" in repr(result)
    assert same(tas(gt, est), result) == (registration == "pcr99")


def test_registration_of_ones_own(noisy_scene: Scene) -> None:
    """It sees the estimated cameras near the origin and the settings in that unit."""
    gt, est = noisy_scene(60, 5, 0.03, 1)
    est[50:] = np.nan
    calls: list[dict[str, Any]] = []

    def least_squares(
        gt_positions: Floats, est_positions: Floats, **settings: Any
    ) -> tuple[Similarity, int]:
        calls.append(settings | {"gt": gt_positions, "est": est_positions})
        return Similarity.fit(gt_positions, est_positions), 7

    result = tas(1e6 + 1e3 * gt, est, registration=least_squares, max_threshold=2, n_hypotheses=5)
    (call,) = calls
    assert sorted(call) == ["est", "gt", "n_hypotheses", "rank", "rng", "threshold"]
    assert call["gt"].shape == call["est"].shape == (50, 3)
    assert np.abs(np.median(call["gt"], axis=0)).max() < 0.5
    unit = 1e3 * np.ptp(gt[:50, 0]) / np.ptp(call["gt"][:, 0])
    assert call["threshold"] == pytest.approx(2 * result.unit / unit)
    assert (call["rank"], call["n_hypotheses"]) == (6, 5)
    assert isinstance(call["rng"], np.random.Generator)

    assert result.registration == "least_squares"
    assert result.n_hypotheses == 7
    expected = Similarity.fit(gt[:50], est[:50])
    errors = 1e3 * expected.position_errors(gt[:50], est[:50])
    np.testing.assert_allclose(result.errors[:50], errors, rtol=1e-6)
    assert np.isinf(result.errors[50:]).all()


def test_registration_of_ones_own_that_finds_nothing(noisy_scene: Scene) -> None:
    """None is no alignment: a score of 0 with the usual warning."""
    with pytest.warns(AlignmentWarning, match="TAS is 0"):
        result = tas(*noisy_scene(20, 5, 0.03, 1), registration=lambda *_, **__: (None, 3))
    assert (result.score, result.alignment, result.n_hypotheses) == (0, None, 3)


@pytest.mark.parametrize(
    "returned", [None, np.eye(4), np.eye(2), (1, 2, 3), (None, "x"), (np.eye(4), 3)]
)
def test_registration_of_ones_own_that_returns_something_else(
    noisy_scene: Scene, returned: Any
) -> None:
    with pytest.raises(TypeError, match="registration must return a Similarity or None and the"):
        tas(*noisy_scene(20, 5, 0.03, 1), registration=lambda *_, **__: returned)


@pytest.mark.parametrize("n", [8, 50, 128])
@pytest.mark.parametrize("copies", [1, 2])
def test_closest_distances_with_and_without_a_tree(
    monkeypatch: pytest.MonkeyPatch, n: int, copies: int
) -> None:
    """The same d, bit for bit, whichever way the closest cameras are found."""
    for seed in range(20):
        gt = np.random.default_rng(seed).normal(size=(n // copies, 3))
        gt = np.concatenate([gt, gt[: n // 4 * (copies - 1)]])
        few = closest_pair_quartile(gt)
        with monkeypatch.context() as patch:
            patch.setattr(translation, "FEW", 0)
            assert closest_pair_quartile(gt) == few
