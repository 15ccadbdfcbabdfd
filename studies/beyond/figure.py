"""A row for each scenario, and a column for each metric: what it orders at the least."""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.metrics import split_options
from figures import style

from .findings import LEAST_ORDER

PANELS = {  # column of the table, title, remark
    "noise_order": ("Noise", "ordered at every number of outliers"),
    "outlier_order": ("Outliers", "ordered at every noise level"),
}
PAPER = {"geometry": "cube", "error": "gaussian", "outliers": "uniform", "outlier_side": 10.0}
ROW = 0.155  # inches
TIGHT = 4.8  # size of the type in narrow columns, in points
NAMES = {"HalfDistance": "half\ndist.", "HalfAngle": "half\nangle", "Median-1": "Median\n-1"}


def draw(table: pd.DataFrame) -> Figure:
    """Figure: what each metric still orders in the scenarios of a study."""
    scenarios = table.drop_duplicates("scenario")
    size = (style.PAGE, 0.75 + ROW * len(scenarios))
    figure = Figure(figsize=size, layout="constrained")
    both = figure.subplots(1, 2, sharey=True)
    for axes, (column, (title, remark)) in zip(both, PANELS.items(), strict=True):
        orders = table.pivot(index="scenario", columns="metric", values=column)
        orders = orders.loc[scenarios["scenario"], table["metric"].unique()]
        _cells(axes, orders)
        style.remark(axes, axes.set_title(title, pad=5), remark)
    labels = [_label(row) for row in scenarios.to_dict("records")]
    both[0].set_yticks(range(len(labels)), labels)
    both[0].invert_yaxis()
    figure.supxlabel(
        "Right order of two trials at neighbouring levels, %, the smallest; 50 is chance. White, "
        "below two of three: does not order.",
        fontsize=style.SMALL,
        color=style.FAINT,
    )
    return figure


def _cells(axes: Axes, orders: pd.DataFrame) -> None:
    """Draw numbers on colours; what does not order has no colour."""
    values = orders.to_numpy(dtype=float)
    shares = np.where(values >= LEAST_ORDER, (values - 40) / 72, np.nan)
    texts = [[f"{value:.0f}" if np.isfinite(value) else "" for value in row] for row in values]
    style.draw_cells(axes, shares, texts, TIGHT)
    axes.set_xticks(range(values.shape[1]), list(map(_metric, orders.columns)))
    axes.tick_params(axis="x", top=False, labeltop=True, labelbottom=False, labelsize=TIGHT)


def _metric(metric: str) -> str:
    name, options = split_options(metric)
    return "\n".join([NAMES.get(name, name), *options.values()])


def _label(row: Mapping[Hashable, Any]) -> str:
    """Name a scenario, and the settings that are not the paper's where its name leaves them out."""
    name = str(row["scenario"])
    others = [
        f"side {row[key]:g}" if key == "outlier_side" else str(row[key])
        for key, paper in PAPER.items()
        if row[key] != paper
    ]
    left_out = ", ".join(other for other in others if other not in name)
    return (f"{name} ({left_out})" if left_out else name).replace("_", " ")
