"""An estimate in parts, such as the sub-models of COLMAP, whose worlds differ.

Each part is aligned by itself, with all its cameras, as if it were the whole estimate and all other
cameras were lost. A camera in several parts is counted by the largest of them, whatever its errors;
a camera in none is a failure. Where no two parts share a camera the TAS of the whole is thus the
sum of the TAS of the parts, and so is the RAS.

To merge parts and align the result is a special choice of an alignment for each part. With the best
alignments the score of the parts is thus an upper bound for every model merged from them, and
scores of different numbers of parts do not compare. A part of fewer than 3 cameras has no
alignment, and a single camera fits any rotation: such cameras fail.

`part_of` is an array (n,) throughout, with the part that counts each camera, -1 where none does.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..aligner import Aligner, one_scene
from ..arrays import Floats, Indices
from ..distance import ErrorsAt
from ..pose import PASResult
from ..rotation import RASResult
from ..similarity import Similarity
from ..translation import TASResult
from ..validation import finite_rows
from .files import Trajectory

__all__ = [
    "all_cameras",
    "assign_cameras",
    "combine",
    "combine_tas",
    "errors_of_parts",
    "in_one_world",
    "poses_by_name",
]


MIN_CAMERAS = 3  # of a part that can be aligned


def all_cameras(parts: Sequence[Trajectory]) -> Trajectory:
    """Return the cameras of all parts, each once, by name, with poses of different worlds."""
    if len(parts) == 1:
        return parts[0]
    keys, rows = np.unique(np.concatenate([part.keys for part in parts]), return_index=True)
    return Trajectory(keys, np.concatenate([part.poses for part in parts])[rows])


def poses_by_name(part: Trajectory, names: Sequence[str | None]) -> Floats:
    """Return the pose of each name in a part, (n, 4, 4), not finite where it has none."""
    row_of = {name: row for row, name in enumerate(part.keys.tolist())}
    rows = np.array([row_of.get(name, -1) for name in names], dtype=np.intp)
    poses = part.poses[rows].copy()
    poses[rows < 0] = np.nan
    return poses


def assign_cameras(parts_poses: Sequence[Floats]) -> Indices:
    """Return `part_of`, of the poses of the same n cameras in each part: the largest with it.

    Of equally large parts it is the first one; parts with too few cameras count none.
    """
    present = np.array([finite_rows(poses) for poses in parts_poses])
    sizes = present * present.sum(axis=1, keepdims=True)
    return np.where(sizes.max(axis=0) >= MIN_CAMERAS, np.argmax(sizes, axis=0), -1)


def combine_tas(results: Sequence[TASResult], part_of: Indices) -> TASResult:
    """Return the TAS of the whole from the TAS of each part over all cameras, with the same d.

    Its alignment is the identity, as for poses `in_one_world`; a single part has its own result.
    """
    first = results[0]
    if len(results) == 1:
        return first
    return replace(
        first,
        errors=_errors_of_whole([result.errors for result in results], part_of),
        alignment=Similarity(1.0, np.eye(3), np.zeros(3)),
        n_hypotheses=sum(result.n_hypotheses for result in results),
    )


def combine(results: Sequence[PASResult], part_of: Indices) -> PASResult:
    """Return the PAS of the whole: the weighted mean of its TAS and RAS."""
    first = results[0]
    if len(results) == 1:
        return first
    tas = combine_tas([result.tas for result in results], part_of)
    ras: RASResult = replace(
        first.ras,
        errors=_errors_of_whole([result.ras.errors for result in results], part_of),
        alignment=np.eye(3),
    )
    score = first.weight * tas.score + (1 - first.weight) * ras.score
    return PASResult(score=score, tas=tas, ras=ras, weight=first.weight)


def errors_of_parts(
    gt_positions: Floats,
    parts_positions: Sequence[Floats],
    part_of: Indices,
    *,
    rng: int,
    alignment: str = "similarity",
    up: str = "z",
) -> ErrorsAt:
    """Return a function from a unit to the errors of the whole, by the refined registration.

    Each part, with positions (n, 3) of the same cameras as the ground truth, is aligned for its
    largest score at that unit.
    """
    options: dict[str, Any] = {"rng": rng, "alignment": alignment, "up": up}
    aligners = [
        Aligner(
            *one_scene(gt_positions, part),
            registration="refined",
            n_hypotheses=1000,
            keep=True,
            **options,
        )
        for part in parts_positions
    ]

    def errors_at(unit: float) -> Floats:
        errors = [aligner.align(np.array([unit])).errors for aligner in aligners]
        return errors[0] if len(errors) == 1 else _errors_of_whole(errors, part_of)

    return errors_at


def _errors_of_whole(parts_errors: Sequence[Floats], part_of: Indices) -> Floats:
    """Return the error of each camera in the part that counts it; infinite where none does."""
    errors = np.array(parts_errors)[part_of, np.arange(len(part_of))]
    return np.where(part_of < 0, np.inf, errors)


def in_one_world(
    parts_poses: Sequence[Floats], results: Sequence[PASResult], part_of: Indices
) -> Floats:
    """Return the pose of each camera in the world of the ground truth, by its part's alignment.

    A position (rotation) is not finite where no part counts the camera, or the part's TAS (RAS)
    has no alignment. The poses of a single part stay as they are.
    """
    if len(results) == 1:
        return parts_poses[0]
    poses = np.tile(np.eye(4), (len(part_of), 1, 1))
    poses[:, :3] = np.nan
    for index, (part, result) in enumerate(zip(parts_poses, results, strict=True)):
        rows = part_of == index
        if result.tas.alignment is not None:
            poses[rows, :3, 3] = result.tas.alignment.inverse().apply(part[rows, :3, 3])
        if result.ras.alignment is not None:
            poses[rows, :3, :3] = result.ras.alignment.T @ part[rows, :3, :3]
    return poses
