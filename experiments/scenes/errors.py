"""Estimation errors: how the estimated cameras depart from the true ones, outliers aside.

Levels compare from one model to the next: sigma_t is the root mean square of the displacement, over
cameras and axes, in ground-truth units, sigma_r the one of the angle of rotation. With independent
errors this holds in expectation, with common ones (drift, scale drift, bias) in every draw, both
before the alignment, which removes what looks like a similarity.
"""

from collections.abc import Callable, Mapping

import numpy as np

from alignscores.arrays import Floats

__all__ = ["ERRORS"]

Errors = tuple[Floats, Floats]  # rotation vectors in radians (n, 3), displacements (n, 3)

STUDENT_DOF = 3  # the fewest degrees of freedom with a finite variance


def _gaussian(
    rng: np.random.Generator, _: Floats, positions: Floats, sigma_t: float, sigma_r: float
) -> Errors:
    """Shift by normal displacements, turn about uniformly random axes by normal angles."""
    n = len(positions)
    axes = rng.standard_normal((n, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = sigma_r * rng.standard_normal((n, 1))
    return angles * axes, sigma_t * rng.standard_normal((n, 3))


def _student_t(
    rng: np.random.Generator, rotations: Floats, positions: Floats, sigma_t: float, sigma_r: float
) -> Errors:
    """Give displacements and angles the heavy tails of Student's t; bad cameras are bad in both."""
    rotvecs, displacements = _gaussian(rng, rotations, positions, sigma_t, sigma_r)
    tails = np.sqrt((STUDENT_DOF - 2) / rng.chisquare(STUDENT_DOF, size=(len(positions), 1)))
    return rotvecs * tails, displacements * tails


def _drift(
    rng: np.random.Generator, _: Floats, positions: Floats, sigma_t: float, sigma_r: float
) -> Errors:
    """Walk away randomly from the first camera on, in position and in rotation."""
    rotvecs, displacements = rng.standard_normal((2, len(positions), 3))
    rotvecs[0] = displacements[0] = 0
    return (
        _scaled(np.cumsum(rotvecs, axis=0), sigma_r),
        _scaled(np.cumsum(displacements, axis=0), np.sqrt(3) * sigma_t),
    )


def _scale_drift(
    rng: np.random.Generator, rotations: Floats, positions: Floats, sigma_t: float, sigma_r: float
) -> Errors:
    """Let the steps along the path grow or shrink, more and more; rotations are Gaussian."""
    rotvecs, _ = _gaussian(rng, rotations, positions, sigma_t, sigma_r)
    growth = rng.choice([-1, 1]) * np.linspace(0, 1, len(positions))[1:, None]
    displacements = np.zeros_like(positions)
    np.cumsum(growth * np.diff(positions, axis=0), axis=0, out=displacements[1:])
    return rotvecs, _scaled(displacements, np.sqrt(3) * sigma_t)


def _bias(
    rng: np.random.Generator, rotations: Floats, _: Floats, sigma_t: float, sigma_r: float
) -> Errors:
    """Shift and turn all cameras alike in their own frames: a lever arm, a mounting angle.

    A constant shift or rotation of the world would be no error at all: the alignment takes it away.
    """
    arm, axis = (vector / np.linalg.norm(vector) for vector in rng.standard_normal((2, 3)))
    return rotations @ (sigma_r * axis), rotations @ (np.sqrt(3) * sigma_t * arm)


def _distance(
    rng: np.random.Generator, rotations: Floats, positions: Floats, sigma_t: float, sigma_r: float
) -> Errors:
    """Err in proportion to the distance from the centre of all cameras; otherwise Gaussian."""
    rotvecs, displacements = _gaussian(rng, rotations, positions, sigma_t, sigma_r)
    distances = _scaled(positions - positions.mean(axis=0), 1.0)
    share = np.linalg.norm(distances, axis=1, keepdims=True)
    return rotvecs * share, displacements * share


ERRORS: Mapping[str, Callable[[np.random.Generator, Floats, Floats, float, float], Errors]] = {
    "gaussian": _gaussian,
    "student_t": _student_t,
    "drift": _drift,
    "scale_drift": _scale_drift,
    "bias": _bias,
    "distance": _distance,
}
"""Each model with its function of a generator, true cameras, sigma_t and sigma_r in radians."""


def _scaled(vectors: Floats, length: float) -> Floats:
    """Scale vectors so that the root mean square of their lengths is as given."""
    rms: float = np.sqrt((vectors**2).sum(axis=1).mean())
    return length / rms * vectors
