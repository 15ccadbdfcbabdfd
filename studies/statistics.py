"""Statistics of trials that the claims and Table 1 are decided by."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import Parameter, signature
from typing import Any

import numpy as np
import pandas as pd
import scipy

from experiments.grid import CELL_SETTINGS

from .order import groups, orders, sign

# The discerning power of a metric that discerns a level. Tau-b counts the pairs of trials at one
# level against it: of those at two levels, 76 % are in the right order then where there are ten
# levels, 78 % where there are five and 81 % where there are three.
LEAST_POWER = 0.5
SUMMARIES: Mapping[str, Callable[[Any], Any]] = {
    "smallest": np.min,
    "largest": np.max,
    "mean": np.mean,
}

Where = Mapping[str, Sequence[float]]  # for some settings of a cell, the values that it may have


def select(trials: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Return the trials whose settings have one of the values named for each."""
    for column, values in where.items():
        trials = trials[trials[column].isin(values)]
    return trials


def cell_means(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the means of the trials of each cell, one row a cell."""
    return trials.groupby(list(CELL_SETTINGS), as_index=False).mean(numeric_only=True)


def correlation(values: "pd.Series[float]", levels: "pd.Series[float]") -> float:
    """Kendall's rank correlation, tau-b; 0 where all values are the same."""
    array = values.to_numpy()  # SciPy takes a third longer with pandas
    if (array == array[0]).all():
        return 0.0
    return float(scipy.stats.kendalltau(array, levels.to_numpy()).statistic)


def range_change(trials: pd.DataFrame, metric: str, before: Where, after: Where) -> float:
    """Change of the range from some cells to others in per cent; NaN where it was 0."""
    ranges = (_range(select(trials, where)[metric]) for where in (after, before))
    return _percentage(*ranges) - 100


def range_change_size(trials: pd.DataFrame, metric: str, before: Where, after: Where) -> float:
    """Change of the range, up or down."""
    return abs(range_change(trials, metric, before, after))


def relative_range(trials: pd.DataFrame, metric: str, versus: str) -> float:
    """How much wider the range of a metric is than another's, in per cent."""
    return _percentage(_range(trials[metric]), _range(trials[versus])) - 100


def powers(trials: pd.DataFrame, metric: str, level: Sequence[str]) -> list[float]:
    """Rank correlations with each level in each group, positive where the metric gets worse."""
    return [
        sign(metric) * correlation(group[metric], group[name])
        for name, group in _groups(trials, level)
    ]


def power(trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str) -> float:
    """Return the discerning power: a summary of `powers`."""
    return float(SUMMARIES[summary](powers(trials, metric, level)))


def joint_power(trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str) -> float:
    """Return the power with each level on its own, the smallest of them."""
    return min(power(trials, metric, [name], summary) for name in level)


def improvement(trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str) -> float:
    """Negate `power`: positive where the metric looks better as a level rises."""
    return float(SUMMARIES[summary]([-tau for tau in powers(trials, metric, level)]))


def dependence(
    trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str, at: Where | None = None
) -> float:
    """How far the mean of a metric moves over a level, in per cent of the range of all means.

    The movements are in the cells that `at` names; the range covers all means.
    """
    means = cell_means(trials)
    moves = [_range(group[metric]) for _, group in _groups(select(means, at or {}), level)]
    return _percentage(SUMMARIES[summary](moves), _range(means[metric]))


def relative_dependence(
    trials: pd.DataFrame,
    metric: str,
    versus: str,
    level: Sequence[str],
    summary: str,
    at: Where | None = None,
) -> float:
    """Dependence of a metric in per cent of another's."""
    return _percentage(*(dependence(trials, name, level, summary, at) for name in (metric, versus)))


def relative_dependence_change(
    trials: pd.DataFrame, metric: str, versus: str, level: Sequence[str], summary: str, at: Where
) -> float:
    """Relative dependence in the cells `at` minus that in all cells."""
    here, anywhere = (
        relative_dependence(trials, metric, versus, level, summary, where) for where in (at, {})
    )
    return here - anywhere


def mean_change(trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str) -> float:
    """Change of the mean from the first to the last level, in per cent of the first."""
    changes = []
    for name, group in _groups(cell_means(trials), level):
        first, *_, last = group.sort_values(name)[metric]
        changes.append(_percentage(last - first, first))
    return float(SUMMARIES[summary](changes))


def order_percentages(trials: pd.DataFrame, metric: str, level: Sequence[str]) -> list[float]:
    """Probabilities of the right order, in per cent; for each group, as in `powers`."""
    return [100 * order for name in level for order in orders(trials, metric, name)]


def mean_order(trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str) -> float:
    """Return the probability of the right order, in per cent."""
    return float(SUMMARIES[summary](order_percentages(trials, metric, level)))


def order_change_size(
    trials: pd.DataFrame,
    metric: str,
    level: Sequence[str],
    summary: str,
    before: Where,
    after: Where,
) -> float:
    """Change, up or down, of the probability of the right order from some cells to others."""
    shares = (order_percentages(select(trials, where), metric, level) for where in (after, before))
    at_after, at_before = map(SUMMARIES[summary], shares)
    return float(abs(at_after - at_before))


def initial_response(
    trials: pd.DataFrame, metric: str, level: Sequence[str], summary: str
) -> float:
    """Share of the mean's change, first to last level, that happens up to the second; per cent."""
    steps = []
    for name, group in _groups(cell_means(trials), level):
        first, second, *_, last = group.sort_values(name)[metric]
        steps.append(_percentage(second - first, last - first))
    return float(SUMMARIES[summary](steps))


def relative_initial_response(
    trials: pd.DataFrame, metric: str, versus: str, level: Sequence[str], summary: str
) -> float:
    """Return the initial response of a metric in per cent of another's."""
    return _percentage(
        *(initial_response(trials, name, level, summary) for name in (metric, versus))
    )


def _percentage(part: float, whole: float) -> float:
    return float(100 * part / whole) if whole else np.nan


def _range(values: "pd.Series[float]") -> float:
    return float(np.ptp(values.to_numpy()))


def _groups(trials: pd.DataFrame, level: Sequence[str]) -> Iterator[tuple[str, pd.DataFrame]]:
    """Split trials, for each level, by the settings that vary where it does not."""
    yield from ((name, group) for name in level for group in groups(trials, name))


@dataclass(frozen=True)
class Statistic:
    """A number that decides a claim: computed from trials, a metric and keys of the claim."""

    function: Callable[..., float]
    text: str  # with the names of keys in braces
    is_percentage: bool = True  # a correlation otherwise
    has_ranges: bool = False  # which could also be ranges of mean curves
    least_levels: int = 2  # of each level

    @cached_property
    def keys(self) -> Sequence[str]:
        """The keys of a claim that it takes."""
        return list(signature(self.function).parameters)[2:]

    @cached_property
    def needs(self) -> Sequence[str]:
        """Those that a claim must have."""
        parameters = signature(self.function).parameters
        return [key for key in self.keys if parameters[key].default is Parameter.empty]


STATISTICS: Mapping[str, Statistic] = {
    "range change": Statistic(range_change, "change of the range of {metric}, %", has_ranges=True),
    "size of range change": Statistic(
        range_change_size, "|change of the range| of {metric}, %", has_ranges=True
    ),
    "relative range": Statistic(
        relative_range, "width of the range of {metric} relative to {versus}, %", has_ranges=True
    ),
    "size of order change": Statistic(
        order_change_size, "|change of the order| of {metric} by {level}, %"
    ),
    "order": Statistic(mean_order, "order of {metric} by {level}, %"),
    "mean change": Statistic(mean_change, "change of the mean of {metric} over {level}, %"),
    "power": Statistic(
        power, "τ of {metric} with {level}, positive where worse", is_percentage=False
    ),
    "joint power": Statistic(
        joint_power,
        "τ of {metric} with {level}, the smallest, positive where worse",
        is_percentage=False,
    ),
    "improvement": Statistic(
        improvement, "τ of {metric} with {level}, positive where better", is_percentage=False
    ),
    "dependence": Statistic(
        dependence, "movement of the mean of {metric} over {level}, % of its range"
    ),
    "relative dependence": Statistic(
        relative_dependence,
        "movement of the mean of {metric} over {level}, in its range, relative to {versus}, %",
    ),
    "relative dependence change": Statistic(
        relative_dependence_change,
        "movement of the mean of {metric} over {level}, relative to {versus}, here minus all, %",
    ),
    "initial response": Statistic(
        initial_response,
        "share of the first step of {level} in the change of {metric}, %",
        least_levels=3,
    ),
    "relative initial response": Statistic(
        relative_initial_response,
        "share of the first step of {level} in the change of {metric}, relative to {versus}, %",
        least_levels=3,
    ),
}
