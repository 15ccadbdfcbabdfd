"""What other thresholds, weights and numbers of hypotheses do to the scores.

Each value of an option is compared with the paper's on the same cameras, one option at a time.
``thresholds.yaml`` has the values, ``snakemake threshold_study`` runs them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from alignscores.arrays import Floats
from alignscores.comparison.statistics import LEVEL, holm
from experiments.command import ConfigError
from experiments.config import load_sweep, read_yaml, to_overrides
from experiments.metrics import metric, split_options, with_options
from experiments.tables import Trials
from figures import style

from .order import Order, in_order, sign
from .settings import naming, reject

AXES = Path(__file__).with_name("thresholds.yaml")
FIXED = ("experiment", "metrics")  # settings that the study itself decides


@dataclass(frozen=True)
class _Axis:
    metric: str
    option: str
    paper: float | str
    values: list[float | str]


@dataclass(frozen=True)
class _File:
    axes: dict[str, _Axis]
    trials: dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Axis:
    """An option of a metric with the values to compare, the paper's among them."""

    name: str
    metric: str
    option: str
    paper: str
    values: tuple[str, ...]

    @classmethod
    def of(cls, name: str, entry: _Axis, values: object) -> Self:
        """Return an axis with its values in rising order; a wrong one is a `ConfigError`."""
        if not isinstance(values, list):
            raise ConfigError(
                f"setting {name!r} must be a list in brackets, for example [1, 2], of the values "
                "that threshold_study compares; a single value in all trials is "
                f"'{entry.metric.lower()}={{{entry.option}: {values}}}'"
            )
        for value in values:
            with naming(f"setting {name!r}: "):
                metric(with_options(entry.metric, {entry.option: _write(value)}))
        paper = _write(entry.paper)
        ordered = sorted({*map(_write, values), paper}, key=float)
        if len(ordered) < 2:
            raise ConfigError(f"setting {name!r} needs another value than the paper's {paper}")
        return cls(name, entry.metric, entry.option, paper, tuple(ordered))

    @property
    def columns(self) -> Mapping[str, str]:
        """The columns of the metric by the values; the paper's needs no option."""
        return {
            value: with_options(self.metric, {} if value == self.paper else {self.option: value})
            for value in self.values
        }


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each table; there may be other values of axes."""
    file = read_yaml(AXES, _File)
    reject(settings, FIXED, "the study decides it")
    others = {key: value for key, value in settings.items() if key not in file.axes}
    axes = [
        Axis.of(name, entry, settings.get(name, entry.values)) for name, entry in file.axes.items()
    ]
    metrics = list(dict.fromkeys(metric for axis in axes for metric in axis.columns.values()))
    tables = {}
    for name, experiment in file.trials.items():
        tables[name] = {**experiment, "metrics": metrics, **others}
        load_sweep(to_overrides(tables[name]))  # a wrong setting ends here
    return tables


def axes_of(metrics: Iterable[str]) -> list[Axis]:
    """Return the axes with the values that the columns of a table have."""
    columns = list(map(split_options, metrics))
    axes = []
    for name, entry in read_yaml(AXES, _File).axes.items():
        values = [
            options[entry.option]
            for metric, options in columns
            if metric == entry.metric and list(options) == [entry.option]
        ]
        axes.append(Axis.of(name, entry, values))
    return axes


def _write(value: object) -> str:
    """Write a number in one way, 1 for 1.0, so that it is compared with the paper's."""
    try:
        return f"{float(str(value)):.12g}"
    except ValueError:
        return str(value)


def answer(trials: Sequence[Trials]) -> list[pd.DataFrame | str]:
    """Return the effects of all values."""
    by_name = {table.path.stem: table for table in trials}
    parts = {name: table.table for name, table in by_name.items()}
    return [effects(axes_of(by_name["outliers"].record.metrics), parts)]


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
    "noise_order": Effect("Noise order, %", noise_order),
    "outlier_order": Effect("Outlier order, %", outlier_order),
    "majority_order": Effect("Noise order, %,\n80 % outliers", noise_order, part="majority"),
    "noise_range": Effect("Range over\nnoise", noise_range),
    "camera_dependence": Effect("Change with\ncameras, %", camera_dependence, False, "length"),
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


TITLES = {
    "max_threshold": "largest threshold, units of d",
    "quantile": "quantile that is d",
    "n_thresholds": "number of thresholds",
    "max_threshold_deg": "largest threshold, degrees",
    "weight": "weight of the TAS",
    "n_hypotheses": "hypotheses",
    "prescreen": "prescreening threshold",
    "order": "m as share of n",
}
HEADS = """\
Order: how often two trials at neighbouring levels are in the right order; 50 % is chance.
Range: of the mean score over the noise levels. Change: of the mean score over the numbers of \
cameras, in % of the range of all means."""
ROW = 0.118  # inches
DOT: dict[str, Any] = {"marker": "o", "ms": 3.2, "mew": 0.7, "mec": style.INK}


def draw(table: pd.DataFrame) -> Figure:
    """Figure: what other thresholds do."""
    # The row of each value, with a line for a title above each axis.
    table = table.assign(row=table.index + pd.factorize(table["axis"])[0] + 1)
    height = 1.25 + ROW * (table["row"].max() + 1)
    figure = Figure(figsize=(style.PAGE, height), layout="constrained")
    panels = figure.subplots(1, len(EFFECTS), sharey=True)
    for axes, (name, effect) in zip(panels, EFFECTS.items(), strict=True):
        _column(axes, table, name)
        axes.set_title(effect.title, pad=11)
        style.direction(axes, larger_is_better=effect.larger_is_better)
    _labels(panels[0], table)
    handles = {
        "the paper's value": Line2D([], [], ls="", mfc=style.INK, **DOT),
        "another": Line2D([], [], ls="", mfc="white", **DOT),
        "95 % interval of the difference, for all at once": Line2D(
            [], [], color=style.INK, lw=0.6, marker=""
        ),
    }
    figure.legend(
        list(handles.values()),
        list(handles),
        title=HEADS,
        loc="outside lower center",
        ncols=len(handles),
        columnspacing=1.6,
    )
    return figure


def _column(axes: Axes, table: pd.DataFrame, effect: str) -> None:
    paper, row = table["paper"] == "yes", table["row"]
    for _, group in table.groupby("axis", sort=False):  # what the values are compared with
        x, y = group.loc[paper, effect].iloc[0], row[group.index]
        axes.plot([x, x], [y.min() - 0.4, y.max() + 0.4], color="0.72", lw=0.6, marker="", zorder=1)
    n_tested = int(table[[f"{name}_p" for name in EFFECTS]].notna().to_numpy().sum())
    reach = scipy.special.ndtri(1 - LEVEL / 2 / max(n_tested, 1))
    errors = reach * table[f"{effect}_error"].fillna(0.0)
    bars: dict[str, Any] = {"fmt": "none", "ecolor": style.INK, "elinewidth": 0.6, "zorder": 2}
    axes.errorbar(table[effect], row, xerr=errors, **bars)
    for chosen, face in ((~paper, "white"), (paper, style.INK)):
        axes.plot(table.loc[chosen, effect], row[chosen], ls="", mfc=face, zorder=3, **DOT)
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter("{x:g}")
    style.as_rows(axes)


def _labels(axes: Axes, table: pd.DataFrame) -> None:
    """Name the values, and above them the options; the paper's values are bold."""
    first = table.drop_duplicates("axis")
    titles = [TITLES.get(option, option) for option in first["option"]]
    heads = [f"{metric}: {title}" for metric, title in zip(first["metric"], titles, strict=True)]
    values = table["value"].replace("inf", "off")  # of the prescreening
    axes.set_yticks([*(first["row"] - 1), *table["row"]], [*heads, *values])
    bold = [True] * len(heads) + list(table["paper"] == "yes")
    for index, text in enumerate(axes.get_yticklabels()):
        if bold[index]:
            text.set_fontweight("bold")
        if index < len(heads):
            text.set_fontsize(style.TEXT)
    axes.set_ylim(table["row"].max() + 0.8, -0.8)
