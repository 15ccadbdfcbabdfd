"""Levels: at which score the distance and the angle order best, and what they survive."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from experiments.command import CommandError
from experiments.config import MetricName, read_yaml
from experiments.metrics import Column
from experiments.tables import Trials

from ..order import Task, estimate, holm
from ..study import Section, Settings, Table, TableName, resolve
from .maps import THRESHOLDS, without_axes

__all__ = ["HALF", "READ", "compare", "plan", "score_of"]

READ = {"HalfDistance": "sigma_t", "HalfAngle": "sigma_r_deg"}  # and the noise they measure
HALF = 0.5  # the score that others are compared with


class _Levels(Section):
    scores: list[Annotated[float, Field(gt=0, le=1)]]
    beside: list[MetricName]
    settings: Settings
    parts: dict[TableName, Settings]


class _File(Section):
    axes: Any  # see `studies.axes`
    trials: Any
    settings: Settings
    maps: Any  # see `maps`
    levels: _Levels


def plan(overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each part, in which distance and angle are read at all scores."""
    file, others = read_yaml(THRESHOLDS, _File), without_axes(overrides)
    own = file.levels
    metrics = [*own.beside, *(_at(metric, score) for metric in READ for score in own.scores)]
    tables = {}
    for part, settings in own.parts.items():
        key = f"levels.parts.{part}"
        sweep = resolve(THRESHOLDS, key, others, file.settings, own.settings, settings)
        tables[f"levels_{part}"] = Table((replace(sweep, metrics=metrics),))
    return tables


def _at(metric: str, score: float) -> str:
    return metric if score == HALF else str(Column(metric).with_option("score", f"{score:g}"))


def score_of(metric: str) -> float:
    """Return the score at which a distance or an angle is read; NaN for another metric."""
    column = Column.parse(metric)
    return float(column.options.get("score", HALF)) if column.name in READ else np.nan


def compare(parts: Mapping[str, Trials]) -> pd.DataFrame:
    """Tell how well each metric orders noise and lost cameras, and what scatters and is biased.

    Returns
    -------
    DataFrame
        One row for each part, level, number of outliers and metric:

        - `part, geometry, n_cameras`
        - `level`: what is put in order, noise or outliers
        - `n_outliers`: of `outliers` the lower one of the two numbers
        - `metric`, and the `score` that it is read at; empty where it is none
        - `right_order`: probability in per cent that the better of two trials at levels that differ
          by 15 % comes out better, the mean over the pairs of levels
        - `difference`: from that of the distance or angle at a score of one half on the same
          cameras, `error`: its standard error, `p`: the p-value against no difference, adjusted for
          all differences in the table by Holm's method
        - `scatter`: standard deviation over the trials in per cent of the mean, the median over the
          levels of noise; empty where a trial is infinite
        - `in_noise`: median over the trials in units of the noise, the median over its levels
    """
    rows = []
    for part in read_yaml(THRESHOLDS, _File).levels.parts:
        if f"levels_{part}" not in parts:
            raise CommandError(f"the levels need the trials of levels_{part}, too")
        rows += [{"part": part} | row for row in _rows(parts[f"levels_{part}"])]
    table = pd.DataFrame(rows)
    table["p"] = holm(table["p"])
    return table.round(6)


def _rows(trials: Trials) -> list[dict[str, Any]]:
    sweep, table = trials.sweep, trials.table
    keys = {"geometry": sweep.geometry, "n_cameras": sweep.n_cameras[0]}
    pairs = list(pairwise(sorted(table["n_outliers"].unique())))[::2]
    rows = []
    for outliers, group in table.groupby("n_outliers"):
        key = keys | {"level": "noise", "n_outliers": outliers}
        found = _orders(_pairs(group, "sigma_t"), sweep.metrics)
        rows += [key | row | _spread(group, str(row["metric"])) for row in found]
    for low, high in pairs:
        both = table[table["n_outliers"].isin([low, high])]
        key = keys | {"level": "outliers", "n_outliers": low}
        tasks = [_pairs(group, "n_outliers") for _, group in both.groupby("sigma_t")]
        samples = [sample for task in tasks for sample in task.samples]
        rows += [key | row for row in _orders(_in_pairs(samples), sweep.metrics)]
    return rows


def _pairs(table: pd.DataFrame, level: str) -> Task:
    """Compare the first level with the second, the third with the fourth, and so on."""
    return _in_pairs([sample for _, sample in table.groupby(level)])


def _in_pairs(samples: Sequence[pd.DataFrame]) -> Task:
    pairs = [(k, k + 1) for k in range(0, len(samples) - 1, 2)]
    return Task(samples, pairs, range(len(samples)))


def _orders(task: Task, metrics: Sequence[str]) -> list[dict[str, Any]]:
    """Return the order of each metric, and its difference from that read at one half."""
    shares = {metric: task.shares(metric) for metric in metrics}
    rows = []
    for metric, own in shares.items():
        row = {"metric": metric, "score": score_of(metric)}
        row |= {"right_order": 100 * estimate(own).probability}
        name = Column.parse(metric).name
        if name in READ:
            difference = estimate(own - shares[name])
            row |= {"difference": 100 * difference.probability, "error": 100 * difference.error}
            row |= {"p": np.nan if metric == name else difference.p_value}
        rows.append(row)
    return rows


def _spread(table: pd.DataFrame, metric: str) -> dict[str, float]:
    """Return scatter and size of a distance or an angle."""
    if (name := Column.parse(metric).name) not in READ:
        return {}
    levels = table.groupby(READ[name])[metric]
    with np.errstate(invalid="ignore"):
        scatter = 100 * levels.std() / levels.mean()
    sizes = levels.median()
    return {
        "scatter": float(scatter.median(skipna=False)),
        "in_noise": float((sizes / sizes.index).median()),
    }
