"""The protocols: each family of names with its function, unit and direction."""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import get_args

from .colmap import colmap_relative_auc
from .families import UNITS, Family, Metric, find
from .images import hloc_median, hloc_recall
from .relative import Convention, vggt_auc, vggt_rra, vggt_rta
from .segments import kitti_relative_error, rpg_relative_error
from .trajectory import (
    STATISTICS,
    Alignment,
    Pairs,
    evo_are,
    evo_ate,
    evo_rpe,
)
from .video import Scale, video_error

__all__ = ["PROTOCOLS", "protocol"]

NUMBER = r"\d+(?:\.\d+)?|\.\d+"
WHOLE = r"@(?P<k>\d+)(?:deg)?"
ANGLE = rf"(?P<max_error_deg>{NUMBER})(?:deg)?"
UNIT = rf"(?P<unit>{'|'.join(UNITS)})"
ERROR = rf"(?P<max_error>{NUMBER}){UNIT}"
NEIGHBOURS = rf"rpe@(?:(?P<frames>[1-9]\d*)f|(?P<seconds>{NUMBER})s|(?P<distance>{NUMBER}){UNIT})"
SEGMENTS = rf"rpg@(?P<length>{NUMBER}){UNIT}"


def _words(names: Iterable[str]) -> dict[str, str]:
    """Return words that are values themselves."""
    return {name: name for name in names}


CONVENTION = {"convention": _words(get_args(Convention))}
HLOC = {"alignment": {"hloc": "none", "hloc-sim3": "sim3"}}
STATISTIC = _words(name for name in STATISTICS if name != "sse")
ALIGNED = {"alignment": _words(get_args(Alignment)), "statistic": STATISTIC}
PAIRS = {"pairs": _words(get_args(Pairs))}
SCALED = {"alignment": _words(["sim3", "se3"]), "statistic": {"mean": "mean"} | STATISTIC}
SCALE = {"scale": _words(get_args(Scale))}
LENGTH = {"error": _words(["translation", "distance"])}
ROTATION = {"error": _words(["rotation"])}

_rate = partial(Family, missing="fail", unit="%", larger_is_better=True)
_motion_error = partial(Family, missing="left out", ordered=True)
_video_error = partial(Family, missing="refused", ordered=True)
_kitti_error = partial(Family, missing="refused", ordered=True, metres=True)

PROTOCOLS: Sequence[Family] = (
    _rate(
        "rra@K:{vggt,mapanything,da3}",
        "rra@5:vggt",
        "relative rotation accuracy: pairs with a rotation error below K degrees",
        vggt_rra,
        f"rra{WHOLE}",
        required=CONVENTION,
    ),
    _rate(
        "rta@K:{vggt,mapanything,da3}",
        "rta@5:vggt",
        "relative translation accuracy: pairs with a direction error, sign folded, below K degrees",
        vggt_rta,
        f"rta{WHOLE}",
        required=CONVENTION,
    ),
    _rate(
        "auc@K:{vggt,mapanything,da3}",
        "auc@30:vggt",
        "area under the accuracy of relative poses up to K degrees, in bins of one degree",
        vggt_auc,
        f"auc{WHOLE}",
        required=CONVENTION,
    ),
    _rate(
        "auc@ANGLE:{colmap,colmap-imc}",
        "auc@5:colmap",
        "area under the interpolated recall of relative poses, of COLMAP's benchmark",
        colmap_relative_auc,
        f"auc@{ANGLE}",
        required={"accuracy": {"colmap": 0.001, "colmap-imc": 0.02}},
        metres=True,
    ),
    _rate(
        "recall@DISTANCE,ANGLE:{hloc,hloc-sim3}",
        "recall@5cm,5deg:hloc-sim3",
        "images within distance and angle, of hloc: not aligned (-sim3: by least squares)",
        hloc_recall,
        f"recall@{ERROR},{ANGLE}",
        required=HLOC,
    ),
    Family(
        "median:{hloc,hloc-sim3}",
        "median:hloc",
        "median distance of the images, of hloc",
        hloc_median,
        "median",
        missing="fail",
        required=HLOC,
        unit="units",
    ),
    Family(
        "median:{hloc,hloc-sim3}:rotation",
        "median:hloc:rotation",
        "median angle of the images, of hloc",
        hloc_median,
        "median",
        missing="fail",
        required=HLOC | ROTATION,
        unit="deg",
    ),
    Family(
        "ate:STATISTIC[:ALIGNMENT]",
        "ate:rmse",
        "absolute trajectory error, of evo",
        evo_ate,
        "ate",
        missing="left out",
        optional=ALIGNED,
        unit="units",
        rotations=False,
    ),
    Family(
        "are[:STATISTIC][:ALIGNMENT]",
        "are:rmse",
        "absolute rotation error after an alignment of the positions, of evo",
        evo_are,
        "are",
        missing="left out",
        optional=ALIGNED,
        unit="deg",
    ),
    _motion_error(
        "rpe@{FRAMESf,TIMEs,DISTANCE}[:distance][:PAIRS][:STATISTIC][:ALIGNMENT]",
        "rpe@1m",
        "relative translation error over frames, seconds or a distance, of evo",
        evo_rpe,
        NEIGHBOURS,
        optional=LENGTH | ALIGNED | PAIRS,
        unit="units",
    ),
    _motion_error(
        "rpe@{FRAMESf,TIMEs,DISTANCE}:rotation[:PAIRS][:STATISTIC][:ALIGNMENT]",
        "rpe@1m:rotation",
        "relative rotation error over frames, seconds or a distance, of evo",
        evo_rpe,
        NEIGHBOURS,
        required=ROTATION,
        optional=ALIGNED | PAIRS,
        unit="deg",
    ),
    _video_error(
        "roterr",
        "roterr",
        "sum of the angles in radians, seen from the first frame, of video generation",
        video_error,
        "roterr",
        unit="rad",
    ),
    _video_error(
        "transerr[:{cami2v,cami2v-abs,cameractrl}]",
        "transerr:cami2v",
        "sum of the distances, seen from the first frame, of video generation",
        partial(video_error, error="translation"),
        "transerr",
        optional=SCALE,
    ),
    _video_error(
        "cammc[:{cami2v,cami2v-abs,cameractrl}]",
        "cammc:cami2v",
        "sum of the norms of differences of matrices, of video generation",
        partial(video_error, error="pose"),
        "cammc",
        optional=SCALE,
    ),
    _kitti_error(
        "kitti",
        "kitti",
        "mean relative translation error over 100 to 800 m, of the KITTI benchmark",
        kitti_relative_error,
        "kitti",
        unit="%",
    ),
    _kitti_error(
        "kitti:rotation",
        "kitti:rotation",
        "mean relative rotation error over 100 to 800 m, of the KITTI benchmark",
        kitti_relative_error,
        "kitti",
        required=ROTATION,
        unit="deg/unit",
    ),
    _motion_error(
        "rpg@DISTANCE[:STATISTIC][:{sim3,se3}]",
        "rpg@100m",
        "relative translation error over a path length, of rpg_trajectory_evaluation",
        rpg_relative_error,
        SEGMENTS,
        optional=SCALED,
        unit="%",
    ),
    _motion_error(
        "rpg@DISTANCE:rotation[:STATISTIC][:{sim3,se3}]",
        "rpg@100m:rotation",
        "relative rotation error over a path length, of rpg_trajectory_evaluation",
        rpg_relative_error,
        SEGMENTS,
        required=ROTATION,
        optional=SCALED,
        unit="deg/unit",
    ),
)
"""All families of names. To add a protocol, add its entry."""


def protocol(name: str) -> Metric:
    """Find a metric by its name.

    Parameters
    ----------
    name : str
        Such as ``auc@30:vggt``, ``auc@5:colmap``, ``recall@5cm,5deg:hloc``, ``rpe@1m``, ``kitti``,
        ``ate:rmse``; see `PROTOCOLS`.

    Returns
    -------
    Metric
        Call it with cameras.

    Raises
    ------
    ValueError
        If there is none of that name; the message lists those that are close to it.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import protocol
    >>> ate = protocol("ate:mean:none")
    >>> positions = np.eye(3)
    >>> ate(positions, None, positions + [2, 0, 0], None)
    2.0
    >>> protocol("rpe")
    Traceback (most recent call last):
        ...
    ValueError: unknown metric 'rpe'; close to it are rpe@1m, rpe@1m:rotation
    """
    return find(name, PROTOCOLS)
