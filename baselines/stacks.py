"""Scenes in one array: the leading axes of (..., n, 3), checked in one call."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from alignscores.arrays import Floats
from alignscores.validation import check_poses, check_positions, check_rotations, check_same_length

__all__ = ["check_stacks", "unstacked"]

CAMERA_AXES = {check_positions: 1, check_rotations: 2, check_poses: 2}


def check_stacks(
    check: Callable[..., Any], gt: Any, est: Any, noun: str, *, est_complete: bool = True
) -> tuple[Any, Any, tuple[int, ...]]:
    """Return what a check of `alignscores.validation` returns of both, and the leading axes.

    The leading axes (...) are joined to a single one, (scenes, n, ...); ``()`` is a single scene.
    """
    names = f"gt_{noun}", f"est_{noun}"
    truth, lead = _checked(check, gt, names[0], complete=True)
    estimate, est_lead = _checked(check, est, names[1], complete=est_complete)
    if lead != est_lead:
        raise ValueError(
            f"{names[0]} has scenes in {lead}, but {names[1]} has scenes in {est_lead}"
        )
    first, est_first = (part[0] if isinstance(part, tuple) else part for part in (truth, estimate))
    check_same_length(first[0], est_first[0], *names)
    return truth, estimate, lead


def unstacked(values: ArrayLike, lead: tuple[int, ...]) -> float | Floats:
    """Return values (scenes, ...) in the leading axes; a float of a single scene."""
    array = np.asarray(values)
    array = array.reshape(lead + array.shape[1:])
    return float(array) if array.ndim == 0 else array


def _checked(
    check: Callable[..., Any], values: ArrayLike, name: str, *, complete: bool
) -> tuple[Any, tuple[int, ...]]:
    n_axes = CAMERA_AXES[check]
    shape = () if hasattr(values, "as_matrix") else np.shape(values)
    lead = shape[: -n_axes - 1]
    if not lead:
        checked = check(values, name, complete=complete)
        return _reshaped(checked, (1, -1)), lead
    array = np.asarray(values)
    try:  # all scenes at once, which takes a fifth of the time
        checked = check(array.reshape(-1, *shape[-n_axes:]), name, complete=complete)
    except ValueError:
        for scene in np.ndindex(*lead):  # to name the scene
            check(array[scene], f"{name}[{', '.join(map(str, scene))}]", complete=complete)
        raise
    return _reshaped(checked, (-1, shape[-n_axes - 1])), lead


def _reshaped(checked: Any, scenes: tuple[int, int]) -> Any:
    if isinstance(checked, tuple):
        return tuple(part.reshape(*scenes, *part.shape[1:]) for part in checked)
    return checked.reshape(*scenes, *checked.shape[1:])
