"""What other thresholds do: a row for each value, a column for each effect."""

from typing import Any

import pandas as pd
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from figures import style

from ..axes import option_title, value_title
from ..order import SIGNIFICANCE
from .effects import COMPARED, EFFECTS

PANELS = {  # effect: title, effect of the tick beside it
    "noise_order": ("Noise, %", "noise_order_smallest"),
    "outlier_order": ("Outliers, %", "outlier_order_smallest"),
    "majority_order": ("Most lost, %", None),
    "noise_range_of_means": ("Noise range", "noise_range"),
    "camera_dependence": ("Cameras, %", None),
    "seed_noise": ("Seed noise", None),
}
ROW = 0.118  # inches
DOT: dict[str, Any] = {"marker": "o", "ms": 3.2, "mew": 0.7, "mec": style.INK}
TICK: dict[str, Any] = {"marker": "|", "ms": 3.6, "mew": 0.7}


@style.applied()
def draw(*tables: pd.DataFrame) -> Figure:
    """Figure: what other thresholds do."""
    table = pd.concat(tables, ignore_index=True)
    # The place of each value, with room for a title above each axis.
    table["row"] = table.index + pd.factorize(table["axis"])[0] + 1
    height = 0.9 + ROW * (table["row"].max() + 1)
    figure = Figure(figsize=(style.PAGE, height), layout="constrained")
    _effects(figure, table)
    return figure


def _effects(figure: Figure, table: pd.DataFrame) -> None:
    panels = figure.subplots(1, len(PANELS), sharey=True)
    for axes, (effect, (title, beside)) in zip(panels, PANELS.items(), strict=True):
        _column(axes, table, effect, beside)
        axes.set_title(title, pad=11)
        style.direction(axes, larger_is_better=EFFECTS[effect].larger_is_better)
    _labels(panels[0], table)
    _key(figure)


def _column(axes: Axes, table: pd.DataFrame, effect: str, beside: str | None) -> None:
    paper, place = table["paper"] == "yes", table["row"]
    for _, group in table.groupby("axis", sort=False):  # what the values are compared with
        x, y = group.loc[paper, effect].iloc[0], place[group.index]
        axes.plot([x, x], [y.min() - 0.4, y.max() + 0.4], color="0.72", lw=0.6, marker="", zorder=1)
    if beside is not None:
        axes.plot(table[beside], place, ls="", color=style.FAINT, **TICK)
    axes.errorbar(
        table[effect],
        place,
        xerr=_reach(table) * table[f"{effect}_error"].fillna(0.0),
        fmt="none",
        ecolor=style.INK,
        elinewidth=0.6,
        zorder=2,
    )
    for chosen, face in ((~paper, "white"), (paper, style.INK)):
        axes.plot(table.loc[chosen, effect], place[chosen], ls="", mfc=face, zorder=3, **DOT)
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter("{x:g}")
    style.as_rows(axes)


def _reach(table: pd.DataFrame) -> float:
    """Return within how many standard errors all differences at once are in 95 % of studies."""
    n = int(table[[f"{name}_p" for name in COMPARED]].notna().to_numpy().sum())
    return float(scipy.special.ndtri(1 - SIGNIFICANCE / 2 / max(n, 1)))


def _labels(axes: Axes, table: pd.DataFrame) -> None:
    """Name the values, and above them the options; the paper's values are bold."""
    first = table.drop_duplicates("axis")
    heads = first["metric"] + ": " + first["option"].map(option_title)
    values = list(map(value_title, table["option"], table["value"]))
    axes.set_yticks([*(first["row"] - 1), *table["row"]], [*heads, *values])
    bold = [True] * len(heads) + list(table["paper"] == "yes")
    for place, text in enumerate(axes.get_yticklabels()):
        if bold[place]:
            text.set_fontweight("bold")
        if place < len(heads):
            text.set_fontsize(style.TEXT)
    axes.set_ylim(table["row"].max() + 0.8, -0.8)


def _key(figure: Figure) -> None:
    handles = {
        "the paper's value": Line2D([], [], ls="", mfc=style.INK, **DOT),
        "another": Line2D([], [], ls="", mfc="white", **DOT),
        "95 % of all differences at once": Line2D([], [], color=style.INK, lw=0.6, marker=""),
        "smallest order, range of trials": Line2D([], [], ls="", color=style.FAINT, **TICK),
    }
    style.key(figure, handles, loc="outside lower center", handletextpad=0.4, columnspacing=1.6)
