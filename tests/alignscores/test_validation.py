"""Malformed input: a ValueError that names the argument, the row and the reason."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from alignscores import closest_pair_quartile, ras, tas

Floats = NDArray[np.float64]
Cloud = Callable[[str, int, int], Floats]
Rotations = Callable[[int, int, float, int], tuple[Floats, Floats]]

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


@pytest.mark.parametrize("values", NOT_NUMBERS.values(), ids=NOT_NUMBERS)
def test_not_real_numbers(values: Any) -> None:
    """Nothing is converted that is not a real number to begin with."""
    with pytest.raises(ValueError, match=r"^gt_positions must hold real numbers"):
        tas(values, POSITIONS)
    with pytest.raises(ValueError, match=r"^est_positions must hold real numbers"):
        tas(POSITIONS, values)
    with pytest.raises(ValueError, match=r"^gt_positions must hold real numbers"):
        closest_pair_quartile(values)
    with pytest.raises(ValueError, match=r"^gt_rotations must hold real numbers"):
        ras(values, ROTATIONS)
    with pytest.raises(ValueError, match=r"^est_rotations must hold real numbers"):
        ras(ROTATIONS, values)


def test_ragged_lists() -> None:
    """Rows of different lengths."""
    with pytest.raises(ValueError, match=r"^gt_positions is not a regular array"):
        tas(RAGGED, POSITIONS)
    with pytest.raises(ValueError, match=r"^est_positions is not a regular array"):
        tas(POSITIONS, RAGGED)
    with pytest.raises(ValueError, match=r"^est_rotations is not a regular array"):
        ras(ROTATIONS, [RAGGED])


@pytest.mark.parametrize(
    "shape", [(), (3,), (60,), (20, 2), (20, 4), (3, 20), (20, 3, 1), (1, 20, 3)]
)
def test_wrong_shapes_of_positions(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"^gt_positions must have shape \(n, 3\)"):
        tas(np.ones(shape), POSITIONS)
    with pytest.raises(ValueError, match=r"^est_positions must have shape \(n, 3\)"):
        tas(POSITIONS, np.ones(shape))


@pytest.mark.parametrize("shape", [(), (3, 3), (20, 9), (20, 3), (20, 4), (20, 4, 4), (20, 3, 4)])
def test_wrong_shapes_of_rotations(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"^gt_rotations must have shape \(n, 3, 3\)"):
        ras(np.ones(shape), ROTATIONS)
    with pytest.raises(ValueError, match=r"^est_rotations must have shape \(n, 3, 3\)"):
        ras(ROTATIONS, np.ones(shape))


def test_single_scipy_rotation() -> None:
    """A Rotation that is not a stack of n."""
    with pytest.raises(ValueError, match=r"^est_rotations must have shape \(n, 3, 3\)"):
        ras(ROTATIONS, Rotation.identity())


@pytest.mark.parametrize(("n_gt", "n_est"), [(20, 19), (19, 20), (20, 1), (4, 5)])
def test_different_numbers_of_cameras(n_gt: int, n_est: int) -> None:
    """Both numbers are named; nothing is broadcast."""
    with pytest.raises(ValueError, match=rf"gt_positions has {n_gt} .*est_positions has {n_est}"):
        tas(POSITIONS[:n_gt], POSITIONS[:n_est])
    with pytest.raises(ValueError, match=rf"gt_rotations has {n_gt} .*est_rotations has {n_est}"):
        ras(ROTATIONS[:n_gt], ROTATIONS[:n_est])


def test_no_cameras() -> None:
    for empty in (np.empty((0, 3)), []):
        with pytest.raises(ValueError, match=r"^gt_positions"):
            tas(empty, empty)
    with pytest.raises(ValueError, match=r"^gt_positions has no cameras"):
        tas(np.empty((0, 3)), np.empty((0, 3)), unit=1.0)
    with pytest.raises(ValueError, match=r"^est_positions has no cameras"):
        tas(POSITIONS, np.empty((0, 3)))
    with pytest.raises(ValueError, match=r"^gt_rotations has no cameras"):
        ras(np.empty((0, 3, 3)), np.empty((0, 3, 3)))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [0, 7, 19])
def test_ground_truth_that_is_not_finite(row: int, value: float) -> None:
    """The first such row is named."""
    positions, rotations = POSITIONS.copy(), ROTATIONS.copy()
    positions[row:, 1] = value
    rotations[row:, 2, 0] = value
    with pytest.raises(ValueError, match=rf"^gt_positions\[{row}\] is not finite"):
        tas(positions, POSITIONS)
    with pytest.raises(ValueError, match=rf"^gt_positions\[{row}\] is not finite"):
        closest_pair_quartile(positions)
    with pytest.raises(ValueError, match=rf"^gt_rotations\[{row}\] is not finite"):
        ras(rotations, ROTATIONS)


def shear(amount: float) -> Floats:
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
def test_matrices_that_are_no_rotations(matrix: Floats) -> None:
    """Refused in either argument, whatever the rotation they come with; the row is named."""
    bad = ROTATIONS.copy()
    bad[5] = bad[5] @ matrix
    with pytest.raises(ValueError, match=r"^gt_rotations\[5\] is not a rotation"):
        ras(bad, ROTATIONS)
    with pytest.raises(ValueError, match=r"^est_rotations\[5\] is not a rotation"):
        ras(ROTATIONS, bad)
    bad[2] = np.nan  # a lost camera does not hide it
    with pytest.raises(ValueError, match=r"^est_rotations\[5\] is not a rotation"):
        ras(ROTATIONS, bad)


def test_a_reflection_is_called_one() -> None:
    """Orthonormal, yet no rotation: the reason differs from that of a scaled matrix."""
    with pytest.raises(ValueError, match="reflection"):
        ras(ROTATIONS, ROTATIONS @ np.diag([1.0, -1.0, 1.0]))
    with pytest.raises(ValueError, match=r"R\^T R differs from the identity"):
        ras(ROTATIONS, 1.1 * ROTATIONS)


@pytest.mark.parametrize("matrix", [(1 + 1e-8) * np.eye(3), shear(1e-8), shear(3e-7)])
def test_rounded_rotations_are_rotations(matrix: Floats) -> None:
    """Rounding to seven digits or so is accepted, in either argument, and does not matter."""
    assert ras(ROTATIONS, ROTATIONS @ matrix).score == 1.0
    assert ras(ROTATIONS @ matrix, ROTATIONS).score == 1.0


BAD_OPTIONS: list[tuple[str, Any]] = [
    *[("unit", value) for value in (0, 0.0, -1, np.nan, np.inf, True, "1", [1.0])],
    *[("n_hypotheses", value) for value in (0, -5, 1.5, 1000.0, True, np.nan, None, "9")],
    *[("max_threshold", value) for value in (0, -1.0, np.nan, np.inf, True, None, "1")],
    *[("n_thresholds", value) for value in (0, -1, 100.0, True, None)],
    *[("registration", value) for value in ("icp", "", "PCR99", None, 99)],
]


@pytest.mark.parametrize(("name", "value"), BAD_OPTIONS)
def test_bad_options_of_tas(name: str, value: Any) -> None:
    """The message begins with the name of the option and tells the value."""
    with pytest.raises(ValueError, match=f"^{name} must be") as error:
        tas(POSITIONS, POSITIONS, **{name: value})
    assert repr(value) in str(error.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [("max_threshold_deg", value) for value in (0, -1.0, np.nan, np.inf, True, None)]
    + [("n_thresholds", value) for value in (0, -1, 2.0, True)],
)
def test_bad_options_of_ras(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"^{name} must be"):
        ras(ROTATIONS, ROTATIONS, **{name: value})


@pytest.mark.parametrize("rng", [-1, 1.5, "seed"])
def test_bad_rng(rng: Any) -> None:
    """Refused by NumPy, with an exception and not with a score."""
    with pytest.raises((ValueError, TypeError)):
        tas(POSITIONS, POSITIONS, rng=rng)


@pytest.mark.parametrize("option", ["unit", "n_hypotheses", "max_threshold", "n_thresholds"])
def test_numpy_scalars_are_numbers(option: str) -> None:
    for kind in (np.int32, np.int64, np.uint8, int):
        assert tas(POSITIONS, POSITIONS, **{option: kind(3)}).score == 1.0
    if option in ("unit", "max_threshold"):
        assert tas(POSITIONS, POSITIONS, **{option: np.float32(0.5)}).score == 1.0


# --- what is accepted -----------------------------------------------------------------------------


def test_lists_and_other_number_types(noisy_rotations: Rotations) -> None:
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
def test_masked_rows_are_not_estimated(kind: type) -> None:
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


LAYOUTS: dict[str, Callable[[Floats], Floats]] = {
    "Fortran order": np.asfortranarray,
    "every other row": lambda a: np.repeat(a, 2, axis=0)[::2],
    "reversed memory": lambda a: a[::-1].copy()[::-1],
    "column of a larger array": lambda a: np.concatenate([a, a], axis=-1)[..., : a.shape[-1]],
    "swapped bytes": lambda a: a.astype(a.dtype.newbyteorder()),
    "subclass": lambda a: a.view(np.recarray),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("n", [15, 100, 300])
def test_memory_layout(layout: str, n: int, noisy_rotations: Rotations, cloud: Cloud) -> None:
    """However the numbers lie in memory: same score, never written to, not even temporarily."""
    gt = cloud("cube", n, 0)
    est = 2 * gt + RNG.normal(0, 0.05, gt.shape)
    est[3] = np.nan
    a, b = noisy_rotations(n, 3, 4, 0)
    b[3] = np.nan
    for score, arrays in ((tas, (gt, est)), (ras, (a, b))):
        expected = score(*arrays)
        laid_out = [LAYOUTS[layout](array) for array in arrays]
        copies = [array.copy() for array in laid_out]
        for array in laid_out:
            array.flags.writeable = False
        result = score(*laid_out)
        assert result.score == expected.score
        np.testing.assert_allclose(result.errors, expected.errors, rtol=1e-9, atol=1e-9)
        for array, copy in zip(laid_out, copies, strict=True):
            np.testing.assert_array_equal(array, copy)


def test_result_does_not_share_memory_with_the_input() -> None:
    """Changing the input afterwards does not change the result."""
    gt, est = POSITIONS.copy(), POSITIONS.copy()
    a, b = ROTATIONS.copy(), ROTATIONS.copy()
    result, turned = tas(gt, est), ras(a, b)
    before = [result.errors.copy(), turned.errors.copy(), turned.alignment]
    for array in (gt, est, a, b):
        array[:] = 7
    for array, copy in zip((result.errors, turned.errors, turned.alignment), before, strict=True):
        np.testing.assert_array_equal(array, copy)
