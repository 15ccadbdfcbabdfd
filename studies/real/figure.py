"""How often each metric orders the systems, and who agrees with whom."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from figures import style

ROW = 0.16  # inches


def draw(table: pd.DataFrame, pairs: pd.DataFrame, agreement: pd.DataFrame) -> Figure:
    """Figure: which metric orders real systems, and who agrees."""
    metrics = list(table["metric"])
    figure = Figure(figsize=(style.PAGE, 1.25 + ROW * len(metrics)), layout="constrained")
    order, agrees = figure.subplots(1, 2, width_ratios=[1.0, 1.5])
    _order(order, table, pairs)
    orders = agreement.pivot(index="metric", columns="other", values="order")
    cells = orders.loc[metrics, metrics].to_numpy()
    texts = [["" if np.isnan(value) else f"{value:.0f}" for value in row] for row in cells]
    style.draw_cells(agrees, np.clip(cells / 50 - 1, 0, 1), texts, style.SMALL - 1)
    agrees.set_xticks(range(len(metrics)), metrics, rotation=90)
    agrees.set_yticks([])
    agrees.invert_yaxis()
    agrees.set_title("Order by another metric, %")
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
