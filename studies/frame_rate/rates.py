"""Synthetic trajectories of which each camera, each second, each fifth ... is kept."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from statistics import fmean

import numpy as np
import pandas as pd

from experiments.config import CONFIG_DIR, read_yaml
from experiments.tables import Trials

from ..statistics import by_level, order
from ..study import Rates, Section, Settings, Study, TableName, at_rates, rates_of, reject, resolve

__all__ = ["FOUND", "FRAME_RATE", "KEYS", "compare", "load_frame_rate", "summaries", "to_markdown"]

FRAME_RATE = CONFIG_DIR / "study" / "frame_rate.yaml"
FOUND = ["mean", "dependence", "order", "order_across"]
KEYS = ["scenario", "geometry", "error", "metric", "every", "sigma_t"]


class _File(Section):
    settings: Settings
    every: Rates
    scenarios: dict[TableName, Settings]


def load_frame_rate(overrides: Sequence[str] = ()) -> Study:
    """Read ``configs/study/frame_rate.yaml``.

    Parameters
    ----------
    overrides : sequence of str
        Settings for all scenarios such as ``"trials=5"``.

    Returns
    -------
    Study
        A table for each scenario, with a sweep for each frame rate: of the same trials.

    Raises
    ------
    ConfigError
        In one line, where something is unknown or impossible.

    Examples
    --------
    >>> from studies.frame_rate.rates import load_frame_rate
    >>> study = load_frame_rate(["trials=5"])
    >>> [sweep.every for sweep in study.tables["car"].sweeps]
    [1, 2, 5, 10, 20]
    """
    reject(overrides, ["every"], f"the frame rates stand in {FRAME_RATE.name}")
    file = read_yaml(FRAME_RATE, _File)
    tables = {}
    for name, own in file.scenarios.items():
        sweep = resolve(FRAME_RATE, f"scenarios.{name}", overrides, file.settings, own)
        tables[name] = at_rates(replace(sweep, name=f"frame_rate/{name}"), file.every)
    return Study("frame_rate", tables)


def compare(scenarios: Mapping[str, Trials]) -> pd.DataFrame:
    """Tell how much each metric depends on the frame rate.

    Parameters
    ----------
    scenarios : mapping of str to Trials
        The trials of each scenario.

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
    return pd.concat(tables, ignore_index=True)[[*KEYS, *FOUND]]


def _compare(trials: Trials, metric: str) -> pd.DataFrame:
    table = trials.table.assign(every=rates_of(trials.table))
    means = table.groupby(["every", "sigma_t"])[metric].mean()
    levels = [by_level(group, metric, "sigma_t") for _, group in table.groupby("every")]
    across = [
        order([better, worse]).probability
        for a, b in permutations(levels, 2)
        for better, worse in zip(a[:-1], b[1:], strict=True)
    ]
    return means.reset_index(name="mean").assign(
        dependence=100 * means.groupby("sigma_t").agg(np.ptp).mean() / np.ptp(means),
        order=100 * fmean(order(rate).probability for rate in levels),
        order_across=100 * fmean(across),
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
    for one in summaries(table):
        span = f"{one.smallest_move:.0f} to {one.largest_move:.0f}"
        lines.append(f"| {one.metric} | {span} | {one.order:.0f} | {one.order_across:.0f} |")
    count = table["scenario"].nunique()
    lines += ["", f"Over {count} scenarios: smallest to largest movement, mean probabilities."]
    return "\n".join(lines) + "\n"
