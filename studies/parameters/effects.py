"""What the values of a study's axes do to a score: statistics of the trials of its parts."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import scipy

from alignscores.arrays import Floats, Indices
from experiments.grid import KEY_COLUMNS

from .. import statistics
from .axes import Axis, seeded

__all__ = ["COMPARED", "EFFECTS", "Effect", "Parts", "effects", "over_seeds"]

RESAMPLES = 999  # of the trials
ROUNDING = 1e-12  # differences below are none

Parts = Mapping[str, pd.DataFrame]  # the trials of each part of a study
Weighted = Callable[[Floats], Floats]  # of weights of the trials (B, T), a value for each of the B


@dataclass(frozen=True)
class Effect:
    """A statistic that the values of an axis are compared by.

    Parameters
    ----------
    words : str
        What it is called.
    larger_is_better : bool
        Whether it is a gain; a cost otherwise.
    digits : int
        That matter.
    of : callable
        Computes it from the trials of all parts and a metric.
    unit : str
        Behind its numbers.
    part : str
        The part that it is of.
    weighted : callable, optional
        Computes it from the trials of this part and a metric, for any weights of the trials; where
        there is none, values are not compared by it.
    """

    words: str
    larger_is_better: bool
    digits: int
    of: Callable[[Parts, str], float]  # the trials of all parts, the metric
    unit: str = ""
    part: str = "outliers"
    weighted: Callable[[pd.DataFrame, str], Weighted] | None = None

    def write(self, value: float) -> str:
        """Write a value with the digits that matter, and its unit."""
        return f"{value:.{self.digits}f}{self.unit}"


def _power(level: str, take: str, part: str = "outliers") -> Callable[[Parts, str], float]:
    def of(parts: Parts, metric: str) -> float:
        table = parts[part]
        if not _varies(table, level):
            return np.nan
        return statistics.power(table, metric, [level], take)

    return of


def _weighted_power(level: str) -> Callable[[pd.DataFrame, str], Weighted]:
    """Return the mean tau for weights of the trials: a quadratic form in these.

    Only the numerator is weighted. In the denominator stand the pairs that tie, which are few.
    """

    def of(table: pd.DataFrame, metric: str) -> Weighted:
        if not _varies(table, level):
            return lambda weights: np.full(len(weights), np.nan)
        forms = []
        for group in statistics.groups(table, level):
            rows = statistics.by_level(group.sort_values("trial"), metric, level)
            signs = sum(
                np.sign(worse - better[:, None])
                for k, better in enumerate(rows)
                for worse in rows[k + 1 :]
            )
            values = np.concatenate(rows)
            pairs = (_pairs(len(values)), sum(map(_pairs, map(len, rows))))
            ties = _pairs(np.unique(values, return_counts=True)[1]).sum()
            forms.append(signs / max(np.sqrt((pairs[0] - pairs[1]) * (pairs[0] - ties)), 1e-300))
        form = np.mean(forms, axis=0)
        return lambda weights: np.einsum("bi,ij,bj->b", weights, form, weights, optimize=True)

    return of


def _pairs(n: Any) -> Any:
    """Return how many pairs there are of so many."""
    return n * (n - 1) / 2


def _noise_range(of_means: bool) -> Callable[[Parts, str], float]:
    """Range over the noise levels; the mean over the outlier counts."""

    def of(parts: Parts, metric: str) -> float:
        part = parts["outliers"]
        values = statistics.cell_means(part) if of_means else part
        return float(values.groupby("n_outliers")[metric].agg(np.ptp).mean())

    return of


def _weighted_noise_range(table: pd.DataFrame, metric: str) -> Weighted:
    means = [_weighted_means(group, metric) for _, group in table.groupby("n_outliers")]
    return lambda weights: np.mean([np.ptp(of(weights), axis=0) for of in means], axis=0)


def _camera_dependence(parts: Parts, metric: str) -> float:
    part = parts["length"]
    if not _varies(part, "n_cameras"):
        return np.nan
    return statistics.dependence(part, metric, ["n_cameras"], "mean")


def _weighted_dependence(table: pd.DataFrame, metric: str) -> Weighted:
    if not _varies(table, "n_cameras"):
        return lambda weights: np.full(len(weights), np.nan)
    groups = [
        _weighted_means(group, metric) for _, group in table.groupby(["n_outliers", "sigma_t"])
    ]

    def of(weights: Floats) -> Floats:
        means = [means_of(weights) for means_of in groups]
        moves = np.mean([np.ptp(mean, axis=0) for mean in means], axis=0)
        share: Floats = 100 * moves / np.ptp(np.concatenate(means), axis=0)
        return share

    return of


def _weighted_means(table: pd.DataFrame, metric: str) -> Weighted:
    """Return the means of cells (C, B) for weights of the trials (B, T)."""
    ordered = table.sort_values("trial").groupby(["n_cameras", "n_outliers", "sigma_t"])[metric]
    values = np.array([cell.to_numpy() for _, cell in ordered])
    return lambda weights: values @ weights.T / values.shape[1]


def over_seeds(trials: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Return the columns of a metric under each seed of the registration; RAS has none."""
    return trials[[name for k in range(trials.shape[1]) if (name := seeded(metric, k)) in trials]]


def _deviations(trials: pd.DataFrame, metric: str) -> Floats:
    """Return the standard deviation over the seeds of each scene; 0 where nothing is random."""
    scores = over_seeds(trials, metric)
    return np.zeros(len(trials)) if scores.empty else scores.std(axis=1, ddof=1).to_numpy()


def _seed_noise(parts: Parts, metric: str) -> float:
    return float(np.median(_deviations(parts["seeds"], metric)))


def _varies(trials: pd.DataFrame, level: str) -> bool:
    return trials[level].nunique() > 1


EFFECTS: Mapping[str, Effect] = {
    "noise_power": Effect(
        "τ with noise",
        True,
        3,
        _power("sigma_t", "mean"),
        weighted=_weighted_power("sigma_t"),
    ),
    "noise_power_smallest": Effect("smallest τ with noise", True, 3, _power("sigma_t", "smallest")),
    "outlier_power": Effect(
        "τ with outliers",
        True,
        3,
        _power("n_outliers", "mean"),
        weighted=_weighted_power("n_outliers"),
    ),
    "outlier_power_smallest": Effect(
        "smallest τ with outliers", True, 3, _power("n_outliers", "smallest")
    ),
    "majority_power": Effect(
        "τ with noise where most are lost",
        True,
        3,
        _power("sigma_t", "mean", "majority"),
        part="majority",
        weighted=_weighted_power("sigma_t"),
    ),
    "noise_range": Effect("range of trials over noise", True, 3, _noise_range(of_means=False)),
    "noise_range_of_means": Effect(
        "range over noise", True, 3, _noise_range(of_means=True), weighted=_weighted_noise_range
    ),
    "camera_dependence": Effect(
        "dependence on cameras",
        False,
        1,
        _camera_dependence,
        " %",
        part="length",
        weighted=_weighted_dependence,
    ),
    "seed_noise": Effect("seed noise", False, 4, _seed_noise, part="seeds"),
}
"""Effects by their columns in the tables of the threshold study; see `effects`."""

COMPARED = tuple(
    name for name, effect in EFFECTS.items() if effect.weighted or name == "seed_noise"
)
"""The effects that values are compared by: those whose sampling error is known."""


def effects(axes: Sequence[Axis], parts: Parts) -> pd.DataFrame:
    """Compute all effects of all values of all axes.

    Returns
    -------
    DataFrame
        One row for each value: `axis, metric, option, value, paper` (yes or no), then each of
        `EFFECTS`:

        - `noise_power, outlier_power`: Kendall's tau with noise and with outliers, the mean over
          the other's levels; `noise_power_smallest, outlier_power_smallest`: the smallest
        - `majority_power`: tau with noise where four of five cameras are outliers
        - `noise_range, noise_range_of_means`: largest minus smallest trial (mean of trials) over
          the noise levels, averaged over the outlier counts
        - `camera_dependence`: how far the mean moves over the numbers of cameras, in per cent of
          the range of all means
        - `seed_noise`: standard deviation over the seeds of the registration, the median over
          scenes

        Behind each of `COMPARED` stand, as `..._error`, the standard error of its difference from
        that of the paper's value, and as `..._p` the p-value against no difference, adjusted for
        the number of all differences in the table by Holm's method. Empty for the paper's value,
        and where there is one trial.

    Notes
    -----
    The errors come from a bootstrap over the trials, which are paired: the values of an axis saw
    the same cameras. The p-values are those of Student's t, for the seed noise of Wilcoxon's signed
    ranks over the scenes.
    """
    rows: list[dict[str, object]] = []
    for axis in axes:
        paper = axis.columns[axis.paper]
        for value, column in axis.columns.items():
            row: dict[str, object] = {"axis": axis.name, "metric": axis.metric}
            row |= {"option": axis.option, "value": value}
            row |= {"paper": "yes" if value == axis.paper else "no"}
            own = _of(parts, column)
            for name, effect in EFFECTS.items():
                row[name] = effect.of(own, column)
                if name in COMPARED:
                    error, p = _compare(parts, effect, column, paper)
                    row |= {f"{name}_error": error, f"{name}_p": p}
            rows.append(row)
    table = pd.DataFrame(rows)
    p_values = [f"{name}_p" for name in COMPARED]
    adjusted = statistics.holm(table[p_values].to_numpy(dtype=np.float64).ravel())
    table[p_values] = adjusted.reshape(-1, len(p_values))
    return table.round(6)


def _of(parts: Parts, column: str) -> Parts:
    """Return the columns that are needed: to group all of them takes long."""
    return {
        part: table if part == "seeds" else table[[*KEY_COLUMNS, column]]
        for part, table in parts.items()
    }


def _compare(parts: Parts, effect: Effect, column: str, paper: str) -> tuple[float, float]:
    """Return the standard error of a difference, and the p-value against none."""
    table = parts[effect.part]
    if column == paper or table["trial"].nunique() < 2:
        return np.nan, np.nan
    if effect.weighted is None:
        return _compare_scenes(_deviations(table, column), _deviations(table, paper))
    theirs, ours = (effect.weighted(table[[*KEY_COLUMNS, name]], name) for name in (column, paper))
    n = table["trial"].nunique()

    def difference(trials: Indices, axis: int = -1) -> Floats:
        weights = np.eye(n)[trials].sum(axis=-2).reshape(-1, n)
        return (theirs(weights) - ours(weights)).reshape(trials.shape[:-1])

    error = _standard_error(np.arange(n), difference)
    return error, _p_value(float(difference(np.arange(n))), error, n)


def _compare_scenes(theirs: Floats, ours: Floats) -> tuple[float, float]:
    """Compare standard deviations scene by scene."""

    def difference(scenes: Indices, axis: int = -1) -> Floats:
        medians: Floats = np.median(theirs[scenes], axis=-1) - np.median(ours[scenes], axis=-1)
        return medians

    error = _standard_error(np.arange(len(ours)), difference)
    if np.array_equal(theirs, ours):
        return error, 1.0
    return error, float(scipy.stats.wilcoxon(theirs, ours).pvalue)


def _standard_error(sample: Indices, statistic: Callable[..., Floats]) -> float:
    with warnings.catch_warnings():  # where nothing scatters, the error is 0
        warnings.simplefilter("ignore", scipy.stats.DegenerateDataWarning)
        found = scipy.stats.bootstrap(
            (sample,),
            statistic,
            n_resamples=RESAMPLES,
            vectorized=True,
            method="percentile",
            rng=np.random.default_rng(0),
        )
    return float(found.standard_error)


def _p_value(difference: float, error: float, n: int) -> float:
    if np.isnan(difference):
        return np.nan
    if abs(difference) < ROUNDING:
        return 1.0
    return float(2 * scipy.stats.t.sf(abs(difference) / max(error, ROUNDING), n - 1))
