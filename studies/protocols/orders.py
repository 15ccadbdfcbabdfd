"""How often each metric puts two estimates in the right order, question by question."""

from collections.abc import Hashable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from experiments.config import Sweep
from experiments.metrics import Column
from experiments.tables import Trials

from ..order import (
    SIGNIFICANCE,
    Order,
    Task,
    across,
    apart,
    compare,
    holm,
    mean_needed,
    needed,
    within,
)
from ..study import rates_of

LEVELS = ("sigma_t", "sigma_r_deg", "n_outliers")
ACROSS = ("n_cameras", "every")  # what must not matter
NOISE = {"sigma_t": "position noise", "sigma_r_deg": "rotation noise"}  # where each is on its own
DISTURBANCES = {"uniform": "outliers", "missing": "missing", "cluster": "merged"}
NEW = ("TAS", "RAS", "PAS", "HalfDistance", "HalfAngle")

KEYS = ["question", "asked", "level", "across", "metric"]
FOUND = ["order", "order_error", "trials", "p_chance", "best", "behind", "behind_error", "p_behind"]
FOUND += ["rival", "ahead", "ahead_error", "p_ahead", "beats", "beaten", "rivals"]


def compare_sides(questions: Mapping[str, Trials]) -> pd.DataFrame:
    """Put all metrics to all questions, and the new scores beside the others.

    Returns
    -------
    DataFrame
        One row for each question, level and metric:

        - `question, asked, level, across, metric`: the level is the setting to be ordered, in words
          as asked; `across` is a setting that differs between the two, too, and must not matter
        - `order, order_error`: probability in per cent that the better of two estimates at
          neighbouring levels comes out better, see `studies.order`; 50 is chance
        - `trials`: estimates at each of two levels that tell them apart, see
          `studies.order.mean_needed`: where the number of outliers varies besides, the mean over it
        - `p_chance`: that the order is one of chance, one-sided
        - `best`: the metric with the largest probability
        - `behind, behind_error, p_behind`: how far behind it in points, with the standard error of
          the paired difference, two-sided
        - `rival`: of a new score the best of the other metrics, and the other way round
        - `ahead, ahead_error, p_ahead`: likewise how far ahead of it
        - `beats, beaten, rivals`: how many of the other side it is certainly ahead of and behind,
          and how many there are

        p-values are adjusted by Holm's method: `p_chance` for all rows, the others for all pairs of
        metrics in all questions, for the best one is chosen by the same trials.
    """
    rows = []
    pairs: dict[tuple[str, ...], Order] = {}
    for name, trials in questions.items():
        for level, other, task in _tasks(trials):
            asked = _words(level, trials.sweep)
            keys = {"question": name, "asked": asked, "level": level, "across": other}
            alone, differences = compare(task, trials.record.metrics)
            rows += [
                keys | {"metric": metric} | _row(found, apart(trials.table, level, metric))
                for metric, found in alone.items()
            ]
            pairs |= {(*keys.values(), *pair): found for pair, found in differences.items()}
    table = pd.DataFrame(rows)
    table["p_chance"] = holm(table["p_chance"])
    p_values = holm([found.p_value for found in pairs.values()])
    tests: dict[tuple[str, ...], tuple[float, ...]] = {}
    for (*asked_of, first, second), found, p in zip(pairs, pairs.values(), p_values, strict=True):
        difference, error = 100 * found.probability, 100 * found.error
        tests[*asked_of, first, second] = difference, error, p
        tests[*asked_of, second, first] = -difference, error, p
    return _versus(table, tests)


def at_outliers(questions: Mapping[str, Trials]) -> pd.DataFrame:
    """Put the questions about noise at each number of outliers apart.

    Returns
    -------
    DataFrame
        One row for each `question`, `asked`, `metric` and number of `outliers`: `order` and
        `trials` as in `compare_sides`.
    """
    rows = []
    for name, trials in questions.items():
        for level, _, _ in _tasks(trials):
            keys = {"question": name, "asked": _words(level, trials.sweep)}
            for metric in trials.record.metrics:
                for n, found in apart(trials.table, level, metric).items():
                    row = {"outliers": n, "order": 100 * found.probability}
                    rows.append(keys | {"metric": metric} | row | {"trials": needed(found)})
    return pd.DataFrame(
        rows, columns=["question", "asked", "metric", "outliers", "order", "trials"]
    )


def _tasks(trials: Trials) -> Iterator[tuple[str, str, Task]]:
    """Return what has to be ordered: all that varies, but for what must not matter."""
    table = trials.table.assign(every=1)
    if "settings" in table:
        table["every"] = rates_of(table)
    paired = trials.sweep.noise == "paired"
    levels = [level for level in LEVELS if table[level].nunique() > 1]
    levels = [level for level in levels if not (paired and level == "sigma_r_deg")]
    other = next((name for name in ACROSS if table[name].nunique() > 1), "")
    for level in levels:
        task = (
            across(table, level, other, same_draws=other == "every")
            if other
            else within(table, level)
        )
        yield level, other, task


def _words(level: str, sweep: Sweep) -> str:
    if level == "n_outliers":
        return DISTURBANCES.get(sweep.outliers, sweep.outliers)
    return "noise" if sweep.noise == "paired" else NOISE[level]


def _row(found: Order, by_outliers: Mapping[int, Order]) -> dict[str, float]:
    return {
        "order": 100 * found.probability,
        "order_error": 100 * found.error,
        "trials": mean_needed(by_outliers.values() or [found]),
        "p_chance": found.p_above(0.5),
    }


def _versus(table: pd.DataFrame, tests: Mapping[Any, tuple[float, ...]]) -> pd.DataFrame:
    """Add the comparisons with the best metric, and with the best one of the other side."""
    rows = []
    for _, task in table.groupby(KEYS[:-1], sort=False):
        orders = task.set_index("metric")["order"]
        for row in task.to_dict("records"):
            others = orders[[is_new(name) != is_new(row["metric"]) for name in orders.index]]
            best, rival = (str(some.idxmax()) if len(some) else "" for some in (orders, others))
            behind = _test(tests, row, best)
            ahead = _test(tests, row, rival)
            sure = [
                difference
                for difference, _, p in (_test(tests, row, other) for other in others.index)
                if p < SIGNIFICANCE
            ]
            rows.append(
                row
                | {"best": best, "behind": 0 - behind[0]}
                | {"behind_error": behind[1], "p_behind": behind[2], "rival": rival}
                | {"ahead": ahead[0], "ahead_error": ahead[1], "p_ahead": ahead[2]}
                | {"beats": sum(difference > 0 for difference in sure)}
                | {"beaten": sum(difference < 0 for difference in sure), "rivals": len(others)}
            )
    return pd.DataFrame(rows)[[*KEYS, *FOUND]]


def is_new(metric: str) -> bool:
    """Tell whether it is one of the alignment scores, or made of them."""
    return Column.parse(metric).name in NEW


def _test(
    tests: Mapping[Any, tuple[float, ...]], row: Mapping[Hashable, Any], other: str
) -> tuple[float, ...]:
    if other in ("", row["metric"]):
        return (0.0, 0.0, 1.0) if other else (np.nan, np.nan, np.nan)
    return tests[(*(row[key] for key in KEYS), other)]
