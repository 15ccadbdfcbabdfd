"""Synthetic trajectories of which each camera, each second, each fifth ... is kept."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
import pandas as pd

from experiments.config import read_yaml, split_override
from experiments.tables import Trials

from ..order import across, estimate, within
from ..study import (
    Rates,
    Section,
    Settings,
    Table,
    TableName,
    at_rates,
    config_file,
    rates_of,
    reject,
    resolve,
)

__all__ = ["FRAME_RATE", "compare", "plan", "summaries", "to_markdown"]

FRAME_RATE = config_file("frame_rate")
KEYS = ["scenario", "geometry", "error", "metric", "every", "sigma_t"]


class _File(Section):
    settings: Settings
    every: Rates
    scenarios: dict[TableName, Settings]


def plan(overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each scenario, with a sweep for each frame rate: of the same trials."""
    overrides = [one for one in overrides if split_override(one)[0] != "trajectories"]
    reject(overrides, ["every"], f"the frame rates stand in {FRAME_RATE.name}")
    file = read_yaml(FRAME_RATE, _File)
    tables = {}
    for name, scenario in file.scenarios.items():
        sweep = resolve(FRAME_RATE, f"scenarios.{name}", overrides, file.settings, scenario)
        tables[name] = at_rates(replace(sweep, name=f"frame_rate/{name}"), file.every)
    return tables


def compare(scenarios: Mapping[str, Trials]) -> pd.DataFrame:
    """Tell how much each metric depends on the frame rate.

    Returns
    -------
    DataFrame
        One row for each scenario, metric, frame rate and noise level:

        - `scenario, geometry, error, metric, every, sigma_t`
        - `mean`: of the metric
        - `dependence`: how far the mean moves over the frame rates, in per cent of its range over
          noise and frame rates; the mean over the noise levels, the same in all rows of a metric in
          a scenario
        - `order`: likewise, the probability in per cent that the better of two estimates at
          neighbouring noise levels comes out better, both at the same frame rate
        - `order_across`: likewise where their frame rates differ
    """
    tables = [
        _compare(trials, metric).assign(
            scenario=name,
            geometry=trials.sweep.geometry,
            error=trials.sweep.error,
            metric=metric,
        )
        for name, trials in scenarios.items()
        for metric in trials.record.metrics
    ]
    return pd.concat(tables, ignore_index=True)[
        [*KEYS, "mean", "dependence", "order", "order_across"]
    ]


def _compare(trials: Trials, metric: str) -> pd.DataFrame:
    table = trials.table.assign(every=rates_of(trials.table))
    means = table.groupby(["every", "sigma_t"])[metric].mean()
    at_one_rate = [within(rate, "sigma_t") for _, rate in table.groupby("every")]
    across_rates = across(table, "sigma_t", "every", same_draws=True)
    return means.reset_index(name="mean").assign(
        dependence=100 * means.groupby("sigma_t").agg(np.ptp).mean() / np.ptp(means),
        order=100 * fmean(estimate(task.shares(metric)).probability for task in at_one_rate),
        order_across=100 * estimate(across_rates.shares(metric)).probability,
    )


@dataclass(frozen=True)
class Summary:
    """A metric over all scenarios: its movements, and the mean probabilities in per cent."""

    metric: str
    smallest_move: float
    largest_move: float
    order: float
    order_across: float


def summaries(table: pd.DataFrame) -> list[Summary]:
    """Sum up what `compare` found, metric by metric."""
    found = table.drop_duplicates(["scenario", "metric"]).groupby("metric", sort=False)
    return [
        Summary(
            str(metric),
            group["dependence"].min(),
            group["dependence"].max(),
            group["order"].mean(),
            group["order_across"].mean(),
        )
        for metric, group in found
    ]


def to_markdown(table: pd.DataFrame) -> str:
    """Write what `compare` found, a line for each metric."""
    lines = [
        "| metric | moves over frame rates, % of its range | right order at one rate, % "
        "| across rates, % |",
        "|---|--:|--:|--:|",
    ]
    for found in summaries(table):
        span = f"{found.smallest_move:.0f} to {found.largest_move:.0f}"
        lines.append(f"| {found.metric} | {span} | {found.order:.0f} | {found.order_across:.0f} |")
    count = table["scenario"].nunique()
    lines += ["", f"Over {count} scenarios: smallest to largest movement, mean probabilities."]
    return "\n".join(lines) + "\n"
