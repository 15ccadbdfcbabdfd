"""The lever arm from the body of an estimate to the prism or antenna whose positions are known."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..averaging import rotation_from_vector
from ..io import Trajectory
from ..similarity import Similarity
from ..translation import tas
from ..validation import finite_rows

__all__ = ["LeverArm", "find_lever_arm", "with_lever_arm"]

STEPS = 10  # of the fit
BLOCKS = 10  # stretches of time, each left out for the standard error
FAR = 3.0  # median errors beyond which a pose is an outlier


@dataclass(frozen=True)
class LeverArm:
    """A position in the estimate's body frame, and the standard errors of its coordinates."""

    vector: Floats
    errors: Floats


def with_lever_arm(estimate: Trajectory, vector: Floats) -> Trajectory:
    """Return an estimate with the positions of a point at `vector` in its body frame."""
    poses = estimate.poses.copy()
    poses[:, :3, 3] += poses[:, :3, :3] @ vector
    return estimate._replace(poses=poses)


def find_lever_arm(gt_positions: Floats, est_poses: Floats, unit: float) -> LeverArm:
    """Return the lever arm l with which estimated poses fit positions (n, 3), in order of time.

    p + R l = s Q g + t is linear in l, and is solved for it together with small changes of the
    similarity, on the inliers. The standard error comes from a jackknife over stretches of time,
    since errors of neighbouring poses are alike. ValueError where it is larger than half of
    what the positions are off without a lever arm; `unit` is d.
    """
    finite = finite_rows(est_poses)
    gt = gt_positions[finite] - gt_positions[finite].mean(axis=0)
    positions, rotations = est_poses[finite, :3, 3], est_poses[finite, :3, :3]
    alignment = tas(gt, positions, unit=unit, registration="refined").alignment
    if alignment is None:
        raise ValueError("no lever arm is found: the positions cannot be aligned")
    vector, misfits = np.zeros(3), np.zeros(STEPS)
    for step in range(STEPS):
        rotated = gt @ alignment.rotation.T
        offsets = alignment.scale * rotated + alignment.translation - positions
        misfit = np.linalg.norm(offsets - rotations @ vector, axis=1)
        misfits[step] = np.median(misfit)
        inlier = misfit <= FAR * misfits[step]
        design = _design(alignment.scale * rotated, rotated, rotations)
        solution = _solved(design[inlier], offsets[inlier])
        vector = solution[:3]
        alignment = Similarity(
            alignment.scale - solution[6],
            rotation_from_vector(-solution[3:6]) @ alignment.rotation,
            alignment.translation - solution[7:],
        )
    blocks = np.arange(len(gt)) * BLOCKS // len(gt)
    parts = [inlier & (blocks != block) for block in range(BLOCKS)]
    others = np.array([_solved(design[part], offsets[part])[:3] for part in parts])
    errors = np.sqrt((BLOCKS - 1) * others.var(axis=0))
    if 2 * errors.max() > misfits[0]:
        text = ", ".join(f"{value:.2g}" for value in errors)
        raise ValueError(f"no lever arm is found: its motion leaves it uncertain by {text}")
    return LeverArm(vector, errors)


def _design(scaled: Floats, rotated: Floats, rotations: Floats) -> Floats:
    """Return what changes of lever arm, rotation, scale and translation add to p, (n, 3, 10)."""
    crossed = np.cross(np.eye(3), scaled[:, None]).swapaxes(1, 2)
    shifts = np.broadcast_to(np.eye(3), rotations.shape)
    return np.concatenate([rotations, crossed, rotated[:, :, None], shifts], axis=2)


def _solved(design: Floats, offsets: Floats) -> Floats:
    """Return the changes that add up to the offsets."""
    solution, _, rank, _ = np.linalg.lstsq(design.reshape(-1, 10), offsets.ravel())
    if rank < 10:
        raise ValueError("no lever arm is found: its rotations do not determine it")
    return np.asarray(solution)
