"""Poses from what trajectory files hold: checked, and with rotations that are rotations."""

import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats
from ...averaging import nearest_rotations, rotations_from_quaternions
from ...validation import finite_rows
from .text import FilePath, Source

__all__ = ["Trajectory", "TrajectoryWarning", "inverse_poses"]

MAX_ROUNDING = 1e-2  # deviation from a unit quaternion or a rotation that counts as rounding
MAX_DEVIATION = 0.1  # deviation from a rotation beyond which a matrix is refused


class TrajectoryWarning(UserWarning):
    """Something in a trajectory that was corrected, and that the user should know about."""


class Trajectory(NamedTuple):
    """Poses with what identifies each of them.

    Parameters
    ----------
    keys : (n,) ndarray
        Time stamps in seconds (float), image names (str) or row numbers (int).
    poses : (n, 4, 4) ndarray
        Camera-to-world poses.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import Trajectory
    >>> Trajectory(np.array([0.5, 1.0]), np.tile(np.eye(4), (2, 1, 1)))
    Trajectory(2 poses, 0.5 to 1.0)
    >>> keys, poses = Trajectory(np.array([0.5]), np.eye(4)[None])
    >>> keys
    array([0.5])
    """

    keys: NDArray[Any]
    poses: Floats

    def __repr__(self) -> str:
        n = len(self.keys)
        return f"Trajectory({n} poses, {self.keys[0]} to {self.keys[-1]})" if n else "Trajectory()"

    @property
    def has_rotations(self) -> bool:
        """Whether a rotation is finite; False for positions alone."""
        rotations, positions = self.poses[:, :3, :3], self.poses[:, :3, 3]
        return bool(finite_rows(rotations).any() or not finite_rows(positions).any())

    def with_rotations(self) -> "Trajectory":
        """Return positions alone with identity rotations, other trajectories unchanged.

        Returns
        -------
        Trajectory
            The trajectory, each finite pose with a rotation.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import Trajectory
        >>> Trajectory(np.arange(2.0), np.tile(np.eye(4), (2, 1, 1))).with_rotations()
        Trajectory(2 poses, 0.0 to 1.0)
        """
        if self.has_rotations:
            return self
        poses = self.poses.copy()
        poses[finite_rows(poses[:, :3, 3]), :3, :3] = np.eye(3)
        return self._replace(poses=poses)


def inverse_poses(poses: Floats) -> Floats:
    """Invert poses (n, 4, 4): camera-to-world from world-to-camera, or the other way round."""
    inverse = poses.copy()
    inverse[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    inverse[:, :3, 3] = -np.einsum("nji,nj->ni", poses[:, :3, :3], poses[:, :3, 3])
    return inverse


def poses_from_positions(positions: Floats) -> Floats:
    """Return poses (n, 4, 4) without rotations, which are nan."""
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = np.nan, positions
    return poses


def poses_from_quaternions(positions: Floats, quaternions: Floats, source: Source) -> Floats:
    """Return poses (n, 4, 4); quaternions are x, y, z, w.

    Quaternions of zeros throughout are no rotations; otherwise a pose with one was not estimated.
    """
    poses = poses_from_positions(positions)
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(quaternions, axis=1)
    zero = lengths == 0
    _warn_of(np.abs(lengths - ~zero), source, "has a quaternion that is not of unit length")
    estimated = np.isfinite(lengths) & ~zero
    unit = quaternions[estimated] / lengths[estimated, None]
    poses[estimated, :3, :3] = rotations_from_quaternions(unit)
    if zero.all():
        warn(source.path, "all quaternions are zero, which are no rotations")
    elif zero.any():
        poses[zero, :3, 3] = np.nan
        poses_have = "pose has" if zero.sum() == 1 else "poses have"
        warn(source.path, f"{zero.sum()} {poses_have} a quaternion of zeros: not estimated")
    return poses


def poses_from_matrices(matrices: Floats, source: Source) -> Floats:
    """Return poses (n, 4, 4) of matrices (n, 3 or 4, 4), with the rotations nearest to theirs."""
    wrong = (matrices[:, 3:] != [0, 0, 0, 1]).any(axis=(1, 2)) & finite_rows(matrices)
    source.refuse(wrong, "the last row of the matrix must be 0 0 0 1")
    linear = matrices[:, :3, :3]
    with np.errstate(all="ignore"):
        deviation = np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max(axis=(1, 2))
        reflected = (np.linalg.det(linear) < 0) & (deviation <= MAX_DEVIATION)
    far = ~(deviation <= MAX_DEVIATION) & finite_rows(linear)
    if far.any():
        row = int(np.argmax(far))
        reason = f"R^T R differs from the identity by {deviation[row]:.2g}"
        raise source.error(row, f"the matrix is not a rotation: {reason}")
    source.refuse(reflected, "the matrix is not a rotation: its determinant is negative")
    _warn_of(deviation, source, "has a matrix that is only roughly a rotation")
    poses = np.tile(np.eye(4), (len(matrices), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = nearest_rotations(linear), matrices[:, :3, 3]
    return poses


def _warn_of(deviation: Floats, source: Source, what: str) -> None:
    """Warn of rotations that deviate from a rotation by more than rounding explains."""
    rows = np.flatnonzero(np.isfinite(deviation) & (deviation > MAX_ROUNDING))
    if len(rows) > 0:
        first, others = int(rows[0]), len(rows) - 1
        more = f" and so have {others} more" if others else ""
        off = f"{what} (off by {deviation[first]:.2g}){more}; normalised"
        warn(f"{source.path}, {source.place(first)}", off)


def warn(path: FilePath, what: str) -> None:
    """Warn of what is unusual in a file, or at a place in it."""
    warnings.warn(f"{path}: {what}", TrajectoryWarning, stacklevel=4)
