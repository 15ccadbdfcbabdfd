"""Maps: how well values of options order two close noise levels, at each size of the noise."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from experiments.config import MetricName, read_yaml, split_override
from experiments.metrics import Column
from experiments.tables import Trials

from ..axes import AxesFile, Axis, AxisValue, axis_names, axis_with
from ..order import SIGNIFICANCE, Order, beside, holm, paired
from ..study import Section, Settings, Table, TableName, config_file, naming, resolve

THRESHOLDS = config_file("threshold_study")
OPTIONS = ("max_threshold", "max_threshold_deg", "order", "prescreen", "n_hypotheses")
NEARLY_BEST = 1.0  # per cent


METHOD = (
    "Numbers are the probability that the better of two estimates, whose noise differs by 15 %, "
    "comes out better; 50 % is chance. Differences that are named are certain: 5 %, Holm."
)


class _Parts(Section):
    beside: list[MetricName]
    settings: Settings
    parts: dict[TableName, Settings]


class _Map(_Parts):
    noise: Literal["sigma_t", "sigma_r_deg"]
    values: dict[str, list[AxisValue]]


class _Levels(_Parts):
    scores: list[Annotated[float, Field(gt=0, le=1)]]


class _File(AxesFile):
    settings: Settings
    maps: dict[TableName, _Map]
    levels: _Levels


def read_thresholds() -> _File:
    """Return the file of the study."""
    return read_yaml(THRESHOLDS, _File)


def plan(overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each part of each map, called by both."""
    given = dict(map(split_override, overrides))
    tables: dict[str, Table] = {}
    for name, own in read_thresholds().maps.items():
        columns = _columns(_axes(name, own, given))
        metrics = [*dict.fromkeys(map(str, columns)), *own.beside]
        tables |= tables_of(f"maps.{name}", own, metrics, overrides)
    return tables


def tables_of(
    key: str, own: _Parts, metrics: Sequence[str], overrides: Sequence[str]
) -> dict[str, Table]:
    """Return the tables of what the file has for a key, all with the same metrics."""
    shared, axes = read_thresholds().settings, axis_names(THRESHOLDS)
    others = [override for override in overrides if split_override(override)[0] not in axes]
    sweeps = resolve(THRESHOLDS, f"{key}.parts", others, own.parts, shared, own.settings)
    return {
        f"{key.removeprefix('maps.')}_{part}": Table((replace(sweep, metrics=list(metrics)),))
        for part, sweep in sweeps.items()
    }


def _axes(name: str, own: _Map, given: Mapping[str, str]) -> list[Axis]:
    """Return the axes of a map, with the values that are given instead of its own."""
    values = own.values.items()
    with naming(f"{THRESHOLDS}: maps.{name}: "):
        axes = [axis_with(THRESHOLDS, axis, given.get(axis, usual)) for axis, usual in values]
    return axes


def _columns(axes: Sequence[Axis]) -> list[Column]:
    """Return the metric with all combinations of values; the paper's are not written."""
    columns = [Column(axes[0].metric)]
    for axis in axes:
        columns = [axis.of(column, value) for column in columns for value in axis.values]
    return columns


def compare(parts: Mapping[str, Trials]) -> pd.DataFrame:
    """Tell how well each value orders two close noise levels, beside the paper's values.

    Returns
    -------
    DataFrame
        One row for each part, pair of noise levels and metric:

        - `map, part, geometry, n_cameras, n_outliers, noise`: the latter the geometric mean of the
          two levels
        - `metric`, and its options that the maps vary: `max_threshold, max_threshold_deg, order,
          prescreen, n_hypotheses`; empty for another metric
        - `right_order`: probability in per cent that a trial at the lower level comes out better
        - `difference`: from that with the paper's values on the same cameras, `error`: its standard
          error, `p`: the p-value against no difference, adjusted for all differences in the map by
          Holm's method
    """
    tables = []
    for name, own in read_thresholds().maps.items():
        axes = _axes(name, own, {})
        rows = [
            {"map": name, "part": part} | row
            for part in own.parts
            for row in _rows(parts[f"{name}_{part}"], own.noise, axes)
        ]
        table = pd.DataFrame(rows)
        table["p"] = holm(table["p"])
        tables.append(table)
    return pd.concat(tables, ignore_index=True).round(6)


def _rows(trials: Trials, noise: str, axes: Sequence[Axis]) -> list[dict[str, Any]]:
    sweep, table = trials.sweep, trials.table
    levels = sorted(table[noise].unique())
    keys = {"geometry": sweep.geometry, "n_cameras": sweep.n_cameras[0]}
    keys["n_outliers"] = sweep.n_outliers[0]
    by_size = {}
    for low, high in zip(levels[::2], levels[1::2], strict=False):
        task = paired(table[table[noise].isin([low, high])], [noise])
        shares = {metric: task.shares(metric) for metric in sweep.metrics}
        by_size[float(np.sqrt(low * high))] = shares
    return [
        {**keys, "noise": size, "metric": metric, **_options(Column.parse(metric), axes)}
        | beside(shares[metric], shares[axes[0].metric])
        for metric in sweep.metrics
        for size, shares in by_size.items()
    ]


def _options(column: Column, axes: Sequence[Axis]) -> dict[str, float | None]:
    """Return the values of the options that a map varies; none of another metric."""
    known = [axis.option for axis in axes]
    ours = column.name == axes[0].metric and set(column.options) <= set(known)
    return {
        axis.option: float(column.options.get(axis.option, axis.paper)) if ours else None
        for axis in axes
    }


def sentences(table: pd.DataFrame) -> list[str]:
    """Return what the maps say: of the TAS, of the RAS, of the registration; in Markdown."""
    return [
        _threshold(table[table["map"] == "tas"], "max_threshold", " d"),
        _threshold(table[table["map"] == "ras"], "max_threshold_deg", "°"),
        _registration(table[table["map"] == "registration"]),
    ]


def _threshold(table: pd.DataFrame, option: str, unit: str) -> str:
    """Tell where the paper's threshold is good, which ones are, and what needs none."""
    values = table.dropna(subset=[option])
    metric = Column.parse(values["metric"].iloc[0]).name
    paper = values[values["metric"] == metric]
    best = values.groupby(["part", "noise"])["right_order"].transform("max")
    better = values[(values["difference"] > 0) & (values["p"] < SIGNIFICANCE)]
    ratios = (values[option] / values["noise"]).round(6)
    good = (best - values["right_order"]).groupby(np.round(np.log2(ratios))).mean() <= NEARLY_BEST
    range_of = 2.0 ** good[good].index
    lines = [
        f"**{metric}.** With the paper's {paper[option].iloc[0]:g}{unit} it is "
        f"{paper['right_order'].mean():.0f} % in the mean over noise and cameras, with the best of "
        f"{values[option].nunique()} thresholds at each noise, found afterwards, "
        f"{best.mean():.0f} %.",
        f"Thresholds of about {range_of.min():g} to {range_of.max():g} times the noise come within "
        f"{NEARLY_BEST:g} % of the best."
        if good.any()
        else f"None comes within {NEARLY_BEST:g} % of the best at every noise.",
        "No other threshold is certainly better anywhere."
        if better.empty
        else f"Another threshold is certainly better at noise of {better['noise'].min():.2g} to "
        f"{better['noise'].max():.2g}{unit}, at most by {better['difference'].max():.0f} %.",
    ]
    others = table[table[option].isna()].groupby("metric", sort=False)["right_order"].mean()
    listed = " and ".join(f"{name} {value:.0f} %" for name, value in others.items())
    return f"{' '.join(lines)} Beside it: {listed}."


def _registration(table: pd.DataFrame) -> str:
    """Tell, for each value of an option alone, with how many outliers it is better or worse."""
    metrics = table["metric"].unique()
    alone = [metric for metric in metrics if len(Column.parse(metric).options) == 1]
    cells = table[table["metric"].isin(alone)].groupby(["metric", "n_outliers"], sort=False)
    means = cells["difference"].mean()
    errors = cells["error"].apply(np.linalg.norm) / cells.size()  # of independent noise levels
    found = map(Order, means, errors)
    p = pd.Series(holm([one.p_value for one in found]), index=means.index)
    parts, uncertain = [], []
    for metric in alone:
        certain = means[metric][p[metric] < SIGNIFICANCE]
        changes = [
            f"{value:+.0f} % with {count:g} outliers".replace("-", "−")
            for count, value in certain.items()
        ]
        if changes:
            parts.append(f"{metric} {', '.join(changes)}")
        else:
            uncertain.append(metric)
    parts += [f"nothing that is certain for {', '.join(uncertain)}"] if uncertain else []
    return f"**The registration**, against the paper's values: {'; '.join(parts)}."
