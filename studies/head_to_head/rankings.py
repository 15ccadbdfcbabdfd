"""Rankings of metrics by the order of neighbouring levels, and what it takes to tell them apart."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
import pandas as pd

from experiments.tables import Record, TableError, Trials

from .. import order
from ..order import SIGNIFICANCE, Order

LEVELS = {  # what is put in order, by what it is called: the settings that may stand for it
    "noise": ("sigma_t", "sigma_r_deg"),
    "rotation noise": ("sigma_r_deg",),
    "outliers": ("n_outliers",),
}
SURE = 0.9  # probability of the right order from which one trial is enough
METHOD = (
    "The order is the probability that one trial at each of two neighbouring levels come in the "
    "right order: 50 % is chance, and no monotone rescaling of a metric changes it. > is certainly "
    f"better, at a level of {100 * SIGNIFICANCE:g} % for all pairs together (paired trials, Holm); "
    "= may be equal. Trials: how many at each level tell the two apart (rank-sum test at 5 %, "
    "power 80 %). Cameras: from how many on one trial each is in the right order with a "
    f"probability of {100 * SURE:g} %; inf: more than any. Where the number of outliers varies, "
    "order and trials are means over it. HalfDistance, HalfAngle: the units at which TAS (refined "
    "registration) and RAS are one half, or the score that they name. Where TAS and PAS name no "
    "registration, it is the paper's."
)
"""How the rankings are made, and read."""


def side_by_side(tables: Sequence[Trials]) -> dict[str, Trials]:
    """Join the metrics of tables that are of the same trials, by the names of the experiments."""
    joined: dict[str, Trials] = {}
    for trials in tables:
        name, metrics = trials.sweep.name, trials.sweep.metrics
        if name not in joined:
            joined[name] = trials
            continue
        first = joined[name]
        if replace(trials.sweep, metrics=first.sweep.metrics) != first.sweep:
            raise TableError(trials.path, f"has other settings than {first.path}")
        sweep = replace(first.sweep, metrics=[*first.sweep.metrics, *metrics])
        table = pd.concat([first.table, trials.table[metrics]], axis=1)
        joined[name] = Trials(first.path, table, Record((sweep,), first.record.origin))
    return joined


def compare_orders(experiments: Mapping[str, Trials]) -> pd.DataFrame:
    """Compare the metrics of each experiment by the order of neighbouring levels.

    Returns
    -------
    DataFrame
        One row for each metric, and one for each pair of metrics, at each level that an experiment
        varies:

        - `experiment, level, metric, versus`; the latter is empty where a metric stands alone
        - `order`: the probability of the right order of two trials at neighbouring levels, in per
          cent, the mean over neighbours and groups; of a pair that of `metric` minus `versus`
        - `low, high`: its 95 % confidence interval, from paired trials
        - `p`: of a pair, the p-value against no difference, adjusted for the number of all pairs
        - `trials`: of a metric, how many at each of the two levels a rank-sum test needs; infinite
          where the order is perhaps one of chance
        - `cameras`: of a metric, the smallest number of cameras from which on one trial at each
          level is in the right order with a probability of 0.9; where their number varies
        - `outliers`: where their number varies besides the level, each metric has a row at each,
          and one without for all, whose `trials` are the mean of theirs
    """
    rows: list[dict[str, object]] = []
    for name, trials in experiments.items():
        for level, settings in LEVELS.items():
            setting = next((key for key in settings if order.varies(trials.table, key)), None)
            if setting is None or _is_said(level, setting, trials.table):
                continue
            keys: dict[str, object] = {"experiment": name, "level": level}
            alone, pairs = order.compare(order.within(trials.table, setting), trials.sweep.metrics)
            for metric, found in alone.items():
                by_outliers = order.apart(trials.table, setting, metric)
                row = keys | {"metric": metric}
                needed = order.mean_needed(by_outliers.values() or [found])
                whole = {"trials": needed, "cameras": _cameras(trials.table, setting, metric)}
                rows.append(row | whole | _numbers(found))
                rows += [
                    row | {"outliers": n, "trials": order.needed(own)} | _numbers(own)
                    for n, own in by_outliers.items()
                ]
            for (metric, versus), found in pairs.items():
                row = keys | {"metric": metric, "versus": versus, "p": found.p_value}
                rows.append(row | _numbers(found))
    columns = ["experiment", "level", "metric", "versus", "order", "low", "high", "p", "trials"]
    table = pd.DataFrame(rows, columns=[*columns, "cameras", "outliers"])
    table["p"] = order.holm(table["p"])
    table = table.astype({"trials": float, "cameras": float, "outliers": float})
    return table.round({"order": 2, "low": 2, "high": 2, "p": 6})


def _is_said(level: str, setting: str, trials: pd.DataFrame) -> bool:
    """Whether noise in rotations is the noise, or rises with it."""
    pairs = trials[["sigma_t", "sigma_r_deg"]].drop_duplicates()
    return level == "rotation noise" and len(pairs) == trials["sigma_r_deg"].nunique()


def _numbers(found: Order) -> dict[str, float]:
    low, high = found.interval
    return {"order": 100 * found.probability, "low": 100 * low, "high": 100 * high}


def _cameras(trials: pd.DataFrame, setting: str, metric: str) -> float:
    """Return the number of cameras from which on one trial is enough; NaN where it is fixed."""
    if not order.varies(trials, "n_cameras"):
        return np.nan
    enough = inf
    for n in sorted(trials["n_cameras"].unique(), reverse=True):
        task = order.within(trials[trials["n_cameras"] == n], setting)
        if order.estimate(task.shares(metric)).probability < SURE:
            break
        enough = float(n)
    return enough


def rankings(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rank the metrics at each level of each experiment, the best first: see `METHOD`."""
    found = []
    over_all = table[table["outliers"].isna()]
    for (experiment, level), rows in over_all.groupby(["experiment", "level"], sort=False):
        alone = rows[rows["versus"].isna()].sort_values("order", ascending=False, kind="stable")
        places = alone[["metric", "order", "trials", "cameras"]].to_dict("records")
        pairs = rows.loc[rows["versus"].notna(), ["metric", "versus", "p"]]
        p = {frozenset(pair): p for *pair, p in pairs.itertuples(index=False)}
        certain = [p[frozenset(pair)] < SIGNIFICANCE for pair in pairwise(alone["metric"])]
        links = [*(" > " if sure else " = " for sure in certain), ""]
        words = [
            f"{place['metric']} {place['order']:.1f}{link}"
            for place, link in zip(places, links, strict=True)
        ]
        keys = {"experiment": experiment, "level": level, "places": places}
        found.append(keys | {"in_words": "".join(words)})
    return found
