"""What repeated runs say of metrics: how often each orders two systems."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pandas as pd

from alignscores.comparison.statistics import LEVEL, permutation_test, wins
from experiments.metrics import metric as find

from ..order import trials_needed
from .scores import ALL_POSES, EQUAL_TIMES, KEYS, QUARTERS

FEWEST = 3  # runs of a system on a sequence


def _sign(metric: str) -> int:
    """Return what a metric is multiplied by so that larger is better."""
    return -1 if metric in QUARTERS else find(metric).sign


def _of_pairs(table: pd.DataFrame) -> Iterator[tuple[dict[str, str], pd.DataFrame, pd.DataFrame]]:
    """Yield each sequence and pair of systems with several runs there, and the runs of both."""
    for sequence, runs in table.groupby("sequence", sort=False):
        several = {name: own for name, own in runs.groupby("system") if len(own) >= FEWEST}
        for (a, of_a), (b, of_b) in combinations(several.items(), 2):
            yield {"sequence": str(sequence), "a": str(a), "b": str(b)}, of_a, of_b


def pairs(table: pd.DataFrame, poses: str = ALL_POSES) -> pd.DataFrame:
    """Compare two systems on a sequence by each metric.

    Returns
    -------
    DataFrame
        One row for each metric, sequence and pair of systems with several runs there:

        - `metric, sequence, a, b`
        - `share`: of the pairs of runs, one of each system, in which `a` is better, in per cent
        - `order`: the same of the better system
        - `significant`: whether the difference is, with these runs
        - `runs`: of each system that a rank-sum test needs (at 5 %, power 80 %)
    """
    rows = []
    for keys, of_a, of_b in _of_pairs(table[table["poses"] == poses]):
        for metric in table.columns.drop(KEYS):
            a, b = (_sign(metric) * runs[metric].dropna().to_numpy(float) for runs in (of_a, of_b))
            if min(len(a), len(b)) < FEWEST:
                continue
            share = wins([(a, b)])
            row = {"metric": metric} | keys | {"share": 100 * share}
            row |= {"order": 100 * max(share, 1 - share)}
            row |= {"significant": permutation_test([(a, b)]).p <= LEVEL}
            rows.append(row | {"runs": trials_needed(max(share, 1 - share))})
    return pd.DataFrame(rows)


def agreement(of_pairs: pd.DataFrame) -> pd.DataFrame:
    """Return how often each metric orders single runs as another one orders the systems.

    Returns
    -------
    DataFrame
        One row for each metric and other metric, `metric, other, order`: of how many pairs of runs,
        in per cent, the metric agrees with the system that the other prefers by all runs; the mean
        over the sequences and pairs of systems that the other does not tie.
    """
    shares = of_pairs.pivot_table("share", ["sequence", "a", "b"], "metric", sort=False)
    rows = []
    for metric in shares:
        for other in shares:
            preferred = np.sign(shares[other] - 50)
            agreeing = 50 + preferred * (shares[metric] - 50)
            mean = agreeing[preferred != 0].mean()
            rows.append({"metric": metric, "other": other, "order": mean})
    return pd.DataFrame(rows)


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Sum up how well each metric orders systems.

    Returns
    -------
    DataFrame
        One row for each metric, the best first:

        - `metric`
        - `order`: how often two runs, one of each system, come in the order of the systems by all
          runs, in per cent; the mean over sequences and pairs of systems
        - `significant`: on how many of these, in per cent, the difference is
        - `runs`: of each system that are needed for that, the median
        - `equal_order, equal_significant`: the same with the estimates at equal times, one pose a
          second
        - `agrees`: how often two runs come in the order of the systems by another metric; the mean
          over the other metrics
    """
    of_pairs, equal = pairs(table), pairs(table, EQUAL_TIMES)
    summary = of_pairs.groupby("metric", sort=False).agg(
        order=("order", "mean"), significant=("significant", "mean"), runs=("runs", "median")
    )
    summary["significant"] *= 100
    if len(equal):
        summary["equal_order"] = equal.groupby("metric")["order"].mean()
        summary["equal_significant"] = 100 * equal.groupby("metric")["significant"].mean()
    agrees = agreement(of_pairs)
    others = agrees[agrees["metric"] != agrees["other"]]
    summary["agrees"] = others.groupby("metric")["order"].mean()
    best = summary.sort_values(["order", "significant"], ascending=False, kind="stable")
    return best.rename_axis("metric").reset_index()
