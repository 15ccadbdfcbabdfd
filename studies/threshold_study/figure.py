"""What other thresholds do: a row for each value, a column for each effect."""

from typing import Any

import pandas as pd
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from alignscores.comparison.statistics import LEVEL
from figures import style

from .effects import EFFECTS

TITLES = {
    "max_threshold": "largest threshold, units of d",
    "quantile": "quantile that is d",
    "n_thresholds": "number of thresholds",
    "max_threshold_deg": "largest threshold, degrees",
    "weight": "weight of the TAS",
    "n_hypotheses": "hypotheses",
    "prescreen": "prescreening threshold",
    "order": "m as share of n",
}
ROW = 0.118  # inches
DOT: dict[str, Any] = {"marker": "o", "ms": 3.2, "mew": 0.7, "mec": style.INK}


def draw(table: pd.DataFrame) -> Figure:
    """Figure: what other thresholds do."""
    # The row of each value, with a line for a title above each axis.
    table = table.assign(row=table.index + pd.factorize(table["axis"])[0] + 1)
    height = 0.9 + ROW * (table["row"].max() + 1)
    figure = Figure(figsize=(style.PAGE, height), layout="constrained")
    panels = figure.subplots(1, len(EFFECTS), sharey=True)
    for axes, (name, effect) in zip(panels, EFFECTS.items(), strict=True):
        _column(axes, table, name)
        axes.set_title(effect.title, pad=11)
        style.direction(axes, larger_is_better=effect.larger_is_better)
    _labels(panels[0], table)
    handles = {
        "the paper's value": Line2D([], [], ls="", mfc=style.INK, **DOT),
        "another": Line2D([], [], ls="", mfc="white", **DOT),
        "95 % interval of the difference, for all at once": Line2D(
            [], [], color=style.INK, lw=0.6, marker=""
        ),
    }
    style.key(figure, handles, loc="outside lower center", handletextpad=0.4, columnspacing=1.6)
    return figure


def _column(axes: Axes, table: pd.DataFrame, effect: str) -> None:
    paper, row = table["paper"] == "yes", table["row"]
    for _, group in table.groupby("axis", sort=False):  # what the values are compared with
        x, y = group.loc[paper, effect].iloc[0], row[group.index]
        axes.plot([x, x], [y.min() - 0.4, y.max() + 0.4], color="0.72", lw=0.6, marker="", zorder=1)
    n_tested = int(table[[f"{name}_p" for name in EFFECTS]].notna().to_numpy().sum())
    reach = scipy.special.ndtri(1 - LEVEL / 2 / max(n_tested, 1))
    errors = reach * table[f"{effect}_error"].fillna(0.0)
    bars: dict[str, Any] = {"fmt": "none", "ecolor": style.INK, "elinewidth": 0.6, "zorder": 2}
    axes.errorbar(table[effect], row, xerr=errors, **bars)
    for chosen, face in ((~paper, "white"), (paper, style.INK)):
        axes.plot(table.loc[chosen, effect], row[chosen], ls="", mfc=face, zorder=3, **DOT)
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter("{x:g}")
    style.as_rows(axes)


def _labels(axes: Axes, table: pd.DataFrame) -> None:
    """Name the values, and above them the options; the paper's values are bold."""
    first = table.drop_duplicates("axis")
    titles = [TITLES.get(option, option) for option in first["option"]]
    heads = [f"{metric}: {title}" for metric, title in zip(first["metric"], titles, strict=True)]
    values = table["value"].replace("inf", "off")  # of the prescreening
    axes.set_yticks([*(first["row"] - 1), *table["row"]], [*heads, *values])
    bold = [True] * len(heads) + list(table["paper"] == "yes")
    for index, text in enumerate(axes.get_yticklabels()):
        if bold[index]:
            text.set_fontweight("bold")
        if index < len(heads):
            text.set_fontsize(style.TEXT)
    axes.set_ylim(table["row"].max() + 0.8, -0.8)
