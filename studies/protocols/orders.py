"""How often each metric puts two estimates in the right order, question by question."""

from collections.abc import Iterator, Mapping

import pandas as pd

from experiments.metrics import Column
from experiments.tables import Trials

from .. import order
from ..order import SIGNIFICANCE, Task
from ..study import rates_of

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
    rows, pairs = [], []
    for trials, keys, task in _tasks(questions):
        alone, differences = order.compare(task, trials.record.metrics)
        for metric, found in alone.items():
            by_outliers = order.apart(trials.table, keys["level"], metric)
            numbers = {"order": 100 * found.probability, "order_error": 100 * found.error}
            numbers["trials"] = order.mean_needed(by_outliers.values() or [found])
            rows.append(keys | {"metric": metric} | numbers | {"p_chance": found.p_above(0.5)})
        pairs += [
            (*keys.values(), *pair, 100 * found.probability, 100 * found.error, found.p_value)
            for pair, found in differences.items()
        ]
    table = pd.DataFrame(rows)
    table["p_chance"] = order.holm(table["p_chance"])
    tests = pd.DataFrame(pairs, columns=[*KEYS, "other", "difference", "error", "p"])
    tests["p"] = order.holm(tests["p"])
    turned = tests.rename(columns={"metric": "other", "other": "metric"})
    turned["difference"] *= -1
    itself = table[KEYS].assign(other=table["metric"], difference=0.0, error=0.0, p=1.0)
    return _versus(table, pd.concat([tests, turned, itself]).set_index(KEYS).sort_index())


def at_outliers(questions: Mapping[str, Trials]) -> pd.DataFrame:
    """Put the questions about noise at each number of outliers apart.

    Returns
    -------
    DataFrame
        One row for each `question`, `asked`, `metric` and number of `outliers`: `order` and
        `trials` as in `compare_sides`.
    """
    rows = [
        keys
        | {"metric": metric, "outliers": n}
        | {"order": 100 * found.probability, "trials": order.needed(found)}
        for trials, keys, _ in _tasks(questions)
        for metric in trials.record.metrics
        for n, found in order.apart(trials.table, keys["level"], metric).items()
    ]
    columns = ["question", "asked", "metric", "outliers", "order", "trials"]
    return pd.DataFrame(rows, columns=columns)


def _tasks(questions: Mapping[str, Trials]) -> Iterator[tuple[Trials, dict[str, str], Task]]:
    """Return what has to be ordered: all that varies, but for what must not matter."""
    for name, trials in questions.items():
        table, sweep = trials.table.assign(every=1), trials.sweep
        if "settings" in table:
            table["every"] = rates_of(table)
        noise = {"sigma_t": "noise"} if sweep.noise == "paired" else NOISE
        asked = noise | {"n_outliers": DISTURBANCES.get(sweep.outliers, sweep.outliers)}
        other = next((setting for setting in ACROSS if order.varies(table, setting)), "")
        for level, words in asked.items():
            if order.varies(table, level):
                keys = {"question": name, "asked": words, "level": level, "across": other}
                if other:
                    task = order.across(table, level, other, same_draws=other == "every")
                else:
                    task = order.within(table, level)
                yield trials, keys, task


def _versus(table: pd.DataFrame, tests: pd.DataFrame) -> pd.DataFrame:
    """Add the comparisons with the best metric, and with the best one of the other side."""
    rows = []
    for _, task in table.groupby(KEYS[:-1], sort=False):
        orders = task.set_index("metric")["order"]
        for row in task.to_dict("records"):
            others = orders[[is_new(name) != is_new(row["metric"]) for name in orders.index]]
            best, rival = (str(some.idxmax()) if len(some) else "" for some in (orders, others))
            versus = tests.loc[[tuple(row[key] for key in KEYS)]].set_index("other")
            behind, ahead = versus.loc[best], versus.reindex([rival]).iloc[0]
            versus = versus.loc[others.index]
            sure = versus.loc[versus["p"] < SIGNIFICANCE, "difference"]
            rows.append(
                row
                | {"best": best, "behind": 0 - behind["difference"]}
                | {"behind_error": behind["error"], "p_behind": behind["p"], "rival": rival}
                | {"ahead": ahead["difference"], "ahead_error": ahead["error"]}
                | {"p_ahead": ahead["p"], "beats": (sure > 0).sum()}
                | {"beaten": (sure < 0).sum(), "rivals": len(others)}
            )
    return pd.DataFrame(rows)[[*KEYS, *FOUND]]


def is_new(metric: str) -> bool:
    """Tell whether it is one of the alignment scores, or made of them."""
    return Column.parse(metric).name in NEW
