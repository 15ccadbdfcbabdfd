"""How often each metric orders the systems, who agrees with whom, and what moves each metric."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from alignscores.arrays import Floats
from figures import style

ROW = 0.16  # inches


@style.applied()
def draw(table: pd.DataFrame, pairs: pd.DataFrame, agreement: pd.DataFrame) -> Figure:
    """Figure: which metric orders real systems, who agrees, and what moves each."""
    metrics = list(table["metric"])
    changes = [str(name) for name in table if str(name).startswith("moves_")]
    widths = [1.2, 1.35, *([0.9] if changes else [])]
    figure = Figure(figsize=(style.PAGE, 1.25 + ROW * len(metrics)), layout="constrained")
    order, agrees, *moves = figure.subplots(1, len(widths), width_ratios=widths)
    _order(order, table, pairs)
    orders = agreement.pivot(index="metric", columns="other", values="order")
    shares = orders.loc[metrics, metrics].to_numpy() / 50 - 1
    _cells(agrees, shares, [[""] * len(metrics)] * len(metrics), metrics)
    style.remark(agrees, agrees.set_title("Order by another metric"), "(dark: 100 %)")
    if changes:
        names = [name.removeprefix("moves_").replace("_", " ") for name in changes]
        moved = table[changes].to_numpy()
        _cells(moves[0], moved / 2, [[f"{value:.1f}" for value in row] for row in moved], names)
        style.remark(moves[0], moves[0].set_title("Moved by"), "(sd of runs)")
    return figure


def _order(axes: Axes, table: pd.DataFrame, pairs: pd.DataFrame) -> None:
    """Draw a row for each metric: the order of each pair of systems, and the means."""
    rows = pd.Series(range(len(table)), table["metric"])
    axes.plot(pairs["order"], pairs["metric"].map(rows), ls="", marker="|", ms=5, color="0.6")
    dot: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.6, "mec": style.INK, "mew": 0.7}
    if "equal_order" in table:
        axes.plot(table["equal_order"], rows, mfc="white", label="one pose a second", **dot)
    axes.plot(table["order"], rows, mfc=style.INK, label="mean", **dot)
    axes.set_xlim(48, 102)
    axes.set_yticks(rows, list(rows.index))
    axes.set_ylim(len(table) - 0.5, -0.5)
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.12), ncols=2, fontsize=style.SMALL)
    style.as_rows(axes)
    style.remark(axes, axes.set_title("Order, %"), "(line: a pair of systems)")


def _cells(axes: Axes, shares: Floats, texts: list[list[str]], names: list[str]) -> None:
    style.draw_cells(axes, np.clip(shares, 0, 1), texts, style.SMALL - 1)
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_yticks([])
    axes.invert_yaxis()
