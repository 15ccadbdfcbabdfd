"""Head to head: which metric puts two neighbouring levels in the right order, and what it takes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from math import inf

import numpy as np
import pandas as pd
import scipy

from experiments.tables import Record, TableError, Trials

from .statistics import SIGNIFICANCE, Order, by_level, groups, holm, order, trials_needed
from .study import Study, Table, load_experiments

__all__ = ["LEVELS", "METHOD", "SURE", "Place", "Ranking", "compare_orders", "load_halves"]
__all__ += ["rankings", "side_by_side", "to_markdown"]

HALVES = {"TAS": "HalfDistance", "RAS": "HalfAngle"}  # what needs no threshold, beside each score

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
    f"probability of {100 * SURE:g} %; inf: more than any. HalfDistance, HalfAngle: the units at "
    "which TAS (refined registration) and RAS are one half."
)
"""How the rankings are made, and read."""


def load_halves(overrides: Sequence[str] = ()) -> Study:
    """Return the paper's experiments once more, for the half-score distance and angle alone.

    They are not in the tables of the experiments, which have the paper's metrics.

    Parameters
    ----------
    overrides : sequence of str
        Those of the experiments.

    Returns
    -------
    Study
        A table for each experiment with TAS or RAS: of the same trials.

    Examples
    --------
    >>> from studies.order import load_halves
    >>> {name: table.sweeps[0].metrics for name, table in load_halves().tables.items()}["combined"]
    ['HalfDistance', 'HalfAngle']
    """
    tables = {}
    for name, table in load_experiments(overrides).tables.items():
        (sweep,) = table.sweeps
        if metrics := [HALVES[metric] for metric in sweep.metrics if metric in HALVES]:
            tables[name] = Table((replace(sweep, metrics=metrics),))
    return Study("halves", tables)


def side_by_side(tables: Sequence[Trials]) -> dict[str, Trials]:
    """Join the metrics of tables of the same trials.

    Parameters
    ----------
    tables : sequence of Trials
        Several of an experiment may be of the same trials.

    Returns
    -------
    dict of str to Trials
        One table for each experiment, by its name, as the first of its tables with more metrics.

    Raises
    ------
    TableError
        Where two tables of an experiment are of other trials.
    """
    joined: dict[str, Trials] = {}
    for one in tables:
        name, metrics = one.sweep.name, one.sweep.metrics
        if name not in joined:
            joined[name] = one
            continue
        first = joined[name]
        if replace(one.sweep, metrics=first.sweep.metrics) != first.sweep:
            raise TableError(one.path, f"has other settings than {first.path}")
        sweep = replace(first.sweep, metrics=[*first.sweep.metrics, *metrics])
        table = pd.concat([first.table, one.table[metrics]], axis=1)
        joined[name] = Trials(first.path, table, Record((sweep,), first.record.origin))
    return joined


def compare_orders(experiments: Mapping[str, Trials]) -> pd.DataFrame:
    """Compare the metrics of each experiment by the order of neighbouring levels.

    Parameters
    ----------
    experiments : mapping of str to Trials
        The trials by the names of the experiments.

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
    """
    rows: list[dict[str, object]] = []
    for name, trials in experiments.items():
        metrics = trials.sweep.metrics
        for level, settings in LEVELS.items():
            setting = next((key for key in settings if _varies(trials.table, key)), None)
            if setting is None or _is_said(level, setting, trials.table):
                continue
            own: dict[str, object] = {"experiment": name, "level": level}
            for metric in metrics:
                found = _order(trials.table, setting, metric)
                numbers = {"trials": _trials(found)}
                numbers["cameras"] = _cameras(trials.table, setting, metric)
                rows.append(own | {"metric": metric} | _row(found) | numbers)
            for metric, versus in combinations(metrics, 2):
                found = _order(trials.table, setting, metric, versus)
                pair = {"metric": metric, "versus": versus, "p": _p_value(found)}
                rows.append(own | pair | _row(found))
    columns = ["experiment", "level", "metric", "versus", "order", "low", "high", "p", "trials"]
    table = pd.DataFrame(rows, columns=[*columns, "cameras"])
    table["p"] = holm(table["p"].to_numpy(dtype=np.float64))
    table = table.astype({"trials": float, "cameras": float})
    return table.round({"order": 2, "low": 2, "high": 2, "p": 6})


def _varies(trials: pd.DataFrame, setting: str) -> bool:
    return trials[setting].nunique() > 1


def _is_said(level: str, setting: str, trials: pd.DataFrame) -> bool:
    """Whether noise in rotations is the noise, or rises with it."""
    pairs = trials[["sigma_t", "sigma_r_deg"]].drop_duplicates()
    return level == "rotation noise" and len(pairs) == trials["sigma_r_deg"].nunique()


def _order(trials: pd.DataFrame, setting: str, metric: str, versus: str | None = None) -> Order:
    """Return the order in all groups of trials that share the other settings."""
    found = []
    for group in groups(trials, setting):
        group = group.sort_values("trial", kind="stable")
        others = None if versus is None else by_level(group, versus, setting)
        found.append(order(by_level(group, metric, setting), others))
    error = float(np.sqrt(sum(one.error**2 for one in found))) / len(found)
    return Order(float(np.mean([one.probability for one in found])), error)


def _trials(found: Order) -> float:
    return trials_needed(found.probability) if found.probability - _reach(found) > 0.5 else inf


def _reach(found: Order) -> float:
    return float(scipy.special.ndtri(1 - SIGNIFICANCE / 2)) * found.error


def _row(found: Order) -> dict[str, float]:
    reach = _reach(found)
    probabilities = (found.probability, found.probability - reach, found.probability + reach)
    return dict(zip(("order", "low", "high"), (100 * p for p in probabilities), strict=True))


def _p_value(found: Order) -> float:
    if found.error == 0:
        return float(found.probability == 0)
    return float(2 * scipy.special.ndtr(-abs(found.probability) / found.error))


def _cameras(trials: pd.DataFrame, setting: str, metric: str) -> float:
    """Return the number of cameras from which on one trial is enough; NaN where it is fixed."""
    if not _varies(trials, "n_cameras"):
        return np.nan
    enough = inf
    for n in sorted(trials["n_cameras"].unique(), reverse=True):
        if _order(trials[trials["n_cameras"] == n], setting, metric).probability < SURE:
            break
        enough = float(n)
    return enough


@dataclass(frozen=True)
class Ranking:
    """The metrics of an experiment, the best first, by the order of one kind of level.

    Parameters
    ----------
    experiment, level : str
        What they are compared in.
    places : sequence of Place
        The metrics.
    """

    experiment: str
    level: str
    places: "Sequence[Place]"

    @property
    def in_words(self) -> str:
        """The metrics with their orders: > certainly better than the next, = perhaps not."""
        parts = []
        for place in self.places:
            link = {True: " > ", False: " = ", None: ""}[place.is_certain]
            parts.append(f"{place.metric} {place.order:.1f}{link}")
        return "".join(parts)


@dataclass(frozen=True)
class Place:
    """A metric in a ranking: its order in per cent, and what it takes to tell neighbours apart."""

    metric: str
    order: float
    trials: float
    cameras: float  # NaN where their number does not vary
    is_certain: bool | None  # whether it certainly is better than the next; None for the last


def rankings(table: pd.DataFrame) -> list[Ranking]:
    """Rank the metrics at each level of each experiment.

    Parameters
    ----------
    table : DataFrame
        What `compare_orders` returns.
    """
    found = []
    for key, rows in table.groupby(["experiment", "level"], sort=False):
        experiment, level = map(str, key)
        alone = rows[rows["versus"].isna()].sort_values("order", ascending=False, kind="stable")
        pairs = rows[rows["versus"].notna()]
        columns = (pairs[column] for column in ("metric", "versus", "p"))
        p = {frozenset(pair): p for *pair, p in zip(*columns, strict=True)}
        names = [str(metric) for metric in alone["metric"]]
        certain = [p[frozenset(pair)] < SIGNIFICANCE for pair in pairwise(names)]
        numbers = alone[["order", "trials", "cameras"]].to_numpy()
        places = [
            Place(name, order=own[0], trials=own[1], cameras=own[2], is_certain=sure)
            for name, own, sure in zip(names, numbers.tolist(), [*certain, None], strict=True)
        ]
        found.append(Ranking(experiment, level, places))
    return found


def to_markdown(table: pd.DataFrame) -> str:
    """Write who orders what best, and what it takes."""
    lines = [METHOD, "", "| experiment | level | order, % | trials |", "|---|---|---|---|"]
    for ranking in rankings(table):
        trials = ", ".join(f"{place.metric} {place.trials:g}" for place in ranking.places)
        words = ranking.in_words
        lines.append(f"| {ranking.experiment} | {ranking.level} | {words} | {trials} |")
    lines += ["", "| experiment | cameras |", "|---|---|"]
    for ranking in rankings(table):
        cameras = [place for place in ranking.places if not np.isnan(place.cameras)]
        if cameras:
            words = ", ".join(f"{place.metric} {place.cameras:g}" for place in cameras)
            lines.append(f"| {ranking.experiment} | {words} |")
    return "\n".join(lines) + "\n"
