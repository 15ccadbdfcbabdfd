"""The section of the report: where the scores fail."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

import pandas as pd

from experiments.config import SETTINGS, Sweep

from ..study import Answer
from ..words import NONE, write_levels, write_number
from .findings import LEAST_ORDER, ORDERS, SCORES

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


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    findings, records = answer.table, answer.records
    first, *_ = (record.sweep for record in records.values())
    metrics = list(dict.fromkeys(findings["metric"]))
    scenarios = [
        _scenario(name, record.sweep, first, findings[findings["scenario"] == name])
        for name, record in records.items()
    ]
    scores = [metric for metric in metrics if metric in SCORES]
    return {
        "name": answer.called,
        "metrics": metrics,
        "scores": scores,
        "trials": first.trials,
        "scenarios": scenarios,
        "failing": {metric: [one for one in scenarios if _fails(metric, one)] for metric in scores},
    }


def _fails(metric: str, scenario: Mapping[str, Any]) -> bool:
    return any(judged["fails"] for judged in scenario["orders"].get(metric, ()))


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
        "finding": rows["finding"].iloc[0],
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
