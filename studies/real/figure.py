"""Runs that each metric needs, who agrees with whom, and what moves each metric."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from alignscores.arrays import Floats
from figures import style

MOST = 100  # where more than 50 runs are drawn
ROW = 0.16  # inches
MEDIAN, PAIR = "#173f67", "#d9822b"


@style.applied()
def draw(table: pd.DataFrame, pairs: pd.DataFrame, agreement: pd.DataFrame) -> Figure:
    """Figure: which metric tells real systems apart, who agrees, and what moves each."""
    metrics = list(table["metric"])
    changes = [str(name) for name in table if str(name).startswith("moves_")]
    widths = [1.2, 1.35, *([0.9] if changes else [])]
    size = (style.PAGE, 1.25 + ROW * len(metrics))
    figure = Figure(figsize=size, layout="constrained")
    needs, agrees, *moves = figure.subplots(1, len(widths), width_ratios=widths)
    _needs(needs, table, pairs)
    orders = agreement.pivot(index="metric", columns="other", values="order")
    _cells(agrees, orders.loc[metrics, metrics].to_numpy(), metrics, (50, 100))
    style.remark(agrees, agrees.set_title("Order by another metric"), "(dark: always)")
    if changes:
        names = [name.removeprefix("moves_").replace("_", " ") for name in changes]
        _cells(moves[0], table[changes].to_numpy(), names, (0, 2), "{:.1f}")
        style.remark(moves[0], moves[0].set_title("Moved by"), "(sd of runs)")
    return figure


def _needs(axes: Axes, table: pd.DataFrame, pairs: pd.DataFrame) -> None:
    """Draw a row for each metric: the runs that tell each pair of systems, and the median."""
    rows = pd.Series(range(len(table)), table["metric"])
    needed, places = pairs["runs"].clip(upper=MOST), pairs["metric"].map(rows)
    axes.plot(needed, places, ls="", marker="|", ms=4.5, color=PAIR, mew=0.8)
    axes.plot(table["runs"].clip(upper=MOST), rows, ls="", marker="o", ms=3.6, color=MEDIAN)
    axes.set_xscale("log")
    axes.set_xlim(1.7, 1.3 * MOST)
    axes.set_xticks([2, 5, 10, 50, MOST], ["2", "5", "10", "50", "more"])
    axes.set_yticks(rows, list(rows.index))
    axes.set_ylim(len(table) - 0.5, -0.5)
    style.as_rows(axes)
    style.remark(axes, axes.set_title("Runs needed"), "(dot: median)")


def _cells(
    axes: Axes, values: Floats, names: list[str], ends: tuple[float, float], form: str = ""
) -> None:
    """Draw a table of numbers, the darker the larger."""
    low, high = ends
    shade = matplotlib.colormaps[style.CELLS]
    share = np.clip((np.nan_to_num(values, nan=low, posinf=high) - low) / (high - low), 0, 1)
    axes.imshow(shade(0.05 + 0.85 * share), aspect="auto")
    for (y, x), value in np.ndenumerate(values if form else np.empty((0, 0))):
        text = form.format(value) if np.isfinite(value) else "–"
        style.write(axes, x, y, text, "white" if share[y, x] > 0.6 else style.INK, style.SMALL - 1)
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_yticks([])
    style.without_lines(axes)
