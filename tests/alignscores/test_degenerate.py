"""Estimates and ground truths that leave little or nothing to align: what design.md decides."""

import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from alignscores import AlignmentWarning, TASResult, tas

Floats = NDArray[np.float64]
Cloud = Callable[[str, int, int], Floats]
World = Callable[..., Floats]

both_registrations = pytest.mark.parametrize("registration", ["pcr99", "refined"])


def unaligned(gt: Floats, est: Floats, **options: Any) -> TASResult:
    """Score an estimate that cannot be aligned: 0, with one warning that points here."""
    with pytest.warns(AlignmentWarning, match="TAS is 0: the estimate cannot be aligned") as caught:
        result = tas(gt, est, **options)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert (result.score, result.alignment, result.n_hypotheses) == (0, None, 0)
    assert np.isinf(result.errors).all()
    assert np.all(result.cumulative_frequency == 0)
    assert len(result.thresholds) == 100
    return result


# --- the ground truth -----------------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("n", [1, 2, 3])
def test_fewer_than_four_cameras(registration: str, cloud: Cloud, n: int) -> None:
    """No d, unless it is given; three cameras can be aligned then, fewer cannot."""
    gt = cloud("cube", n, 0)
    with pytest.raises(ValueError, match=rf"at least 4 .* there are {n}.*unit="):
        tas(gt, gt, registration=registration)
    if n == 3:
        result = tas(gt, 2 * gt, unit=0.1, registration=registration)
        assert result.score == 1.0
        assert result.unit == 0.1
    else:
        unaligned(gt, gt, unit=0.1, registration=registration)


@both_registrations
def test_d_of_zero(registration: str, cloud: Cloud) -> None:
    """Three quarters of the cameras coincide with another one: no d, unless it is given."""
    gt = cloud("cube", 20, 0)
    gt[10:] = gt[:10]
    with pytest.raises(ValueError, match=r"three quarters.*coincide.*unit="):
        tas(gt, gt, registration=registration)
    result = tas(gt, 3 * gt, unit=0.05, registration=registration)
    assert result.score == 1.0
    assert result.unit == 0.05


@both_registrations
def test_ground_truth_in_one_place(registration: str, cloud: Cloud) -> None:
    """With unit= there is a score, but nothing to align."""
    unaligned(np.ones((20, 3)), cloud("cube", 20, 0), unit=0.1, registration=registration)


# --- the estimate ---------------------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("n", [4, 20, 100, 300])
@pytest.mark.parametrize("distinct", [1, 2])
def test_fewer_than_three_distinct_positions(
    registration: str, cloud: Cloud, n: int, distinct: int
) -> None:
    """All estimated positions equal, or two places: no triangle."""
    gt = cloud("cube", n, 0)
    est = np.arange(distinct)[np.arange(n) % distinct][:, None] * np.ones(3) + 5
    unaligned(gt, est, registration=registration)


@both_registrations
@pytest.mark.parametrize("n", [4, 100])
@pytest.mark.parametrize("finite", [0, 1, 2])
def test_fewer_than_three_estimated_cameras(
    registration: str, cloud: Cloud, n: int, finite: int
) -> None:
    gt = cloud("cube", n, 0)
    est = np.full((n, 3), np.nan)
    est[:finite] = gt[:finite]
    unaligned(gt, est, registration=registration)


@both_registrations
def test_no_triplet_passes(registration: str, cloud: Cloud) -> None:
    """Distinct positions that resemble nothing: the draws have a budget, so it ends soon."""
    t = np.arange(100)
    est = np.zeros((100, 3))
    est[:, 2] = 20.0**t  # every triangle much flatter than any of the ground truth's
    start = time.perf_counter()
    unaligned(cloud("helix", 100, 0)[t], est, registration=registration)
    assert time.perf_counter() - start < 10


def test_alignment_warning_is_a_class_of_its_own() -> None:
    """It can be turned into an error, or ignored, without touching other warnings."""
    assert issubclass(AlignmentWarning, UserWarning)
    assert AlignmentWarning is not UserWarning
    with warnings.catch_warnings():
        warnings.simplefilter("error", AlignmentWarning)
        with pytest.raises(AlignmentWarning):
            tas(np.eye(4, 3), np.zeros((4, 3)))


# --- outliers of any size -------------------------------------------------------------------------


@both_registrations
@pytest.mark.parametrize("n", [5, 30, 100, 300])
@pytest.mark.parametrize("value", [1e3, 1e15, -1e15, 1e100, 1e150])
def test_one_camera_far_away(
    registration: str, cloud: Cloud, another_world: World, n: int, value: float
) -> None:
    """The others still score in full."""
    gt = cloud("cube", n, 0)
    est = another_world(gt, 0)
    est[1] = value
    assert tas(gt, est, registration=registration).score == (n - 1) / n


@both_registrations
@pytest.mark.parametrize("value", [1e160, 1e200, -1e200, 1e308, -1.7e308])
@pytest.mark.parametrize("places", [1, 3])
@pytest.mark.parametrize("kind", ["cube", "axis", "start at rest"])
def test_one_camera_absurdly_far_away(
    registration: str, cloud: Cloud, kind: str, value: float, places: int
) -> None:
    """Squares overflow: an error of infinity, and no warning from NumPy."""
    gt = cloud("axis" if kind == "axis" else "cube", 30, 0)
    if kind == "start at rest":
        gt[:16] = gt[0]
    est = 2 * gt
    est[20, :places] = value
    result = tas(gt, est, registration=registration)
    assert result.score == 29 / 30
    assert np.flatnonzero(result.errors > 1e100).tolist() == [20]


@both_registrations
@pytest.mark.parametrize("outliers", [15, 16, 29, 30])
@pytest.mark.parametrize("spread", [False, True])
def test_cameras_at_the_end_of_the_number_range(
    registration: str, cloud: Cloud, outliers: int, spread: bool
) -> None:
    """Sums and differences overflow: a score from 0 to 1, and no warning from NumPy."""
    gt = cloud("cube", 30, 0)
    est = 2 * gt
    est[:outliers] = 1.7e308
    if spread:
        est[:outliers] *= np.random.default_rng(0).uniform(-1, 1, (outliers, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", AlignmentWarning)
        result = tas(gt, est, registration=registration)
    assert 0 <= result.score <= 1
    assert not np.isnan(result.errors).any()


@both_registrations
@pytest.mark.parametrize(
    ("outliers", "distance"),
    # With half of the cameras at 1e15 the origin lies there, where a double resolves 0.1 units.
    [
        (n, far)
        for n in (10, 49, 50, 51, 80)
        for far in (1e3, 1e6, 1e9, 1e15)
        if n < 50 or far < 1e15
    ],
)
@pytest.mark.parametrize("place", ["one place", "one side"])
def test_many_cameras_far_away(
    registration: str,
    cloud: Cloud,
    another_world: World,
    outliers: int,
    distance: float,
    place: str,
) -> None:
    """Half of the trajectory diverged: the rest scores in full, as with outliers nearby."""
    gt = cloud("cube", 100, 0)
    est = another_world(gt, 0)
    est[:outliers] = distance
    if place == "one side":
        est[:outliers] *= np.random.default_rng(0).random((outliers, 3))
    assert tas(gt, est, registration=registration).score == (100 - outliers) / 100


@both_registrations
@pytest.mark.parametrize("outliers", [30, 60])
@pytest.mark.parametrize("distance", [1e4, 1e7, 1e10])
def test_cameras_far_away_do_not_blur_the_others(
    registration: str, cloud: Cloud, outliers: int, distance: float
) -> None:
    """With noise the hypotheses differ: the best is found whatever the size of the outliers."""
    gt = cloud("cube", 100, 0)
    rng = np.random.default_rng(0)
    est = gt + rng.normal(0, 0.01, gt.shape)
    est[:outliers] = 10 * rng.random((outliers, 3))
    far = est.copy()
    far[:outliers] *= distance / 10
    near_scores = [tas(gt, est, rng=seed, registration=registration).score for seed in range(20)]
    far_scores = [tas(gt, far, rng=seed, registration=registration).score for seed in range(20)]
    assert np.mean(far_scores) == pytest.approx(np.mean(near_scores), abs=0.01)


@both_registrations
@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1e9, 1e150])
def test_outliers_do_not_hide_the_scale(registration: str, cloud: Cloud, scale: float) -> None:
    """The prescreen works on ratios: very small and very large estimates."""
    gt = cloud("cube", 50, 0)
    est = scale * gt
    est[30:] = 10 * scale * np.random.default_rng(0).random((20, 3))
    assert tas(gt, est, registration=registration).score == pytest.approx(0.6, abs=0.01)


# --- anything goes --------------------------------------------------------------------------------

WILD = st.sampled_from(
    [0.0, -0.0, 1.0, 2.0, 3.0, -1.0, 0.5, 1e-9, 1e9, 1e15, 1e-200, 1e200, np.nan, np.inf, -np.inf]
)


@both_registrations
@given(
    n=st.integers(4, 25),
    seed=st.integers(0, 99),
    wild=st.dictionaries(st.integers(0, 24), st.tuples(WILD, WILD, WILD)),
)
def test_wild_estimates(
    registration: str, cloud: Cloud, n: int, seed: int, wild: dict[int, tuple[float, ...]]
) -> None:
    """Any estimate gets a score from 0 to 1, possibly with our warning, never another one."""
    gt = cloud("cube", n, seed)
    est = 3 * gt
    for row, values in wild.items():
        est[row % n] = values
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", AlignmentWarning)
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


@given(
    rows=st.lists(st.tuples(*[st.sampled_from([0.0, 1.0, 2.0, 4.0])] * 3), min_size=4, max_size=30),
    seed=st.integers(0, 99),
)
def test_coarse_ground_truth(rows: list[tuple[float, ...]], seed: int) -> None:
    """Duplicates, lines, planes and symmetric solids: a score, or the error about d."""
    gt = np.array(rows)
    est = gt + np.random.default_rng(seed).normal(0, 0.01, gt.shape)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", AlignmentWarning)
        try:
            result = tas(gt, est)
        except ValueError as error:
            assert "unit=" in str(error)  # noqa: PT017
        else:
            assert 0 <= result.score <= 1
            assert not np.isnan(result.errors).any()
