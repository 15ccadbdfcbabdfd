"""What the values of an axis do to a score, and how sure the difference from the paper's is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from alignscores.arrays import Floats
from alignscores.comparison.statistics import holm

from ..order import Order, in_order, sign
from .axes import Axis

RESAMPLES = 400  # of the trials

Parts = Mapping[str, pd.DataFrame]  # the trials of each part of the study
# Of values (numbers of cameras, numbers of outliers, noise levels, trials), larger is worse, and
# weights of the trials (B, trials), B numbers.
Statistic = Callable[[Floats, Floats], Floats]


def noise_order(values: Floats, weights: Floats) -> Floats:
    """Return how often two trials at neighbouring noise levels are in the right order, in %."""
    n_levels, n_trials = values.shape[2:]
    groups = values.reshape(-1, n_levels, n_trials)
    pairs = [in_order(*pair) for group in groups for pair in pairwise(group)]
    if not pairs:
        return np.full(len(weights), np.nan)
    right = np.einsum("bt,ptu,bu->b", weights, np.array(pairs), weights, optimize=True)
    return np.asarray(100 * right / len(pairs) / n_trials**2)


def outlier_order(values: Floats, weights: Floats) -> Floats:
    """Return the same for neighbouring numbers of outliers."""
    return noise_order(np.swapaxes(values, 1, 2), weights)


def noise_range(values: Floats, weights: Floats) -> Floats:
    """Return the range of the means over the noise levels; the mean over the outlier counts."""
    return np.asarray(np.ptp(_means(values, weights), axis=(0, 2)).mean(axis=0))


def camera_dependence(values: Floats, weights: Floats) -> Floats:
    """Return how far the mean moves over the numbers of cameras, in % of the range of all means."""
    means = _means(values, weights)
    if len(means) == 1:
        return np.full(len(weights), np.nan)
    moves = np.ptp(means, axis=0).mean(axis=(0, 1))
    return np.asarray(100 * moves / np.ptp(means, axis=(0, 1, 2)))


def _means(values: Floats, weights: Floats) -> Floats:
    """Return the means of the trials of each cell (cameras, outliers, noise, B)."""
    return np.asarray(values @ weights.T / values.shape[-1])


@dataclass(frozen=True)
class Effect:
    """A statistic that the values of an axis are compared by, and the trials that it is of."""

    title: str
    statistic: Statistic
    larger_is_better: bool = True
    part: str = "outliers"


EFFECTS: Mapping[str, Effect] = {
    "noise_order": Effect("Noise, %", noise_order),
    "outlier_order": Effect("Outliers, %", outlier_order),
    "majority_order": Effect("Most lost, %", noise_order, part="majority"),
    "noise_range": Effect("Noise range", noise_range),
    "camera_dependence": Effect("Cameras, %", camera_dependence, False, "length"),
}
"""The effects by their columns in the table of the study; see `effects`."""


def effects(axes: Sequence[Axis], parts: Parts) -> pd.DataFrame:
    """Compute all effects of all values of all axes.

    Returns
    -------
    DataFrame
        One row for each value: `axis, metric, option, value, paper` (yes or no), then

        - `noise_order, outlier_order`: how often two trials at neighbouring levels of noise, or
          numbers of outliers, come in the right order, in per cent; the mean over the other's
          levels
        - `majority_order`: the order of noise where four of five cameras are outliers
        - `noise_range`: largest minus smallest mean over the noise levels, averaged over the
          outlier counts
        - `camera_dependence`: how far the mean moves over the numbers of cameras, in per cent of
          the range of all means

        Each is followed, as `..._error`, by the standard error of its difference from the paper's
        value (bootstrap over the trials, which are paired), and as `..._p` by the p-value against
        no difference, adjusted for all differences in the table by Holm's method.
    """
    tables = [_of_axis(axis, parts) for axis in axes]
    table = pd.concat(tables, ignore_index=True)
    p_values = [f"{name}_p" for name in EFFECTS]
    table[p_values] = holm(table[p_values])
    return table


def _of_axis(axis: Axis, parts: Parts) -> pd.DataFrame:
    keys = {"axis": axis.name, "metric": axis.metric, "option": axis.option}
    rows = [keys | {"value": v, "paper": "yes" if v == axis.paper else "no"} for v in axis.values]
    table = pd.DataFrame(rows, index=axis.values, dtype=object)
    for name, effect in EFFECTS.items():
        trials = parts[effect.part]
        samples = {
            value: _resampled(effect, trials, column) for value, column in axis.columns.items()
        }
        for value, numbers in samples.items():
            difference, *others = numbers - samples[axis.paper]
            has_error = value != axis.paper and trials["trial"].nunique() > 1
            error = float(np.std(others, ddof=1)) if has_error else np.nan
            p_value = Order(float(difference), error).p_value if np.isfinite(error) else np.nan
            table.loc[value, [name, f"{name}_error", f"{name}_p"]] = numbers[0], error, p_value
    return table


def _resampled(effect: Effect, trials: pd.DataFrame, metric: str) -> Floats:
    """Return an effect of all trials, and of each resample of them."""
    keys = ["n_cameras", "n_outliers", "sigma_t", "trial"]
    values = trials[keys].assign(value=sign(metric) * trials[metric]).sort_values(keys)
    shape = [values[key].nunique() for key in keys]
    n = shape[-1]
    drawn = np.random.default_rng(0).integers(n, size=(RESAMPLES, n))
    weights = np.concatenate([np.ones((1, n)), np.eye(n)[drawn].sum(axis=1)])
    return effect.statistic(values["value"].to_numpy().reshape(shape), weights)
