"""Malformed input: a ValueError that names the argument, the row and the reason."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import closest_pair_quartile, nearest_rotations, pas, ras, tas

RNG = np.random.default_rng(0)
POSITIONS = RNG.random((20, 3))
ROTATIONS = Rotation.random(20, rng=RNG).as_matrix()
POSES = np.concatenate([ROTATIONS, POSITIONS[:, :, None]], axis=2)
SCORES = {"positions": (tas, POSITIONS), "rotations": (ras, ROTATIONS), "poses": (pas, POSES)}
each_score = pytest.mark.parametrize("what", SCORES)


def refused(what, bad, reason, *, other=None):
    """Assert that either argument is refused, by its name and the reason."""
    score, good = SCORES[what]
    other = good if other is None else other
    with pytest.raises(ValueError, match=rf"^gt_{what}{reason}"):
        score(bad, other)
    with pytest.raises(ValueError, match=rf"^est_{what}{reason}"):
        score(other, bad)


@each_score
@pytest.mark.parametrize(
    "convert",
    [
        lambda values: values.astype(object),
        lambda values: values.astype(complex),
        lambda values: values.astype(str),
        lambda values: values > 0.5,
        lambda values: None,
        lambda values: {"x": 1},
        lambda values: np.zeros(values.shape, dtype="datetime64[s]"),
        lambda values: [[0.0, None, 1.0]] * 20,
        lambda values: [[10**30, 0, 0]] * 20,
    ],
)
def test_not_real_numbers(what, convert):
    """Nothing is converted that is not a real number to begin with."""
    refused(what, convert(SCORES[what][1]), " must hold real numbers")


@each_score
def test_wrong_shapes(what):
    good = SCORES[what][1]
    shapes = [(), (3,), (20, 2), good.shape[1:], (1, *good.shape), (20, 5, 5), (*good.shape, 1)]
    for shape in shapes:
        refused(what, np.ones(shape), r" must have shape \(n, ")
    refused(what, [[0.0, 0.0, 0.0], [1.0, 0.0]], " is not a regular array")
    with pytest.raises(ValueError, match=f"gt_{what} has 20 .*est_{what} has 19"):
        SCORES[what][0](good, good[:19])
    with pytest.raises(ValueError, match=f"^gt_{what} has no cameras"):
        SCORES[what][0](good[:0], good[:0])


@each_score
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_ground_truth_that_is_not_finite(what, value):
    """The first such row is named."""
    score, good = SCORES[what]
    bad = good.copy()
    bad[7:].reshape(13, -1)[:, 1] = value
    with pytest.raises(ValueError, match=rf"^gt_{what}\[7\] is not finite"):
        score(bad, good)


def shear(amount):
    matrix = np.eye(3)
    matrix[0, 1] = amount
    return matrix


@pytest.mark.parametrize(
    ("matrix", "reason"),
    [
        (2 * np.eye(3), r".*R\^T R differs from the identity"),
        (np.zeros((3, 3)), r".*R\^T R differs"),
        (np.diag([1.0, 1.0, -1.0]), ".*a reflection"),
        (-np.eye(3), ".*a reflection"),
        ((1 + 1e-5) * np.eye(3), r".*R\^T R differs"),
        (shear(1e-5), r".*R\^T R differs"),
        (1e200 * np.eye(3), r".*R\^T R differs"),
        (1e-200 * np.eye(3), r".*R\^T R differs"),
    ],
)
@pytest.mark.parametrize("what", ["rotations", "poses"])
def test_matrices_that_are_no_rotations(what, matrix, reason):
    """In either argument, also next to a camera without an estimate."""
    bad = SCORES[what][1].copy()
    bad[5, :, :3] = bad[5, :, :3] @ matrix
    refused(what, bad, rf"\[5\] is not a rotation: {reason}")
    bad[2] = np.nan
    with pytest.raises(ValueError, match=rf"^est_{what}\[5\] is not a rotation"):
        SCORES[what][0](SCORES[what][1], bad)


@pytest.mark.parametrize("matrix", [(1 + 1e-8) * np.eye(3), shear(1e-8), shear(3e-7)])
def test_rounded_rotations_are_rotations(matrix):
    """Rounding to six or seven digits does not matter, in either argument."""
    assert ras(ROTATIONS, ROTATIONS @ matrix).score == 1.0
    assert ras(ROTATIONS @ matrix, ROTATIONS).score == 1.0
    assert ras(np.round(ROTATIONS, 6), ROTATIONS).score == 1.0


def test_products_in_single_precision_are_rotations():
    rotations = ROTATIONS.astype(np.float32)
    for _ in range(1000):
        rotations = rotations @ ROTATIONS[::-1].astype(np.float32)
    assert np.abs(rotations.transpose(0, 2, 1) @ rotations - np.eye(3)).max() > 1e-6
    assert ras(rotations, rotations).score == 1.0


def test_what_mends_rotations_is_named():
    few_digits = np.round(ROTATIONS, 3)
    few_digits[4] = np.nan
    with pytest.raises(ValueError, match=r"\[0\].*alignscores\.nearest_rotations mends it"):
        ras(ROTATIONS, few_digits)
    mended = nearest_rotations(few_digits)
    assert ras(ROTATIONS, mended).score == 0.95
    assert np.isnan(mended[4]).all()
    with pytest.raises(ValueError, match=r"must have shape \(n, 3, 3\), not \(3, 3\)"):
        nearest_rotations(np.eye(3))


@pytest.mark.parametrize(
    ("what", "name", "values"),
    [
        ("positions", "unit", (0, -1, np.nan, np.inf, True, "1", [1.0])),
        ("positions", "n_hypotheses", (0, -5, 1.5, True, np.nan, None, "9")),
        ("positions", "max_threshold", (0, -1.0, np.nan, np.inf, True, None, "1")),
        ("positions", "n_thresholds", (0, -1, 100.0, True, None)),
        ("positions", "registration", ("icp", "", "PCR99", None, 99)),
        ("rotations", "max_threshold_deg", (0, -1.0, np.nan, np.inf, True, None)),
        ("rotations", "n_thresholds", (0, -1, 2.0, True)),
        ("poses", "weight", (-0.1, 1.5, np.nan, np.inf)),
    ],
)
def test_bad_options(what, name, values):
    """The message begins with the name of the option and names the value."""
    score, good = SCORES[what]
    for value in values:
        with pytest.raises(ValueError, match=f"^{name} must be") as error:
            score(good, good, **{name: value})
        assert repr(value) in str(error.value)


def test_lists_and_other_number_types():
    """Lists, integers and 32-bit floats are taken as the numbers that they are."""
    gt = np.arange(60).reshape(20, 3) ** 2 % 37
    est = 3 * gt + 1
    for convert in (np.ndarray.tolist, np.int16, np.uint16, np.float32, np.float16, np.longdouble):
        assert tas(convert(gt), convert(est)).score == 1.0
    quarter_turns = np.array([[[0, -1, 0], [1, 0, 0], [0, 0, 1]]] * 4)
    assert ras(quarter_turns, quarter_turns.tolist()).score == 1.0
    assert tas(gt, est, unit=np.float32(0.5), n_hypotheses=np.int64(30)).score == 1.0


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_masked_rows_are_not_estimated(kind):
    """The values beneath a mask count for nothing, in the estimate or in the ground truth."""
    gt = (1000 * POSITIONS).astype(kind)
    est = np.ma.array(gt, mask=False)
    est[3] = np.ma.masked
    result = tas(gt, est)
    assert np.flatnonzero(np.isinf(result.errors)).tolist() == [3]
    assert result.score == 0.95
    with pytest.raises(ValueError, match=r"^gt_positions\[3\] is not finite"):
        tas(est, gt)


@pytest.mark.parametrize(
    "layout",
    [
        np.asfortranarray,
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: a[::-1].copy()[::-1],
        lambda a: np.concatenate([a, a], axis=-1)[..., : a.shape[-1]],
        lambda a: a.astype(a.dtype.newbyteorder()),
    ],
)
@pytest.mark.parametrize("n", [15, 300])
def test_memory_layout(layout, n, noisy_rotations, cloud):
    """However the numbers lie in memory: same score, and never written to."""
    gt = cloud("cube", n, 0)
    est = 2 * gt + RNG.normal(0, 0.05, gt.shape)
    a, b = noisy_rotations(n, 3, 4, 0)
    est[3], b[3] = np.nan, np.nan
    refined = partial(tas, registration="refined")
    for score, arrays in ((tas, (gt, est)), (refined, (gt, est)), (ras, (a, b))):
        expected = score(*arrays)
        laid_out = [layout(array) for array in arrays]
        for array in laid_out:
            array.flags.writeable = False
        result = score(*laid_out)
        assert result.score == expected.score
        np.testing.assert_allclose(result.errors, expected.errors, rtol=1e-9, atol=1e-9)


def test_d_names_its_argument():
    with pytest.raises(ValueError, match=r"^gt_positions must hold real numbers"):
        closest_pair_quartile("positions")
