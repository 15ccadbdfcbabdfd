"""What the new scores win and what they lose against today's protocols, in sentences and tables."""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from ..order import REACH, SIGNIFICANCE
from ..words import NONE, document, markdown_table
from .orders import is_new

VERDICTS = {"wins": "win", "loses": "lose", "even": "are not certainly ahead or behind"}


def duels(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the best new score and its best rival for each question, and who certainly wins."""
    found = []
    for title, rows in table.groupby(_titles(table), sort=False):
        new = rows[rows["metric"].map(is_new)]
        if new.empty or len(new) == len(rows):
            continue
        ours = new.iloc[int(new["order"].argmax())]
        theirs = rows[rows["metric"] == ours["rival"]].iloc[0]
        verdict = "wins" if ours["ahead"] > 0 else "loses"
        interval = f"{ours['ahead']:+.1f} ± {REACH * ours['ahead_error']:.1f}".replace("-", "−")
        found.append(
            {"title": title, "new": ours["metric"], "other": ours["rival"], "interval": interval}
            | {"verdict": verdict if ours["p_ahead"] < SIGNIFICANCE else "even"}
            | {name: [ours[name], theirs[name]] for name in ("order", "trials")}
        )
    return found


def sentences(table: pd.DataFrame) -> list[str]:
    """Say on what the best new score is certainly ahead of all others, behind one, or neither."""
    found = duels(table)
    texts = []
    for verdict, words in VERDICTS.items():
        some = [duel for duel in found if duel["verdict"] == verdict]
        parts = ["{title} ({new} {interval} against {other})".format(**duel) for duel in some]
        where = "; ".join(parts) or "nowhere"
        texts.append(f"The new scores {words} on {len(some)} of {len(found)}: {where}.")
    n_asked = table.groupby("metric", sort=False).size()
    seeing = table[table["p_chance"] < SIGNIFICANCE].groupby("metric", sort=False).size()
    everything = [metric for metric, n in seeing.items() if n == n_asked.max()]
    names = ", ".join(map(str, everything)) or "none"
    return [*texts, f"Better than chance on all {n_asked.max()}: {names}."]


def to_markdown(table: pd.DataFrame, by_outliers: pd.DataFrame) -> str:
    """Write what was found: sentences, the best of both sides, all numbers, those by outliers."""
    titled = table.assign(title=_titles(table))
    said = [f"- {sentence}" for sentence in sentences(table)]
    numbers = _duels(duels(table)), _matrix(titled), _totals(titled)
    return document(said, *numbers, LEGEND, *_by_outliers(by_outliers))


LEGEND = (
    "Numbers: how often the better of two estimates at neighbouring levels comes out better, %; "
    "50 is chance, × no better than that, – not asked. Bold: not certainly behind the best of the "
    "column. Intervals: 95 %, paired. Certain: p < 0.05 after Holm's method over all pairs of "
    "metrics and all columns."
)


def _duels(found: Sequence[Mapping[str, Any]]) -> list[str]:
    head = ["question", "best new score", "%", "best other", "%", "points ahead", "the new score"]
    rows = []
    for duel in found:
        ours, theirs = (f"{order:.1f}" for order in duel["order"])
        needed = " / ".join(f"{trials:.0f}" for trials in duel["trials"])
        cells = [duel["title"], duel["new"], ours, duel["other"], theirs, duel["interval"]]
        rows.append([*cells, duel["verdict"], needed])
    return markdown_table([*head, "estimates needed"], rows, "llrlrrlr")


def _matrix(table: pd.DataFrame) -> list[str]:
    cells = table.assign(cell=list(map(_cell, table.to_dict("records"))))
    wide = cells.pivot(index="metric", columns="title", values="cell").fillna(NONE)
    wide = wide.loc[table["metric"].unique(), table["title"].unique()]
    return markdown_table(["metric", *wide.columns], wide.itertuples(name=None))


def _titles(table: pd.DataFrame) -> "pd.Series[str]":
    return table["question"].str.replace("_", " ") + ": " + table["asked"]


def _by_outliers(table: pd.DataFrame) -> Iterator[list[str]]:
    """Write how each question about noise is answered at each number of outliers."""
    for title, rows in table.groupby(_titles(table), sort=False):
        orders = rows.pivot(index="metric", columns="outliers", values="order")
        ordered = orders.loc[rows["metric"].unique()]
        cells = [[name, *map("{:.0f}".format, row)] for name, *row in ordered.itertuples()]
        yield markdown_table([f"{title}; outliers", *map(str, orders.columns)], cells)


def _totals(table: pd.DataFrame) -> list[str]:
    """Sum up new scores against the others, and the others against them, over all questions."""
    head = ["metric", "certainly ahead of the other side", "behind", "of", "weakest, %", "where"]
    rows = []
    for metric, asked in table.groupby("metric", sort=False):
        counts = [f"{asked[name].sum():.0f}" for name in ("beats", "beaten", "rivals")]
        weakest = asked.iloc[int(asked["order"].argmin())]
        rows.append([str(metric), *counts, f"{weakest['order']:.0f}", weakest["title"]])
    return markdown_table(head, rows, "lrrrrl")


def _cell(row: Mapping[Hashable, Any]) -> str:
    if row["p_chance"] >= SIGNIFICANCE:
        return "×"
    number = f"{row['order']:.0f}"
    return f"**{number}**" if row["p_behind"] >= SIGNIFICANCE else number
