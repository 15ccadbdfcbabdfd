"""What the paper leaves out: the main experiment with other paths, errors and outliers.

A metric orders the noise levels of a scenario where, at every number of outliers, it puts at least
two of three pairs of trials at neighbouring levels in the right order; likewise the numbers of
outliers. For evenly spaced levels that is a Kendall correlation of about one half.
``beyond.yaml`` has the scenarios.
"""

import re
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydantic import AfterValidator, ConfigDict, Field
from pydantic.dataclasses import dataclass

from experiments.config import EXECUTION, Sweep, flat, load_sweep, read_yaml, require, to_overrides
from experiments.metrics import split_options
from experiments.tables import Trials
from figures import style

from .order import orders, varies
from .settings import naming

SCENARIOS = Path(__file__).with_name("beyond.yaml")


def _table_name(name: str) -> str:
    fits = re.fullmatch(r"[A-Za-z0-9_]+", name) is not None
    require(fits, "may have only letters, digits and underscores")
    return name


def _settings(settings: dict[str, Any]) -> dict[str, Any]:
    for key in EXECUTION:
        problem = f"may not set {key}, which holds for all studies; set it with --config"
        require(key not in settings, problem)
    return flat(settings)


Settings = Annotated[dict[str, Any], AfterValidator(_settings)]


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class _File:
    scenarios: Annotated[
        dict[Annotated[str, AfterValidator(_table_name)], Settings], Field(min_length=1)
    ]
    settings: Settings = Field(default_factory=dict)


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each scenario; what a file does not set is as in this folder's."""
    others = flat(settings)
    path = Path(others.pop("scenarios", SCENARIOS))
    shared, file = read_yaml(SCENARIOS, _File), read_yaml(path, _File)
    tables = {}
    for scenario, changes in file.scenarios.items():
        name = f"{study_name(path)}/{scenario}"
        table = {**shared.settings, **file.settings, **changes, "name": name, **others}
        with naming(f"{path}: scenarios.{scenario}: "):
            _check(load_sweep(to_overrides(table)))
        tables[scenario] = table
    return tables


def _check(sweep: Sweep) -> None:
    require(sweep.noise == "paired", "needs noise=paired: one order of levels")
    n_levels = max(len(sweep.sigma_t), len(sweep.n_outliers))
    require(n_levels > 1, "needs two levels of noise, or numbers of outliers")


def study_name(path: Path) -> str:
    """Return the name of the results of a file of scenarios."""
    name = "beyond" if path.resolve() == SCENARIOS else f"beyond_{path.stem}"
    with naming(f"{path}: the name {name!r} "):
        return _table_name(name)


def answer(trials: Sequence[Trials]) -> list[pd.DataFrame | str]:
    """Return what each metric orders in each scenario."""
    return [findings({table.path.stem: table for table in trials})]


LEVELS = {"noise": "sigma_t", "outliers": "n_outliers"}
LEAST_ORDER = 200 / 3  # per cent: two of three
GENERATORS = ("geometry", "error", "outliers", "outlier_side", "every")


def findings(scenarios: Mapping[str, Trials]) -> pd.DataFrame:
    """Judge every metric in every scenario.

    Returns
    -------
    DataFrame
        One row for each scenario and metric:

        - `scenario, geometry, error, outliers, outlier_side, every, n_cameras, metric`
        - `noise_order`: how often two trials at neighbouring noise levels come in the right order,
          in per cent, the smallest at any number of outliers; 50 is chance, empty where there is
          one level
        - `outlier_order`: likewise for the numbers of outliers, at any noise level
        - `mean`: of the metric, over the trials without outliers
        - `verdict`: "orders noise and outliers", "orders noise", "orders outliers" or "orders
          nothing"
    """
    rows = []
    for name, trials in scenarios.items():
        keys = {"scenario": name} | {key: getattr(trials.sweep, key) for key in GENERATORS}
        keys |= {"n_cameras": max(trials.sweep.n_cameras)}
        rows += [keys | _judge(trials.table, metric) for metric in trials.sweep.metrics]
    return pd.DataFrame(rows)


def _judge(trials: pd.DataFrame, metric: str) -> dict[str, object]:
    orders_of = {level: _smallest(trials, metric, setting) for level, setting in LEVELS.items()}
    ordered = [level for level, order in orders_of.items() if order >= LEAST_ORDER]
    return {
        "metric": metric,
        "noise_order": orders_of["noise"],
        "outlier_order": orders_of["outliers"],
        "mean": trials.loc[trials["n_outliers"] == trials["n_outliers"].min(), metric].mean(),
        "verdict": f"orders {' and '.join(ordered) or 'nothing'}",
    }


def _smallest(trials: pd.DataFrame, metric: str, level: str) -> float:
    return 100 * min(orders(trials, metric, level)) if varies(trials, level) else np.nan


PANELS = {  # column of the table, title, remark
    "noise_order": ("Noise", "ordered at every number of outliers"),
    "outlier_order": ("Outliers", "ordered at every noise level"),
}
PAPER = {"geometry": "cube", "error": "gaussian", "outliers": "uniform", "outlier_side": 10.0}
ROW = 0.155  # inches
TIGHT = 4.8  # size of the type in narrow columns, in points
NAMES = {"HalfDistance": "half\ndist.", "HalfAngle": "half\nangle", "Median-1": "Median\n-1"}


def draw(table: pd.DataFrame) -> Figure:
    """Figure: what each metric still orders in the scenarios of a study."""
    scenarios = table.drop_duplicates("scenario")
    size = (style.PAGE, 0.85 + ROW * len(scenarios))
    figure = Figure(figsize=size, layout="constrained")
    both = figure.subplots(1, 2, sharey=True)
    for axes, (column, (title, remark)) in zip(both, PANELS.items(), strict=True):
        orders = table.pivot(index="scenario", columns="metric", values=column)
        orders = orders.loc[scenarios["scenario"], table["metric"].unique()]
        _cells(axes, orders)
        style.remark(axes, axes.set_title(title, pad=5), remark)
    labels = [_label(row) for row in scenarios.to_dict("records")]
    both[0].set_yticks(range(len(labels)), labels)
    both[0].invert_yaxis()
    figure.supxlabel(
        "How often two trials at neighbouring levels are in the right order, in %: the lowest "
        "value over\nthe numbers of outliers (left) or the noise levels (right). 50 is chance; "
        "white, below two thirds, does not order.",
        fontsize=style.SMALL,
        color=style.FAINT,
    )
    return figure


def _cells(axes: Axes, orders: pd.DataFrame) -> None:
    """Draw numbers on colours; what does not order has no colour."""
    values = orders.to_numpy(dtype=float)
    shares = np.where(values >= LEAST_ORDER, (values - 40) / 72, np.nan)
    texts = [[f"{value:.0f}" if np.isfinite(value) else "" for value in row] for row in values]
    style.draw_cells(axes, shares, texts, TIGHT)
    axes.set_xticks(range(values.shape[1]), list(map(_metric, orders.columns)))
    axes.tick_params(axis="x", top=False, labeltop=True, labelbottom=False, labelsize=TIGHT)


def _metric(metric: str) -> str:
    name, options = split_options(metric)
    return "\n".join([NAMES.get(name, name), *options.values()])


def _label(row: Mapping[Hashable, Any]) -> str:
    """Name a scenario, and the settings that are not the paper's where its name leaves them out."""
    name = str(row["scenario"])
    others = [
        f"side {row[key]:g}" if key == "outlier_side" else str(row[key])
        for key, paper in PAPER.items()
        if row[key] != paper
    ]
    left_out = ", ".join(other for other in others if other not in name)
    return (f"{name} ({left_out})" if left_out else name).replace("_", " ")
