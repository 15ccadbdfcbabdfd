"""Which metric puts neighbouring levels of the paper's trials in order best.

The metrics that the paper does not have are evaluated on the trials of its experiments.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from alignscores.comparison.statistics import holm
from experiments.config import EXPERIMENTS, to_overrides
from experiments.tables import Record, TableError, Trials

from . import order
from .order import Order
from .settings import load_experiment

COMPARED = {  # with a metric of the paper, on the same trials
    "mAA": ("auc@30:vggt",),
    "TAS": (
        "TAS(registration=refined)",
        "TAS(registration=refined,max_threshold=2)",
        "HalfDistance",
        "HalfDistance(score=0.25)",
    ),
    "RAS": ("HalfAngle", "HalfAngle(score=0.25)"),
}


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the paper's experiments once more, for the metrics that it does not have."""
    tables = {}
    for name in EXPERIMENTS:
        experiment = {"experiment": name, **settings}
        evaluated = load_experiment(to_overrides(experiment)).metrics
        if metrics := [other for metric in evaluated for other in COMPARED.get(metric, ())]:
            tables[name] = {**experiment, "metrics": metrics}
    return tables


def answer(trials: Sequence[Trials]) -> list[pd.DataFrame | str]:
    """Return the comparison as a table."""
    return [compare_orders(joined(trials))]


LEVELS = {  # what is put in order: the settings that may vary with it
    "noise": ("sigma_t", "sigma_r_deg"),
    "rotation noise": ("sigma_r_deg",),
    "outliers": ("n_outliers",),
}


def joined(tables: Sequence[Trials]) -> dict[str, Trials]:
    """Join the metrics of tables that are of the same trials, by the names of the experiments."""
    by_name: dict[str, Trials] = {}
    for trials in tables:
        name, metrics = trials.sweep.name, trials.sweep.metrics
        if name not in by_name:
            by_name[name] = trials
            continue
        first = by_name[name]
        if replace(trials.sweep, metrics=first.sweep.metrics) != first.sweep:
            raise TableError(trials.path, f"has other settings than {first.path}")
        sweep = replace(first.sweep, metrics=[*first.sweep.metrics, *metrics])
        table = pd.concat([first.table, trials.table[metrics]], axis=1)
        by_name[name] = Trials(first.path, table, Record((sweep,), first.record.origin))
    return by_name


def compare_orders(experiments: Mapping[str, Trials]) -> pd.DataFrame:
    """Compare the metrics of each experiment by the order of neighbouring levels.

    Returns
    -------
    DataFrame
        One row for each metric at each level that an experiment varies, the best first:

        - `experiment, level, metric`
        - `order`: the probability of the right order of two trials at neighbouring levels, in per
          cent, the mean over neighbours and groups, and `low, high`: its 95 % confidence interval
        - `difference`: from the best metric, with its p-value `p` from paired trials, adjusted for
          all rows with a difference
        - `trials`: how many at each of the two levels a rank-sum test needs, the mean over the
          numbers of outliers; infinite where the order may be chance
        - `at N outliers`, `at N cameras`: the order at each of these, where they vary
    """
    rows: list[dict[str, object]] = []
    for name, trials in experiments.items():
        for level, settings in LEVELS.items():
            setting = next((key for key in settings if order.varies(trials.table, key)), None)
            if setting is not None and not _is_the_noise(level, trials.table):
                keys = {"experiment": name, "level": level}
                rows += [keys | row for row in _ranked(trials, setting)]
    table = pd.DataFrame(rows)
    table["p"] = holm(table["p"])
    return table


def _is_the_noise(level: str, trials: pd.DataFrame) -> bool:
    """Return whether rotation noise is the noise, or rises with it."""
    pairs = trials[["sigma_t", "sigma_r_deg"]].drop_duplicates()
    return level == "rotation noise" and len(pairs) == trials["sigma_r_deg"].nunique()


def _ranked(trials: Trials, setting: str) -> list[dict[str, object]]:
    """Return a row for each metric, the best first."""
    task = order.neighbouring_levels(trials.table, setting)
    shares = {metric: task.shares(metric) for metric in trials.sweep.metrics}
    estimates = {metric: order.estimate(share) for metric, share in shares.items()}
    ranking = sorted(estimates, key=lambda metric: -estimates[metric].probability)
    best = ranking[0]
    rows = []
    for metric in ranking:
        low, high = estimates[metric].interval
        row = {"metric": metric, "order": 100 * estimates[metric].probability}
        row |= {"low": 100 * low, "high": 100 * high, "difference": None, "p": None}
        if metric != best:
            difference = order.estimate(shares[metric] - shares[best])
            row |= {"difference": 100 * difference.probability, "p": difference.p_value}
        by_outliers = _orders_within(trials.table, setting, metric, "n_outliers")
        by_cameras = _orders_within(trials.table, setting, metric, "n_cameras")
        needed = [order.needed(level) for level in by_outliers.values() or [estimates[metric]]]
        row |= {"trials": sum(needed) / len(needed)}
        row |= {f"at {n} outliers": 100 * level.probability for n, level in by_outliers.items()}
        row |= {f"at {n} cameras": 100 * level.probability for n, level in by_cameras.items()}
        rows.append(row)
    return rows


def _orders_within(trials: pd.DataFrame, level: str, metric: str, setting: str) -> dict[int, Order]:
    """Return the order at each value of a setting, where it varies besides the level."""
    if level == setting or not order.varies(trials, setting):
        return {}
    return {
        int(str(n)): order.estimate(order.neighbouring_levels(group, level).shares(metric))
        for n, group in trials.groupby(setting)
    }
