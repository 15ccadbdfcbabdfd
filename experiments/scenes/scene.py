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
    """Ground-truth and estimated cameras, row by row the same; a missing one has rows of NaN."""

    gt_rotations: Floats  # camera-to-world
    gt_positions: Floats  # camera centres
    est_rotations: Floats
    est_positions: Floats

    @cached_property
    def estimated(self) -> "Scene":
        """The cameras that were estimated, without the missing ones."""
        has_position = np.atleast_1d(np.isfinite(self.est_positions).all(axis=1))
        return self if has_position.all() else self[has_position]

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
    outlier_side: float = 10.0,  # of the cube about the origin that they lie in
    volume: float = 1.0,  # of the cube of the geometry "cube"; n / 10: 10 cameras per cubed unit
    n_cameras: int,
    n_outliers: int,
    sigma_t: float,
    sigma_r_deg: float,
) -> Scene:
    """Draw a ground truth, and an estimate of it in a frame of random scale, rotation and origin.

    `sigma_t` is the root mean square of the displacement along each axis, in ground-truth units,
    `sigma_r_deg` the one of the angle of the rotation errors. The defaults are from Lee and Civera,
    "Alignment Scores", section 6, with the geometries "cube" and "line", whose cameras are a unit
    apart; other geometries are not in the paper. Where the number of cameras varies, the volume is
    a tenth of it: the paper's density of 10 cameras per cubed unit.
    """
    gt_rotations, gt_positions = PATHS[geometry](rng, n_cameras, volume)
    rotvecs, displacements = ERRORS[error](
        rng, gt_rotations, gt_positions, sigma_t, float(np.radians(sigma_r_deg))
    )
    rotations = Rotation.from_rotvec(rotvecs).as_matrix() @ gt_rotations
    positions = gt_positions + displacements
    OUTLIERS[outliers](rng, rotations, positions, n_outliers, outlier_side)

    world = Rotation.random(rng=rng).as_matrix()
    scale = np.exp(rng.uniform(*np.log(SCALE_RANGE)))
    origin = rng.uniform(-TRANSLATION_LIMIT, TRANSLATION_LIMIT, size=3)
    return Scene(
        gt_rotations=gt_rotations,
        gt_positions=gt_positions,
        est_rotations=world @ rotations,
        est_positions=scale * positions @ world.T + origin,
    )
