"""What the values of an axis do to a score: statistics of the trials of the study's parts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy

from alignscores.arrays import Floats, Indices
from experiments.grid import KEY_COLUMNS

from .. import order
from ..axes import Axis, over_seeds

RESAMPLES = 999  # of the trials

Parts = Mapping[str, pd.DataFrame]  # the trials of each part of a study


@dataclass(frozen=True)
class Effect:
    """A statistic that the values of an axis are compared by."""

    words: str
    larger_is_better: bool
    digits: int  # that matter
    unit: str = ""
    part: str = "outliers"
    level: str = ""  # whose order it is
    smallest: bool = False  # of the groups, not their mean
    of_means: Callable[[Floats], Floats] | None = None  # (cameras, outliers, noise, B)
    alone: Callable[[pd.DataFrame, str], float] | None = None  # of the trials as they are

    def of(self, trials: pd.DataFrame, metric: str) -> float:
        """Compute it from the trials of a metric; NaN where the level does not vary."""
        if self.alone:
            return self.alone(trials, metric)
        if self.of_means:
            weights = np.ones((1, trials["trial"].nunique()))
            return float(self.of_means(weighted_means(trials, metric, weights))[0])
        if not order.varies(trials, self.level):
            return np.nan
        needed = trials[[*KEY_COLUMNS, metric]]  # to group all columns takes long
        found = [one.probability for one in order.orders(needed, metric, self.level)]
        return 100 * float(min(found) if self.smallest else np.mean(found))

    def compare(self, trials: pd.DataFrame, metric: str, paper: str) -> tuple[float, float]:
        """Return the standard error of the difference from the paper's metric, and its p-value."""
        n = trials["trial"].nunique()
        if metric == paper or n == 1 or (self.level and not order.varies(trials, self.level)):
            return np.nan, np.nan
        if self.alone:
            return _compare_scenes(_deviations(trials, metric), _deviations(trials, paper))
        if self.of_means:
            weights = np.concatenate([np.ones((1, n)), np.eye(n)[_resampled(n)].sum(axis=1)])
            means = (weighted_means(trials, name, weights) for name in (metric, paper))
            difference, *resampled = np.subtract(*map(self.of_means, means))
            found = order.Order(float(difference), float(np.std(resampled, ddof=1)))
            return found.error, np.nan if np.isnan(difference) else found.p_value
        task = order.within(trials[[*KEY_COLUMNS, metric, paper]], self.level)
        found = order.estimate(task.shares(metric) - task.shares(paper))
        return 100 * found.error, found.p_value

    def write(self, value: float) -> str:
        """Write a value with the digits that matter, and its unit."""
        return f"{value:.{self.digits}f}{self.unit}"


def weighted_means(trials: pd.DataFrame, metric: str, weights: Floats) -> Floats:
    """Return the means (cameras, outliers, noise, B) for weights of the trials (B, T)."""
    keys = ["n_cameras", "n_outliers", "sigma_t", "trial"]
    shape = [trials[key].nunique() for key in keys]
    values = trials[[*keys, metric]].sort_values(keys)[metric].to_numpy().reshape(shape)
    means: Floats = values @ weights.T / shape[-1]
    return means


def _noise_range(means: Floats) -> Floats:
    """Return the range over the noise levels; the mean over the outlier counts."""
    return np.asarray(np.ptp(means, axis=(0, 2)).mean(axis=0))


def _range_of_trials(trials: pd.DataFrame, metric: str) -> float:
    """Return the same of single trials."""
    return float(trials.groupby("n_outliers")[metric].agg(np.ptp).mean())


def _dependence(means: Floats) -> Floats:
    """Return `studies.statistics.dependence` on the number of cameras."""
    if len(means) == 1:
        return np.full(means.shape[-1], np.nan)
    moves = np.ptp(means, axis=0).mean(axis=(0, 1))
    return np.asarray(100 * moves / np.ptp(means, axis=(0, 1, 2)))


def _deviations(trials: pd.DataFrame, metric: str) -> Floats:
    """Return the standard deviation over the seeds of each scene; 0 where nothing is random."""
    scores = over_seeds(trials, metric)
    return np.zeros(len(trials)) if scores.empty else scores.std(axis=1, ddof=1).to_numpy()


def _seed_noise(trials: pd.DataFrame, metric: str) -> float:
    return float(np.median(_deviations(trials, metric)))


def _compare_scenes(theirs: Floats, ours: Floats) -> tuple[float, float]:
    """Compare standard deviations scene by scene."""
    scenes = _resampled(len(ours))
    differences = np.median(theirs[scenes], axis=1) - np.median(ours[scenes], axis=1)
    error = float(np.std(differences, ddof=1))
    same = np.array_equal(theirs, ours)
    return error, 1.0 if same else float(scipy.stats.wilcoxon(theirs, ours).pvalue)


def _resampled(n: int) -> Indices:
    """Draw as many as there are, with replacement, time and again."""
    return np.random.default_rng(0).integers(n, size=(RESAMPLES, n))


NOISE, OUTLIERS = "order of noise", "order of outliers"
EFFECTS: Mapping[str, Effect] = {
    "noise_order": Effect(NOISE, True, 1, " %", level="sigma_t"),
    "noise_order_smallest": Effect(
        f"smallest {NOISE}", True, 1, " %", level="sigma_t", smallest=True
    ),
    "outlier_order": Effect(OUTLIERS, True, 1, " %", level="n_outliers"),
    "outlier_order_smallest": Effect(
        f"smallest {OUTLIERS}", True, 1, " %", level="n_outliers", smallest=True
    ),
    "majority_order": Effect(f"{NOISE} where most are lost", True, 1, " %", "majority", "sigma_t"),
    "noise_range": Effect("range of trials over noise", True, 3, alone=_range_of_trials),
    "noise_range_of_means": Effect("range over noise", True, 3, of_means=_noise_range),
    "camera_dependence": Effect(
        "dependence on cameras", False, 1, " %", "length", of_means=_dependence
    ),
    "seed_noise": Effect("seed noise", False, 4, part="seeds", alone=_seed_noise),
}
"""Effects by their columns in the tables of the threshold study; see `effects`."""

COMPARED = tuple(
    name for name, effect in EFFECTS.items() if not effect.smallest and name != "noise_range"
)
"""The effects that values are compared by: those whose sampling error is known."""


def effects(axes: Sequence[Axis], parts: Parts) -> pd.DataFrame:
    """Compute all effects of all values of all axes.

    Returns
    -------
    DataFrame
        One row for each value: `axis, metric, option, value, paper` (yes or no), then each of
        `EFFECTS`:

        - `noise_order, outlier_order`: how often two trials at neighbouring levels of noise, or
          numbers of outliers, come in the right order, in per cent; the mean over the other's
          levels, and as `noise_order_smallest, outlier_order_smallest` the smallest
        - `majority_order`: the order of noise where four of five cameras are outliers
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

    The values of an axis saw the same cameras, so the trials are paired. Errors of the order are
    those of `studies.order`, others come from a bootstrap over the trials, and the p-value of the
    seed noise is that of Wilcoxon's signed ranks over the scenes.
    """
    rows = []
    for axis in axes:
        for value, column in axis.columns.items():
            row: dict[str, object] = dict(axis.keys(value))
            row["paper"] = "yes" if value == axis.paper else "no"
            for name, effect in EFFECTS.items():
                trials = parts[effect.part]
                row[name] = effect.of(trials, column)
                if name in COMPARED:
                    found = effect.compare(trials, column, axis.columns[axis.paper])
                    row[f"{name}_error"], row[f"{name}_p"] = found
            rows.append(row)
    table = pd.DataFrame(rows)
    p_values = [f"{name}_p" for name in COMPARED]
    table[p_values] = order.holm(table[p_values])
    return table.round(6)
