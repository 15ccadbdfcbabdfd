"""Synthetic cameras: ground truth, estimate with noise and outliers, in two unrelated worlds."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["Scene", "make_scene"]

Floats = NDArray[np.float64]

OUTLIER_SIDE = 10.0  # outliers lie in a cube of this side, whatever the extent of the cameras
SCALE_RANGE = (0.1, 10.0)  # of the estimated world, log-uniform
TRANSLATION_LIMIT = 100.0  # of the estimated world, uniform within plus and minus this


@dataclass(frozen=True, eq=False)
class Scene:
    """Ground-truth and estimated cameras; row i of both is the same camera.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) ndarray
        Camera-to-world rotations.
    gt_positions, est_positions : (n, 3) ndarray
        Camera centres in their world.
    """

    gt_rotations: Floats
    gt_positions: Floats
    est_rotations: Floats
    est_positions: Floats

    @cached_property
    def gt_poses(self) -> Floats:
        """Ground-truth poses, camera-to-world, (n, 3, 4)."""
        return np.concatenate([self.gt_rotations, self.gt_positions[..., None]], axis=2)

    @cached_property
    def est_poses(self) -> Floats:
        """Estimated poses, camera-to-world, (n, 3, 4)."""
        return np.concatenate([self.est_rotations, self.est_positions[..., None]], axis=2)


def make_scene(
    rng: np.random.Generator,
    *,
    geometry: str,
    volume: float,
    n_cameras: int,
    n_outliers: int,
    sigma_t: float,
    sigma_r_deg: float,
) -> Scene:
    """Draw one ground truth and one estimate of it.

    Parameters
    ----------
    rng : Generator
        Source of all randomness.
    geometry : {"cube", "line", "x_axis"}
        Cameras uniform in a cube centred at the origin, or at unit steps along a line through it,
        of random direction or the first axis.
    volume : float
        Volume of the cube in cubed units.
    n_cameras, n_outliers : int
        Number of cameras, and how many of them, chosen at random, have an estimate that is
        uniformly random in position (a cube of side 10) and rotation.
    sigma_t : float
        Standard deviation of the position noise along each axis, in ground-truth units.
    sigma_r_deg : float
        The angle of the rotation noise is normal with this standard deviation, in degrees; its axis
        is uniformly random.

    Returns
    -------
    Scene
        The cameras; the estimate has been moved to a world of random scale, rotation and origin.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 6.

    Examples
    --------
    >>> import numpy as np
    >>> from experiments.cameras import make_scene
    >>> scene = make_scene(
    ...     np.random.default_rng(0),
    ...     geometry="line",
    ...     volume=1.0,
    ...     n_cameras=5,
    ...     n_outliers=1,
    ...     sigma_t=0.01,
    ...     sigma_r_deg=3.0,
    ... )
    >>> np.linalg.norm(np.diff(scene.gt_positions, axis=0), axis=1).round(9)
    array([1., 1., 1., 1.])
    """
    gt_rotations = Rotation.random(n_cameras, rng=rng).as_matrix()
    gt_positions = _positions(rng, geometry, volume, n_cameras)

    rotations = _rotation_noise(rng, n_cameras, sigma_r_deg) @ gt_rotations
    positions = gt_positions + sigma_t * rng.standard_normal((n_cameras, 3))
    outliers = rng.choice(n_cameras, size=n_outliers, replace=False)
    half = OUTLIER_SIDE / 2
    positions[outliers] = rng.uniform(-half, half, size=(n_outliers, 3))
    rotations[outliers] = Rotation.random(n_outliers, rng=rng).as_matrix()

    world = Rotation.random(rng=rng).as_matrix()
    scale = np.exp(rng.uniform(*np.log(SCALE_RANGE)))
    origin = rng.uniform(-TRANSLATION_LIMIT, TRANSLATION_LIMIT, size=3)
    return Scene(
        gt_rotations=gt_rotations,
        gt_positions=gt_positions,
        est_rotations=world @ rotations,
        est_positions=scale * positions @ world.T + origin,
    )


def _positions(rng: np.random.Generator, geometry: str, volume: float, n: int) -> Floats:
    if geometry in ("line", "x_axis"):
        direction: Floats = rng.standard_normal(3) if geometry == "line" else np.eye(3)[0]
        steps = np.arange(n) - (n - 1) / 2
        return steps[:, None] * direction / np.linalg.norm(direction)
    side = np.cbrt(volume)
    return rng.uniform(-side / 2, side / 2, size=(n, 3))


def _rotation_noise(rng: np.random.Generator, n: int, sigma_deg: float) -> Floats:
    """Rotations about uniformly random axes by normally distributed angles."""
    axes = rng.standard_normal((n, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.radians(sigma_deg) * rng.standard_normal((n, 1))
    noise: Floats = Rotation.from_rotvec(angles * axes).as_matrix()
    return noise
