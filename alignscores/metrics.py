"""The vocabulary of metrics: the scores of this package, and the protocols, each by one name."""

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from .arrays import Floats
from .pose import pas
from .protocols.cameras import estimated_positions
from .protocols.families import Family, Metric, Missing, find
from .protocols.registry import PROTOCOLS
from .registration import Seed
from .rotation import ras
from .similarity import least_squares_rmse
from .thresholds import ras_angle, tas_distance
from .translation import tas

__all__ = ["FAMILIES", "SCORES", "Family", "Metric", "header", "metric", "named"]


def named(
    name: str, description: str, function: Callable[..., float], missing: Missing, **traits: Any
) -> Family:
    """Return the family of a single name, which sets no arguments."""
    return Family(name, name, description, function, re.escape(name.lower()), missing, **traits)


def _tas(gt: Floats, est: Floats, *, rng: Seed) -> float:
    return tas(gt, est, rng=rng).score


def _ras(gt: Floats, est: Floats) -> float:
    return ras(gt[:, :, :3], est[:, :, :3]).score


def _pas(gt: Floats, est: Floats, *, rng: Seed) -> float:
    return pas(gt, est, rng=rng).score


def _angle(gt: Floats, est: Floats) -> float:
    return ras_angle(gt[:, :, :3], est[:, :, :3])


def _ate(gt: Floats, est: Floats) -> float:
    return least_squares_rmse(*estimated_positions(gt, est))


SCORES: Sequence[Family] = (
    named(
        "TAS",
        "Translation Alignment Score",
        _tas,
        "fail",
        larger_is_better=True,
        rotations=False,
        random=True,
    ),
    named("RAS", "Rotation Alignment Score", _ras, "fail", larger_is_better=True),
    named("PAS", "Pose Alignment Score", _pas, "fail", larger_is_better=True, random=True),
    named(
        "half_distance",
        "half-score distance: the smallest unit at which the TAS reaches one half",
        tas_distance,
        "fail",
        unit="units",
        rotations=False,
        random=True,
        aliases=("half", "halfdistance"),
    ),
    named(
        "half_angle",
        "half-score angle: the smallest range of thresholds at which the RAS reaches one half",
        _angle,
        "fail",
        unit="deg",
        aliases=("half:rotation", "halfangle"),
    ),
    named(
        "ATE",
        "absolute trajectory error: RMSE of the positions, aligned by least squares",
        _ate,
        "left out",
        unit="units",
        rotations=False,
    ),
)
"""What every estimate is given, in the order of tables."""

FAMILIES = (*SCORES, *PROTOCOLS)


@cache
def metric(name: str) -> Metric:
    """Find a metric by its name, whatever its case, or by a short one, such as half."""
    return find(name, FAMILIES)


def header(name: str, length: str) -> str:
    """Return a metric as it heads a column, in short, with its unit; `length` is a position's."""
    entry = metric(name)
    unit = entry.family.unit.replace("units", length)
    short = entry.name.partition("_")[0]
    return f"{short} [{unit}]" if unit else short
