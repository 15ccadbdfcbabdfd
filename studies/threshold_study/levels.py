"""Levels: at which score the distance and the angle order best, and what they survive."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from experiments.metrics import Column
from experiments.tables import Trials

from ..order import SIGNIFICANCE, Order, Task, beside, estimate, holm, paired
from ..study import Table
from ..words import NONE, document, markdown_table
from .maps import read_thresholds, tables_of

READ = {"HalfDistance": "sigma_t", "HalfAngle": "sigma_r_deg"}  # and the noise they measure
HALF = 0.5  # the score that others are compared with
METHOD = (
    "HalfDistance (refined registration) and HalfAngle are read at each score; TAS and RAS stand "
    "beside them, with the paper's registration where none is named, and with one threshold alone "
    "they are the share of the cameras below it. Order: how often the better of two estimates "
    "comes out better, per cent; chance is 50. Their noise differs by 15 %, over five sizes of it "
    "in nine scenes where nothing is lost, and at 0.1 d where some of 100 cameras are outliers; or "
    "their numbers of outliers do. ▲ is certainly better than the same read at one half, ▼ worse "
    "(paired trials, 5 %, Holm). Scatter: standard deviation over the trials, per cent of the "
    "mean. Few cameras: the median in scenes of the fewest cameras, relative to the most."
)


def plan(overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each part, in which distance and angle are read at all scores."""
    own = read_thresholds().levels
    scores = sorted({*own.scores, HALF})
    metrics = [*own.beside, *(_at(metric, score) for metric in READ for score in scores)]
    return tables_of("levels", own, metrics, overrides)


def _at(metric: str, score: float) -> str:
    return metric if score == HALF else str(Column(metric).with_option("score", f"{score:g}"))


def _score_of(metric: str) -> float:
    """Return the score at which a distance or an angle is read; NaN for another metric."""
    column = Column.parse(metric)
    return float(column.options.get("score", HALF)) if column.name in READ else np.nan


def compare(parts: Mapping[str, Trials]) -> pd.DataFrame:
    """Tell how well each metric orders noise and lost cameras, and what scatters and is biased.

    Returns
    -------
    DataFrame
        One row for each part, level, number of outliers and metric:

        - `part, geometry, n_cameras`
        - `level`: what is put in order, noise or outliers
        - `n_outliers`: of `outliers` the lower one of the two numbers
        - `metric`, and the `score` that it is read at; empty where it is none
        - `right_order`: probability in per cent that the better of two trials at levels that differ
          by 15 % comes out better, the mean over the pairs of levels
        - `difference`: from that of the distance or angle at a score of one half on the same
          cameras, `error`: its standard error, `p`: the p-value against no difference, adjusted for
          all differences in the table by Holm's method
        - `scatter`: standard deviation over the trials in per cent of the mean, the median over the
          levels of noise; empty where a trial is infinite
        - `in_noise`: median over the trials in units of the noise, the median over its levels
    """
    names = read_thresholds().levels.parts
    rows = [{"part": part} | row for part in names for row in _rows(parts[f"levels_{part}"])]
    table = pd.DataFrame(rows)
    table["p"] = holm(table["p"])
    return table.round(6)


def _rows(trials: Trials) -> list[dict[str, Any]]:
    sweep, table = trials.sweep, trials.table
    keys = {"geometry": sweep.geometry, "n_cameras": sweep.n_cameras[0]}
    counts = sorted(table["n_outliers"].unique())
    rows = []
    for outliers, group in table.groupby("n_outliers"):
        key = keys | {"level": "noise", "n_outliers": outliers}
        found = _orders(paired(group, ["sigma_t"]), sweep.metrics)
        rows += [key | row | _spread(group, str(row["metric"])) for row in found]
    for low, high in zip(counts[::2], counts[1::2], strict=False):
        both = table[table["n_outliers"].isin([low, high])]
        key = keys | {"level": "outliers", "n_outliers": low}
        task = paired(both, ["sigma_t", "n_outliers"])
        rows += [key | row for row in _orders(task, sweep.metrics)]
    return rows


def _orders(task: Task, metrics: Sequence[str]) -> list[dict[str, Any]]:
    """Return the order of each metric, and its difference from that read at one half."""
    shares = {metric: task.shares(metric) for metric in metrics}
    rows = []
    for metric, own in shares.items():
        name = Column.parse(metric).name
        alone = {"right_order": 100 * estimate(own).probability}
        found = beside(own, shares[name]) if name in READ else alone
        rows.append({"metric": metric, "score": _score_of(metric)} | found)
    return rows


def _spread(table: pd.DataFrame, metric: str) -> dict[str, float]:
    """Return scatter and size of a distance or an angle."""
    if (name := Column.parse(metric).name) not in READ:
        return {}
    levels = table.groupby(READ[name])[metric]
    with np.errstate(invalid="ignore"):
        scatter = 100 * levels.std() / levels.mean()
    sizes = levels.median()
    return {
        "scatter": float(scatter.median(skipna=False)),
        "in_noise": float((sizes / sizes.index).median()),
    }


def summaries(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Sum up what `compare` found, a row for each metric: means over the scenes, and their text."""
    lower = sorted(table.loc[table["level"] == "outliers", "n_outliers"].astype(int).unique())
    titles = {0: "noise, none lost"} | {n: f"{n} lost" for n in lower if n}
    columns = table["n_outliers"].map(titles).where(table["level"] == "noise", "outliers")
    groups = table.groupby(["metric", columns])
    metrics = table["metric"].unique()
    orders, marks = (
        found.unstack().reindex(metrics)[[*titles.values(), "outliers"]]
        for found in (groups["right_order"].mean(), _marks(groups))
    )
    intact = table[table["n_outliers"] == 0].groupby("metric")
    numbers = orders.assign(
        score=table.groupby("metric")["score"].first(),
        scatter=intact["scatter"].median(),
        **{"few cameras": _few_cameras(table)},
    )
    written = orders.map("{:.0f}".format) + marks
    for name, digits in (("scatter", 1), ("few cameras", 2)):
        texts = numbers[name].map(f"{{:.{digits}f}}".format)
        written[name] = texts.where(numbers["score"].notna(), NONE)
    return numbers, written


def _marks(groups: Any) -> "pd.Series[str]":
    """Return a mark for each group of scenes whose mean order is another than at one half."""
    differences = groups["difference"].mean()
    errors = groups["error"].apply(np.linalg.norm) / groups.size()
    found = list(map(Order, differences, errors))
    sure = holm([one.p_value if one.error > 0 else np.nan for one in found]) < SIGNIFICANCE
    signs = np.where(differences > 0, " ▲", " ▼")
    return pd.Series(np.where(sure, signs, "").tolist(), differences.index)


def _few_cameras(table: pd.DataFrame) -> "pd.Series[float]":
    """Return the size of distances and angles of the fewest cameras relative to the most."""
    intact = table[(table["n_outliers"] == 0) & table["score"].notna()]
    sizes = intact.pivot_table("in_noise", ["metric", "geometry"], "n_cameras")
    ratios: pd.Series[float] = sizes[sizes.columns.min()] / sizes[sizes.columns.max()]
    return ratios.groupby("metric").mean()


def to_markdown(table: pd.DataFrame) -> str:
    """Write a table with a row for each metric."""
    _, written = summaries(table)
    rows = written.itertuples(name=None)
    return document(METHOD, markdown_table(["", *written.columns], rows))
