"""Statistics of trials: what the claims, and Table 1, are decided by."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from .config import split_metric

__all__ = [
    "SETTINGS",
    "cell_means",
    "correlation",
    "dependence",
    "favour",
    "first_step",
    "power",
    "range_change",
    "relative_range",
    "select",
]

SETTINGS = ("n_cameras", "n_outliers", "sigma_t", "sigma_r_deg")  # that make a cell
SCORES = ("mAA", "TAS", "RAS", "PAS")  # better when larger; all others are errors
TAKES: Mapping[str, Callable[[Sequence[float]], float]] = {
    "smallest": min,
    "largest": max,
    "mean": lambda values: sum(values) / len(values),
}


def select(trials: pd.DataFrame, where: Mapping[str, Sequence[float]]) -> pd.DataFrame:
    """Return the trials whose settings have one of the values named for each."""
    for column, values in where.items():
        trials = trials[trials[column].isin(list(values))]
    return trials


def cell_means(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the means of the trials of each cell, one row a cell."""
    return trials.groupby(list(SETTINGS), as_index=False).mean(numeric_only=True)


def correlation(values: "pd.Series[float]", levels: "pd.Series[float]") -> float:
    """Kendall's rank correlation, tau-b; 0 where all values are the same."""
    tau = float(kendalltau(values, levels).statistic)
    return 0.0 if np.isnan(tau) else tau


def range_change(before: "pd.Series[float]", after: "pd.Series[float]") -> float:
    """Change of the range from one set of values to another in per cent; NaN where it was 0."""
    return 100 * (_ratio(_range(after), _range(before)) - 1)


def relative_range(trials: pd.DataFrame, metric: str, versus: str) -> float:
    """How much wider the range of a metric is than that of another, in per cent."""
    return range_change(trials[versus], trials[metric])


def power(trials: pd.DataFrame, metric: str, levels: Sequence[str], take: str) -> float:
    """Discerning power: absolute rank correlation of a metric with a level.

    It is taken in each group of trials that share all other settings, for each of the levels.
    """
    return TAKES[take](
        [
            abs(correlation(group[metric], group[level]))
            for level in levels
            for group in _groups(trials, level)
        ]
    )


def favour(trials: pd.DataFrame, metric: str, level: str, take: str) -> float:
    """Rank correlation with a level, positive where more of it makes a metric look better."""
    sign = 1 if split_metric(metric)[0] in SCORES else -1
    return TAKES[take](
        [sign * correlation(group[metric], group[level]) for group in _groups(trials, level)]
    )


def dependence(trials: pd.DataFrame, metric: str, level: str, take: str) -> float:
    """How far the mean of a metric moves over a level, in per cent of the range of all means."""
    means = cell_means(trials)
    moves = [_range(group[metric]) for group in _groups(means, level)]
    return 100 * _ratio(TAKES[take](moves), _range(means[metric]))


def first_step(trials: pd.DataFrame, metric: str, level: str, take: str) -> float:
    """Share of the mean's change, first to last level, that happens up to the second; per cent."""
    steps = []
    for group in _groups(cell_means(trials), level):
        first, second, *_, last = group.sort_values(level)[metric]
        steps.append(100 * _ratio(second - first, last - first))
    return TAKES[take](steps)


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else np.nan


def _range(values: "pd.Series[float]") -> float:
    return float(np.ptp(values.to_numpy()))


def _groups(trials: pd.DataFrame, level: str) -> list[pd.DataFrame]:
    """Split trials by the settings that vary at a fixed level, which others may rise with."""
    at_a_level = trials.groupby(level)
    free = [column for column in SETTINGS if at_a_level[column].nunique().max() > 1]
    return [group for _, group in trials.groupby(free)] if free else [trials]
