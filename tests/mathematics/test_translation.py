"""TAS: the unit d, the perfect score, errors and thresholds, m, missing cameras, degeneracy."""

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, Similarity, closest_pair_quartile, tas, tas_distance
from alignscores.io import read_colmap

both_registrations = pytest.mark.parametrize("registration", ["pcr99", "refined"])
ignores_alignment = pytest.mark.filterwarnings("ignore::alignscores.AlignmentWarning")
SEEDS = st.integers(0, 10_000)
SHAPES = ["cube", "axis", "oblique line", "plane", "oblique plane", "helix", "clusters"]


def unaligned(gt, est, **options):
    """Score an estimate that cannot be aligned: 0, with one warning that points here."""
    with pytest.warns(AlignmentWarning, match="TAS is 0: the estimate cannot be aligned") as caught:
        result = tas(gt, est, **options)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert (result.score, result.alignment, result.n_hypotheses) == (0, None, 0)
    assert np.isinf(result.errors).all()
    assert np.all(result.cumulative_frequency == 0)
    assert len(result.thresholds) == 100


# --- the unit d ---------------------------------------------------------------------------------


def naive_d(gt):
    """The rank-th of the sorted closest-neighbour distances, with exact arithmetic for the rank."""
    closest = sorted(
        min(math.dist(a, b) for j, b in enumerate(gt) if j != i) for i, a in enumerate(gt)
    )
    return closest[math.ceil(Fraction(3, 4) * len(gt)) - 1]


@pytest.mark.parametrize("n", [*range(4, 30), 100, 101, 102, 103])
def test_d_is_an_order_statistic(cloud, n):
    """d against sorted distances, for every remainder of n modulo 4."""
    for shape in ("cube", "helix", "clusters", "oblique line"):
        gt = cloud(shape, n, 7)
        assert closest_pair_quartile(gt) == pytest.approx(naive_d(gt), rel=1e-12)
        assert tas(gt, gt).unit == closest_pair_quartile(gt)


@given(gt=arrays(np.int64, st.tuples(st.integers(4, 15), st.just(3)), elements=st.integers(-4, 4)))
def test_d_with_ties_and_duplicates(gt):
    """On a coarse grid many distances tie or vanish: d is still that rank, or there is none."""
    expected = naive_d(gt.astype(float))
    if expected == 0:
        with pytest.raises(ValueError, match="unit="):
            closest_pair_quartile(gt)
    else:
        assert closest_pair_quartile(gt) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("jitter", [0.0, 1e-16, 1e-11])
def test_a_d_of_rounding_is_refused(jitter):
    """Six cameras in one place each, as of a cubemap: d is no spacing."""
    positions = np.repeat(np.random.default_rng(0).random((20, 3)), 6, axis=0)
    gt = 100 * positions + jitter * np.random.default_rng(1).normal(size=(120, 3))
    for score in (closest_pair_quartile, lambda gt: tas(gt, gt)):
        with pytest.raises(ValueError, match=r"coincide with another one; pass groups= .* or pass"):
            score(gt)
    spacing = closest_pair_quartile(100 * positions[::6])
    assert closest_pair_quartile(gt, groups=np.repeat(range(20), 6)) == pytest.approx(spacing)


@given(seed=SEEDS, n=st.integers(4, 200), n_groups=st.integers(4, 80))
def test_rows_of_one_group_are_one_camera(seed, n, n_groups):
    """At their mean position, whatever the order of the rows and the kind of the labels."""
    rng = np.random.default_rng(seed)
    gt, groups = rng.random((n, 3)), rng.integers(n_groups, size=n)
    groups[:4] = range(4)
    expected = naive_d([gt[groups == group].mean(axis=0) for group in np.unique(groups)])
    names = [f"frame {group}" for group in groups]
    assert closest_pair_quartile(gt, groups=names) == pytest.approx(expected, rel=1e-12)
    order = rng.permutation(n)
    unit = tas(gt[order], gt[order], groups=groups[order]).unit
    assert unit == pytest.approx(expected, rel=1e-12)
    assert closest_pair_quartile(gt, groups=range(n)) == closest_pair_quartile(gt)


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        (
            [0, 1, 2],
            r"groups must have a label for each of the 10 rows of gt_positions, not \(3,\)",
        ),
        (np.zeros((10, 1)), "groups must have a label for each"),
        ([*range(9), np.nan], r"groups\[9\] is NaN"),
        ([*range(9), None], "groups must be labels of one kind"),
        (5 * ["a", "b"], "at least 4 ground-truth rig frames .* there are 2"),
    ],
)
def test_wrong_groups(cloud, groups, message):
    gt = cloud("cube", 10, 0)
    with pytest.raises(ValueError, match=message):
        tas(gt, gt, groups=groups)


@pytest.mark.parametrize("rig", ["mono", "stereo_.12", "four_.05", "cubemap_0"])
def test_d_of_camera_rigs_is_the_spacing_of_the_path(rig):
    """One path and its errors with 1, 2, 4 and 6 cameras a position; images of one name belong."""
    folder = Path(__file__).resolve().parents[3] / "shared" / "cases" / "46-camera-rigs" / rig
    if not folder.is_dir():
        pytest.skip(f"no camera rigs at {folder}")
    gt, est = (read_colmap(folder / name) for name in ("ref", "est"))
    assert list(gt.keys) == list(est.keys)
    frames = [Path(name).name for name in gt.keys]
    result = tas(
        *(trajectory.poses[:, :3, 3] for trajectory in (gt, est)),
        groups=frames,
        registration="refined",
    )
    assert result.unit == pytest.approx(1.06, abs=0.005)
    assert result.score == pytest.approx(0.70, abs=0.015)


@both_registrations
@pytest.mark.parametrize("n", [1, 2, 3])
def test_fewer_than_four_cameras(registration, cloud, n):
    """No d, unless it is given; three cameras can be aligned then, fewer cannot."""
    gt = cloud("cube", n, 0)
    with pytest.raises(ValueError, match=rf"at least 4 .* there are {n}.*unit="):
        tas(gt, gt, registration=registration)
    if n == 3:
        result = tas(gt, 2 * gt, unit=0.1, registration=registration)
        assert (result.score, result.unit) == (1.0, 0.1)
    else:
        unaligned(gt, gt, unit=0.1, registration=registration)


# --- a perfect estimate -------------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("shape", SHAPES)
def test_perfect_estimate(registration, cloud, another_world, shape):
    """Exactly 1, with errors at the level of rounding, for every number of cameras."""
    for n in (*range(4, 25), 44, 45, 100, 129, 257, 1000):
        for seed in range(1 if n == 1000 else 2):
            gt = cloud(shape, n, seed)
            for est in (gt, another_world(gt, seed)):
                result = tas(gt, est, rng=seed, registration=registration)
                assert result.score == 1.0
                assert result.errors.max() < 1e-6 * result.unit
                assert np.all(result.cumulative_frequency == n)


@both_registrations
@pytest.mark.parametrize("n", [8, 16, 50, 100, 400])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_perfect_estimate_of_a_partly_straight_path(registration, cloud, another_world, n, offset):
    """Three cameras on the straight half do not determine the spin around it."""
    for seed in range(20):
        gt = cloud("straight then bend", n, seed)
        gt += offset * np.random.default_rng(seed).uniform(-1, 1, 3)
        est = another_world(gt, seed)
        assert tas(gt, est, rng=seed, registration=registration).score == 1.0


# --- m, the rank of the cost --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "m"), [(10, 4), (34, 4), (44, 4), (45, 5), (54, 5), (55, 6), (64, 6), (65, 7), (74, 7)]
)
@pytest.mark.parametrize("lost", [0, 2])
def test_hypotheses_are_ranked_by_a_tenth_of_all_cameras(n, m, lost):
    """m = max(4, round(n/10)) with halves up, of all n cameras, those without an estimate too.

    k cameras fit a wrong similarity exactly, the others the right one with noise: the wrong one
    wins if and only if m <= k. With all triplets enumerated, nothing is random.
    """
    rng = np.random.default_rng(n)
    gt = rng.random((n, 3))
    for k in (m - 1, m):
        est = gt + rng.normal(0, 0.003, (n, 3))
        est[:k] = 9 * gt[:k] @ Rotation.from_euler("y", 80, degrees=True).as_matrix().T
        est[n - lost :] = np.nan
        alignment = tas(gt, est, n_hypotheses=math.comb(n, 3)).alignment
        assert alignment.scale == pytest.approx(9 if k == m else 1, rel=0.1)


@both_registrations
def test_the_score_follows_from_the_alignment(registration, noisy_scene):
    """Errors, thresholds and counts by their definitions; options set the thresholds."""
    gt, est = noisy_scene(40, 8, 0.05, 0)
    for options in ({}, {"max_threshold": 2, "n_thresholds": 7}, {"unit": 0.1, "n_thresholds": 1}):
        result = tas(gt, est, registration=registration, **options)
        s, R, t = vars(result.alignment).values()
        assert np.linalg.det(R) == pytest.approx(1)
        errors = np.linalg.norm((est - t) / s - gt @ R.T, axis=1)
        np.testing.assert_allclose(result.errors, errors, rtol=1e-9, atol=1e-9)
        assert result.unit == options.get("unit", closest_pair_quartile(gt))
        number = options.get("n_thresholds", 100)
        steps = np.arange(1, number + 1) / number
        largest = options.get("max_threshold", 1) * result.unit
        np.testing.assert_allclose(result.thresholds, largest * steps, rtol=1e-12)
        counts = (result.errors[:, None] < result.thresholds).sum(axis=0)
        assert result.cumulative_frequency.tolist() == counts.tolist()
        assert result.score == pytest.approx(counts.mean() / 40, abs=1e-12)


# --- cameras without an estimate ------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("lost", [1, 10, 90, 96])
def test_cameras_that_were_not_estimated_fail(registration, cloud, another_world, lost, value):
    """A row that is not finite fails, the others are aligned without it: a perfect rest."""
    gt = cloud("cube", 100, 1)
    est = another_world(gt, 1)
    rows = np.random.default_rng(0).permutation(100)[:lost]
    est[rows, rows % 3] = value  # one coordinate is enough
    result = tas(gt, est, registration=registration)
    assert result.score == (100 - lost) / 100
    assert np.all(np.isinf(result.errors) == np.isin(np.arange(100), rows))


# --- invariance ---------------------------------------------------------------------------------


@ignores_alignment
@both_registrations
@given(seed=SEEDS, n=st.integers(4, 300), exponent=st.floats(-6, 6), offset=st.floats(0, 1000))
def test_a_similarity_of_the_estimate_changes_nothing(
    registration, noisy_scene, another_world, seed, n, exponent, offset
):
    """Nor one of the ground truth, but for the unit of errors and d."""
    gt, est = noisy_scene(n, n // 4, 0.02, seed)
    moved = another_world(est, seed + 1, scale=10**exponent, offset=offset)
    scale = 10**exponent
    a, b, c = (
        tas(*pair, rng=seed, registration=registration)
        for pair in ((gt, est), (gt, moved), (scale * gt, est))
    )
    assert [b.score, c.score] == pytest.approx([a.score, a.score], abs=1e-12)
    np.testing.assert_allclose(a.errors, b.errors, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(scale * a.errors, c.errors, rtol=1e-6, atol=1e-7 * scale)
    assert scale * a.unit == pytest.approx(c.unit, rel=1e-9)


@ignores_alignment
@both_registrations
@given(seed=SEEDS, n=st.integers(4, 19))
def test_order_of_few_cameras_changes_nothing(registration, noisy_scene, seed, n):
    """All triplets are used: neither the order of the cameras nor the seed matters."""
    gt, est = noisy_scene(n, n // 5, 0.02, seed)
    order = np.random.default_rng(seed).permutation(n)
    a = tas(gt, est, rng=1, registration=registration)
    b = tas(gt[order], est[order], rng=2, registration=registration)
    assert a.n_hypotheses == b.n_hypotheses
    exact = registration == "pcr99"
    assert a.score == pytest.approx(b.score, abs=1e-12 if exact else 0.003)
    if exact:
        np.testing.assert_allclose(a.errors[order], b.errors, rtol=1e-6, atol=1e-7)


# --- registrations ------------------------------------------------------------------------------


def test_a_user_supplied_registration(noisy_scene):
    """It sees only the estimated cameras, and its alignment is used."""
    gt, est = noisy_scene(60, 5, 0.03, 1)
    est[50:] = np.nan
    seen = []

    def least_squares(gt_positions, est_positions, **settings):
        seen.append((gt_positions.shape, est_positions.shape, settings["n_hypotheses"]))
        return Similarity.fit(gt_positions, est_positions), 7

    result = tas(gt, est, registration=least_squares, n_hypotheses=5)
    assert seen == [((50, 3), (50, 3), 5)]
    assert (result.registration, result.n_hypotheses) == ("least_squares", 7)
    expected = Similarity.fit(gt[:50], est[:50]).position_errors(gt[:50], est[:50])
    np.testing.assert_allclose(result.errors, [*expected, *[np.inf] * 10], rtol=1e-6)


@pytest.mark.parametrize(
    "returned", [None, np.eye(4), np.eye(2), (1, 2, 3), (None, "x"), (np.eye(4), 3)]
)
def test_a_user_supplied_registration_that_returns_something_else(noisy_scene, returned):
    with pytest.raises(TypeError, match="registration must return a Similarity or None and the"):
        tas(*noisy_scene(20, 5, 0.03, 1), registration=lambda *_, **__: returned)


# --- nothing to align ---------------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("n", [4, 100])
def test_no_triangle(registration, cloud, n):
    """Fewer than three estimated cameras, or either world in one place."""
    gt = cloud("cube", n, 0)
    for finite in (0, 1, 2):
        est = np.full((n, 3), np.nan)
        est[:finite] = gt[:finite]
        unaligned(gt, est, registration=registration)
    unaligned(gt, np.ones((n, 3)), registration=registration)
    unaligned(np.ones((n, 3)), gt, unit=0.1, registration=registration)


# --- outliers of any size -----------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("value", [1e3, -1e15, 1e100, 1e150, -1e200, 1e308, -1.7e308])
def test_one_camera_far_away(registration, cloud, another_world, value):
    """The others still score in full; where squares overflow, without a warning from NumPy."""
    for n in (5, 30, 300):
        for shape in ("cube", "axis"):
            gt = cloud(shape, n, 0)
            est = another_world(gt, 0)
            for axes in (slice(3), 0):  # all coordinates, or one
                far = est.copy()
                far[1, axes] = value
                result = tas(gt, far, registration=registration)
                assert result.score == (n - 1) / n
                if abs(value) > 1e110:
                    assert np.flatnonzero(result.errors > 1e100).tolist() == [1]


@ignores_alignment
@both_registrations
@pytest.mark.parametrize("alignment", ["similarity", "rigid", "yaw", "none"])
@pytest.mark.parametrize("unit", [2.0**-1050, 2.0**998, 2.0**1018])
def test_the_score_does_not_depend_on_the_unit(registration, alignment, cloud, unit):
    """Up to the ends of the number range the score does not depend on the unit."""
    rng = np.random.default_rng(0)
    gt = cloud("cube", 30, 0)
    est = gt + rng.normal(scale=0.05, size=gt.shape)
    est[:6] = rng.uniform(-5, 5, (6, 3))
    settings = {"registration": registration, "alignment": alignment}
    expected, scaled = (tas(u * gt, u * est, **settings) for u in (1, unit))
    assert 0.3 < expected.score < 0.8
    assert scaled.score == pytest.approx(expected.score, abs=0.001)
    if unit > 1:  # smaller distances than the smallest normal number are 0
        distances = [tas_distance(u * gt, u * est, **settings) / u for u in (1, unit)]
        assert distances[1] == pytest.approx(distances[0], rel=1e-3)
    assert 0 <= tas(unit * gt, est, **settings).score <= 1


# --- anything goes ------------------------------------------------------------------------------

VALUES = st.sampled_from(
    [0.0, -0.0, 1.0, 2.0, 3.0, -1.0, 0.5, 1e-9, 1e9, 1e15, 1e-200, 1e200, np.nan, np.inf, -np.inf]
)


@ignores_alignment
@both_registrations
@given(
    n=st.integers(4, 25),
    seed=st.integers(0, 99),
    changes=st.dictionaries(st.integers(0, 24), st.tuples(VALUES, VALUES, VALUES)),
)
def test_any_estimate_has_a_score(registration, cloud, n, seed, changes):
    """Any estimate gets a score from 0 to 1, possibly with our warning, never another one."""
    gt = cloud("cube", n, seed)
    est = 3 * gt
    for row, values in changes.items():
        est[row % n] = values
    result = tas(gt, est, registration=registration)
    assert 0 <= result.score <= 1
    assert not np.isnan(result.errors).any()
    assert np.isinf(result.errors[~np.isfinite(est).all(axis=1)]).all()
    if result.alignment is None:
        assert result.score == 0
        assert result.n_hypotheses == 0
    else:
        assert np.isfinite(result.alignment.scale)
        assert np.isfinite(result.alignment.translation).all()
        np.testing.assert_allclose(np.linalg.det(result.alignment.rotation), 1)


def test_errors_beyond_all_numbers_are_infinite():
    gt = np.random.default_rng(0).normal(size=(40, 3))
    gt[0] = 1e300
    gt[1:] *= 1e-12
    for registration in ("pcr99", "refined"):
        errors = tas(gt, gt, registration=registration, unit=1e-12).errors
        assert errors[0] == np.inf
        assert np.isfinite(errors[1:]).all()
