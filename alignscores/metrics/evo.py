"""APE and RPE of evo, which computes them: the values of ``evo_ape`` and ``evo_rpe``.

evo is under the GPL and comes with the extra ``evo``; without it these metrics end in a sentence
that names the extra.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..extras import require
from ..validation import check_positive
from .base import Metric, Need, length
from .cameras import Cameras, NoValueError, check_choice, estimated_positions
from .paths import STATISTICS, Statistic

__all__ = ["METRICS", "evo_are", "evo_ate", "evo_rpe"]

Alignment = Literal["sim3", "se3", "scale", "none"]
Pairs = Literal["consecutive", "consecutive-reference", "all", "all-reference"]

ALIGNMENTS = {  # as options of evo
    "sim3": {"align": True, "correct_scale": True},
    "se3": {"align": True},
    "scale": {"correct_scale": True},
    "none": {},
}
RELATIONS = {
    "translation": "translation_part",
    "rotation": "rotation_angle_deg",
    "distance": "point_distance",
}


def evo_ate(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    *,
    alignment: Alignment = "sim3",
    statistic: Statistic = "rmse",
) -> float:
    """Absolute trajectory error: distances after a least-squares alignment, by evo's APE.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Camera centres, row i of both the same camera. An estimate that is not finite is left out:
        losing a bad camera improves the value.
    alignment : {"sim3", "se3", "scale", "none"}
        What moves the estimate to the ground truth: the least-squares similarity (``evo_ape -as``),
        the same without scale (``-a``), only its scale (``-s``), or nothing.
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the distances.

    Returns
    -------
    float
        In ground-truth units; "sse" in their square.

    Raises
    ------
    NoValueError
        If evo does not align, as for collinear or coinciding cameras, or nothing was estimated.
    ModuleNotFoundError
        If evo is not installed.

    Notes
    -----
    `baselines.ate` is the RMSE with a similarity, with a value for collinear cameras, too.

    References
    ----------
    evo (github.com/MichaelGrupp/evo), evo_ape.
    Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import evo_ate
    >>> gt = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> est = gt + [3, 0, 0]
    >>> evo_ate(gt, est, alignment="none"), round(evo_ate(gt, est), 9)
    (3.0, 0.0)
    """
    gt, est = estimated_positions(gt_positions, est_positions)
    still = np.broadcast_to(np.eye(3), (len(gt), 3, 3))
    poses = _poses(still, gt), _poses(still, est)
    return _statistic("ape", *poses, "translation", alignment, statistic)


def evo_are(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    alignment: Alignment = "sim3",
    statistic: Statistic = "rmse",
) -> float:
    """Absolute rotation error: angles after an alignment of the centres, evo_ape's ``angle_deg``.

    The rotations are turned as the centres are; none of them takes part in the alignment.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same camera. Estimates that are not finite are left
        out first.
    alignment : {"sim3", "se3", "scale", "none"}
        As in `evo_ate`, with its errors.
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the angles.

    Returns
    -------
    float
        Degrees.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.metrics import evo_are
    >>> gt = np.tile(np.eye(4), (4, 1, 1))
    >>> gt[1:, :3, 3] = np.eye(3)
    >>> est = gt.copy()
    >>> est[0, :3, :3] = Rotation.from_euler("x", 2, degrees=True).as_matrix()
    >>> round(evo_are(gt, est, statistic="mean"), 9)
    0.5
    """
    return _statistic("ape", *_estimated(gt_poses, est_poses), "rotation", alignment, statistic)


def evo_rpe(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    distance: float | None = None,
    *,
    error: Literal["translation", "rotation", "distance"] = "translation",
    alignment: Alignment = "none",
    statistic: Statistic = "rmse",
    pairs: Pairs = "consecutive",
    frames: int = 1,
) -> float:
    """Relative pose error over some frames, or over a distance along the path, by evo's RPE.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses in the order of time, row i of both the same frame. Estimates that are
        not finite are left out first: the next frame may be many later.
    distance : float, optional
        Path length of the pairs (``evo_rpe -d 1 -u m``); by default `frames` count (``-u f``).
    error : {"translation", "rotation", "distance"}
        Length of the translation, angle of the rotation (``-r angle_deg``), or the difference
        between the lengths of the two motions (``-r point_distance``).
    alignment : {"sim3", "se3", "scale", "none"}
        See `evo_ate`. Only the scale, and with it the path length, matters. evo aligns nothing by
        default; CUT3R, MonST3R and Pi3 take "sim3".
    statistic : {"rmse", "mean", "median", "std", "min", "max", "sse"}
        What is returned of the errors.
    pairs : {"consecutive", "consecutive-reference", "all", "all-reference"}
        "consecutive", as evo by default, one after the other; "all" is ``--all_pairs``, and
        "-reference" is ``--pairs_from_reference``: by the path of the reference, not the estimate.
    frames : int
        Frames with an estimate from one pose of a pair to the other, where no distance is given.

    Returns
    -------
    float
        In ground-truth units, or degrees.

    Raises
    ------
    NoValueError
        If no pair has that distance, or evo does not align.
    ModuleNotFoundError
        If evo is not installed.

    References
    ----------
    evo (github.com/MichaelGrupp/evo), evo_rpe; for "sim3" and frames also Pi3,
    relpose/evo_utils.py at 9125273 (2025).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import evo_rpe
    >>> gt = np.tile(np.eye(4), (5, 1, 1))
    >>> gt[:, 0, 3] = [0, 1, 2, 3, 4]
    >>> est = gt.copy()
    >>> est[:, 0, 3] *= 1.1
    >>> round(evo_rpe(gt, est), 9), round(evo_rpe(gt, est, 2, pairs="all-reference"), 9)
    (0.1, 0.2)
    """
    check_choice(error, RELATIONS, "error")
    check_choice(pairs, get_args(Pairs), "pairs")
    check_positive(frames, "frames", integer=True)
    if distance is not None:
        check_positive(distance, "distance")
    unit = "frames" if distance is None else "meters"
    delta = {
        "delta": frames if distance is None else distance,
        "delta_unit": getattr(require("evo.core.units", "evo").Unit, unit),
        "all_pairs": pairs.startswith("all"),
        "pairs_from_reference": pairs.endswith("reference"),
    }
    return _statistic("rpe", *_estimated(gt_poses, est_poses), error, alignment, statistic, **delta)


def _estimated(gt_poses: ArrayLike, est_poses: ArrayLike) -> tuple[Floats, Floats]:
    """Return the checked poses (n, 4, 4) of the cameras with an estimate, true and estimated."""
    cameras = Cameras.check(gt_poses, est_poses).matched()
    return _poses(cameras.gt_rotations, cameras.gt), _poses(cameras.est_rotations, cameras.est)


def _poses(rotations: Floats, positions: Floats) -> Floats:
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations, positions
    return poses


def _statistic(
    program: Literal["ape", "rpe"],
    gt: Floats,
    est: Floats,
    error: str,
    alignment: str,
    statistic: str,
    **options: Any,
) -> float:
    """Return a statistic of the errors that evo's program computes of poses (n, 4, 4)."""
    check_choice(alignment, ALIGNMENTS, "alignment")
    check_choice(statistic, STATISTICS, "statistic")
    evo = require("evo", "evo")
    run = getattr(require(f"evo.main_{program}", "evo"), program)
    relation = require("evo.core.metrics", "evo").PoseRelation[RELATIONS[error]]
    path = require("evo.core.trajectory", "evo").PosePath3D
    if len(gt) == 0:
        raise NoValueError("no camera was estimated")
    try:
        result = run(
            path(poses_se3=list(gt)),
            path(poses_se3=list(est)),
            relation,
            **ALIGNMENTS[alignment],
            **options,
        )
    except evo.EvoException as refusal:
        raise NoValueError(f"evo: {refusal}") from None
    return float(result.stats[statistic])


def _frames(text: str) -> Mapping[str, int] | None:
    count = text.removesuffix("f")
    return {"frames": int(count)} if count.isdecimal() and int(count) and text != count else None


def _distance(text: str) -> Mapping[str, float] | None:
    metres = length(text)
    return None if metres is None else {"distance": metres}


def _metrics() -> list[Metric]:
    statistics = [name for name in get_args(Statistic) if name != "sse"]
    aligned = {"alignment": get_args(Alignment)}
    ates = [
        Metric(
            f"ate:{statistic}",
            partial(evo_ate, statistic=statistic),
            unit="units",
            needs=("evo",),
            description=f"absolute trajectory error, {statistic}, of evo",
            options=aligned,
        )
        for statistic in statistics
    ]
    are = Metric(
        "are",
        evo_are,
        unit="deg",
        needs=("rotations", "evo"),
        description="absolute rotation error after an alignment of the positions, of evo",
        options={"statistic": statistics, **aligned},
        example="are:rmse",
    )
    paired = {"pairs": get_args(Pairs), "statistic": statistics, **aligned}
    rpes: list[Metric] = []
    of_frames: tuple[Need, ...] = ("rotations", "order", "evo")
    of_metres: tuple[Need, ...] = (*of_frames, "metres")
    for placeholder, read, needs, over, example in (
        ("FRAMESf", _frames, of_frames, "frames", "1f"),
        ("DISTANCE", _distance, of_metres, "a distance", "1m"),
    ):
        rpes += [
            Metric(
                f"rpe@{placeholder}",
                evo_rpe,
                unit="units",
                needs=needs,
                description=f"relative translation error over {over}, of evo",
                argument=read,
                options={"error": ("translation", "distance"), **paired},
                example=f"rpe@{example}",
            ),
            Metric(
                f"rpe@{placeholder}:rotation",
                partial(evo_rpe, error="rotation"),
                unit="deg",
                needs=needs,
                description=f"relative rotation error over {over}, of evo",
                argument=read,
                options=paired,
                example=f"rpe@{example}:rotation",
            ),
        ]
    return [*ates, are, *rpes]


METRICS = _metrics()
"""ATE, ARE and RPE."""
