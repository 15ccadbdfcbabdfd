"""What each metric orders in each scenario, and what its mean is.

A metric orders the noise levels of a scenario where, at every number of outliers, it puts at least
two of three pairs of trials at neighbouring levels in the right order; likewise the numbers of
outliers. Of evenly spaced levels that is a Kendall correlation of about one half.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from experiments.tables import Trials

from ..order import orders, varies

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
