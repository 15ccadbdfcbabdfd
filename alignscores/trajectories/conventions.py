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

from ..arrays import Floats
from ..averaging import angles_and_axes, project_to_rotation, rotation_angles, tlud_mean
from ..io import inverse_poses
from ..registration import pcr99
from ..validation import finite_rows

__all__ = ["Convention", "describe_rotation", "find_convention", "rotate_cameras"]

NEAR_DEG = 10.0  # the largest threshold of the RAS; a smaller B is inaccuracy
MIN_CAMERAS = 10  # fewer fit some rotation by chance
STEPS = 5  # in which B and Q are refined in turn
CLEARLY = 0.02  # in RAS, by which a less likely convention must be better
QUATERNION_ORDERS = {  # the true order, and B where it is read with w at the other end
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
    """The convention under which an estimate fits its reference; all is empty if there is none."""

    kind: str = ""  # inverted, inverted rotations, mirrored, or the true order of quaternions
    body_rotation: Floats | None = None  # its camera axes (columns) in the reference's camera frame
    ras: float = 0.0  # of the poses as they are
    corrected_ras: float = 0.0  # under the convention


def find_convention(gt_poses: Floats, est_poses: Floats) -> Convention:
    """Find the convention under which the finite ones of estimated poses fit their reference."""
    estimated = np.flatnonzero(finite_rows(est_poses))
    n = len(estimated)
    if n < MIN_CAMERAS:
        return Convention()
    rows = estimated[np.linspace(0, n - 1, min(500, n)).astype(int)]
    gt, est = gt_poses[rows], est_poses[rows]
    convention = _of_rotations(gt, est)
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0]) @ est
    if not convention.kind and _fits_better(gt, mirrored, est):
        return replace(convention, kind="mirrored")
    return convention


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
    axis = ", ".join(f"{part:z.2f}" for part in axes[:, 0])
    return f"{np.degrees(angles[0]):.1f} deg about ({axis})"


def _of_rotations(gt: Floats, est: Floats) -> Convention:
    """Find the convention of the rotations, the likeliest of those that fit about as well."""
    true, rotations = gt[:, :3, :3], est[:, :3, :3]
    ras_now = _ras(true, rotations)
    if ras_now > 0.9:
        return Convention()
    inverse = inverse_poses(est)
    kind = "inverted" if _fits_better(gt, inverse, est) else ""
    rotations = inverse[:, :3, :3] if kind else rotations
    candidates = [(kind, rotations, axes) for axes in COMMON.values()]
    if not kind:
        transposed = rotations.swapaxes(1, 2)
        candidates += [("inverted rotations", transposed, axes) for axes in COMMON.values()]
        candidates += [(order, transposed, axes) for order, axes in QUATERNION_ORDERS.items()]
    candidates.append((kind, rotations, _fitted_frame(true, rotations)))
    fits = np.array([_ras(true, rotations @ axes.T) for _, rotations, axes in candidates])
    likeliest = int(np.argmax(fits > fits.max() - CLEARLY))
    if fits[likeliest] < ras_now + min(0.3, (1 - ras_now) / 2):
        return Convention()
    kind, _, axes = candidates[likeliest]
    is_same = kind in QUATERNION_ORDERS or rotation_angles(axes[None])[0] <= NEAR_DEG
    return Convention(kind, None if is_same else axes, ras_now, float(fits[likeliest]))


def _fitted_frame(gt: Floats, est: Floats) -> Floats:
    """Return the constant B with R̂_i ≈ Q R_i B.

    Between two cameras both turn by the same angle, about axes that B takes to each other. A B
    near a common one is that: what is between them is inaccuracy.
    """
    true, estimated = _turns(gt), _turns(est)
    lengths = np.linalg.norm([true, estimated], axis=2)
    alike = np.abs(lengths[0] - lengths[1]) < 0.1  # not so where one of the cameras is an outlier
    moments = true[alike].T @ estimated[alike]
    near_identity = 1e-3 * np.linalg.norm(moments) * np.eye(3)  # where turns are about one axis
    body = project_to_rotation(moments + near_identity)
    for _ in range(STEPS):
        frame = tlud_mean(est @ body.T @ gt.swapaxes(1, 2))
        body = tlud_mean((frame @ gt).swapaxes(1, 2) @ est)
    common = np.array(list(COMMON.values()))
    apart = rotation_angles(common.swapaxes(1, 2) @ body)
    return common[np.argmin(apart)] if apart.min() <= NEAR_DEG else body


def _turns(rotations: Floats) -> Floats:
    """Return the axes of the rotations between some pairs of cameras, as long as their sines."""
    n = len(rotations)
    partners = np.concatenate([np.roll(rotations, k, axis=0) for k in (n // 10, n // 4, n // 2)])
    angles, axes = angles_and_axes(np.tile(rotations, (3, 1, 1)).swapaxes(1, 2) @ partners)
    return np.asarray((np.sin(angles) * axes).T)


def _ras(gt: Floats, est: Floats) -> float:
    """Return the RAS with infinitely many thresholds, also of what is no rotation."""
    frame = tlud_mean(est @ gt.swapaxes(1, 2))
    errors = rotation_angles((frame @ gt).swapaxes(1, 2) @ est)
    return float(np.maximum(1 - errors / NEAR_DEG, 0).mean())


def _fits_better(gt: Floats, other: Floats, est: Floats) -> bool:
    """Return whether other positions fit the reference, and three times as well as the given."""
    return _misfit(gt, other) < min(0.15, _misfit(gt, est) / 3)


def _misfit(gt: Floats, est: Floats) -> float:
    """Return the median error of aligned positions, relative to the extent of the reference."""
    gt, est = gt[:, :3, 3], est[:, :3, 3]
    extent = float(np.median(np.linalg.norm(gt - np.median(gt, axis=0), axis=1)))
    rank, rng = len(gt) // 2 + 1, np.random.default_rng(0)
    alignment, _ = pcr99(gt, est, rank=rank, n_hypotheses=300, rng=rng)
    if alignment is None or extent == 0:
        return np.inf
    return float(np.median(alignment.position_errors(gt, est))) / extent
