"""The section of the report: where the scores fail."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Judged:
    """How well a metric orders the levels of noise, or the numbers of outliers, in per cent."""

    level: str
    order: float

    @property
    def is_defined(self) -> bool:
        """Whether there are levels to be ordered."""
        return isfinite(self.order)

    @property
    def fails(self) -> bool:
        """Whether it does not order them."""
        return self.order < LEAST_ORDER

    @property
    def number(self) -> str:
        """The order."""
        return write_number(self.order, 0) if self.is_defined else NONE


@dataclass(frozen=True)
class Scenario:
    """A scenario with what each metric still orders there."""

    name: str
    settings: Sequence[tuple[str, str]]
    orders: Mapping[str, Sequence[Judged]]
    finding: str

    @property
    def title(self) -> str:
        """The name as it is read."""
        return self.name.replace("_", " ")

    def failures(self, metric: str) -> list[Judged]:
        """Return what a metric does not order."""
        return [judged for judged in self.orders.get(metric, ()) if judged.fails]


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
        "failing": {
            metric: [scenario for scenario in scenarios if scenario.failures(metric)]
            for metric in scores
        },
    }


def _scenario(name: str, sweep: Sweep, first: Sweep, rows: pd.DataFrame) -> Scenario:
    orders = {
        str(row["metric"]): [Judged(level, float(row[column])) for level, column in ORDERS.items()]
        for row in rows.to_dict("records")
    }
    return Scenario(name, _settings(sweep, first), orders, str(rows["finding"].iloc[0]))


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
