"""Checks of user input, shared by all metrics: every error names the argument, row and reason."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import Booleans, Floats, Indices
from .texts import brief

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "AlignmentWarning",
    "check_groups",
    "check_poses",
    "check_position_pair",
    "check_positions",
    "check_positive",
    "check_rotations",
    "check_same_length",
    "finite_rows",
    "real_array",
]


# Largest entry of R^T R - I that still counts as a rotation. Six digits are off by 1.6e-6; a
# hundred products in single precision by 2.5e-6, also after a conversion to float64. An array in
# float32 may be the result of any number of products; half the precision has three digits or two.
ROTATION_TOLERANCE = 5e-6
TOLERANCES = {"float32": 1e-4, "float16": 5e-3, "bfloat16": 4e-2}


class AlignmentWarning(UserWarning):
    """The estimate could not be aligned to the ground truth: the score is 0."""


def check_positions(values: ArrayLike, name: str, *, complete: bool) -> Floats:
    """Return camera centres as (n, 3) floats, all finite if `complete`; or raise ValueError."""
    positions = real_array(values, name)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), not {positions.shape}")
    _check_rows(positions, name, complete)
    return positions


def check_rotations(values: "ArrayLike | Rotation", name: str, *, complete: bool) -> Floats:
    """Return rotations as (n, 3, 3) floats, all finite if `complete`; or raise ValueError."""
    if hasattr(values, "as_matrix"):  # SciPy's, without a third of a second to import it
        values = values.as_matrix()
    rotations = real_array(values, name)
    if rotations.ndim != 3 or rotations.shape[1:] != (3, 3):
        raise ValueError(f"{name} must have shape (n, 3, 3), not {rotations.shape}")
    _check_rows(rotations, name, complete)
    _check_orthonormal(rotations, name, _tolerance(values))
    return rotations


def check_poses(values: ArrayLike, name: str, *, complete: bool) -> tuple[Floats, Floats]:
    """Return the rotations (n, 3, 3), a view, and positions (n, 3) of camera-to-world poses."""
    poses = real_array(values, name)
    if poses.ndim != 3 or poses.shape[1:] not in ((4, 4), (3, 4)):
        raise ValueError(f"{name} must have shape (n, 4, 4) or (n, 3, 4), not {poses.shape}")
    _check_rows(poses[:, :3], name, complete)
    _check_orthonormal(poses[:, :3, :3], name, _tolerance(values))
    if poses.shape[1] == 4:
        deviation = np.abs(poses[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1)
        wrong = ~(deviation <= ROTATION_TOLERANCE) & finite_rows(poses[:, :3])
        if wrong.any():
            row = int(np.argmax(wrong))
            raise ValueError(f"{name}[{row}] has the last row {poses[row, 3]}, not [0, 0, 0, 1]")
    return poses[:, :3, :3], np.ascontiguousarray(poses[:, :3, 3])


def check_same_length(gt: Floats, est: Floats, gt_name: str, est_name: str) -> None:
    """Check that ground truth and estimate have the same number of cameras."""
    if len(gt) != len(est):
        raise ValueError(
            f"{gt_name} has {len(gt)} cameras but {est_name} has {len(est)}; "
            "row i of both must be the same camera"
        )


def check_position_pair(gt_positions: ArrayLike, est_positions: ArrayLike) -> tuple[Floats, Floats]:
    """Return checked positions (n, 3) of ground truth and estimate; estimates may be missing."""
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=False)
    check_same_length(gt, est, "gt_positions", "est_positions")
    return gt, est


def check_groups(groups: ArrayLike, n: int, name: str) -> Indices:
    """Return the labels of n rows as numbers from 0, or raise ValueError."""
    labels = np.asarray(groups)
    if labels.shape != (n,):
        raise ValueError(
            f"groups must have a label for each of the {n} rows of {name}, not {labels.shape}"
        )
    if labels.dtype.kind == "f" and np.isnan(labels).any():
        raise ValueError(f"groups[{int(np.argmax(np.isnan(labels)))}] is NaN, not a label")
    try:
        return np.unique(labels, return_inverse=True)[1]
    except TypeError:
        raise ValueError("groups must be labels of one kind, such as numbers or names") from None


def check_positive(value: float, name: str, *, integer: bool = False) -> float:
    """Return a parameter that is a positive, finite (whole) number, or raise ValueError."""
    types = (int, np.integer) if integer else (int, float, np.integer, np.floating)
    if isinstance(value, bool) or not isinstance(value, types) or not 0 < value < np.inf:
        expected = "whole number" if integer else "finite number"
        raise ValueError(f"{name} must be a positive {expected}, not {brief(value)}")
    return float(value)


def finite_rows(array: Floats) -> Booleans:
    """Return which cameras were estimated: those whose values are all finite."""
    return np.asarray(np.isfinite(array).all(axis=tuple(range(1, array.ndim))))


def real_array(values: Any, name: str) -> Floats:
    """Return real numbers as float64, of a tensor on any device and in any precision, too."""
    try:
        array = _as_array(values)
    except ValueError as error:
        raise ValueError(f"{name} is not a regular array: {error}") from None
    except Exception as error:  # whatever a library of tensors may raise
        raise ValueError(f"{name} cannot be made an array: {error}") from None
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} must hold real numbers, not {array.dtype}")
    if isinstance(values, np.ma.MaskedArray):
        # Masked rows were not estimated, whatever values the mask hides.
        array = np.ma.filled(values.astype(np.float64), np.nan)
    return np.asarray(array, dtype=np.float64)


def _as_array(values: Any) -> NDArray[Any]:
    """Return an array of anything array-like, of tensors of torch, JAX, CuPy and TensorFlow."""
    if isinstance(values, np.ndarray):
        return values
    if isinstance(values, (list, tuple)):
        if not any(map(_is_tensor, values)):
            return np.asarray(values)
        return np.stack([_as_array(value) for value in values])
    for method in ("detach", "cpu"):  # of torch: without gradients, and off the GPU
        values = getattr(values, method, lambda values=values: values)()
    if str(getattr(values, "dtype", "")) == "torch.bfloat16":  # which NumPy does not know
        values = values.float()
    if hasattr(values, "__cuda_array_interface__") and hasattr(values, "get"):
        values = values.get()  # of CuPy, which moves nothing unasked
    if hasattr(values, "__dlpack__") and not hasattr(values, "__array__"):
        return np.from_dlpack(values)
    array = np.asarray(values)
    return array.astype(np.float32) if array.dtype.name == "bfloat16" else array


def _is_tensor(values: Any) -> bool:
    return hasattr(values, "__dlpack__") and not isinstance(values, (np.ndarray, np.generic))


def _check_rows(array: Floats, name: str, complete: bool) -> None:
    if len(array) == 0:
        raise ValueError(f"{name} has no cameras")
    if complete and not np.isfinite(array).all():
        row = int(np.argmin(finite_rows(array)))
        raise ValueError(f"{name}[{row}] is not finite")


def _tolerance(values: Any) -> float:
    """Return how far from orthonormal rotations may be, by the precision they are given in."""
    while isinstance(values, (list, tuple)) and values:
        values = values[0]
    dtype = getattr(values, "dtype", np.float64)
    if dtype == np.float64:  # before its name, which NumPy makes anew
        return ROTATION_TOLERANCE
    return TOLERANCES.get(str(dtype).removeprefix("torch."), ROTATION_TOLERANCE)


def _check_orthonormal(rotations: Floats, name: str, tolerance: float) -> None:
    """Check that all finite matrices are rotations."""
    a, b, c = columns = np.ascontiguousarray(rotations.transpose(2, 1, 0))
    with np.errstate(all="ignore"):
        gram = np.einsum("ikn,jkn->ijn", columns, columns).reshape(9, -1)
        gram[::4] -= 1
        # fmax ignores NaN, so infinite entries count.
        deviation = np.fmax.reduce(np.abs(gram, out=gram))
        minors = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
        determinant = a[0] * minors[0] + a[1] * minors[1] + a[2] * minors[2]
    wrong = (deviation > tolerance) | (determinant < 0)
    if wrong.any() and (wrong := wrong & finite_rows(rotations)).any():
        row = int(np.argmax(wrong))
        reason = (
            f"R^T R differs from the identity by {deviation[row]:.1e}, and {tolerance:g} is "
            "allowed; alignscores.nearest_rotations repairs it where it is mere rounding"
            if deviation[row] > tolerance
            else "its determinant is -1, a reflection"
        )
        raise ValueError(f"{name}[{row}] is not a rotation: {reason}")
