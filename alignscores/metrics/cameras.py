"""The cameras that a metric is given: checked, and those without an estimate marked."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Booleans, Floats
from ..similarity import FARTHEST_SQUARABLE
from ..validation import check_poses, check_positions, check_same_length, finite_rows

__all__ = ["Cameras", "NoValueError", "check_choice", "estimated_positions", "moderate"]


class NoValueError(ValueError):
    """The metric has no value for this input: its program stops, or writes nothing."""


def estimated_positions(gt_positions: ArrayLike, est_positions: ArrayLike) -> tuple[Floats, Floats]:
    """Return the checked centres (n, 3) of the cameras with an estimate, true and estimated."""
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=False)
    check_same_length(gt, est, "gt_positions", "est_positions")
    rows = finite_rows(est)
    return moderate(gt[rows]), moderate(est[rows])


@dataclass(frozen=True, eq=False)
class Cameras:
    """Camera-to-world poses of both frames; rows that were not estimated are not finite."""

    gt_rotations: Floats
    gt: Floats
    est_rotations: Floats
    est: Floats
    estimated: Booleans

    @classmethod
    def check(cls, gt_poses: ArrayLike, est_poses: ArrayLike) -> "Cameras":
        """Check (n, 4, 4) or (n, 3, 4) poses."""
        gt_rotations, gt = check_poses(gt_poses, "gt_poses", complete=True)
        est_rotations, est = check_poses(est_poses, "est_poses", complete=False)
        check_same_length(gt, est, "gt_poses", "est_poses")
        estimated = finite_rows(est_rotations) & finite_rows(est)
        return cls(gt_rotations, moderate(gt), est_rotations, moderate(est), estimated)

    def __len__(self) -> int:
        return len(self.gt)

    def matched(self) -> "Cameras":
        """Return the cameras with an estimate."""
        return Cameras(*(array[self.estimated] for array in vars(self).values()))


def check_choice(value: str, choices: Iterable[str], name: str) -> None:
    """Check that an option is one of some words."""
    *words, last = choices
    if value not in (*words, last):
        raise ValueError(f"{name} must be {', '.join(words)} or {last}, not {value!r}")


def moderate(positions: Floats) -> Floats:
    """Clip coordinates whose squares would overflow."""
    return np.clip(positions, -FARTHEST_SQUARABLE, FARTHEST_SQUARABLE)
