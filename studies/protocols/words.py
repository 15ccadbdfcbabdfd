"""What the new scores win and what they lose against today's protocols, in sentences and tables."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from ..order import REACH, SIGNIFICANCE
from .orders import is_new

VERDICTS = {"wins": "win", "loses": "lose", "even": "are not certainly ahead or behind"}


@dataclass(frozen=True)
class Duel:
    """The best of the new scores and the best of the other metrics, on one question.

    In per cent: how often each is right, and how far the new score is ahead. `trials` is how many
    estimates each needs at each of two levels.
    """

    question: str
    asked: str
    new: str
    other: str
    orders: tuple[float, float]
    trials: tuple[float, float]
    ahead: float
    error: float
    p: float

    @property
    def title(self) -> str:
        """What is to be ordered in which question."""
        return f"{self.question.replace('_', ' ')}: {self.asked}"

    @property
    def verdict(self) -> str:
        """``wins`` or ``loses`` where that is certain, for the new score; else ``even``."""
        if not self.p < SIGNIFICANCE:
            return "even"
        return "wins" if self.ahead > 0 else "loses"

    @property
    def interval(self) -> str:
        """How far the new score is ahead, with half the width of the 95 % interval."""
        return f"{self.ahead:+.1f} ± {REACH * self.error:.1f}".replace("-", "−")


def duels(table: pd.DataFrame) -> list[Duel]:
    """Return the best new score and its best rival for each question of `compare_sides`."""
    found = []
    for (question, asked), rows in table.groupby(["question", "asked"], sort=False):
        new = rows[rows["metric"].map(is_new)]
        if new.empty or len(new) == len(rows):
            continue
        ours = new.iloc[int(new["order"].argmax())]
        theirs = rows[rows["metric"] == ours["rival"]].iloc[0]
        found.append(
            Duel(
                str(question),
                str(asked),
                ours["metric"],
                ours["rival"],
                (ours["order"], theirs["order"]),
                (ours["trials"], theirs["trials"]),
                ours["ahead"],
                ours["ahead_error"],
                ours["p_ahead"],
            )
        )
    return found


def sentences(table: pd.DataFrame) -> list[str]:
    """Say on what the best new score is certainly ahead of all others, behind one, or neither."""
    found = duels(table)
    texts = []
    for verdict, words in VERDICTS.items():
        some = [duel for duel in found if duel.verdict == verdict]
        parts = [f"{duel.title} ({duel.new} {duel.interval} against {duel.other})" for duel in some]
        where = "; ".join(parts) or "nowhere"
        texts.append(f"The new scores {words} on {len(some)} of {len(found)}: {where}.")
    n_asked = table.groupby("metric", sort=False).size()
    seeing = table[table["p_chance"] < SIGNIFICANCE].groupby("metric", sort=False).size()
    everything = [metric for metric, n in seeing.items() if n == n_asked.max()]
    names = ", ".join(map(str, everything)) or "none"
    return [*texts, f"Better than chance on all {n_asked.max()}: {names}."]


def to_markdown(table: pd.DataFrame, by_outliers: pd.DataFrame) -> str:
    """Write what was found: sentences, the best of both sides, all numbers, those by outliers."""
    lines = [f"- {sentence}" for sentence in sentences(table)]
    lines += ["", *_duels(duels(table)), "", *_matrix(table), "", *_totals(table), "", LEGEND]
    lines += _by_outliers(by_outliers)
    return "\n".join(lines) + "\n"


LEGEND = (
    "Numbers: how often the better of two estimates at neighbouring levels comes out better, %; "
    "50 is chance, × no better than that, – not asked. Bold: not certainly behind the best of the "
    "column. Intervals: 95 %, paired. Certain: p < 0.05 after Holm's method over all pairs of "
    "metrics and all columns."
)


def _duels(found: Sequence[Duel]) -> list[str]:
    lines = [
        "| question | best new score | % | best other | % | points ahead | the new score "
        "| estimates needed |",
        "|---|---|--:|---|--:|--:|---|--:|",
    ]
    for duel in found:
        ours, theirs = (f"{order:.1f}" for order in duel.orders)
        needed = " / ".join(f"{trials:.0f}" for trials in duel.trials)
        cells = [duel.title, duel.new, ours, duel.other, theirs, duel.interval, duel.verdict]
        lines.append(f"| {' | '.join([*cells, needed])} |")
    return lines


def _matrix(table: pd.DataFrame) -> list[str]:
    titles = _titles(table)
    columns = list(titles.unique())
    lines = [f"| metric | {' | '.join(columns)} |", f"|---|{'--:|' * len(columns)}"]
    for metric, rows in table.assign(title=titles).groupby("metric", sort=False):
        cells = {row["title"]: _cell(row) for row in rows.to_dict("records")}
        lines.append(f"| {metric} | {' | '.join(cells.get(title, '–') for title in columns)} |")
    return lines


def _titles(table: pd.DataFrame) -> "pd.Series[str]":
    return table["question"].str.replace("_", " ") + ": " + table["asked"]


def _by_outliers(table: pd.DataFrame) -> list[str]:
    """Write how each question about noise is answered at each number of outliers."""
    lines = []
    for title, rows in table.groupby(_titles(table), sort=False):
        orders = rows.pivot(index="metric", columns="outliers", values="order")
        lines += ["", f"| {title}; outliers | {' | '.join(map(str, orders.columns))} |"]
        lines.append(f"|---|{'--:|' * len(orders.columns)}")
        for metric in rows["metric"].unique():
            numbers = [f"{order:.0f}" for order in orders.loc[metric]]
            lines.append(f"| {metric} | {' | '.join(numbers)} |")
    return lines


def _totals(table: pd.DataFrame) -> list[str]:
    """Sum up new scores against the others, and the others against them, over all questions."""
    lines = ["| metric | certainly ahead of the other side | behind | of | weakest, % | where |"]
    lines.append("|---|--:|--:|--:|--:|---|")
    for metric, rows in table.groupby("metric", sort=False):
        counts = [f"{rows[name].sum():.0f}" for name in ("beats", "beaten", "rivals")]
        weakest = rows.iloc[int(rows["order"].argmin())]
        where = f"{weakest['question'].replace('_', ' ')}: {weakest['asked']}"
        cells = [str(metric), *counts, f"{weakest['order']:.0f}", where]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _cell(row: Mapping[Hashable, Any]) -> str:
    if row["p_chance"] >= SIGNIFICANCE:
        return "×"
    number = f"{row['order']:.0f}"
    return f"**{number}**" if row["p_behind"] >= SIGNIFICANCE else number
