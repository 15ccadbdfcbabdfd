"""Mistakes of convention in an estimate, distinguished from inaccuracy.

With R_i, R̂_i the camera-to-world rotations and Q the rotation between the frames:

- *another camera frame*: R̂_i ≈ Q R_i B with one constant B, a swap of axes or any rotation.
- *world-to-camera*: the same for the inverted poses, whose positions fit better, too.
- *inverted rotations* with true positions: the same for the transposed rotations.
- *quaternions with w at the wrong end*: the same for the transposed rotations, with one of two B.
- *mirrored*: the positions fit the reference's mirror image, as after a flip of one axis.

The RAS measures how well the rotations fit. A convention is reported if it raises the RAS by 0.3,
or by half of what is missing to 1: noise, lost cameras or drift fit under none so much better.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..averaging import angles_and_axes, project_to_rotation, rotation_angles, tlud_mean
from ..registration import pcr99
from ..validation import check_poses, check_same_length, finite_rows
from .files import inverse_poses

__all__ = [
    "Convention",
    "check_conventions",
    "describe_rotation",
    "find_convention",
    "rotate_cameras",
]

NEAR_DEG = 10.0  # the largest threshold of the RAS; a smaller B is inaccuracy
MIN_CAMERAS = 10  # fewer fit some rotation by chance
STEPS = 5  # in which B and Q are refined in turn
CLEARLY = 0.02  # in RAS, by which a less likely convention must be better
SHIFTED_QUATERNIONS = {  # the true order, and B where it is read with w at the other end
    "qw qx qy qz": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "qx qy qz qw": np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]),
}
BODY, CAMERA = "x forward, y left, z up", "x right, y down, z forward"
OF_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
COMMON = {  # swaps of axes that have a use: B, and its name
    "none": np.eye(3),
    "180 deg about x, as OpenGL's camera axes to OpenCV's": np.diag([1.0, -1.0, -1.0]),
    f"as a frame with {BODY} to a camera with {CAMERA}": OF_BODY,
    f"as a camera with {CAMERA} to a frame with {BODY}": OF_BODY.T,
}


@dataclass(frozen=True, eq=False)
class Convention:
    """The convention under which an estimate fits its reference.

    Parameters
    ----------
    inverted : bool
        Whether the estimated poses are world-to-camera.
    rotations_inverted : bool
        Whether the rotations alone are world-to-camera, and the positions are camera centres.
    quaternion_order : str
        "qw qx qy qz" or "qx qy qz qw" where quaternions of this order were read with w at the wrong
        end, otherwise empty.
    body_rotation : (3, 3) ndarray or None
        The estimate's camera axes (columns) in the reference's camera frame; None where it is the
        same frame, or no other one explains the estimate.
    mirrored : bool
        Whether the positions fit the mirror image of the reference.
    ras, corrected_ras : float
        RAS of the poses as they are, and under the convention found, approximately.

    Examples
    --------
    >>> from alignscores import Convention
    >>> str(Convention(inverted=True, mirrored=True))
    'the estimated poses are world-to-camera; the estimated positions are mirrored'
    """

    inverted: bool = False
    rotations_inverted: bool = False
    quaternion_order: str = ""
    body_rotation: Floats | None = None
    mirrored: bool = False
    ras: float = 0.0
    corrected_ras: float = 0.0

    def __str__(self) -> str:
        frame = "" if self.body_rotation is None else describe_rotation(self.body_rotation)
        texts = {
            "the estimated poses are world-to-camera": self.inverted,
            "the estimated rotations are world-to-camera": self.rotations_inverted,
            "the quaternions have w at the wrong end": self.quaternion_order,
            f"the camera frame is rotated: {frame}": frame,
            "the estimated positions are mirrored": self.mirrored,
        }
        return "; ".join(text for text, holds in texts.items() if holds) or "no mistake is found"


def find_convention(gt_poses: Floats, est_poses: Floats, *, quaternions: bool = True) -> Convention:
    """Find the convention under which the finite ones of estimated poses fit their reference.

    All of it is False and None where they fit as they are, or fit under none. `quaternions` tells
    whether the rotations may have been quaternions.
    """
    estimated = np.flatnonzero(finite_rows(est_poses))
    n = len(estimated)
    if n < MIN_CAMERAS:
        return Convention()
    rows = estimated[np.linspace(0, n - 1, min(500, n)).astype(int)]
    gt, est = gt_poses[rows], est_poses[rows]
    convention = _of_rotations(gt, est, quaternions)
    positions = (inverse_poses(est) if convention.inverted else est)[:, :3, 3]
    mirrored = _fits_better(gt[:, :3, 3], positions * [1.0, 1.0, -1.0], positions)
    return replace(convention, mirrored=mirrored)


def check_conventions(gt_poses: ArrayLike, est_poses: ArrayLike) -> Convention:
    """Look for a mistake of convention that makes estimated poses fit badly.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Poses as they would be scored, camera-to-world; see `pas`. At least 10 cameras.

    Returns
    -------
    Convention
        What explains the estimate better: inverted poses, other camera axes, quaternions with w at
        the wrong end, mirrored positions; all False or None where nothing does. Its ``str`` says it
        in words.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import check_conventions
    >>> rng = np.random.default_rng(0)
    >>> gt = np.tile(np.eye(4), (30, 1, 1))
    >>> gt[:, :3, :3] = Rotation.random(30, rng=rng).as_matrix()
    >>> gt[:, :3, 3] = rng.random((30, 3))
    >>> convention = check_conventions(gt, np.linalg.inv(gt))
    >>> convention.inverted, str(convention)
    (True, 'the estimated poses are world-to-camera')
    >>> opengl = gt @ np.diag([1.0, -1.0, -1.0, 1.0])
    >>> str(check_conventions(gt, opengl))
    "the camera frame is rotated: 180 deg about x, as OpenGL's camera axes to OpenCV's"
    """
    gt = np.dstack(check_poses(gt_poses, "gt_poses", complete=True))  # (n, 3, 4)
    est = np.dstack(check_poses(est_poses, "est_poses", complete=False))
    check_same_length(gt, est, "gt_poses", "est_poses")
    return find_convention(gt, est)


def rotate_cameras(est_poses: Floats, body_rotation: Floats | None) -> Floats:
    """Return estimated poses (n, 4, 4) with the reference's camera axes: R̂_i Bᵀ."""
    if body_rotation is None:
        return est_poses
    rotated = est_poses.copy()
    rotated[:, :3, :3] = est_poses[:, :3, :3] @ body_rotation.T
    return rotated


def describe_rotation(rotation: Floats) -> str:
    """Return a rotation of the camera frame in words."""
    for name, axes in COMMON.items():
        if np.allclose(rotation, axes):
            return name
    angles, axes = angles_and_axes(rotation[None])
    axis = ", ".join(f"{part:.2f}" for part in axes[:, 0])
    return f"{np.degrees(angles[0]):.1f} deg about ({axis})"


def _of_rotations(gt: Floats, est: Floats, quaternions: bool) -> Convention:
    """Find the convention of the rotations, the likeliest of those that fit clearly better."""
    true, estimated = gt[:, :3, :3], est[:, :3, :3]
    ras = _approximate_ras(true, estimated)
    nothing = Convention(ras=ras, corrected_ras=ras)
    needed = ras + max(0.1, min(0.3, (1 - ras) / 2))
    if needed > 1:
        return nothing
    inverse = inverse_poses(est)
    inverted = _fits_better(gt[:, :3, 3], inverse[:, :3, 3], est[:, :3, 3])
    estimated = inverse[:, :3, :3] if inverted else estimated
    likeliest = [Convention(inverted=inverted, body_rotation=axes) for axes in COMMON.values()]
    if not inverted:
        likeliest += [
            Convention(rotations_inverted=True, body_rotation=axes) for axes in COMMON.values()
        ]
    if quaternions and not inverted:
        likeliest += [
            Convention(quaternion_order=order, body_rotation=axes)
            for order, axes in SHIFTED_QUATERNIONS.items()
        ]
    free = Convention(inverted=inverted, body_rotation=_fitted_frame(true, estimated))
    best = nothing
    for candidate in (*likeliest, free):
        transposed = candidate.rotations_inverted or bool(candidate.quaternion_order)
        rotations = estimated.swapaxes(1, 2) if transposed else estimated
        assert candidate.body_rotation is not None
        fit = _approximate_ras(true, rotations @ candidate.body_rotation.T)
        if fit > best.corrected_ras + CLEARLY:
            best = replace(candidate, ras=ras, corrected_ras=fit)
    if best.corrected_ras < needed or best.body_rotation is None:
        return nothing
    if best.quaternion_order or rotation_angles(best.body_rotation[None])[0] <= NEAR_DEG:
        best = replace(best, body_rotation=None)
    mistaken = best.inverted or best.rotations_inverted or best.quaternion_order
    return best if mistaken or best.body_rotation is not None else nothing


def _fitted_frame(gt: Floats, est: Floats) -> Floats:
    """Return the constant B with R̂_i ≈ Q R_i B.

    Between two cameras both turn by the same angle, about axes that B takes to each other. A B
    near a common one is that: what is between them is inaccuracy.
    """
    true, estimated = _axes_of_turns(gt), _axes_of_turns(est)
    lengths = np.linalg.norm([true, estimated], axis=2)
    alike = np.abs(lengths[0] - lengths[1]) < 0.2  # not so where one of the cameras is an outlier
    moments = true[alike].T @ estimated[alike]
    near_identity = 1e-3 * np.linalg.norm(moments) * np.eye(3)  # where turns are about one axis
    body = project_to_rotation(moments + near_identity)
    for _ in range(STEPS):
        frame = tlud_mean(est @ body.T @ gt.swapaxes(1, 2))
        body = tlud_mean((frame @ gt).swapaxes(1, 2) @ est)
    common = np.array(list(COMMON.values()))
    apart = rotation_angles(common.swapaxes(1, 2) @ body)
    return common[np.argmin(apart)] if apart.min() <= NEAR_DEG else body


def _axes_of_turns(rotations: Floats) -> Floats:
    """Return the axes of the rotations between some pairs of cameras, as long as their sines."""
    n = len(rotations)
    turns = np.concatenate(
        [
            rotations.swapaxes(1, 2) @ np.roll(rotations, k, axis=0)
            for k in (n // 10, n // 4, n // 2)
        ]
    )
    parts = (2, 1), (0, 2), (1, 0)
    return np.column_stack([turns[:, i, j] - turns[:, j, i] for i, j in parts])


def _approximate_ras(gt: Floats, est: Floats) -> float:
    """Return the RAS with infinitely many thresholds; 0 where only few cameras fit, by chance."""
    frame = tlud_mean(est @ gt.swapaxes(1, 2))
    errors = rotation_angles((frame @ gt).swapaxes(1, 2) @ est)
    if np.sum(errors < NEAR_DEG) < MIN_CAMERAS:
        return 0.0
    return float(np.maximum(1 - errors / NEAR_DEG, 0).mean())


def _fits_better(gt: Floats, other: Floats, est: Floats) -> bool:
    """Return whether other positions fit the reference, and three times as well as the given."""
    return _misfit(gt, other) < min(0.15, _misfit(gt, est) / 3)


def _misfit(gt: Floats, est: Floats) -> float:
    """Median position error after robust registration, relative to the extent of the reference."""
    extent = float(np.median(np.linalg.norm(gt - np.median(gt, axis=0), axis=1)))
    rank, rng = len(gt) // 2 + 1, np.random.default_rng(0)
    alignment, _ = pcr99(gt, est, rank=rank, n_hypotheses=300, rng=rng)
    if alignment is None or extent == 0:
        return np.inf
    return float(np.median(alignment.position_errors(gt, est))) / extent
