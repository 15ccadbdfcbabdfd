"""The lever arm from the body of an estimate to the prism or antenna whose positions are known."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..averaging import rotation_from_vector
from ..similarity import Similarity
from ..translation import tas
from ..validation import finite_rows
from .files import Trajectory

__all__ = ["LeverArm", "find_lever_arm", "with_lever_arm"]

STEPS = 20  # of the fit
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


def find_lever_arm(gt_positions: Floats, est_poses: Floats) -> LeverArm:
    """Return the lever arm l with which estimated poses fit positions (n, 3), in order of time.

    p + R l = s Q g + t is linear in l, and is solved for it together with small changes of the
    similarity, on the inliers. The standard error comes from a jackknife over stretches of time,
    since errors of neighbouring poses are alike. ValueError where it is larger than the errors.
    """
    finite = finite_rows(est_poses)
    gt, est = gt_positions[finite], est_poses[finite]
    alignment = tas(gt, est[:, :3, 3], registration="refined").alignment if len(gt) > 3 else None
    if alignment is None:
        raise ValueError("no lever arm is found: the positions cannot be aligned")
    vector = np.zeros(3)
    blocks = np.arange(len(gt)) * BLOCKS // len(gt)
    for _ in range(STEPS):
        turned = gt @ alignment.rotation.T
        wanted = alignment.scale * turned + alignment.translation - est[:, :3, 3]
        misfit = np.linalg.norm(wanted - est[:, :3, :3] @ vector, axis=1)
        inlier = misfit <= FAR * np.median(misfit)
        design = _design(alignment.scale * turned, turned, est[:, :3, :3])
        squares, products = np.zeros((BLOCKS, 10, 10)), np.zeros((BLOCKS, 10))
        for block in range(BLOCKS):
            rows = inlier & (blocks == block)
            stacked = design[rows].reshape(-1, 10)
            squares[block], products[block] = stacked.T @ stacked, stacked.T @ wanted[rows].ravel()
        solution = _solved(squares.sum(axis=0), products.sum(axis=0))
        vector = solution[:3]
        alignment = Similarity(
            alignment.scale - solution[6],
            rotation_from_vector(-solution[3:6]) @ alignment.rotation,
            alignment.translation - solution[7:],
        )
    others = np.array(
        [
            _solved(squares.sum(axis=0) - squares[k], products.sum(axis=0) - products[k])[:3]
            for k in range(BLOCKS)
        ]
    )
    errors = np.sqrt((BLOCKS - 1) * others.var(axis=0))
    if errors.max() > np.sqrt(np.mean(misfit[inlier] ** 2)):
        said = ", ".join(f"{value:.2g}" for value in errors)
        raise ValueError(f"no lever arm is found: its motion leaves it uncertain by {said}")
    return LeverArm(vector, errors)


def _design(scaled: Floats, turned: Floats, rotations: Floats) -> Floats:
    """Return what changes of lever arm, rotation, scale and translation add to p, (n, 3, 10)."""
    design = np.zeros((len(turned), 3, 10))
    design[:, :, :3] = rotations
    design[:, [0, 1, 2], [4, 5, 3]] = scaled[:, [2, 0, 1]]
    design[:, [0, 1, 2], [5, 3, 4]] = -scaled[:, [1, 2, 0]]
    design[:, :, 6] = turned
    design[:, :, 7:] = np.eye(3)
    return design


def _solved(squares: Floats, products: Floats) -> Floats:
    """Return the solution of normal equations."""
    size = np.sqrt(np.diag(squares))
    if not (size > 0).all() or np.linalg.cond(squares / np.outer(size, size)) > 1e10:
        raise ValueError("no lever arm is found: its rotations do not determine it")
    return np.linalg.solve(squares / np.outer(size, size), products / size) / size
