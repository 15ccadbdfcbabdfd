"""What repeated runs say of metrics: which of them tells the systems apart, and what moves it."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pandas as pd

from alignscores.arrays import Floats
from alignscores.comparison.statistics import LEVEL, rank_test, runs_needed
from alignscores.metrics import metric as find
from experiments.metrics import METRICS

from ..order import in_order
from .scores import AS_IT_IS, CHANGES, KEYS

FEWEST = 3  # runs of a system on a sequence, to tell how they scatter


def _sign(metric: str) -> int:
    """Return what a metric is multiplied by so that larger is worse."""
    family = METRICS[metric].family if metric in METRICS else find(metric).family
    return -1 if family.larger_is_better else 1


def _duels(table: pd.DataFrame) -> Iterator[tuple[str, str, str, pd.DataFrame, pd.DataFrame]]:
    """Yield sequence, two systems, and their runs as they are, where there are several of each."""
    table = table[table["change"] == AS_IT_IS]
    for sequence, runs in table.groupby("sequence", sort=False):
        several = {name: own for name, own in runs.groupby("system") if len(own) >= FEWEST}
        for (a, of_a), (b, of_b) in combinations(several.items(), 2):
            yield str(sequence), str(a), str(b), of_a, of_b


def _first_is_better(of_a: pd.DataFrame, of_b: pd.DataFrame, metric: str) -> Floats:
    """Return of each pair of runs whether the first is better, (runs, runs); a tie is a half."""
    a, b = (_sign(metric) * runs[metric].to_numpy(dtype=np.float64) for runs in (of_a, of_b))
    return in_order(a, b)


def pairs(table: pd.DataFrame) -> pd.DataFrame:
    """Tell how well each metric tells two systems apart on a sequence.

    Returns
    -------
    DataFrame
        One row for each metric, sequence and pair of systems with several runs there:

        - `metric, sequence, a, b`
        - `better`: the system that is better in most pairs of runs
        - `order`: in how many of them, in per cent
        - `told`: whether the difference is significant, with these runs
        - `runs`: of each system that show it in four of five cases; infinite for more than 50
    """
    rows = []
    for sequence, a, b, of_a, of_b in _duels(table):
        for metric in table.columns.drop(KEYS):
            share = float(_first_is_better(of_a, of_b, metric).mean())
            values = [runs[metric].dropna().to_numpy() for runs in (of_a, of_b)]
            if min(map(len, values)) < FEWEST:
                continue
            runs = [(values[0], values[1])]
            rows.append(
                {"metric": metric, "sequence": sequence, "a": a, "b": b}
                | {"better": a if share > 0.5 else b if share < 0.5 else ""}
                | {"order": 100 * max(share, 1 - share), "told": rank_test(runs).p <= LEVEL}
                | {"runs": runs_needed(runs) or np.inf}
            )
    return pd.DataFrame(rows)


def agreement(table: pd.DataFrame) -> pd.DataFrame:
    """Tell which metrics agree with each other on runs.

    Returns
    -------
    DataFrame
        One row for each metric and other metric:

        - `metric, other`
        - `order`: of how many pairs of runs, in per cent, the metric puts those in the order in
          which the other puts the two systems by all of their runs; the mean over sequences and
          pairs of systems that the other does not tie
        - `correlation`: Spearman's, of the runs on a sequence, larger is better; the mean over
          sequences
    """
    duels = list(_duels(table))
    metrics = list(pairs(table)["metric"].unique())
    first = {
        m: [_first_is_better(of_a, of_b, m).mean() for *_, of_a, of_b in duels] for m in metrics
    }
    as_they_are = table[table["change"] == AS_IT_IS]
    ranks = {
        m: as_they_are.groupby("sequence")[m].rank().where(as_they_are[m].notna()) * -_sign(m)
        for m in metrics
    }
    rows = []
    for metric in metrics:
        own = np.array(first[metric])
        for other in metrics:
            theirs = np.sign(np.array(first[other]) - 0.5)
            right = np.where(theirs > 0, own, 1 - own)[theirs != 0]
            both = pd.DataFrame({"a": ranks[metric], "b": ranks[other]})
            by_sequence = both.groupby(as_they_are["sequence"]).apply(lambda g: g["a"].corr(g["b"]))
            rows.append(
                {"metric": metric, "other": other}
                | {"order": 100 * right.mean() if len(right) else np.nan}
                | {"correlation": by_sequence.mean()}
            )
    return pd.DataFrame(rows)


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Sum up what runs say of each metric.

    Returns
    -------
    DataFrame
        One row for each metric, those that need the fewest runs first:

        - `metric`
        - `runs`: of each system that tell two systems apart on a sequence, the median over
          sequences and pairs of systems
        - `told`: on how many of these, in per cent, the runs that there are tell it
        - `order`: how often two runs, one of each system, come in the order of the systems by all
          runs, in per cent
        - `agrees`: likewise, in the order by another metric; the mean over the other metrics
        - `between`: share of the variance of the runs on a sequence that is between systems, in per
          cent; the mean over sequences
        - `moves_` with the name of a change: how far it moves a run, in standard deviations of the
          runs of a system; the median over runs
    """
    by_pair, agrees = pairs(table), agreement(table)
    others = agrees[agrees["metric"] != agrees["other"]]
    found = by_pair.groupby("metric", sort=False).agg(
        runs=("runs", "median"), told=("told", "mean"), order=("order", "mean")
    )
    found["told"] *= 100
    found["agrees"] = others.groupby("metric")["order"].mean()
    found["between"] = [100 * _between(table, metric) for metric in found.index]
    for change in CHANGES:
        if (table["change"] == change).any():
            moved = [_moves(table, metric, change) for metric in found.index]
            found[f"moves_{change.replace(' ', '_')}"] = moved
    order = found.sort_values(["runs", "order"], ascending=[True, False])
    return order.rename_axis("metric").reset_index()


def _between(table: pd.DataFrame, metric: str) -> float:
    """Return the intraclass correlation of the runs of a system, the mean over sequences."""
    table = table[table["change"] == AS_IT_IS]
    found = []
    for _, runs in table.groupby("sequence"):
        given = [own[metric].dropna() for _, own in runs.groupby("system")]
        several = [own for own in given if len(own) >= FEWEST]
        if len(several) > 1 and np.isfinite(pd.concat(several)).all():
            within = float(np.mean([np.var(own, ddof=1) for own in several]))
            n = float(np.mean([len(own) for own in several]))
            between = max(float(np.var([own.mean() for own in several], ddof=1)) - within / n, 0.0)
            found.append(between / (between + within) if between + within else np.nan)
    return float(np.nanmean(found)) if found else np.nan


def _moves(table: pd.DataFrame, metric: str, change: str) -> float:
    """Return how far a change moves a run, in standard deviations of runs; the median."""
    runs = table.set_index(KEYS[:3])
    as_they_are, changed = (runs.loc[runs["change"] == one, metric] for one in (AS_IT_IS, change))
    finite = as_they_are[np.isfinite(as_they_are)]
    scatter = finite.groupby(level=[0, 1]).var().groupby(level=0).mean() ** 0.5
    moved = (changed - as_they_are).abs()
    return float((moved / scatter.reindex(moved.index, level=0)).median())
