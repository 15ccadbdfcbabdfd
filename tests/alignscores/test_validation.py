"""Malformed input: a ValueError that names the argument, the row and the reason."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import closest_pair_quartile, nearest_rotations, pas, ras, tas

RNG = np.random.default_rng(0)
POSITIONS = RNG.random((20, 3))
ROTATIONS = Rotation.random(20, rng=RNG).as_matrix()

NOT_NUMBERS = {
    "object": POSITIONS.astype(object),
    "complex": POSITIONS.astype(complex),
    "string": POSITIONS.astype(str),
    "bool": POSITIONS > 0.5,
    "None": None,
    "text": "positions",
    "dict": {"x": 1},
    "dates": np.zeros((20, 3), dtype="datetime64[s]"),
    "None inside": [[0.0, None, 1.0]] * 20,
    "too large for 64 bits": [[10**30, 0, 0]] * 20,
}
RAGGED = [[0.0, 0.0, 0.0], [1.0, 0.0]]


def refused(function, name, *arguments, reason):
    """Assert that the error begins with the name of the argument and the reason."""
    with pytest.raises(ValueError, match=rf"^{name}{reason}"):
        function(*arguments)


@pytest.mark.parametrize("values", NOT_NUMBERS.values(), ids=NOT_NUMBERS)
def test_not_real_numbers(values):
    """Nothing is converted that is not a real number to begin with."""
    reason = " must hold real numbers"
    refused(tas, "gt_positions", values, POSITIONS, reason=reason)
    refused(tas, "est_positions", POSITIONS, values, reason=reason)
    refused(closest_pair_quartile, "gt_positions", values, reason=reason)
    refused(ras, "gt_rotations", values, ROTATIONS, reason=reason)
    refused(ras, "est_rotations", ROTATIONS, values, reason=reason)


def test_ragged_lists():
    """Rows of different lengths."""
    reason = " is not a regular array"
    refused(tas, "gt_positions", RAGGED, POSITIONS, reason=reason)
    refused(tas, "est_positions", POSITIONS, RAGGED, reason=reason)
    refused(ras, "est_rotations", ROTATIONS, [RAGGED], reason=reason)


@pytest.mark.parametrize(
    "shape", [(), (3,), (60,), (20, 2), (20, 4), (3, 20), (20, 3, 1), (1, 20, 3)]
)
def test_wrong_shapes_of_positions(shape):
    reason = r" must have shape \(n, 3\)"
    refused(tas, "gt_positions", np.ones(shape), POSITIONS, reason=reason)
    refused(tas, "est_positions", POSITIONS, np.ones(shape), reason=reason)


@pytest.mark.parametrize("shape", [(), (3, 3), (20, 9), (20, 3), (20, 4), (20, 4, 4), (20, 3, 4)])
def test_wrong_shapes_of_rotations(shape):
    reason = r" must have shape \(n, 3, 3\)"
    refused(ras, "gt_rotations", np.ones(shape), ROTATIONS, reason=reason)
    refused(ras, "est_rotations", ROTATIONS, np.ones(shape), reason=reason)
    refused(ras, "est_rotations", ROTATIONS, Rotation.identity(), reason=reason)  # not a stack


@pytest.mark.parametrize(("n_gt", "n_est"), [(20, 19), (19, 20), (20, 1), (4, 5)])
def test_different_numbers_of_cameras(n_gt, n_est):
    """Both numbers are named; nothing is broadcast."""
    for function, what, values in ((tas, "positions", POSITIONS), (ras, "rotations", ROTATIONS)):
        reason = f" has {n_gt} .*est_{what} has {n_est}"
        refused(function, f"gt_{what}", values[:n_gt], values[:n_est], reason=reason)


def test_no_cameras():
    empty = np.empty((0, 3))
    refused(tas, "gt_positions", [], [], reason="")
    refused(partial(tas, unit=1.0), "gt_positions", empty, empty, reason=" has no cameras")
    refused(tas, "gt_positions", empty, empty, reason=" has no cameras")
    refused(tas, "est_positions", POSITIONS, empty, reason=" has no cameras")
    refused(ras, "gt_rotations", ROTATIONS[:0], ROTATIONS[:0], reason=" has no cameras")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [0, 7, 19])
def test_ground_truth_that_is_not_finite(row, value):
    """The first such row is named."""
    positions, rotations = POSITIONS.copy(), ROTATIONS.copy()
    positions[row:, 1] = value
    rotations[row:, 2, 0] = value
    reason = rf"\[{row}\] is not finite"
    refused(tas, "gt_positions", positions, POSITIONS, reason=reason)
    refused(closest_pair_quartile, "gt_positions", positions, reason=reason)
    refused(ras, "gt_rotations", rotations, ROTATIONS, reason=reason)


def shear(amount):
    matrix = np.eye(3)
    matrix[0, 1] = amount
    return matrix


NO_ROTATIONS = {
    "scaled": 2 * np.eye(3),
    "shrunk": 0.5 * np.eye(3),
    "zero": np.zeros((3, 3)),
    "reflected": np.diag([1.0, 1.0, -1.0]),
    "inverted": -np.eye(3),
    "sheared": shear(0.1),
    "scaled by 1 + 1e-5": (1 + 1e-5) * np.eye(3),
    "sheared by 1e-5": shear(1e-5),
    "projection": np.diag([1.0, 1.0, 0.0]),
    "huge": 1e200 * np.eye(3),
    "tiny": 1e-200 * np.eye(3),
}


@pytest.mark.parametrize("matrix", NO_ROTATIONS.values(), ids=NO_ROTATIONS)
def test_matrices_that_are_no_rotations(matrix):
    """Refused in either argument, whatever they are multiplied with; row and reason are named."""
    bad = ROTATIONS.copy()
    bad[5] = bad[5] @ matrix
    reflection = np.array_equal(np.abs(matrix), np.eye(3))
    what = ".*a reflection" if reflection else r".*R\^T R differs from the identity"
    reason = rf"\[5\] is not a rotation: {what}"
    refused(ras, "gt_rotations", bad, ROTATIONS, reason=reason)
    refused(ras, "est_rotations", ROTATIONS, bad, reason=reason)
    bad[2] = np.nan  # a lost camera does not hide it
    refused(ras, "est_rotations", ROTATIONS, bad, reason=reason)


@pytest.mark.parametrize("matrix", [(1 + 1e-8) * np.eye(3), shear(1e-8), shear(3e-7)])
def test_rounded_rotations_are_rotations(matrix):
    """Rounding to seven digits or so is accepted, in either argument, and does not matter."""
    assert ras(ROTATIONS, ROTATIONS @ matrix).score == 1.0
    assert ras(ROTATIONS @ matrix, ROTATIONS).score == 1.0


@pytest.mark.parametrize(("dtype", "products"), [(np.float32, 1000), (np.float64, 20)])
def test_products_in_single_precision_are_rotations(dtype, products):
    """As float32 they may be off by more; whoever has passed on six digits is off by 1.6e-6."""
    rotations = ROTATIONS.astype(np.float32)
    for _ in range(products):
        rotations = rotations @ ROTATIONS[::-1].astype(np.float32)
    rotations = rotations.astype(dtype)
    deviation = np.abs(rotations.transpose(0, 2, 1) @ rotations - np.eye(3)).max()
    assert deviation > 1e-6
    assert ras(rotations, rotations).score == 1.0
    poses = np.concatenate([rotations, POSITIONS[:, :, None].astype(dtype)], axis=2)
    assert pas(poses, poses).score == 1.0
    assert ras(np.round(ROTATIONS, 6), ROTATIONS).score == 1.0


def test_what_mends_rotations_is_named():
    few_digits = np.round(ROTATIONS, 3)
    few_digits[4] = np.nan
    for values, tolerance in ((few_digits, "5e-06"), (few_digits.astype(np.float32), "0.0001")):
        reason = r"\[0\] is not a rotation: R\^T R differs from the identity by \d.\de-\d\d, "
        reason += f"and {tolerance} is allowed; alignscores.nearest_rotations mends it"
        refused(ras, "est_rotations", ROTATIONS, values, reason=reason)
        mended = nearest_rotations(values)
        assert ras(ROTATIONS, mended).score == 0.95
        assert np.isnan(mended[4]).all()
    with pytest.raises(ValueError, match=r"must have shape \(n, 3, 3\), not \(3, 3\)"):
        nearest_rotations(np.eye(3))


BAD_OPTIONS = [
    *[(tas, "unit", value) for value in (0, 0.0, -1, np.nan, np.inf, True, "1", [1.0])],
    *[(tas, "n_hypotheses", value) for value in (0, -5, 1.5, 1e3, True, np.nan, None, "9")],
    *[(tas, "max_threshold", value) for value in (0, -1.0, np.nan, np.inf, True, None, "1")],
    *[(tas, "n_thresholds", value) for value in (0, -1, 100.0, True, None)],
    *[(tas, "registration", value) for value in ("icp", "", "PCR99", None, 99)],
    *[(ras, "max_threshold_deg", value) for value in (0, -1.0, np.nan, np.inf, True, None)],
    *[(ras, "n_thresholds", value) for value in (0, -1, 2.0, True)],
]


@pytest.mark.parametrize(("function", "name", "value"), BAD_OPTIONS)
def test_bad_options(function, name, value):
    """The message begins with the name of the option and names the value."""
    values = POSITIONS if function is tas else ROTATIONS
    with pytest.raises(ValueError, match=f"^{name} must be") as error:
        function(values, values, **{name: value})
    assert repr(value) in str(error.value)


@pytest.mark.parametrize("rng", [-1, 1.5, "seed"])
def test_bad_rng(rng):
    """Refused by NumPy, with an exception and not with a score."""
    with pytest.raises((ValueError, TypeError)):
        tas(POSITIONS, POSITIONS, rng=rng)


@pytest.mark.parametrize("option", ["unit", "n_hypotheses", "max_threshold", "n_thresholds"])
def test_numpy_scalars_are_numbers(option):
    for kind in (np.int32, np.int64, np.uint8, int):
        assert tas(POSITIONS, POSITIONS, **{option: kind(3)}).score == 1.0
    if option in ("unit", "max_threshold"):
        assert tas(POSITIONS, POSITIONS, **{option: np.float32(0.5)}).score == 1.0


# --- what is accepted -----------------------------------------------------------------------------


def test_lists_and_other_number_types(noisy_rotations):
    """Lists, integers and 32-bit floats are taken as the numbers that they are."""
    gt = np.arange(60).reshape(20, 3) ** 2 % 37
    est = 3 * gt + 1
    for convert in (
        np.asarray,
        np.ndarray.tolist,
        np.int16,
        np.uint16,
        np.float32,
        np.float16,
        np.longdouble,
    ):
        assert tas(convert(gt), convert(est)).score == 1.0
    a, b = noisy_rotations(20, 3, 2, 0)
    assert ras(a.tolist(), b.tolist()).score == ras(a, b).score
    quarter_turns = np.array([[[0, -1, 0], [1, 0, 0], [0, 0, 1]]] * 4)
    assert ras(quarter_turns, quarter_turns.tolist()).score == 1.0


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_masked_rows_are_not_estimated(kind):
    """The values beneath a mask count for nothing, in the estimate or in the ground truth."""
    gt = (1000 * POSITIONS).astype(kind)
    est = np.ma.array(gt, mask=False)
    est[3] = np.ma.masked
    result = tas(gt, est)
    assert np.flatnonzero(np.isinf(result.errors)).tolist() == [3]
    assert result.score == 0.95
    assert not np.ma.isMaskedArray(result.errors)
    rotations = np.ma.array(ROTATIONS, mask=False)
    rotations[5, 1, 1] = np.ma.masked
    assert ras(ROTATIONS, rotations).score == 0.95
    with pytest.raises(ValueError, match=r"^gt_positions\[3\] is not finite"):
        tas(est, gt)


LAYOUTS = {
    "Fortran order": np.asfortranarray,
    "every other row": lambda a: np.repeat(a, 2, axis=0)[::2],
    "reversed memory": lambda a: a[::-1].copy()[::-1],
    "column of a larger array": lambda a: np.concatenate([a, a], axis=-1)[..., : a.shape[-1]],
    "swapped bytes": lambda a: a.astype(a.dtype.newbyteorder()),
    "subclass": lambda a: a.view(np.recarray),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("n", [15, 100, 300])
def test_memory_layout(layout, n, noisy_rotations, cloud):
    """However the numbers lie in memory: same score, never written to, not even temporarily."""
    gt = cloud("cube", n, 0)
    est = 2 * gt + RNG.normal(0, 0.05, gt.shape)
    est[3] = np.nan
    a, b = noisy_rotations(n, 3, 4, 0)
    b[3] = np.nan
    poses = [np.concatenate([r, p[:, :, None]], axis=2) for r, p in ((a, gt), (b, est))]
    refined = partial(tas, registration="refined")
    for score, arrays in ((tas, (gt, est)), (refined, (gt, est)), (ras, (a, b)), (pas, poses)):
        expected = score(*arrays)
        laid_out = [LAYOUTS[layout](array) for array in arrays]
        copies = [array.copy() for array in laid_out]
        for array in laid_out:
            array.flags.writeable = False
        result = score(*laid_out)
        assert result.score == expected.score
        if score is not pas:
            np.testing.assert_allclose(result.errors, expected.errors, rtol=1e-9, atol=1e-9)
        for array, copy in zip(laid_out, copies, strict=True):
            np.testing.assert_array_equal(array, copy)


def test_result_does_not_share_memory_with_the_input():
    """Changing the input afterwards does not change the result."""
    gt, est = POSITIONS.copy(), POSITIONS.copy()
    a, b = ROTATIONS.copy(), ROTATIONS.copy()
    result, turned = tas(gt, est), ras(a, b)
    before = [result.errors.copy(), turned.errors.copy(), turned.alignment]
    for array in (gt, est, a, b):
        array[:] = 7
    for array, copy in zip((result.errors, turned.errors, turned.alignment), before, strict=True):
        np.testing.assert_array_equal(array, copy)
