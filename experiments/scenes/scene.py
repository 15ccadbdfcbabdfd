"""Synthetic cameras: ground truth, estimate with errors and outliers, in two unrelated worlds."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from alignscores.arrays import Booleans, Floats

from .errors import ERRORS
from .outliers import OUTLIERS
from .paths import PATHS

__all__ = ["Scene", "make_scene"]


SCALE_RANGE = (0.1, 10.0)  # of the estimated world, log-uniform
TRANSLATION_LIMIT = 100.0  # of the estimated world, uniform within plus and minus this


@dataclass(frozen=True, eq=False)
class Scene:
    """Ground-truth and estimated cameras; row i of both is the same camera.

    An estimated camera that is missing has rows of NaN.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) ndarray
        Camera-to-world rotations.
    gt_positions, est_positions : (n, 3) ndarray
        Camera centres in their world.
    is_outlier : (n,) ndarray of bool
        Which of the estimated cameras are outliers.
    """

    gt_rotations: Floats
    gt_positions: Floats
    est_rotations: Floats
    est_positions: Floats
    is_outlier: Booleans

    @cached_property
    def estimated(self) -> "Scene":
        """The cameras that were estimated, without the missing ones."""
        found = np.atleast_1d(np.isfinite(self.est_positions).all(axis=1))
        return self if found.all() else self[found]

    def __getitem__(self, cameras: slice | Booleans) -> "Scene":
        """Return some of the cameras."""
        return Scene(*(getattr(self, field.name)[cameras] for field in fields(self)))

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
    error: str = "gaussian",
    outliers: str = "uniform",
    outlier_side: float = 10.0,
    volume: float = 1.0,
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
    geometry : str
        Name out of `experiments.scenes.PATHS`: where the cameras stand and look.
    error : str
        Name out of `experiments.scenes.ERRORS`: how the estimate departs from the ground truth.
    outliers : str
        Name out of `experiments.scenes.OUTLIERS`: what becomes of the outliers.
    outlier_side : float
        Side of the cube that outliers lie in, centred at the origin, in ground-truth units.
    volume : float
        Volume of the cube that cameras of the geometry "cube" lie in, in cubed units.
    n_cameras, n_outliers : int
        Number of cameras, and how many of them are outliers.
    sigma_t : float
        Root mean square of the displacement along each axis, in ground-truth units.
    sigma_r_deg : float
        Root mean square of the angle of the rotation errors, in degrees.

    Returns
    -------
    Scene
        The cameras; the estimate has been moved to a world of random scale, rotation and origin.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 6: the defaults, with the geometries "cube" and
    "line". The others are not in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from experiments.scenes import make_scene
    >>> scene = make_scene(
    ...     np.random.default_rng(0),
    ...     geometry="line",
    ...     n_cameras=5,
    ...     n_outliers=1,
    ...     sigma_t=0.01,
    ...     sigma_r_deg=3.0,
    ... )
    >>> np.linalg.norm(np.diff(scene.gt_positions, axis=0), axis=1).round(9)
    array([1., 1., 1., 1.])
    """
    gt_rotations, gt_positions = PATHS[geometry](rng, n_cameras, volume)
    rotvecs, displacements = ERRORS[error](
        rng, gt_rotations, gt_positions, sigma_t, float(np.radians(sigma_r_deg))
    )
    rotations = Rotation.from_rotvec(rotvecs).as_matrix() @ gt_rotations
    positions = gt_positions + displacements
    is_outlier = np.zeros(n_cameras, dtype=np.bool_)
    is_outlier[OUTLIERS[outliers](rng, rotations, positions, n_outliers, outlier_side)] = True

    world = Rotation.random(rng=rng).as_matrix()
    scale = np.exp(rng.uniform(*np.log(SCALE_RANGE)))
    origin = rng.uniform(-TRANSLATION_LIMIT, TRANSLATION_LIMIT, size=3)
    return Scene(
        gt_rotations=gt_rotations,
        gt_positions=gt_positions,
        est_rotations=world @ rotations,
        est_positions=scale * positions @ world.T + origin,
        is_outlier=is_outlier,
    )
