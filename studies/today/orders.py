"""How probably each metric puts two estimates in the right order, question by question."""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, permutations
from typing import Any

import numpy as np
import pandas as pd
import scipy

from alignscores.arrays import Floats
from experiments.config import Sweep
from experiments.metrics import Column
from experiments.tables import Trials

from ..statistics import SIGNIFICANCE, groups, holm, order_shares, trials_needed
from ..study import rates_of

__all__ = ["FOUND", "KEYS", "compare", "is_new"]

LEVELS = ("sigma_t", "sigma_r_deg", "n_outliers")
ACROSS = ("n_cameras", "every")  # what must not matter
NOISE = {"sigma_t": "position noise", "sigma_r_deg": "rotation noise"}  # where each is on its own
DISTURBANCES = {"uniform": "outliers", "missing": "missing", "cluster": "merged"}
NEW = ("TAS", "RAS", "PAS", "HalfDistance", "HalfAngle")

KEYS = ["question", "asked", "level", "across", "metric"]
FOUND = ["order", "order_error", "trials", "p_chance", "best", "behind", "behind_error", "p_behind"]
FOUND += ["rival", "ahead", "ahead_error", "p_ahead", "beats", "beaten", "rivals"]

ROUNDING = 12  # decimals, so that certainty is 1 and chance 1/2


@dataclass(frozen=True)
class Task:
    """Pairs of samples of trials that are to be put in order, the better one first.

    Parameters
    ----------
    level : str
        What differs between the two of a pair.
    across : str
        What else differs, and must not matter; empty where nothing does.
    samples : sequence of DataFrame
        The trials.
    units : sequence of int
        For each sample, which draws of cameras it is of: those of one unit are not independent.
    pairs : sequence of (int, int)
        Which samples are compared.
    """

    level: str
    across: str
    samples: Sequence[pd.DataFrame]
    units: Sequence[int]
    pairs: Sequence[tuple[int, int]]

    def shares(self, metric: str) -> Floats:
        """Return each draw's share of the probability of the right order, (units, trials)."""
        sign = -1 if Column.parse(metric).metric.family.larger_is_better else 1
        values = [sign * sample[metric].to_numpy() for sample in self.samples]
        totals = np.zeros((max(self.units) + 1, len(values[0])))
        for unit, shares in zip(self.units, order_shares(values, self.pairs), strict=True):
            totals[unit] += shares
        return totals


def compare(questions: Mapping[str, Trials]) -> pd.DataFrame:
    """Put all metrics to all questions.

    Parameters
    ----------
    questions : mapping of str to Trials
        The trials of each question.

    Returns
    -------
    DataFrame
        One row for each question, level and metric:

        - `question, asked, level, across, metric`: the level is the setting to be ordered, in words
          as asked; `across` is a setting that differs between the two, too, and must not matter
        - `order, order_error`: probability in per cent that the better of two estimates at
          neighbouring levels comes out better, see `studies.statistics.order`; 50 is chance
        - `trials`: estimates at each of two levels that tell them apart, see
          `studies.statistics.trials_needed`
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
    tables, tests = [], []
    for name, trials in questions.items():
        for task in _tasks(trials):
            shares = {metric: task.shares(metric) for metric in trials.record.metrics}
            asked = _words(task, trials.sweep)
            keys = {"question": name, "asked": asked, "level": task.level, "across": task.across}
            tables.append(pd.DataFrame(_row(metric, one) for metric, one in shares.items()))
            tables[-1] = tables[-1].assign(**keys)
            tests += [
                keys | {"first": a, "second": b} | _difference(shares[a], shares[b])
                for a, b in combinations(shares, 2)
            ]
    table = pd.concat(tables, ignore_index=True)
    table["p_chance"] = holm(table["p_chance"])
    pairs = pd.DataFrame(tests, columns=[*KEYS[:-1], "first", "second", "difference", "error", "p"])
    pairs["p"] = holm(pairs["p"])
    return _versus(table, pairs)


def _tasks(trials: Trials) -> Iterator[Task]:
    """Return what has to be ordered: all that varies, but for what must not matter."""
    table = trials.table.assign(every=1)
    if "settings" in table:
        table["every"] = rates_of(table)
    paired = trials.sweep.noise == "paired"
    levels = [level for level in LEVELS if table[level].nunique() > 1]
    levels = [level for level in levels if not (paired and level == "sigma_r_deg")]
    across = next((name for name in ACROSS if table[name].nunique() > 1), "")
    for level in levels:
        yield _across(table, level, across) if across else _within(table, level)


def _words(task: Task, sweep: Sweep) -> str:
    """Say what is to be ordered."""
    if task.level == "n_outliers":
        return DISTURBANCES.get(sweep.outliers, sweep.outliers)
    return "noise" if sweep.noise == "paired" else NOISE[task.level]


def _within(table: pd.DataFrame, level: str) -> Task:
    """Compare neighbouring levels where all else is the same."""
    samples: list[pd.DataFrame] = []
    pairs: list[tuple[int, int]] = []
    for group in groups(table, level):
        first = len(samples)
        samples += [sample for _, sample in group.groupby(level)]
        pairs += pairwise(range(first, len(samples)))
    return Task(level, "", samples, range(len(samples)), pairs)


def _across(table: pd.DataFrame, level: str, across: str) -> Task:
    """Compare neighbouring levels where another setting differs, each value with each other one.

    The same cameras are seen at all frame rates.
    """
    names, samples = zip(*table.groupby([level, across]), strict=True)
    levels, others = (sorted(table[name].unique()) for name in (level, across))
    pairs = [
        (names.index((low, a)), names.index((high, b)))
        for low, high in pairwise(levels)
        for a, b in permutations(others, 2)
    ]
    shared = across == "every"
    units = [levels.index(key[0]) if shared else place for place, key in enumerate(names)]
    return Task(level, across, samples, units, pairs)


def _row(metric: str, shares: Floats) -> dict[str, float | str]:
    probability, error = _estimate(shares)
    return {
        "metric": metric,
        "order": 100 * probability,
        "order_error": 100 * error,
        "trials": trials_needed(probability),
        "p_chance": _p_value(probability - 0.5, error),
    }


def _difference(ours: Floats, theirs: Floats) -> dict[str, float]:
    difference, error = _estimate(ours - theirs)
    p = min(1.0, 2 * _p_value(abs(difference), error))
    return {"difference": 100 * difference, "error": 100 * error, "p": p}


def _estimate(shares: Floats) -> tuple[float, float]:
    """Return a probability, or a difference of two, and its standard error over the draws."""
    n = shares.shape[1]
    variance = shares.var(axis=1, ddof=1).sum() / n if n > 1 else np.inf
    probability = round(float(shares.mean(axis=1).sum() / 2), ROUNDING)
    return probability, round(float(np.sqrt(variance)), ROUNDING)


def _p_value(difference: float, error: float) -> float:
    """Probability of so large a difference, or a larger one, by chance."""
    if not error:
        return 0.5 if not difference else float(difference < 0)
    return float(scipy.special.ndtr(-difference / error))


def _versus(table: pd.DataFrame, pairs: pd.DataFrame) -> pd.DataFrame:
    """Add the comparisons with the best metric, and with the best one of the other side."""
    swapped = {"first": pairs["second"], "second": pairs["first"]}
    both = pd.concat([pairs, pairs.assign(**swapped, difference=-pairs["difference"])])
    found = both.set_index([*KEYS[:-1], "first", "second"])[["difference", "error", "p"]]
    tests = dict(zip(found.index, found.itertuples(index=False, name=None), strict=True))
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
    """Return a metric's difference from another, its error and p-value."""
    if other in ("", row["metric"]):
        return (0.0, 0.0, 1.0) if other else (np.nan, np.nan, np.nan)
    return tests[(*(row[key] for key in KEYS), other)]
