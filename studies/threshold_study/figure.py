"""What other thresholds do: maps over the size of the noise, effects of options, and levels."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from figures import style

from ..axes import option_title, value_title
from ..order import SIGNIFICANCE
from .effects import COMPARED, EFFECTS
from .levels import summaries
from .maps import OPTIONS

THRESHOLDS = {  # map: option, title, label of x, label of y
    "tas": ("max_threshold", "TAS", "noise, units of d", "largest threshold, units of d"),
    "ras": ("max_threshold_deg", "RAS", "noise, degrees", "largest threshold, degrees"),
}
REGISTRATION = {  # option: title, the paper's value
    "order": ("m as share of n", 0.1),
    "prescreen": ("Prescreening threshold", 0.1),
    "n_hypotheses": ("Hypotheses", 1000.0),
}
PAPER = {"max_threshold": 1.0, "max_threshold_deg": 10.0}
OTHERS = {"TAS(registration=refined)": "refined, 1 d", **style.NAMES}
CHANCE, LARGEST = 50.0, 112.0  # values of the lightest and the darkest colour
WHITE_ABOVE = 88  # the text
TIGHT = 5.0  # points
MAPS_HEIGHT = 5.9  # inches

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

READ = {"HalfDistance": ("Distance", "-"), "HalfAngle": ("Angle", "--")}  # at levels of the score
MARKERS = "osD^vP"


@style.applied()
def draw(*tables: pd.DataFrame) -> Figure:
    """Figure: what other thresholds do."""
    *effects, map_ = tables
    table = pd.concat(effects, ignore_index=True)
    table = table[~table["option"].isin(OPTIONS)].reset_index(drop=True)
    # The place of each value, with room for a title above each axis.
    table["row"] = table.index + pd.factorize(table["axis"])[0] + 1
    height = 0.9 + ROW * (table["row"].max() + 1)
    figure = Figure(figsize=(style.PAGE, MAPS_HEIGHT + height), layout="constrained")
    halves = figure.subfigures(2, 1, height_ratios=[MAPS_HEIGHT, height])
    upper, lower = np.ravel(np.asarray(halves))
    _maps(upper, map_)
    _effects(lower, table)
    return figure


def _maps(figure: SubFigure, table: pd.DataFrame) -> None:
    rows = np.ravel(np.asarray(figure.subfigures(3, 1, height_ratios=[1.15, 1.0, 0.72])))
    for part, (name, labels) in zip(rows, THRESHOLDS.items(), strict=False):
        option, title, xlabel, ylabel = labels
        own = table[table["map"] == name]
        counts = sorted(own["n_cameras"].unique())
        panels = part.subplots(1, len(counts), sharey=True, squeeze=False)[0]
        for axes, n in zip(panels, counts, strict=True):
            _thresholds(axes, own[own["n_cameras"] == n], option)
            axes.set_title(f"{title}, {n} cameras")
            axes.set_xlabel(xlabel)
        panels[0].set_ylabel(ylabel)
    own = table[table["map"] == "registration"]
    panels = rows[2].subplots(1, len(REGISTRATION))
    for axes, (option, (title, paper)) in zip(panels, REGISTRATION.items(), strict=True):
        _registration(axes, own, option, paper)
        axes.set_title(title)
        axes.set_xlabel("outliers of 100 cameras")
    figure.supxlabel(
        "Above: probability in % that the better of two estimates, whose noise differs by 15 %, "
        "comes out better: 50 (white) is chance. Framed: the paper's value.",
        fontsize=style.SMALL,
        color=style.FAINT,
    )


def _thresholds(axes: Axes, table: pd.DataFrame, option: str) -> None:
    """Draw a row for each threshold, the largest at the top, and above them those without one."""
    values = table.pivot_table("right_order", option, "noise")
    others = [metric for metric in OTHERS if metric in set(table["metric"])]
    above = table.pivot_table("right_order", "metric", "noise").reindex(others)
    orders = pd.concat([values, above])
    labels = [*(f"{value:g}" for value in values.index), *(OTHERS[m] for m in others)]
    places = range(0, orders.shape[1], 2)
    lower = orders.columns / np.sqrt(1.15)  # of the two levels
    _heat_map(axes, orders, labels, framed=list(values.index).index(PAPER[option]))
    axes.set_xticks(places, [f"{lower[place]:.3g}" for place in places])
    axes.axhline(len(values) - 0.5, color=style.INK, lw=0.6, marker="")


def _registration(axes: Axes, table: pd.DataFrame, option: str, paper: float) -> None:
    """Draw a row for each value of an option, the others as in the paper."""
    others = pd.Series({other: value for other, (_, value) in REGISTRATION.items()}).drop(option)
    alone = table[(table[others.index] == others).all(axis=1)]
    values = alone.pivot_table("right_order", option, "n_outliers")
    refined = table[table["metric"].isin(OTHERS)].pivot_table("right_order", "metric", "n_outliers")
    orders = pd.concat([values, refined]) if option == "order" else values
    labels = [value_title(option, f"{value:g}") for value in values.index]
    labels += ["refined"] * (len(orders) - len(values))
    _heat_map(axes, orders, labels, framed=list(values.index).index(paper))
    axes.set_xticks(range(orders.shape[1]), [f"{count:g}" for count in orders.columns])
    for (row, column), value in np.ndenumerate(orders.to_numpy(dtype=float)):
        colour = "white" if value > WHITE_ABOVE else style.INK
        style.write(axes, column, row, f"{value:.0f}", colour, TIGHT)


def _heat_map(axes: Axes, orders: pd.DataFrame, labels: Sequence[str], framed: int) -> None:
    style.draw_cells(axes, orders.to_numpy(dtype=float), CHANCE, LARGEST, gap=0.6)
    axes.set_yticks(range(len(labels)), labels)
    style.without_lines(axes)
    corner, width = (-0.5, framed - 0.5), orders.shape[1]
    frame = Rectangle(corner, width, 1, fill=False, ec=style.INK, lw=0.9, clip_on=False)
    axes.add_patch(frame)


def _effects(figure: SubFigure, table: pd.DataFrame) -> None:
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


def _key(figure: SubFigure) -> None:
    handles = {
        "the paper's value": Line2D([], [], ls="", mfc=style.INK, **DOT),
        "another": Line2D([], [], ls="", mfc="white", **DOT),
        "95 % of all differences at once": Line2D([], [], color=style.INK, lw=0.6, marker=""),
        "smallest order, range of trials": Line2D([], [], ls="", color=style.FAINT, **TICK),
    }
    style.key(figure, handles, loc="outside lower center", handletextpad=0.4, columnspacing=1.6)


@style.applied()
def draw_levels(table: pd.DataFrame) -> Figure:
    """Figure: at which score to read the distance."""
    figure = Figure(figsize=(style.PAGE, 2.3), layout="constrained")
    spread, *orders = figure.subplots(1, 3)
    numbers, _ = summaries(table)
    for axes, (kind, (title, dashes)) in zip(orders, READ.items(), strict=True):
        levels = numbers[numbers.index.str.startswith(kind)].set_index("score")
        _level_orders(axes, levels.filter(like="lost"))
        axes.set_title(title)
        scatter = levels["scatter"]
        spread.plot(scatter.index, scatter, color="#1f4e79", ls=dashes, marker="o", ms=3)
        end = scatter.index[-1], scatter.iloc[-1]
        style.note(spread, title.lower(), end, (0, 4), ha="right")
    handles, labels = orders[0].get_legend_handles_labels()
    placed = {"loc": "outside right center", "title": "lost", "title_fontsize": style.SMALL}
    style.key(figure, dict(zip(labels, handles, strict=True)), ncols=1, **placed)
    orders[0].set_ylabel("right order of noise, %")
    spread.set_ylim(bottom=0)
    spread.set_title("Scatter, %")
    for axes in (*orders, spread):
        axes.set_xlabel("score at which it is read")
        axes.set_xlim(0.05, 0.95)
    return figure


def _level_orders(axes: Axes, orders: pd.DataFrame) -> None:
    """Draw a line for each number of lost cameras."""
    colours = style.colours("n_outliers", orders.shape[1])
    for name, colour, marker in zip(map(str, orders), colours, MARKERS, strict=False):
        label = "0, any noise" if "none" in name else name.replace("lost", "%")
        axes.plot(orders.index, orders[name], color=colour, marker=marker, ms=3, lw=1, label=label)
    axes.axhline(CHANCE, color=style.FAINT, lw=0.6, ls=":", marker="")
    axes.set_ylim(35, 102)
