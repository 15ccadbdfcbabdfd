"""Three metrics over the frame rate, and the order of all metrics within and across rates."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.metrics import Column
from figures import style

CURVES = (  # drawn over the frame rates, of one scenario, with equal registration
    "TAS(registration=refined)",
    "HalfDistance",
    "HalfDistance(score=0.25)",
)
SCENARIO = "car"
SHADES = ("#0b2a4a", "#1f4e79", "#3a78ae", "#5f9fd0", "#8cc0e4")  # dark: little noise
ORDERS = ["order", "order_across"]
ONE_RATE, ACROSS = "#173f67", "#d9822b"


@style.applied()
def draw(table: pd.DataFrame, means: pd.DataFrame) -> Figure:
    """Figure: what the frame rate does to each metric."""
    figure = Figure(figsize=(style.PAGE, 4.2), layout="constrained")
    upper, lower = np.ravel(np.asarray(figure.subfigures(2, 1, height_ratios=[1, 1.1])))
    scenario = SCENARIO if (means["scenario"] == SCENARIO).any() else means["scenario"].iloc[0]
    shown = means[(means["scenario"] == scenario) & (means["lost"] == means["lost"].min())]
    for axes, metric in zip(upper.subplots(1, len(CURVES)), CURVES, strict=True):
        _over_rates(axes, shown[shown["metric"] == metric])
        name = style.metric_name(metric)
        style.remark(axes, axes.set_title(name[0].upper() + name[1:]), f"({scenario})")
    step = table["step"].min()
    shares = list(table[table["step"] == step].groupby("lost"))
    panels = np.ravel(lower.subplots(1, len(shares), sharey=True, sharex=True))
    for axes, (lost, group) in zip(panels, shares, strict=True):
        _orders(axes, group)
        axes.set_title(f"{lost:g} % lost")
    panels[0].set_xlim(min(40, table[ORDERS].to_numpy().min() - 2), 101)
    handles, labels = panels[0].get_legend_handles_labels()
    style.key(lower, dict(zip(labels, handles, strict=True)), loc="outside upper right")
    lower.supxlabel(
        f"better of two estimates, whose noise differs by {step} %, comes out better, %",
        fontsize=style.TEXT,
    )
    return figure


def _over_rates(axes: Axes, table: pd.DataFrame) -> None:
    means = table.pivot(index="every", columns="sigma_t", values="mean")
    step = max(1, len(SHADES) // max(1, len(means.columns)))
    for shade, (sigma, values) in zip(SHADES[::step], means.items(), strict=False):
        axes.plot(range(len(values)), values, color=shade, ms=4)
        label, end = rf"$\sigma_t$ {sigma:g}", (0.0, values.iloc[0])
        style.note(axes, label, end, (-5, 0), ha="right", va="center", color=style.FAINT)
    axes.set_xticks(range(len(means)), [f"{k}" for k in means.index])
    axes.set_xlim(-1.4, len(means) - 0.8)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("every k-th camera is kept")
    if Column.parse(str(table["metric"].iloc[0])).metric.family.larger_is_better:
        axes.set_ylim(0, 1)


def _orders(axes: Axes, table: pd.DataFrame) -> None:
    """Draw a row for each metric: how often the better estimate wins, within and across rates."""
    orders = table.groupby("metric", sort=False)[ORDERS].mean()
    rows = range(len(orders))
    for row, (same, across) in zip(rows, orders.to_numpy(), strict=True):
        axes.plot([across, same], [row, row], color="0.8", lw=1.6, marker="", zorder=1)
    for column, colour, marker, label in (
        ("order", ONE_RATE, "o", "at one frame rate"),
        ("order_across", ACROSS, "D", "at different ones"),
    ):
        axes.plot(orders[column], rows, color=colour, ls="", marker=marker, ms=3.6, label=label)
    axes.set_yticks(rows, [style.metric_name(metric) for metric in orders.index])
    axes.set_ylim(len(orders) - 0.5, -0.5)
    style.as_rows(axes)
