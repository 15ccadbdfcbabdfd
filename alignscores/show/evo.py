"""Results for ``evo_res``: evo's absolute pose error with our scores, as evo writes it.

evo associates, aligns, computes and writes; it comes with the extra ``evo``.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ..evaluation.conventions import rotate_cameras
from ..evaluation.evaluation import Evaluation
from ..evaluation.lever import with_lever_arm
from ..extras import require
from ..io import Trajectory
from ..io.trajectory import TIME_UNITS, time_unit
from ..similarity import Similarity
from ..texts import printable
from ..validation import finite_rows

__all__ = ["POSE_RELATIONS", "evo_result"]

POSE_RELATIONS = {  # values of evo's -r
    "trans_part": "translation_part",
    "angle_deg": "rotation_angle_deg",
    "angle_rad": "rotation_angle_rad",
    "rot_part": "rotation_part",
    "full": "full_transformation",
    "point_distance": "point_distance",
}
SCORES = "TAS", "RAS", "PAS", "half_distance", "half_angle"


def evo_result(evaluation: Evaluation, reference: str, pose_relation: str = "trans_part") -> bytes:
    """Return the zip that ``evo_ape --save_results`` writes, with both trajectories and our scores.

    The poses are those of the files, by evo's own reader where it reads the same poses, and are
    associated by evo: each with the nearest reference pose within ``t_max_diff``. Without stamps
    they are the matched poses. `reference` is the path that names the reference in it. Raise a
    ValueError where evo has no result.
    """
    evo = require("evo", "evo")
    file_interface = require("evo.tools.file_interface", "evo")
    relation = require("evo.core.metrics", "evo").PoseRelation[POSE_RELATIONS[pose_relation]]
    settings = evaluation.settings
    names = reference, printable(evaluation.file or evaluation.name)
    try:
        ref, est = _associated(evaluation, *names)
        result = require("evo.main_ape", "evo").ape(
            ref,
            _aligned_by_yaw(ref, est, settings.up) if settings.alignment == "yaw" else est,
            relation,
            align=settings.alignment in ("similarity", "rigid"),
            correct_scale=settings.alignment == "similarity",
        )
    except evo.EvoException as refusal:
        raise ValueError(f"is not written, since evo has no result: {refusal}") from None
    if settings.alignment == "yaw":
        title = result.info["title"].replace("(not aligned)", "(with yaw alignment of alignscores)")
        result.info["title"] = title
    scores = {name: evaluation.value(name) for name in SCORES}
    result.stats |= {name: value for name, value in scores.items() if value is not None}
    result.stats["coverage"] = 1 - evaluation.lost
    buffer = BytesIO()
    file_interface.save_res_file(buffer, result)
    return buffer.getvalue()


def _associated(evaluation: Evaluation, ref_name: str, est_name: str) -> tuple[Any, Any]:
    """Return reference and estimate as evo's trajectories, pose by pose the same."""
    trajectory = require("evo.core.trajectory", "evo")
    settings, matches = evaluation.settings, evaluation.matches
    if not matches.timed:
        rows = finite_rows(matches.est_poses)
        return (
            trajectory.PosePath3D(poses_se3=list(matches.gt_poses[rows]), name=ref_name),
            trajectory.PosePath3D(poses_se3=list(matches.est_poses[rows]), name=est_name),
        )
    read = evaluation.read
    if evaluation.lever_arm is not None:
        read = with_lever_arm(read, evaluation.lever_arm.vector)
    read = read._replace(poses=rotate_cameras(read.poses, evaluation.body_rotation))
    files = (ref_name, evaluation.reference), (est_name, _finite_in_order(read))
    by_evo = [_by_evo(*file) for file in files]
    units = {time_unit(read.timestamps) for read in by_evo if read is not None}
    if None in by_evo or len(units) != 1:
        units = {"s"}
        by_evo = [
            trajectory.PoseTrajectory3D(poses_se3=list(poses), timestamps=stamps, name=name)
            for name, (stamps, poses) in files
        ]
    ref, est = by_evo
    second = TIME_UNITS[units.pop()]
    start, end = (
        time if time is None else time * second for time in (settings.t_start, settings.t_end)
    )
    if start is not None or end is not None:
        ref.reduce_to_time_range(start, end)
    pair: tuple[Any, Any] = ref.sync_with(
        est, max_diff=settings.t_max_diff * second, offset_2=evaluation.t_offset * second
    )
    return pair


def _finite_in_order(estimate: Trajectory) -> Trajectory:
    """Return the poses that were estimated, in the order of time."""
    rows = np.flatnonzero(finite_rows(estimate.poses))
    rows = rows[np.argsort(estimate.keys[rows], kind="stable")]
    return Trajectory(estimate.keys[rows], estimate.poses[rows])


def _by_evo(file: str, ours: Trajectory) -> Any:
    """Return what evo reads from a TUM file, if it is the same: its stamps have all their digits.

    Nanoseconds since 1970 are rounded in float64, and in seconds otherwise than as they are.
    """
    if not Path(file).is_file():
        return None
    try:
        read = require("evo.tools.file_interface", "evo").read_tum_trajectory_file(file)
    except (require("evo", "evo").EvoException, ValueError):
        return None
    seconds = read.timestamps / TIME_UNITS[time_unit(read.timestamps)]
    theirs = Trajectory(seconds, np.array(read.poses_se3))
    pairs = zip(_by_time(theirs), _by_time(ours), strict=True)
    same = all(a.shape == b.shape and np.allclose(a, b, rtol=1e-9, atol=1e-6) for a, b in pairs)
    return read if same else None


def _by_time(read: Trajectory) -> Trajectory:
    """Return poses in the order of time, the first of each stamp."""
    stamps, first = np.unique(read.keys, return_index=True)
    return Trajectory(stamps, read.poses[first])


def _aligned_by_yaw(ref: Any, est: Any, up: str) -> Any:
    """Return an estimate of evo after the least-squares yaw alignment, which evo has not."""
    fit = Similarity.fit(ref.positions_xyz, est.positions_xyz, alignment="yaw", up=up).inverse()
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = fit.rotation, fit.translation
    est.transform(pose)
    return est
