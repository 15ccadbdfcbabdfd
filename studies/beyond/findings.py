"""What the scenarios of a study show: each metric, judged, and the section of the report.

A metric orders the noise levels of a scenario where, at every number of outliers, it puts at least
two of three pairs of trials at neighbouring levels in the right order; likewise the numbers of
outliers. Of evenly spaced levels that is a Kendall correlation of about one half.
"""

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd

from experiments.config import SETTINGS, Sweep
from experiments.tables import Trials

from ..order import orders, varies
from ..study import Answer
from ..words import NONE, write_levels, write_number

LEVELS = {"noise": "sigma_t", "outliers": "n_outliers"}
ORDERS = {"noise": "noise_order", "outliers": "outlier_order"}  # columns of the findings
LEAST_ORDER = 200 / 3  # per cent: two of three
GENERATORS = ("geometry", "error", "outliers", "outlier_side")
SCORES = ("TAS", "RAS", "PAS")  # shown first

LABELS = {
    "geometry": "cameras",
    "error": "errors",
    "outlier_side": "side of the outliers’ cube",
    "n_cameras": "number of cameras",
    "n_outliers": "numbers of outliers",
    "sigma_t": "sigma_t",
    "sigma_r_deg": "sigma_r_deg, degrees",
}
MAIN = ("geometry", "error", "outliers", "n_cameras", "n_outliers", "sigma_t", "sigma_r_deg")


def findings(scenarios: Mapping[str, Trials]) -> pd.DataFrame:
    """Judge every metric in every scenario.

    Returns
    -------
    DataFrame
        One row for each scenario and metric:

        - `scenario, geometry, error, outliers, outlier_side, metric`
        - `noise_order`: how often two trials at neighbouring noise levels come in the right order,
          in per cent, the smallest at any number of outliers; 50 is chance, empty where there is
          one level
        - `outlier_order`: likewise for the numbers of outliers, at any noise level
        - `mean`: of the metric, over all trials
        - `verdict`: "orders noise and outliers", "orders noise", "orders outliers" or "orders
          nothing"
    """
    rows = []
    for name, trials in scenarios.items():
        judged = [_judge(trials.table, metric) for metric in trials.sweep.metrics]
        keys = {key: getattr(trials.sweep, key) for key in GENERATORS}
        rows += [{"scenario": name} | keys | row for row in judged]
    return pd.DataFrame(rows)


def _judge(trials: pd.DataFrame, metric: str) -> dict[str, Any]:
    found = {level: _smallest(trials, metric, setting) for level, setting in LEVELS.items()}
    ordered = [level for level, order in found.items() if order >= LEAST_ORDER]
    return {
        "metric": metric,
        **{column: found[level] for level, column in ORDERS.items()},
        "mean": float(trials[metric].mean()),
        "verdict": f"orders {' and '.join(ordered) or 'nothing'}",
    }


def _smallest(trials: pd.DataFrame, metric: str, level: str) -> float:
    found = orders(trials, metric, level) if varies(trials, level) else []
    return 100 * min((one.probability for one in found), default=np.nan)


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    findings, records = answer.table, answer.records
    first, *_ = (record.sweep for record in records.values())
    metrics = list(dict.fromkeys(findings["metric"]))
    scenarios = [
        _scenario(name, record.sweep, first, findings[findings["scenario"] == name])
        for name, record in records.items()
    ]
    return {
        "name": answer.called,
        "metrics": metrics,
        "scores": [metric for metric in metrics if metric in SCORES],
        "trials": first.trials,
        "scenarios": scenarios,
    }


def _scenario(name: str, sweep: Sweep, first: Sweep, rows: pd.DataFrame) -> dict[str, Any]:
    """Return a scenario with what each metric still orders there."""
    orders = {
        row["metric"]: [_judged(level, row[column]) for level, column in ORDERS.items()]
        for row in rows.to_dict("records")
    }
    return {
        "name": name,
        "title": name.replace("_", " "),
        "settings": _settings(sweep, first),
        "orders": orders,
    }


def _judged(level: str, order: float) -> dict[str, Any]:
    """Return how well a metric orders the levels, in per cent, where there are any."""
    number = write_number(order) if isfinite(order) else NONE
    return {"level": level, "number": number, "fails": order < LEAST_ORDER}


def _settings(sweep: Sweep, first: Sweep) -> list[tuple[str, str]]:
    """Return the main settings of the first scenario, and of another what differs from them."""
    others = (key for key in SETTINGS if key not in ("metrics", "replicate"))
    differing = [key for key in others if getattr(sweep, key) != getattr(first, key)]
    keys = MAIN if sweep is first else differing
    return [(LABELS.get(key, key.replace("_", " ")), _write(getattr(sweep, key))) for key in keys]


def _write(value: object) -> str:
    if isinstance(value, list):
        return write_levels(value)
    return f"{value:g}" if isinstance(value, float) else str(value).replace("_", " ")
