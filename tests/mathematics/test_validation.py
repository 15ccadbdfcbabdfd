"""Wrong arrays and options: a ValueError with the argument, the row and the reason."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import (
    Similarity,
    closest_pair_quartile,
    nearest_rotations,
    pas,
    ras,
    ras_angle,
    tas,
    tas_distance,
    tas_profile,
)

RNG = np.random.default_rng(0)
POSITIONS = RNG.random((20, 3))
ROTATIONS = Rotation.random(20, rng=RNG).as_matrix()
POSES = np.tile(np.eye(4), (20, 1, 1))
POSES[:, :3, :3], POSES[:, :3, 3] = ROTATIONS, POSITIONS
SCORES = {"positions": (tas, POSITIONS), "rotations": (ras, ROTATIONS), "poses": (pas, POSES)}


def with_row(row, change):
    """Change one row of an array."""

    def changed(array):
        array = array.copy()
        array[row] = change(array[row])
        return array

    return changed


def rotated(matrix):
    """Multiply the rotation of camera 5 by a matrix."""

    def change(camera):
        camera = camera.copy()
        camera[:3, :3] = camera[:3, :3] @ matrix
        return camera

    return with_row(5, change)


def last_row(*values):
    return with_row(7, lambda pose: np.vstack([pose[:3], values]))


SHEAR = np.eye(3) + 1e-5 * np.eye(3, k=1)
EACH, MATRICES = SCORES, ("rotations", "poses")
ARRAYS = [  # what is wrong, for which scores, and the message after the argument's name
    (lambda a: a.astype(object), EACH, " must hold real numbers, not object"),
    (lambda a: a.astype(complex), EACH, " must hold real numbers, not complex128"),
    (lambda a: a.astype(str), EACH, " must hold real numbers, not <U32"),
    (lambda a: a > 0.5, EACH, " must hold real numbers, not bool"),
    (lambda a: np.zeros(a.shape, "datetime64[s]"), EACH, " must hold real numbers, not datetime"),
    (lambda _: None, EACH, " must hold real numbers, not object"),
    (lambda _: [[10**30, 0, 0]] * 20, EACH, " must hold real numbers, not object"),
    (lambda _: [[0.0, 0.0, 0.0], [1.0, 0.0]], EACH, " is not a regular array"),
    (lambda _: 1.0, EACH, r" must have shape \(n, .*, not \(\)"),
    (lambda a: a[0], EACH, r" must have shape \(n, "),
    (lambda a: a[None], EACH, r" must have shape \(n, "),
    (lambda a: a[..., :2], EACH, r" must have shape \(n, "),
    (lambda a: a[:0], EACH, " has no cameras"),
    (rotated(2 * np.eye(3)), MATRICES, r"\[5\] is not a rotation: R\^T R differs from the ident"),
    (rotated(np.zeros((3, 3))), MATRICES, r"\[5\] is not a rotation: R\^T R differs"),
    (rotated(SHEAR), MATRICES, r"\[5\] is not a rotation: R\^T R differs"),
    (rotated(1e200 * np.eye(3)), MATRICES, r"\[5\] is not a rotation: R\^T R differs"),
    (rotated(-np.eye(3)), MATRICES, r"\[5\] is not a rotation: .*a reflection"),
    (last_row(0, 0, 0, 2), ("poses",), r"\[7\] has the last row \[.*\], not \[0, 0, 0, 1\]"),
    (last_row(1, 2, 3, 1), ("poses",), r"\[7\] has the last row"),
    (last_row(0, 0, 0, np.nan), ("poses",), r"\[7\] has the last row"),
]


@pytest.mark.parametrize(
    ("change", "what", "reason"),
    [(change, what, reason) for change, scores, reason in ARRAYS for what in scores],
)
def test_wrong_arrays(change, what, reason):
    """In either argument."""
    score, good = SCORES[what]
    with pytest.raises(ValueError, match=rf"^gt_{what}{reason}"):
        score(change(good), good)
    with pytest.raises(ValueError, match=rf"^est_{what}{reason}"):
        score(good, change(good))


@pytest.mark.parametrize("what", SCORES)
def test_arrays_that_do_not_belong_together(what):
    """Another number of cameras, or a ground truth that is not finite: its first row is named."""
    score, good = SCORES[what]
    with pytest.raises(ValueError, match=f"gt_{what} has 20 .*est_{what} has 19"):
        score(good, good[:19])
    for value in (np.nan, np.inf, -np.inf):
        bad = good.copy()
        bad[7:].reshape(13, -1)[:, 1] = value
        with pytest.raises(ValueError, match=rf"^gt_{what}\[7\] is not finite"):
            score(bad, good)
    with pytest.raises(ValueError, match=r"^gt_positions must hold real numbers"):
        closest_pair_quartile("positions")


LEVELS = 0, -1, 1.1, np.nan, "half", True
UNITS = [], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [1.0, np.nan], [np.inf], [[1.0]], 3
OPTIONS = [
    (tas, "unit", (0, -1, np.nan, np.inf, True, "1", [1.0])),
    (tas, "n_hypotheses", (0, -5, 1.5, True, np.nan, None, "9")),
    (tas, "max_threshold", (0, -1.0, np.nan, np.inf, True, None, "1")),
    (tas, "n_thresholds", (0, -1, 100.0, True, None)),
    (tas, "registration", ("icp", "", "PCR99", None, 99)),
    (tas, "alignment", ("se3", None)),
    (tas, "up", ("north", None)),
    (Similarity.fit, "alignment", ("se3", None)),
    (ras, "max_threshold_deg", (0, -1.0, np.nan, np.inf, True, None)),
    (ras, "n_thresholds", (0, -1, 2.0, True)),
    (ras, "alignment", ("se3", None)),
    (ras, "up", ("north", None)),
    (pas, "weight", (-0.1, 1.5, np.nan, np.inf)),
    (tas_distance, "score", LEVELS),
    (ras_angle, "score", LEVELS),
    (tas_profile, "units", UNITS),
]
INPUT = {ras: ROTATIONS, ras_angle: ROTATIONS, pas: POSES}


@pytest.mark.parametrize(("function", "name", "values"), OPTIONS)
def test_wrong_options(function, name, values):
    """The message begins with the name of the option and names the value."""
    good = INPUT.get(function, POSITIONS)
    for value in values:
        with pytest.raises(ValueError, match=f"^{name} must be") as error:
            function(good, good, **{name: value})
        assert repr(value) in str(error.value)


# --- what is accepted -----------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [1 + 1e-8, 1 + 2e-7, np.eye(3) + 3e-7 * np.eye(3, k=1)])
def test_rounded_rotations_are_rotations(factor):
    """Also where the trace of an error exceeds 3, whose arc cosine is no angle."""
    rounded = ROTATIONS * factor if np.ndim(factor) == 0 else ROTATIONS @ factor
    for gt, est in ((ROTATIONS, rounded), (rounded, ROTATIONS), (ROTATIONS, ROTATIONS.round(6))):
        result = ras(gt, est)
        assert result.score == 1.0
        assert (result.errors >= 0).all()


def test_nearest_rotations_repair_few_digits():
    few_digits = np.round(ROTATIONS, 3)
    few_digits[4] = np.nan
    with pytest.raises(ValueError, match=r"\[0\].*alignscores\.nearest_rotations repairs it"):
        ras(ROTATIONS, few_digits)
    mended = nearest_rotations(few_digits)
    assert ras(ROTATIONS, mended).score == 0.95
    assert np.isnan(mended[4]).all()
    with pytest.raises(ValueError, match=r"must have shape \(n, 3, 3\), not \(3, 3\)"):
        nearest_rotations(np.eye(3))


def test_lists_and_other_number_types():
    gt = np.arange(60).reshape(20, 3) ** 2 % 37
    est = 3 * gt + 1
    for convert in (np.ndarray.tolist, np.int16, np.uint16, np.float32, np.float16, np.longdouble):
        assert tas(convert(gt), convert(est)).score == 1.0
    quarter_turns = np.array([[[0, -1, 0], [1, 0, 0], [0, 0, 1]]] * 4)
    assert ras(quarter_turns, quarter_turns.tolist()).score == 1.0
    assert tas(gt, est, unit=np.float32(0.5), n_hypotheses=np.int64(30)).score == 1.0


@pytest.mark.parametrize("dtype", [np.float64, np.int64])
def test_masked_rows_are_not_estimated(dtype):
    gt = (1000 * POSITIONS).astype(dtype)
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
def test_the_layout_in_memory_changes_nothing(layout, n, noisy_rotations, cloud):
    """And arrays are never written to."""
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
