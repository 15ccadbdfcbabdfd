"""What other thresholds and registrations do to the scores: the threshold study."""

from typing import Any

import pandas as pd
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from studies.parameters.axes import option_title, value_title
from studies.parameters.effects import COMPARED, EFFECTS
from studies.statistics import SIGNIFICANCE

from . import style

__all__ = ["COLUMNS", "draw"]

PANELS = {  # effect: title, effect of the tick beside it
    "noise_power": ("τ, noise", "noise_power_smallest"),
    "outlier_power": ("τ, outliers", "outlier_power_smallest"),
    "majority_power": ("τ, most lost", None),
    "noise_range_of_means": ("Noise range", "noise_range"),
    "camera_dependence": ("Cameras, %", None),
    "seed_noise": ("Seed noise", None),
}
COLUMNS = (
    *("axis", "metric", "option", "value", "paper"),
    *(column for effect in PANELS for column in (effect, f"{effect}_error", f"{effect}_p")),
    *(beside for _, beside in PANELS.values() if beside is not None),
)
ROW = 0.118  # inches
DOT: dict[str, Any] = {"marker": "o", "ms": 3.2, "mew": 0.7, "mec": style.INK}
TICK: dict[str, Any] = {"marker": "|", "ms": 3.6, "mew": 0.7}


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Draw the effects: a row for each value of each axis, a column for each effect.

    Parameters
    ----------
    table : DataFrame
        What `studies.parameters.effects.effects` returns.
    """
    rows, titles = _layout(table)
    height = max(rows) + 1
    figure = Figure(figsize=(style.PAGE, 0.62 + ROW * height), layout="constrained")
    panels = figure.subplots(1, len(PANELS), sharey=True)
    for axes, (effect, (title, beside)) in zip(panels, PANELS.items(), strict=True):
        _column(axes, table, rows, effect, beside)
        axes.set_title(title, pad=11)
        style.direction(axes, higher_is_better=EFFECTS[effect].larger_is_better)
    _labels(panels[0], table, rows, titles)
    _key(figure)
    return figure


def _layout(table: pd.DataFrame) -> tuple[list[int], dict[str, int]]:
    """Return the place of each value, and of a title above each axis."""
    rows: list[int] = []
    titles: dict[str, int] = {}
    for axis in table["axis"]:
        if axis not in titles:
            titles[axis] = rows[-1] + 1 if rows else 0
            rows.append(titles[axis] + 1)
        else:
            rows.append(rows[-1] + 1)
    return rows, titles


def _column(
    axes: Axes, table: pd.DataFrame, rows: list[int], effect: str, beside: str | None
) -> None:
    paper = table["paper"] == "yes"
    place = pd.Series(rows, index=table.index)
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
        axes.plot(
            table.loc[chosen, effect],
            place[chosen],
            ls="",
            mfc=face,
            zorder=3,
            **DOT,
        )
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter("{x:g}")
    style.as_rows(axes)


def _reach(table: pd.DataFrame) -> float:
    """Return within how many standard errors all differences at once are in 95 % of studies."""
    n = int(table[[f"{name}_p" for name in COMPARED]].notna().to_numpy().sum())
    return float(scipy.special.ndtri(1 - SIGNIFICANCE / 2 / max(n, 1)))


def _labels(axes: Axes, table: pd.DataFrame, rows: list[int], titles: dict[str, int]) -> None:
    """Name the values, and above them the options; the paper's values are bold."""
    options = table.drop_duplicates("axis").set_index("axis")
    heads = {
        row: f"{options['metric'][axis]}: {option_title(options['option'][axis])}"
        for axis, row in titles.items()
    }
    values = {
        row: value_title(option, value)
        for row, option, value in zip(rows, table["option"], table["value"], strict=True)
    }
    labels = heads | values
    axes.set_yticks(list(labels), list(labels.values()))
    bold = {row for row, paper in zip(rows, table["paper"], strict=True) if paper == "yes"}
    for row, text in zip(labels, axes.get_yticklabels(), strict=True):
        if row in bold or row in heads:
            text.set_fontweight("bold")
        if row in heads:
            text.set_fontsize(style.TEXT)
    axes.set_ylim(max(rows) + 0.8, -0.8)


def _key(figure: Figure) -> None:
    handles = {
        "the paper's value": _dot(style.INK),
        "another": _dot("white"),
        "95 % of all differences at once": Line2D([], [], color=style.INK, lw=0.6, marker=""),
        "smallest τ, range of trials": Line2D([], [], ls="", color=style.FAINT, **TICK),
    }
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower center",
        ncols=len(handles),
        fontsize=style.SMALL,
        handletextpad=0.4,
        columnspacing=1.6,
    )


def _dot(face: str) -> Line2D:
    return Line2D([], [], ls="", mfc=face, **DOT)
