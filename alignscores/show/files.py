"""Files of estimates for other programs: the errors of each frame, and aligned trajectories."""

import math
from collections.abc import Sequence
from io import BytesIO

import numpy as np
import scipy

from ..evaluation.evaluation import STATUSES, Evaluation
from ..extras import require
from ..validation import finite_rows
from . import tables

__all__ = ["aligned", "errors_csv"]


def errors_csv(scored: Sequence[Evaluation]) -> str:
    """Return a table of the errors of each expected frame, with a status.

    Frames that are left out, or have no reference pose, have no errors.
    """
    lines: list[tuple[object, ...]] = []
    for evaluation in scored:
        matches, result = evaluation.matches, evaluation.result
        statuses = [STATUSES[status] for status in evaluation.statuses]
        errors = result.tas.errors.tolist(), result.ras.errors.tolist()
        rows = list(zip(matches.keys.tolist(), *errors, statuses, strict=True))
        without = matches.without_reference.tolist()
        rows += [(key, math.nan, math.nan, "no reference pose") for key in without]
        if evaluation.settings.missing != "fail":
            keys = evaluation.reference.keys[matches.expected_rows]
            left_out = keys[~np.isin(keys, matches.keys)].tolist()
            rows += [(key, math.nan, math.nan, "left out") for key in left_out]
        lines += [(evaluation.name, *row) for row in sorted(rows, key=lambda row: row[0])]
    columns = ["estimate", "camera", "position_error", "rotation_error_deg", "status"]
    return tables.as_csv(require("pandas", "tables").DataFrame(lines, columns=columns))


def aligned(evaluation: Evaluation) -> bytes:
    """Return an estimate in the reference's frame, with its time stamps: as TUM, or KITTI without.

    It has all its poses, whether they were matched or not, aligned as in the TAS.
    """
    alignment = evaluation.result.tas.alignment
    if alignment is None:
        raise ValueError(f"is not written, since {evaluation.name} could not be aligned")
    keys, poses = evaluation.estimate
    to_reference = alignment.inverse()
    positions = to_reference.apply(poses[:, :3, 3])
    rotations = to_reference.rotation @ poses[:, :3, :3]
    if keys.dtype.kind == "f":
        quaternions = np.full((len(poses), 4), np.nan)
        finite = finite_rows(rotations)
        of_matrix = scipy.spatial.transform.Rotation.from_matrix
        quaternions[finite] = of_matrix(rotations[finite]).as_quat()
        columns = [keys, positions, quaternions]
    else:
        columns = [np.dstack([rotations, positions]).reshape(-1, 12)]
    buffer = BytesIO()
    np.savetxt(buffer, np.column_stack(columns), fmt="%.16g")
    return buffer.getvalue()
