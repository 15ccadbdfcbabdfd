"""Statistics of trials: what the claims, Table 1 and the findings are decided by."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from alignscores.arrays import Floats
from experiments.grid import CELL_SETTINGS
from experiments.metrics import Column

if TYPE_CHECKING:  # heavy, and Snakemake only wants to know what the claims need
    import pandas as pd

__all__ = [
    "LEAST_POWER",
    "SIGNIFICANCE",
    "STATISTICS",
    "SUMMARIES",
    "Order",
    "Statistic",
    "Where",
    "cell_means",
]
__all__ += ["by_level", "correlation", "dependence", "groups", "holm", "order", "order_shares"]
__all__ += ["power", "powers", "select", "trials_needed"]

# The discerning power of a metric that discerns a level. Tau-b counts the pairs of trials at one
# level against it: of those at two levels, 76 % are in the right order then where there are ten
# levels, 78 % where there are five and 81 % where there are three.
LEAST_POWER = 0.5
SIGNIFICANCE = 0.05  # level of p-values, which are adjusted where several are asked at once
SUMMARIES: Mapping[str, Callable[[Any], Any]] = {
    "smallest": np.min,
    "largest": np.max,
    "mean": np.mean,
}

Where = Mapping[str, Sequence[float]]  # for some settings of a cell, the values that it may have
EVERYWHERE: Where = MappingProxyType({})


@dataclass(frozen=True)
class Order:
    """Probability that neighbouring levels are put in the right order, with its standard error."""

    probability: float
    error: float


def order(values: Sequence[ArrayLike], versus: Sequence[ArrayLike] | None = None) -> Order:
    """Compute how probably one trial at each of two neighbouring levels come in the right order.

    No monotone rescaling of a metric changes it: a score, its square root and its logarithm are
    equally good. It is P(X < Y) + P(X = Y) / 2 for trials X and Y at a level and at the next one,
    the mean over the pairs of neighbours; 1/2 is chance, 1 is certain. A metric that has no value
    (NaN) cannot put two trials in order, so that is a tie.

    Parameters
    ----------
    values : sequence of (T,) array_like
        The trials of each level, in rising order of the levels, of a metric that rises when it gets
        worse. Negate a score.
    versus : sequence of (T,) array_like, optional
        The same trials by another metric. Then the probability of `values` minus this one's is
        returned, and what scatters alike in both is no error.

    Returns
    -------
    Order
        The probability, or the difference of two, and its standard error over the trials, which
        must be independent from level to level.

    References
    ----------
    DeLong, DeLong and Clarke-Pearson, "Comparing the areas under two or more correlated receiver
    operating characteristic curves", Biometrics 1988: here for the mean over more than one pair.

    Examples
    --------
    >>> from studies.statistics import order
    >>> order([[1, 2], [2, 3]]).probability, order([[1, 2], [2, 3]], [[1, 1], [1, 1]]).probability
    (0.875, 0.375)
    """
    shares = order_shares(values)
    if versus is not None:
        both = zip(shares, order_shares(versus), strict=True)
        shares = [ours - theirs for ours, theirs in both]
    # Each pair of neighbours is in the shares of the one level and in those of the other.
    probability = sum(float(level.mean()) for level in shares) / 2
    variance = sum(level.var(ddof=1) / len(level) if len(level) > 1 else inf for level in shares)
    return Order(probability, float(np.sqrt(variance)))


def order_shares(
    values: Sequence[ArrayLike], pairs: Sequence[tuple[int, int]] | None = None
) -> list[Floats]:
    """Return each trial's share of the probability of `order`: how often it is right.

    Parameters
    ----------
    values : sequence of (T,) array_like
        The trials of each level, so that larger is worse.
    pairs : sequence of (int, int), optional
        Which levels are compared, the better one first; by default neighbours.

    Returns
    -------
    list of (T,) ndarray
        Each pair of trials is in the shares of both: the means of all levels sum to twice the
        probability.

    Examples
    --------
    >>> from studies.statistics import order_shares
    >>> order_shares([[1, 2], [2, 3]])
    [array([1.  , 0.75]), array([0.75, 1.  ])]
    """
    levels = [np.asarray(level, dtype=np.float64) for level in values]
    compared = list(pairwise(range(len(levels)))) if pairs is None else pairs
    shares = [np.zeros(len(level)) for level in levels]
    for better, worse in compared:
        lower, upper = levels[better][:, None], levels[worse]
        right = (lower < upper) + (lower == upper) / 2
        right[np.isnan(lower) | np.isnan(upper)] = 0.5
        shares[better] += right.mean(axis=1) / len(compared)
        shares[worse] += right.mean(axis=0) / len(compared)
    return shares


def trials_needed(probability: float) -> float:
    """Return how many trials at each of two levels tell them apart, by their ranks alone.

    They are those of a two-sided rank-sum test that errs at 5 % and finds the difference at 80 %.

    Parameters
    ----------
    probability : float
        That one trial of each comes in the right order; see `order`.

    Returns
    -------
    float
        A whole number; infinite where the order is a matter of chance, or wrong.

    References
    ----------
    Noether, "Sample size determination for some common nonparametric tests", JASA 1987.

    Examples
    --------
    >>> from studies.statistics import trials_needed
    >>> trials_needed(0.9), trials_needed(0.6), trials_needed(0.5)
    (9.0, 131.0, inf)
    """
    if not probability > 0.5:
        return inf
    reach = scipy.special.ndtri(1 - SIGNIFICANCE / 2) + scipy.special.ndtri(0.8)
    return float(ceil(reach**2 / (6 * (probability - 0.5) ** 2)))


def holm(p_values: ArrayLike) -> Floats:
    """Adjust p-values for their number, by Holm's method.

    Parameters
    ----------
    p_values : (n,) array_like
        p-values of all tests of a family; NaN for one that cannot be made, which stays so.

    Returns
    -------
    (n,) ndarray
        The adjusted ones: where those below a level are called significant, the probability that
        any is so by chance is at most this level.

    References
    ----------
    Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Statistics 1979.

    Examples
    --------
    >>> from studies.statistics import holm
    >>> holm([0.03, 0.01, 0.04]).round(2)
    array([0.06, 0.03, 0.06])
    """
    p = np.asarray(p_values, dtype=np.float64)
    adjusted = np.full(len(p), np.nan)
    rising = [k for k in np.argsort(p, kind="stable") if not np.isnan(p[k])]
    factors = np.arange(len(rising), 0, -1)
    adjusted[rising] = np.minimum(np.maximum.accumulate(factors * p[rising]), 1) if rising else []
    return adjusted


def select(trials: "pd.DataFrame", where: Where) -> "pd.DataFrame":
    """Return the trials whose settings have one of the values named for each."""
    for column, values in where.items():
        trials = trials[trials[column].isin(values)]
    return trials


def cell_means(trials: "pd.DataFrame") -> "pd.DataFrame":
    """Return the means of the trials of each cell, one row a cell."""
    return trials.groupby(list(CELL_SETTINGS), as_index=False).mean(numeric_only=True)


def correlation(values: "pd.Series[float]", levels: "pd.Series[float]") -> float:
    """Kendall's rank correlation, tau-b; 0 where all values are the same."""
    if (values == values.iloc[0]).all():
        return 0.0
    return float(scipy.stats.kendalltau(values, levels).statistic)


def range_change(trials: "pd.DataFrame", metric: str, before: Where, after: Where) -> float:
    """Change of the range from some cells to others in per cent; NaN where it was 0."""
    ranges = (_range(select(trials, where)[metric]) for where in (after, before))
    return _percentage(*ranges) - 100


def range_change_size(trials: "pd.DataFrame", metric: str, before: Where, after: Where) -> float:
    """Change of the range, up or down."""
    return abs(range_change(trials, metric, before, after))


def relative_range(trials: "pd.DataFrame", metric: str, versus: str) -> float:
    """How much wider the range of a metric is than that of another, in per cent."""
    return _percentage(_range(trials[metric]), _range(trials[versus])) - 100


def powers(trials: "pd.DataFrame", metric: str, level: Sequence[str]) -> list[float]:
    """Rank correlations with each level, positive where the metric gets worse as it rises.

    There is one for each group of trials that share all other settings.
    """
    sign = _sign(metric)
    return [
        sign * correlation(group[metric], group[name]) for name, group in _groups(trials, level)
    ]


def power(trials: "pd.DataFrame", metric: str, level: Sequence[str], take: str) -> float:
    """Discerning power: what is taken of `powers`."""
    return float(SUMMARIES[take](powers(trials, metric, level)))


def improvement(trials: "pd.DataFrame", metric: str, level: Sequence[str], take: str) -> float:
    """Negate `power`: positive where the metric looks better as a level rises."""
    return float(SUMMARIES[take]([-tau for tau in powers(trials, metric, level)]))


def dependence(
    trials: "pd.DataFrame", metric: str, level: Sequence[str], take: str, at: Where = EVERYWHERE
) -> float:
    """How far the mean of a metric moves over a level, in per cent of the range of all means.

    The movements are those in the cells that `at` names; the range is that of all means.
    """
    means = cell_means(trials)
    moves = [_range(group[metric]) for _, group in _groups(select(means, at), level)]
    return _percentage(SUMMARIES[take](moves), _range(means[metric]))


def relative_dependence(
    trials: "pd.DataFrame",
    metric: str,
    versus: str,
    level: Sequence[str],
    take: str,
    at: Where = EVERYWHERE,
) -> float:
    """Dependence of a metric in per cent of that of another."""
    return _percentage(*(dependence(trials, name, level, take, at) for name in (metric, versus)))


def mean_change(trials: "pd.DataFrame", metric: str, level: Sequence[str], take: str) -> float:
    """Change of the mean from the first to the last level, in per cent of the first."""
    changes = []
    for name, group in _groups(cell_means(trials), level):
        first, *_, last = group.sort_values(name)[metric]
        changes.append(_percentage(last - first, first))
    return float(SUMMARIES[take](changes))


def shift(trials: "pd.DataFrame", metric: str, versus: str) -> float:
    """Mean difference from another metric, in per cent of the range of the other's means."""
    means = cell_means(trials)
    return _percentage((means[metric] - means[versus]).mean(), _range(means[versus]))


def orders(trials: "pd.DataFrame", metric: str, level: Sequence[str]) -> list[float]:
    """Probabilities of the right order, in per cent; one for each group, as in `powers`."""
    return [
        100 * order(by_level(group, metric, name)).probability
        for name, group in _groups(trials, level)
    ]


def by_level(trials: "pd.DataFrame", metric: str, level: str) -> list[Floats]:
    """Return the trials of each level, in rising order, so that larger is worse."""
    sign = _sign(metric)
    return [sign * values.to_numpy() for _, values in trials.groupby(level)[metric]]


def order_change_size(
    trials: "pd.DataFrame",
    metric: str,
    level: Sequence[str],
    take: str,
    before: Where,
    after: Where,
) -> float:
    """Change, up or down, of the probability of the right order from some cells to others."""
    now, then = (
        SUMMARIES[take](orders(select(trials, where), metric, level)) for where in (after, before)
    )
    return float(abs(now - then))


def initial_response(trials: "pd.DataFrame", metric: str, level: Sequence[str], take: str) -> float:
    """Share of the mean's change, first to last level, that happens up to the second; per cent."""
    steps = []
    for name, group in _groups(cell_means(trials), level):
        first, second, *_, last = group.sort_values(name)[metric]
        steps.append(_percentage(second - first, last - first))
    return float(SUMMARIES[take](steps))


def relative_initial_response(
    trials: "pd.DataFrame", metric: str, versus: str, level: Sequence[str], take: str
) -> float:
    """Return the initial response of a metric in per cent of that of another."""
    return _percentage(*(initial_response(trials, name, level, take) for name in (metric, versus)))


def _sign(metric: str) -> int:
    return -1 if Column.parse(metric).metric.family.larger_is_better else 1


def _percentage(part: float, whole: float) -> float:
    return float(100 * part / whole) if whole else np.nan


def _range(values: "pd.Series[float]") -> float:
    return float(np.ptp(values.to_numpy()))


def groups(trials: "pd.DataFrame", level: str) -> list["pd.DataFrame"]:
    """Return the trials that share all settings but a level, and those that rise with it."""
    return [group for _, group in _groups(trials, [level])]


def _groups(trials: "pd.DataFrame", level: Sequence[str]) -> Iterator[tuple[str, "pd.DataFrame"]]:
    """Split trials, for each level, by the settings that vary where it does not.

    A setting that rises with the level is no reason to split.
    """
    for name in level:
        at_a_level = trials.groupby(name)
        free = [column for column in CELL_SETTINGS if at_a_level[column].nunique().max() > 1]
        groups = [group for _, group in trials.groupby(free)] if free else [trials]
        yield from ((name, group) for group in groups)


@dataclass(frozen=True)
class Statistic:
    """What can decide a claim.

    Parameters
    ----------
    function : callable
        Computes it from trials, a metric and what it `needs`.
    needs : sequence of str
        The keys of a claim that it takes, and that the claim must have.
    text : str
        It in words, with the names of keys in braces.
    is_percentage : bool
        Whether it is in per cent; a correlation otherwise.
    has_ranges : bool
        Whether it compares ranges, which could also be those of mean curves.
    least_levels : int
        How many values of each ``level`` it takes.
    is_local : bool
        Whether it also takes the cells ``at`` which it is looked for among those of ``where``.
    """

    function: Callable[..., float]
    needs: Sequence[str]
    text: str
    is_percentage: bool = True
    has_ranges: bool = False
    least_levels: int = 2
    is_local: bool = False


STATISTICS: Mapping[str, Statistic] = {
    "range change": Statistic(
        range_change, ("before", "after"), "change of the range of {metric}, %", has_ranges=True
    ),
    "size of range change": Statistic(
        range_change_size,
        ("before", "after"),
        "|change of the range| of {metric}, %",
        has_ranges=True,
    ),
    "relative range": Statistic(
        relative_range,
        ("versus",),
        "width of the range of {metric} relative to {versus}, %",
        has_ranges=True,
    ),
    "size of order change": Statistic(
        order_change_size,
        ("level", "take", "before", "after"),
        "|change of the order| of {metric} by {level}, %",
    ),
    "mean change": Statistic(
        mean_change,
        ("level", "take"),
        "change of the mean of {metric} over {level}, %",
    ),
    "shift": Statistic(
        shift,
        ("versus",),
        "mean of {metric} minus {versus}, % of the range of {versus}",
    ),
    "power": Statistic(
        power,
        ("level", "take"),
        "τ of {metric} with {level}, positive where worse",
        is_percentage=False,
    ),
    "improvement": Statistic(
        improvement,
        ("level", "take"),
        "τ of {metric} with {level}, positive where better",
        is_percentage=False,
    ),
    "dependence": Statistic(
        dependence,
        ("level", "take"),
        "movement of the mean of {metric} over {level}, % of its range",
        is_local=True,
    ),
    "relative dependence": Statistic(
        relative_dependence,
        ("versus", "level", "take"),
        "movement of the mean of {metric} over {level}, in its range, relative to {versus}, %",
        is_local=True,
    ),
    "initial response": Statistic(
        initial_response,
        ("level", "take"),
        "share of the first step of {level} in the change of {metric}, %",
        least_levels=3,
    ),
    "relative initial response": Statistic(
        relative_initial_response,
        ("versus", "level", "take"),
        "share of the first step of {level} in the change of {metric}, relative to {versus}, %",
        least_levels=3,
    ),
}
