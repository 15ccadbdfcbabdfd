"""Metrics by name: the scores of this package, and other projects' metrics, a module a project.

Each is exactly as its origin defines it, under its name. Where an origin surprises, so does the
metric: they are there so that numbers compare, not because they are good. The table is in
docs/reference/metrics.md, the surprises are in docs/explanation/other-metrics.md.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from . import cami2v, colmap, evo, hloc, kitti, rpg, scores, vggt
from .base import Metric, find, split_names
from .cameras import NoValueError
from .cami2v import video_error
from .colmap import colmap_relative_auc
from .evo import evo_are, evo_ate, evo_rpe
from .hloc import hloc_median, hloc_recall
from .kitti import kitti_relative_error
from .rpg import rpg_relative_error
from .scores import SCORES
from .superglue import pair_auc, pair_pose_errors
from .vggt import vggt_auc, vggt_rra, vggt_rta

__all__ = [
    "METRICS",
    "SCORES",
    "Metric",
    "NoValueError",
    "colmap_relative_auc",
    "evo_are",
    "evo_ate",
    "evo_rpe",
    "hloc_median",
    "hloc_recall",
    "kitti_relative_error",
    "metric",
    "pair_auc",
    "pair_pose_errors",
    "rpg_relative_error",
    "split_names",
    "vggt_auc",
    "vggt_rra",
    "vggt_rta",
    "video_error",
]

METRICS: Sequence[Metric] = (
    *scores.METRICS,
    *vggt.METRICS,
    *colmap.METRICS,
    *hloc.METRICS,
    *evo.METRICS,
    *cami2v.METRICS,
    *kitti.METRICS,
    *rpg.METRICS,
)
"""All metrics. To add one, add its entry."""

SHORT = {"half": "half_distance"}  # as the table of estimates heads its column


def metric(name: str | Metric | Callable[..., Any]) -> Metric:
    """Return a metric by its name, or the metric of a function.

    Parameters
    ----------
    name : str, Metric or callable
        Such as ``TAS``, ``auc@30:vggt``, ``recall@5cm,5deg:hloc``, ``rpe@1m``, ``kitti``; case and
        underscores do not matter. A function of ground-truth and estimated poses is an error
        (smaller is better) by its own name; a `Metric` says more about it.

    Returns
    -------
    Metric
        Call it with poses.

    Raises
    ------
    ValueError
        If the metric is unknown; the message lists the nearest names.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import metric
    >>> poses = np.tile(np.eye(4), (3, 1, 1))
    >>> metric("median:hloc")(poses, poses)
    0.0
    >>> metric("rpe")
    Traceback (most recent call last):
        ...
    ValueError: unknown metric 'rpe'; close to it are rpe@1m, rpe@1f, rpe@1m:rotation
    """
    if isinstance(name, Metric):
        return name
    if callable(name):
        return Metric(getattr(name, "__name__", type(name).__name__), name)
    return _by_name(name)


@cache
def _by_name(name: str) -> Metric:
    return find(SHORT.get(name.strip().lower(), name), METRICS)


def header(name: str | Metric, length: str) -> str:
    """Return a metric as it heads a column, in short, with its unit; `length` is a position's."""
    entry = metric(name)
    unit = entry.unit.replace("units", length)
    short = entry.name.partition("_")[0] if entry.name in SCORES else entry.name
    return f"{short} [{unit}]" if unit else short
