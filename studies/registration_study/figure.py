"""The scores over the seeds on fixed inputs, and below how well they order the noise."""

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from figures import style

from .registrations import GEOMETRIES, ORDER

COLOURS = {"pcr99": "#d9822b", "refined": "#173f67"}  # far apart in lightness, too
NAMES = {"pcr99": "the paper's registration (PCR-99)", "refined": "refined"}
PARTS = {  # whose order is drawn: title, setting along the x axis and its label
    "outliers": ("Cube", "n_outliers", "outliers"),
    "collinear": ("Line", "n_outliers", "outliers"),
    "trajectory_length": ("Cube", "n_cameras", "cameras"),
}
APART = 0.16  # of the registrations, in inputs
SPREAD = ["mean", "smallest", "largest"]


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Figure: the paper's registration and the refined one, spread over seeds and right order."""
    inputs = table[table["statistic"].isin(SPREAD)]
    geometries, counts = inputs["geometry"].unique(), sorted(inputs["n_cameras"].unique())
    columns = max(len(counts), len(PARTS))
    rows = len(geometries) + 1
    figure = Figure(figsize=(style.PAGE, 0.3 + 1.45 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for row, geometry in zip(grid, geometries, strict=False):
        where = GEOMETRIES.get(geometry, geometry).capitalize()
        for axes, n in zip(row, counts, strict=False):
            chosen = inputs[(inputs["geometry"] == geometry) & (inputs["n_cameras"] == n)]
            _scores(axes, chosen, f"{where}, {n:g} cameras")
    orders = table[table["statistic"] == f"{ORDER}noise, %"]
    lowest = 0.98 * float(orders[list(COLOURS)].to_numpy(dtype=float).min(initial=100.0))
    for axes, (part, (title, setting, label)) in zip(grid[-1], PARTS.items(), strict=False):
        chosen = orders[orders["part"] == part].sort_values(setting)
        if not chosen.empty:
            _orders(axes, chosen, setting, lowest)
            axes.set_title(f"{title}: right order of noise, %")
            axes.set_xlabel(label)
    for axes in grid.flat:
        if not axes.has_data():
            axes.set_axis_off()
    _key(figure)
    return figure


def _scores(axes: Axes, table: pd.DataFrame, title: str) -> None:
    """Draw the scores of each input: a dot at the mean, a bar from the smallest to the largest."""
    scenes = table.set_index(["sigma_t", "n_outliers", "trial", "statistic"])
    wide = scenes[list(COLOURS)].unstack()
    ticks = []
    for place, ((_, outliers, _), row) in enumerate(wide.iterrows()):
        for shift, (name, colour) in zip((-APART, APART), COLOURS.items(), strict=True):
            mean, low, high = (row[name, statistic] for statistic in SPREAD)
            x = place + shift
            axes.plot([x, x], [low, high], color=colour, lw=2.2, marker="")
            axes.plot(x, mean, color=colour, ls="", marker="_", ms=4.5, mew=1.0)
        ticks.append(f"{outliers:g}")
    levels = wide.index.get_level_values("sigma_t")
    for sigma in levels.unique():
        places = [i for i, level in enumerate(levels) if level == sigma]
        top: Any = {"xycoords": ("data", "axes fraction"), "ha": "center", "va": "top"}
        middle = sum(places) / len(places), 0.98
        style.note(axes, rf"$\sigma_t$ {sigma:g}", middle, (0, 0), color=style.FAINT, **top)
        if places[0]:
            axes.axvline(places[0] - 0.5, color="0.75", lw=0.5, marker="")
    axes.set_xticks(range(len(ticks)), ticks)
    axes.set_ylim(0, 1)
    axes.set_xlim(-0.6, len(ticks) - 0.4)
    axes.set_xlabel("outliers")
    style.remark(axes, axes.set_title(title), "(TAS)")


def _orders(axes: Axes, table: pd.DataFrame, setting: str, lowest: float) -> None:
    for name, colour in COLOURS.items():
        axes.plot(range(len(table)), table[name], color=colour, ms=5)
    axes.set_xticks(range(len(table)), [f"{value:g}" for value in table[setting]])
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylim(lowest, 100)


def _key(figure: Figure) -> None:
    both = {NAMES[name]: Line2D([], [], color=c, lw=2.2, marker="") for name, c in COLOURS.items()}
    mark = Line2D([], [], color=style.FAINT, ls="", marker="_", ms=6)
    handles = {**both, "mean over seeds, and from the smallest to the largest": mark}
    style.key(figure, handles, loc="outside upper center", borderaxespad=0.4)
