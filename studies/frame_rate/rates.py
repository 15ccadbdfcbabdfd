"""Synthetic trajectories of which each camera, each second, each fifth ... is kept."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from experiments.config import read_yaml, split_override
from experiments.tables import Trials

from .. import study
from ..order import Task, across, estimate, needed
from ..words import document, markdown_table

FRAME_RATE = study.config_file("frame_rate")
KEYS = ["scenario", "geometry", "error", "lost", "metric"]


class _File(study.Section):
    settings: study.Settings
    every: study.Rates
    scenarios: dict[study.TableName, study.Settings]


def plan(overrides: Sequence[str] = ()) -> dict[str, study.Table]:
    """Return a table for each scenario, with a sweep for each frame rate: of the same trials."""
    overrides = [one for one in overrides if split_override(one)[0] != "trajectories"]
    study.reject(overrides, ["every"], f"the frame rates stand in {FRAME_RATE.name}")
    file = read_yaml(FRAME_RATE, _File)
    sweeps = study.resolve(FRAME_RATE, "scenarios", overrides, file.scenarios, file.settings)
    return {
        name: study.at_rates(replace(sweep, name=f"frame_rate/{name}"), file.every)
        for name, sweep in sweeps.items()
    }


def means(scenarios: Mapping[str, Trials]) -> pd.DataFrame:
    """Return the means that the metrics have at each frame rate.

    Returns
    -------
    DataFrame
        One row for each scenario, share of outliers, metric, frame rate and noise level:

        - `scenario, geometry, error, lost, metric, every, sigma_t`; `lost` is the share of
          outliers in per cent
        - `mean`: of the metric
    """
    tables = []
    for name, trials in scenarios.items():
        groups = _with_keys(name, trials).groupby([*KEYS[:-1], "every", "sigma_t"])
        grouped = groups[list(trials.record.metrics)].mean()
        table = grouped.melt(var_name="metric", value_name="mean", ignore_index=False)
        tables.append(table.reset_index())
    return pd.concat(tables, ignore_index=True)[[*KEYS, "every", "sigma_t", "mean"]]


def compare(scenarios: Mapping[str, Trials]) -> pd.DataFrame:
    """Tell how much each metric depends on the frame rate.

    Returns
    -------
    DataFrame
        One row for each scenario, share of outliers, metric and step of the noise:

        - `scenario, geometry, error, lost, metric`; `lost` is the share of outliers in per cent
        - `dependence`: how far the mean moves over the frame rates, in per cent of its range over
          noise and frame rates; the mean over the noise levels, the same for all steps; empty where
          a mean is infinite
        - `step`: by how many per cent two neighbouring noise levels differ
        - `order`: the probability in per cent that the better of two estimates at such levels comes
          out better, both at the same frame rate, the mean over the rates
        - `order_across`: likewise where their frame rates differ
        - `trials, trials_across`: how many at each of the two levels a rank-sum test needs;
          infinite where the order is perhaps one of chance
    """
    rows: list[dict[str, object]] = []
    for name, trials in scenarios.items():
        for keys, table in _with_keys(name, trials).groupby(KEYS[:-1]):
            steps = _steps(table)
            for metric in trials.record.metrics:
                row = dict(zip(KEYS, (*keys, metric), strict=True))
                row["dependence"] = _dependence(table, metric)
                rows += [
                    row | {"step": step} | _orders(pairs, metric) for step, pairs in steps.items()
                ]
    return pd.DataFrame(rows).round(6)


def _with_keys(name: str, trials: Trials) -> pd.DataFrame:
    sweep, table = trials.sweep, trials.table.assign(every=study.rates_of(trials.table))
    lost = 100 * table["n_outliers"] / sweep.n_cameras[0]
    return table.assign(scenario=name, geometry=sweep.geometry, error=sweep.error, lost=lost)


def _dependence(table: pd.DataFrame, metric: str) -> float:
    found = table.groupby(["every", "sigma_t"])[metric].mean()
    if np.isinf(found).any():
        return np.nan
    return float(100 * found.groupby("sigma_t").agg(np.ptp).mean() / np.ptp(found))


def _steps(table: pd.DataFrame) -> dict[int, list[tuple[Task, Task]]]:
    """Return tasks at each frame rate and across them, by the step of the noise in per cent."""
    found: dict[int, list[tuple[Task, Task]]] = {}
    for low, high in pairwise(sorted(table["sigma_t"].unique())):
        pair = table[table["sigma_t"].isin([low, high])]
        same, other = (
            across(pair, "sigma_t", "every", same_draws=True, differ=one) for one in (False, True)
        )
        found.setdefault(round(100 * (high / low - 1)), []).append((same, other))
    return found


def _orders(pairs: Sequence[tuple[Task, Task]], metric: str) -> dict[str, float]:
    """Return the mean order over pairs of levels, within and across frame rates."""
    shares = ([task.shares(metric) for task in tasks] for tasks in zip(*pairs, strict=True))
    one, other = (estimate(np.concatenate(own) / len(own)).rounded for own in shares)
    return {
        "order": 100 * one.probability,
        "order_across": 100 * other.probability,
        "trials": needed(one),
        "trials_across": needed(other),
    }


def summaries(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Sum up what `compare` found over the scenarios: each metric with a cell by step and loss."""
    found = []
    for metric, group in table.groupby("metric", sort=False):
        moves = group[group["lost"] == group["lost"].min()]["dependence"]
        by_cell = group.groupby(["step", "lost"])
        cells = by_cell[["order", "order_across"]].mean()
        means = cells.mean().to_dict()
        cells = cells.join(by_cell[["trials", "trials_across"]].median().apply(np.ceil))
        found.append(
            {"metric": metric, "smallest_move": moves.min(), "largest_move": moves.max(), **means}
            | {"cells": cells.reset_index().to_dict("records")}
        )
    return found


def to_markdown(table: pd.DataFrame) -> str:
    """Write what `compare` found: a table of movements, of orders and of trials."""
    found = summaries(table)
    heads = [f"{cell['lost']:g} lost, step {cell['step']}" for cell in found[0]["cells"]]
    orders, trials = [], []
    for one in found:
        moves = f"{one['smallest_move']:.0f} to {one['largest_move']:.0f}"
        orders.append([one["metric"], moves, *_pairs(one, "order")])
        trials.append([one["metric"], *_pairs(one, "trials")])
    return document(
        "At one frame rate / at different ones. In the head: how many per cent of the cameras are "
        "outliers, and by how many the noise differs. Over "
        f"{table['scenario'].nunique()} scenarios: the smallest and the largest movement, where "
        "nothing is lost; the mean probability; the median of the numbers of trials.",
        markdown_table(["right order, %", "moves, % of its range", *heads], orders),
        markdown_table(["trials needed", *heads], trials),
    )


def _pairs(summary: Mapping[str, Any], name: str) -> list[str]:
    return [f"{cell[name]:.0f} / {cell[f'{name}_across']:.0f}" for cell in summary["cells"]]
