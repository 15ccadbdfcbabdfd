"""What the values of a study's axes do to a score: statistics of the trials of its parts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from experiments.grid import KEY_COLUMNS

from .. import statistics
from .axes import Axis, seeded

__all__ = ["EFFECTS", "Effect", "Parts", "effects", "over_seeds"]

GROUPS = 10  # of trials, for the jackknife

Parts = Mapping[str, pd.DataFrame]  # the trials of each part of a study


@dataclass(frozen=True)
class Effect:
    """A statistic that the values of an axis are compared by."""

    words: str
    larger_is_better: bool
    digits: int
    of: Callable[[Parts, str], float]  # the trials of all parts, the metric
    unit: str = ""

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


def _noise_range(of_means: bool) -> Callable[[Parts, str], float]:
    """Range over the noise levels; the mean over the outlier counts."""

    def of(parts: Parts, metric: str) -> float:
        part = parts["outliers"]
        values = statistics.cell_means(part) if of_means else part
        return float(values.groupby("n_outliers")[metric].agg(np.ptp).mean())

    return of


def _camera_dependence(parts: Parts, metric: str) -> float:
    part = parts["length"]
    if not _varies(part, "n_cameras"):
        return np.nan
    return statistics.dependence(part, metric, ["n_cameras"], "mean")


def over_seeds(trials: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Return the columns of a metric under each seed of the registration; RAS has none."""
    return trials[[name for k in range(trials.shape[1]) if (name := seeded(metric, k)) in trials]]


def _seed_noise(parts: Parts, metric: str) -> float:
    scores = over_seeds(parts["seeds"], metric)
    return 0.0 if scores.empty else float(scores.std(axis=1, ddof=1).median())


def _varies(trials: pd.DataFrame, level: str) -> bool:
    return trials[level].nunique() > 1


EFFECTS: Mapping[str, Effect] = {
    "noise_power": Effect("τ with noise", True, 3, _power("sigma_t", "mean")),
    "noise_power_smallest": Effect("smallest τ with noise", True, 3, _power("sigma_t", "smallest")),
    "outlier_power": Effect("τ with outliers", True, 3, _power("n_outliers", "mean")),
    "outlier_power_smallest": Effect(
        "smallest τ with outliers", True, 3, _power("n_outliers", "smallest")
    ),
    "majority_power": Effect(
        "τ with noise where most are lost", True, 3, _power("sigma_t", "mean", "majority")
    ),
    "noise_range": Effect("range of trials over noise", True, 3, _noise_range(of_means=False)),
    "noise_range_of_means": Effect("range over noise", True, 3, _noise_range(of_means=True)),
    "camera_dependence": Effect("dependence on cameras", False, 1, _camera_dependence, " %"),
    "seed_noise": Effect("seed noise", False, 4, _seed_noise),
}
"""Effects by their columns in the tables of the threshold study.

Discerning power is Kendall's tau, positive where the score gets worse, its mean and its smallest
value over the outlier counts (noise levels); `majority_power` is that with noise where four of five
cameras are outliers. The range is the largest minus the smallest trial (mean of trials) over the
noise levels, averaged over the outlier counts. The dependence is how far the mean moves over the
numbers of cameras in per cent of the range of all means. Seed noise is the standard deviation over
the seeds of the registration, the median over scenes.
"""


def effects(axes: Sequence[Axis], parts: Parts) -> pd.DataFrame:
    """Compute all effects of all values of all axes.

    Returns
    -------
    DataFrame
        One row for each value: `axis, metric, option, value, paper` (yes or no), then each of
        `EFFECTS` and behind it, as `..._error`, the standard error of its difference from that of
        the paper's value. It comes from a jackknife over groups of trials; since the trials are
        paired, it is smaller than that of either value. Empty where there is one trial.
    """
    columns = list(dict.fromkeys(column for axis in axes for column in axis.columns.values()))
    whole = _compute(parts, columns)
    n_trials = max(int(table["trial"].max()) + 1 for table in parts.values())
    count = min(GROUPS, n_trials)
    reduced = [_compute(_without(parts, group, count), columns) for group in range(count)]
    rows = []
    for axis in axes:
        paper = axis.columns[axis.paper]
        for value, column in axis.columns.items():
            row: dict[str, object] = {"axis": axis.name, "metric": axis.metric}
            row |= {"option": axis.option, "value": value}
            row |= {"paper": "yes" if value == axis.paper else "no"}
            for name in EFFECTS:
                row[name] = whole[column, name]
                differences = [values[column, name] - values[paper, name] for values in reduced]
                row[f"{name}_error"] = np.nan if column == paper else _jackknife(differences)
            rows.append(row)
    return pd.DataFrame(rows).round(6)


def _compute(parts: Parts, columns: Sequence[str]) -> dict[tuple[str, str], float]:
    values: dict[tuple[str, str], float] = {}
    for column in columns:
        own = {  # the columns that are needed: to group all of them takes long
            part: table if part == "seeds" else table[[*KEY_COLUMNS, column]]
            for part, table in parts.items()
        }
        values |= {(column, name): effect.of(own, column) for name, effect in EFFECTS.items()}
    return values


def _without(parts: Parts, group: int, count: int) -> Parts:
    """Leave out a group of trials in every cell."""
    if count < 2:
        return parts
    return {part: table[table["trial"] % count != group] for part, table in parts.items()}


def _jackknife(values: Sequence[float]) -> float:
    n = len(values)
    return float(np.sqrt((n - 1) * np.var(values))) if n > 1 else np.nan
