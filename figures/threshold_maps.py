"""How well thresholds and registrations order noise, at each size of the noise."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from studies.parameters.axes import value_title

from . import style

__all__ = ["COLUMNS", "draw"]

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
COLUMNS = (
    *("map", "geometry", "n_cameras", "n_outliers", "noise", "metric", "right_order"),
    *(*PAPER, *REGISTRATION),
)
CHANCE, LARGEST = 50.0, 112.0  # values of the lightest and the darkest colour
WHITE_ABOVE = 88  # the text
TIGHT = 5.0  # points


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Draw maps of the threshold over the noise, and those of the registration over outliers.

    Parameters
    ----------
    table : DataFrame
        What `studies.parameters.maps.compare` returns.
    """
    figure = Figure(figsize=(style.PAGE, 5.9), layout="constrained")
    rows = np.ravel(np.asarray(figure.subfigures(3, 1, height_ratios=[1.15, 1.0, 0.72])))
    for part, (name, (option, title, xlabel, ylabel)) in zip(
        rows, THRESHOLDS.items(), strict=False
    ):
        own = table[table["map"] == name]
        counts = sorted(own["n_cameras"].unique())
        for place, (axes, n) in enumerate(
            zip(np.atleast_1d(part.subplots(1, len(counts), sharey=True)), counts, strict=True)
        ):
            _thresholds(axes, own[own["n_cameras"] == n], option)
            axes.set_title(f"{title}, {n} cameras")
            axes.set_xlabel(xlabel)
            if place == 0:
                axes.set_ylabel(ylabel)
    own = table[table["map"] == "registration"]
    for axes, (option, (title, paper)) in zip(
        rows[2].subplots(1, len(REGISTRATION)), REGISTRATION.items(), strict=True
    ):
        _registration(axes, own, option, paper)
        axes.set_title(title)
        axes.set_xlabel("outliers of 100 cameras")
    figure.supxlabel(
        "Probability in % that the better of two estimates, whose noise differs by 15 %, comes out "
        "better: 50 (white) is chance. Framed: the paper's value.",
        fontsize=style.SMALL,
        color=style.FAINT,
    )
    return figure


def _thresholds(axes: Axes, table: pd.DataFrame, option: str) -> None:
    """Draw a row for each threshold, the largest at the top, and above them those without one."""
    values = table.dropna(subset=[option]).pivot_table("right_order", option, "noise")
    others = [metric for metric in OTHERS if metric in set(table["metric"])]
    above = table[table["metric"].isin(others)].pivot_table("right_order", "metric", "noise")
    orders = pd.concat([values, above.reindex(others)])
    labels = [*(f"{value:g}" for value in values.index), *(OTHERS[m] for m in others)]
    places = range(0, orders.shape[1], 2)
    lower = orders.columns / np.sqrt(1.15)  # of the two levels
    _heat_map(axes, orders, labels, [f"{noise:.3g}" for noise in lower])
    axes.set_xticks(places, [f"{lower[place]:.3g}" for place in places])
    _frame(axes, list(values.index).index(PAPER[option]), orders.shape[1])
    axes.axhline(len(values) - 0.5, color=style.INK, lw=0.6, marker="")


def _registration(axes: Axes, table: pd.DataFrame, option: str, paper: float) -> None:
    """Draw a row for each value of an option, the others as in the paper."""
    alone = table.dropna(subset=[option])
    for other, (_, value) in REGISTRATION.items():
        if other != option:
            alone = alone[alone[other] == value]
    values = alone.pivot_table("right_order", option, "n_outliers")
    refined = table[table["metric"].isin(OTHERS)].pivot_table("right_order", "metric", "n_outliers")
    orders = pd.concat([values, refined]) if option == "order" else values
    labels = [value_title(option, f"{value:g}") for value in values.index]
    labels += ["refined"] * (len(orders) - len(values))
    _heat_map(axes, orders, labels, [f"{count:g}" for count in orders.columns], numbers=True)
    _frame(axes, list(values.index).index(paper), orders.shape[1])


def _heat_map(
    axes: Axes,
    orders: pd.DataFrame,
    labels: Sequence[str],
    columns: Sequence[str],
    *,
    numbers: bool = False,
) -> None:
    values = orders.to_numpy(dtype=float)
    style.draw_cells(axes, values, CHANCE, LARGEST, gap=0.6)
    for (row, column), value in np.ndenumerate(values) if numbers else ():
        colour = "white" if value > WHITE_ABOVE else style.INK
        style.write(axes, column, row, f"{value:.0f}", colour, TIGHT)
    axes.set_yticks(range(len(labels)), labels)
    axes.set_xticks(range(len(columns)), columns)
    style.without_lines(axes)


def _frame(axes: Axes, row: int, width: int) -> None:
    """Frame the paper's value."""
    axes.add_patch(
        Rectangle((-0.5, row - 0.5), width, 1, fill=False, ec=style.INK, lw=0.9, clip_on=False)
    )
