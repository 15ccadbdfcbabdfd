"""Ground truths: where the cameras stand and look. Along a path, neighbours are a unit apart."""

from collections.abc import Callable, Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from alignscores.arrays import Floats

__all__ = ["PATHS"]

Cameras = tuple[Floats, Floats]  # camera-to-world rotations (n, 3, 3), positions (n, 3)

UP = np.array([0.0, 0.0, 1.0])
HELIX_TURN = 20  # cameras a turn
HELIX_CLIMB = 0.2  # rise from one camera to the next
STRETCH = (5, 15)  # steps that a car drives straight, from and to
BEND = 5  # steps of its turn by a right angle
LAP = 100  # cameras in a lap
LANE = 0.1  # standard deviation of the radius and height from lap to lap
CLUSTERS = 5
CLUSTER_SPREADS = (0.01, 0.1)  # standard deviation, of the fullest and of the emptiest cluster


def _cube(rng: np.random.Generator, n: int, volume: float) -> Cameras:
    """Stand uniformly in a cube centred at the origin; random rotations."""
    rotations = _random_rotations(rng, n)
    side = np.cbrt(volume)
    return rotations, rng.uniform(-side / 2, side / 2, size=(n, 3))


def _line(rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Stand along a line of random direction through the origin; random rotations."""
    rotations = _random_rotations(rng, n)
    return rotations, _straight(n, rng.standard_normal(3))


def _ray(rng: np.random.Generator, n: int, volume: float) -> Cameras:
    """Stand along a line of random direction that starts at the origin; random rotations."""
    rotations, positions = _line(rng, n, volume)
    return rotations, positions - positions[0]


def _x_axis(rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Stand along the first axis; random rotations."""
    return _random_rotations(rng, n), _straight(n, np.eye(3)[0])


def _random_walk(rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Step in uniformly random directions; random rotations."""
    rotations = _random_rotations(rng, n)
    steps = rng.standard_normal((n - 1, 3))
    return rotations, _walk(steps / np.linalg.norm(steps, axis=1, keepdims=True))


def _orbit(_rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Go once round a circle, looking at its centre."""
    angles = 2 * np.pi * np.arange(n) / n
    outward = _headings(angles)
    return _looking(-outward, UP), outward / (2 * np.sin(np.pi / n))


def _helix(_rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Climb round a tower, looking at its axis."""
    angles = 2 * np.pi * np.arange(n) / HELIX_TURN
    outward = _headings(angles)
    radius = np.sqrt(1 - HELIX_CLIMB**2) / (2 * np.sin(np.pi / HELIX_TURN))
    return _looking(-outward, UP), radius * outward + HELIX_CLIMB * np.outer(np.arange(n), UP)


def _survey(_rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Fly line by line over a square grid, back and forth, looking down; image tops point ahead."""
    side = int(np.ceil(np.sqrt(n)))
    row, along = np.divmod(np.arange(n), side)
    back = row % 2 == 1
    column = np.where(back, side - 1 - along, along)
    ahead = np.where(back, -1.0, 1.0)[:, None] * np.eye(3)[0]
    positions = np.stack([column, row, np.zeros(n)], axis=1).astype(np.float64)
    return _looking(np.tile(-UP, (n, 1)), ahead), positions


def _car(rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Drive straight stretches and turns to the left or right in a plane, looking ahead."""
    bends = np.zeros(0)
    while len(bends) < n:
        straight = np.zeros(rng.integers(*STRETCH, endpoint=True))
        bends = np.append(bends, np.append(straight, rng.choice([-1, 1]) * np.ones(BEND)))
    headings = _headings(np.cumsum(bends[:n]) * np.pi / 2 / BEND)
    return _looking(headings, UP), _walk(headings[:-1])


def _laps(rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Drive round a circle in laps of 100 cameras; each starts elsewhere, on a lane of its own."""
    lap, position = np.divmod(np.arange(n), LAP)
    phases, aside, above = rng.random(lap[-1] + 1), *LANE * rng.standard_normal((2, lap[-1] + 1))
    angles = 2 * np.pi * (position + phases[lap]) / LAP
    radius = 1 / (2 * np.sin(np.pi / LAP)) + aside[lap]
    positions = radius[:, None] * _headings(angles) + np.outer(above[lap], UP)
    return _looking(_headings(angles + np.pi / 2), UP), positions


def _uneven(rng: np.random.Generator, n: int, _: float) -> Cameras:
    """Stand in clusters in a unit cube, the fuller the denser, in turn; random rotations."""
    rotations = _random_rotations(rng, n)
    shares = 1 / np.arange(1, CLUSTERS + 1)
    cluster = np.sort(rng.choice(CLUSTERS, size=n, p=shares / shares.sum()))
    centres = rng.uniform(-0.5, 0.5, size=(CLUSTERS, 3))
    spreads = np.geomspace(*CLUSTER_SPREADS, CLUSTERS)
    return rotations, centres[cluster] + spreads[cluster, None] * rng.standard_normal((n, 3))


PATHS: Mapping[str, Callable[[np.random.Generator, int, float], Cameras]] = {
    "cube": _cube,
    "line": _line,
    "ray": _ray,
    "x_axis": _x_axis,
    "random_walk": _random_walk,
    "orbit": _orbit,
    "helix": _helix,
    "survey": _survey,
    "car": _car,
    "laps": _laps,
    "uneven": _uneven,
}
"""Each geometry with the function that draws it: of a generator, n and the volume of the cube."""


def _random_rotations(rng: np.random.Generator, n: int) -> Floats:
    rotations: Floats = Rotation.random(n, rng=rng).as_matrix()
    return rotations


def _straight(n: int, direction: Floats) -> Floats:
    steps = np.arange(n) - (n - 1) / 2
    return steps[:, None] * direction / np.linalg.norm(direction)


def _walk(steps: Floats) -> Floats:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def _headings(angles: Floats) -> Floats:
    """Return unit vectors in the horizontal plane."""
    return np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)


def _looking(ahead: Floats, up: Floats) -> Floats:
    """Return rotations whose third axis looks `ahead`, image tops towards `up`: x right, y down.

    The two directions are unit vectors at right angles.
    """
    right = np.cross(ahead, up)
    return np.stack([right, np.cross(ahead, right), ahead], axis=2)
