"""Outliers: estimated cameras that have nothing to do with the true ones, or are not there."""

from collections.abc import Callable, Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats

__all__ = ["OUTLIERS"]

CLUSTER_SCALES = (0.5, 2.0)  # of a wrongly merged component, log-uniform


def _uniform(
    rng: np.random.Generator, rotations: Floats, positions: Floats, count: int, side: float
) -> None:
    """Put random cameras anywhere in the cube, with random rotations."""
    if count == 0:
        return
    outliers = rng.choice(len(positions), size=count, replace=False)
    positions[outliers] = rng.uniform(-side / 2, side / 2, size=(count, 3))
    rotations[outliers] = Rotation.random(count, rng=rng).as_matrix()


def _last(
    rng: np.random.Generator, rotations: Floats, positions: Floats, count: int, side: float
) -> None:
    """Put the last cameras anywhere in the cube, with random rotations: the authors' program."""
    if count == 0:
        return
    positions[-count:] = rng.uniform(-side / 2, side / 2, size=(count, 3))
    rotations[-count:] = Rotation.random(count, rng=rng).as_matrix()


def _cluster(
    rng: np.random.Generator, rotations: Floats, positions: Floats, count: int, side: float
) -> None:
    """Move consecutive cameras by one similarity, to a place in the cube: a wrong merge."""
    if count == 0:
        return
    first = rng.integers(len(positions) - count, endpoint=True)
    part = slice(first, first + count)
    rotation = Rotation.random(rng=rng).as_matrix()
    scale = np.exp(rng.uniform(*np.log(CLUSTER_SCALES)))
    centre = rng.uniform(-side / 2, side / 2, size=3)
    local = positions[part] - positions[part].mean(axis=0)
    positions[part] = scale * local @ rotation.T + centre
    rotations[part] = rotation @ rotations[part]


def _frozen(
    _rng: np.random.Generator, rotations: Floats, positions: Floats, count: int, _: float
) -> None:
    """Lose track before the last cameras, and stay with the last pose."""
    last = len(positions) - count - 1
    positions[last:] = positions[last]
    rotations[last:] = rotations[last]


def _diverging(
    _rng: np.random.Generator, rotations: Floats, positions: Floats, count: int, _: float
) -> None:
    """Lose track before the last cameras, and repeat the last motion (constant velocity)."""
    last = len(positions) - count - 1
    back = rotations[last - 1].T
    turn, step = back @ rotations[last], back @ (positions[last] - positions[last - 1])
    for i in range(last + 1, len(positions)):
        positions[i] = positions[i - 1] + rotations[i - 1] @ step
        rotations[i] = rotations[i - 1] @ turn


def _missing(
    rng: np.random.Generator, rotations: Floats, positions: Floats, count: int, _: float
) -> None:
    """Estimate no pose for random cameras: their rows are not finite."""
    missing = rng.choice(len(positions), size=count, replace=False)
    positions[missing] = np.nan
    rotations[missing] = np.nan


OUTLIERS: Mapping[str, Callable[[np.random.Generator, Floats, Floats, int, float], None]] = {
    "uniform": _uniform,
    "last": _last,
    "cluster": _cluster,
    "frozen": _frozen,
    "diverging": _diverging,
    "missing": _missing,
}
"""Each kind with the function that makes a number of estimated cameras outliers, in place."""
