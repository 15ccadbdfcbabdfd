"""Rankings of metrics by the order of neighbouring levels, and what it takes to tell them apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

import numpy as np
import pandas as pd

from experiments.tables import Record, TableError, Trials

from ..order import SIGNIFICANCE, Order, apart, compare, estimate, holm, mean_needed, needed, within

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
            setting = next((key for key in settings if _varies(trials.table, key)), None)
            if setting is None or _is_said(level, setting, trials.table):
                continue
            keys: dict[str, object] = {"experiment": name, "level": level}
            alone, pairs = compare(within(trials.table, setting), trials.sweep.metrics)
            for metric, found in alone.items():
                by_outliers = apart(trials.table, setting, metric)
                row = {"metric": metric, "trials": mean_needed(by_outliers.values() or [found])}
                cameras = _cameras(trials.table, setting, metric)
                rows.append(keys | row | {"cameras": cameras} | _numbers(found))
                rows += [
                    keys | row | {"outliers": n, "trials": needed(order)} | _numbers(order)
                    for n, order in by_outliers.items()
                ]
            for (metric, versus), found in pairs.items():
                row = {"metric": metric, "versus": versus, "p": found.p_value}
                rows.append(keys | row | _numbers(found))
    columns = ["experiment", "level", "metric", "versus", "order", "low", "high", "p", "trials"]
    table = pd.DataFrame(rows, columns=[*columns, "cameras", "outliers"])
    table["p"] = holm(table["p"].to_numpy(dtype=np.float64))
    table = table.astype({"trials": float, "cameras": float, "outliers": float})
    return table.round({"order": 2, "low": 2, "high": 2, "p": 6})


def _varies(trials: pd.DataFrame, setting: str) -> bool:
    return trials[setting].nunique() > 1


def _is_said(level: str, setting: str, trials: pd.DataFrame) -> bool:
    """Whether noise in rotations is the noise, or rises with it."""
    pairs = trials[["sigma_t", "sigma_r_deg"]].drop_duplicates()
    return level == "rotation noise" and len(pairs) == trials["sigma_r_deg"].nunique()


def _numbers(found: Order) -> dict[str, float]:
    low, high = found.interval
    return {"order": 100 * found.probability, "low": 100 * low, "high": 100 * high}


def _cameras(trials: pd.DataFrame, setting: str, metric: str) -> float:
    """Return the number of cameras from which on one trial is enough; NaN where it is fixed."""
    if not _varies(trials, "n_cameras"):
        return np.nan
    enough = inf
    for n in sorted(trials["n_cameras"].unique(), reverse=True):
        task = within(trials[trials["n_cameras"] == n], setting)
        if estimate(task.shares(metric)).probability < SURE:
            break
        enough = float(n)
    return enough


@dataclass(frozen=True)
class Place:
    """A metric in a ranking: its order in per cent, and what it takes to tell neighbours apart."""

    metric: str
    order: float
    trials: float
    cameras: float  # NaN where their number does not vary
    is_certain: bool | None  # whether it certainly is better than the next; None for the last


@dataclass(frozen=True)
class Ranking:
    """The metrics of an experiment, the best first, by the order of one kind of level."""

    experiment: str
    level: str
    places: Sequence[Place]

    @property
    def in_words(self) -> str:
        """The metrics with their orders: > certainly better than the next, = perhaps not."""
        parts = []
        for place in self.places:
            link = {True: " > ", False: " = ", None: ""}[place.is_certain]
            parts.append(f"{place.metric} {place.order:.1f}{link}")
        return "".join(parts)


def rankings(table: pd.DataFrame) -> list[Ranking]:
    """Rank the metrics at each level of each experiment, from what `compare_orders` returns."""
    found = []
    over_all = table[table["outliers"].isna()]
    for key, rows in over_all.groupby(["experiment", "level"], sort=False):
        experiment, level = map(str, key)
        alone = rows[rows["versus"].isna()].sort_values("order", ascending=False, kind="stable")
        pairs = rows[rows["versus"].notna()]
        columns = (pairs[column] for column in ("metric", "versus", "p"))
        p = {frozenset(pair): p for *pair, p in zip(*columns, strict=True)}
        names = [str(metric) for metric in alone["metric"]]
        certain = [p[frozenset(pair)] < SIGNIFICANCE for pair in pairwise(names)]
        numbers = alone[["order", "trials", "cameras"]].to_numpy()
        places = [
            Place(name, order=row[0], trials=row[1], cameras=row[2], is_certain=sure)
            for name, row, sure in zip(names, numbers.tolist(), [*certain, None], strict=True)
        ]
        found.append(Ranking(experiment, level, places))
    return found


def at_outliers(table: pd.DataFrame) -> list[tuple[tuple[str, str], pd.DataFrame]]:
    """Return the order of each metric (rows) at each number of outliers, where it varies."""
    apart = table[table["outliers"].notna()].astype({"outliers": int})
    return [
        ((str(key[0]), str(key[1])), rows.pivot(index="metric", columns="outliers", values="order"))
        for key, rows in apart.groupby(["experiment", "level"], sort=False)
    ]


def to_markdown(table: pd.DataFrame) -> str:
    """Write who orders what best, and what it takes."""
    lines = [METHOD, "", "| experiment | level | order, % | trials |", "|---|---|---|---|"]
    for ranking in rankings(table):
        trials = ", ".join(f"{place.metric} {place.trials:.3g}" for place in ranking.places)
        words = ranking.in_words
        lines.append(f"| {ranking.experiment} | {ranking.level} | {words} | {trials} |")
    lines += ["", "| experiment | cameras |", "|---|---|"]
    for ranking in rankings(table):
        cameras = [place for place in ranking.places if not np.isnan(place.cameras)]
        if cameras:
            words = ", ".join(f"{place.metric} {place.cameras:g}" for place in cameras)
            lines.append(f"| {ranking.experiment} | {words} |")
    for (experiment, level), rows in at_outliers(table):
        heads = " | ".join(map(str, rows.columns))
        lines += ["", f"| {experiment}, {level}: order, %, at outliers | {heads} |"]
        lines += ["|---|" + "--:|" * len(rows.columns)]
        for metric, orders in zip(rows.index, rows.to_numpy().tolist(), strict=True):
            lines.append(f"| {metric} | {' | '.join(f'{order:.1f}' for order in orders)} |")
    return "\n".join(lines) + "\n"
