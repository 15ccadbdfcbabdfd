"""A recording for the Rerun viewer: trajectories, camera frames and errors on one timeline.

Needs Rerun, which the extra ``rerun`` brings. Nothing is started.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from ..arrays import Booleans, Floats
from ..evaluation.evaluation import LOST, Evaluation
from ..extras import require
from ..texts import printable
from ..validation import finite_rows
from .curves import over_expected, times

rr: Any = require("rerun", "rerun")
blueprint: Any = require("rerun.blueprint", "rerun")

__all__ = ["recording"]

DARK, LIGHT = np.array([[0, 0, 4], [249, 150, 13]])  # an error of 0, and of d or more
GREY, RED = [150, 150, 150], [220, 30, 30]
WIDTH = rr.Radius.ui_points(3)


def recording(scored: Sequence[Evaluation]) -> bytes:
    """Return the content of a file for Rerun, of estimates of one reference.

    Positions count from the first expected one of the reference, since Rerun stores 32 bits.
    """
    first = scored[0]
    poses = first.reference.poses[first.matches.expected_rows]
    origin = poses[0, :3, 3]
    names = [rr.new_entity_path(["estimates", printable(each.name)]) for each in scored]
    series = [
        blueprint.TimeSeriesView(
            name=quantity.replace("_", " "), contents=[f"{name}/{quantity}" for name in names]
        )
        for quantity in ("position_error", "rotation_error", "lost")
    ]
    stream = rr.RecordingStream("alignscores")
    memory = stream.memory_recording()
    views = blueprint.Spatial3DView(origin="/"), blueprint.Vertical(*series)
    stream.send_blueprint(blueprint.Horizontal(*views))
    _log_camera(stream, first, "reference", poses[:, :3, 3] - origin, poses[:, :3, :3])
    path = [poses[:, :3, 3] - origin]
    ordered = first.settings.file_format.ordered
    drawn = rr.LineStrips3D(path, colors=[GREY]) if ordered else rr.Points3D(*path, colors=[GREY])
    stream.log("reference/path", drawn, static=True, strict=True)
    for evaluation, name in zip(scored, names, strict=True):
        _log_estimate(stream, evaluation, name, origin)
    content: bytes = memory.drain_as_bytes()
    stream.disconnect()
    return content


def _log_estimate(stream: Any, evaluation: Evaluation, name: str, origin: Floats) -> None:
    """Log an estimate, each of positions and rotations in the alignment of its score."""
    tas, ras = evaluation.result.tas, evaluation.result.ras
    positions = over_expected(evaluation, evaluation.positions, np.nan) - origin
    rotations = evaluation.matches.est_poses[:, :3, :3]
    rotations = rotations * np.nan if ras.alignment is None else ras.alignment.T @ rotations
    _log_camera(stream, evaluation, name, positions, over_expected(evaluation, rotations, np.nan))
    errors = {
        "position_error": over_expected(evaluation, tas.errors, np.inf),
        "rotation_error": over_expected(evaluation, ras.errors, np.inf),
        "lost": (over_expected(evaluation, evaluation.statuses, LOST) == LOST).astype(float),
    }
    for quantity, values in errors.items():
        is_finite = np.isfinite(values)
        columns = rr.Scalars.columns(scalars=values[is_finite])
        _send(stream, evaluation, f"{name}/{quantity}", is_finite, columns)
    finite = finite_rows(positions)
    shares = np.minimum(errors["position_error"][finite, None] / tas.unit, 1)
    colours = DARK + shares * (LIGHT - DARK)
    points = rr.Points3D(positions[finite], colors=colours.astype(np.uint8), radii=WIDTH)
    stream.log(f"{name}/positions", points, static=True, strict=True)
    lost = evaluation.reference.poses[evaluation.matches.expected_rows[errors["lost"] == 1]]
    points = rr.Points3D(lost[:, :3, 3] - origin, colors=[RED], radii=WIDTH)
    stream.log(f"{name}/lost_stretches", points, static=True, strict=True)


def _log_camera(
    stream: Any, evaluation: Evaluation, name: str, positions: Floats, rotations: Floats
) -> None:
    """Log the camera's frame at each expected frame."""
    has_pose = finite_rows(positions) & finite_rows(rotations)
    quaternions = np.empty((0, 4))
    if has_pose.any():
        quaternions = scipy.spatial.transform.Rotation.from_matrix(rotations[has_pose]).as_quat()
    columns = [
        *rr.Transform3D.columns(translation=positions[has_pose], quaternion=quaternions),
        *rr.TransformAxes3D.columns(axis_length=[2 * evaluation.result.tas.unit] * has_pose.sum()),
    ]
    _send(stream, evaluation, f"{name}/camera", has_pose, columns)


def _send(stream: Any, evaluation: Evaluation, name: str, rows: Booleans, columns: Any) -> None:
    """Send what was found at some of the expected frames; it ends where the next has nothing."""
    stream.send_columns(name, [_times(evaluation, rows)], columns, strict=True)
    ends = ~rows & np.roll(rows, 1)
    cleared = rr.Clear.columns(is_recursive=[False] * ends.sum())
    stream.send_columns(name, [_times(evaluation, ends)], cleared, strict=True)


def _times(evaluation: Evaluation, chosen: Booleans) -> Any:
    """Return the chosen expected frames: seconds from the reference's start, or its rows."""
    if evaluation.matches.timed:
        return rr.TimeColumn("time", duration=times(evaluation)[chosen])
    return rr.TimeColumn("frame", sequence=evaluation.matches.expected_rows[chosen])
