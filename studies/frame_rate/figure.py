"""Two metrics over the frame rate, and the order of all metrics within and across rates."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.metrics import Column
from figures import style

__all__ = ["draw"]

CURVES = ("TAS", "HalfDistance")  # drawn over the frame rates, of one scenario
SCENARIO = "car"
SHADES = ("#0b2a4a", "#1f4e79", "#3a78ae", "#5f9fd0", "#8cc0e4")  # dark: little noise
ONE_RATE, ACROSS = "#173f67", "#d9822b"


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Figure: what the frame rate does to each metric."""
    figure = Figure(figsize=(style.PAGE, 2.15), layout="constrained")
    *curves, right = figure.subplots(1, 3, width_ratios=[1, 1, 1.25])
    scenario = SCENARIO if (table["scenario"] == SCENARIO).any() else table["scenario"].iloc[0]
    for axes, metric in zip(curves, CURVES, strict=True):
        _over_rates(axes, table[(table["scenario"] == scenario) & (table["metric"] == metric)])
        name = style.metric_name(metric)
        style.remark(axes, axes.set_title(name[0].upper() + name[1:]), f"({scenario})")
    _orders(right, table.drop_duplicates(["scenario", "metric"]))
    return figure


def _over_rates(axes: Axes, table: pd.DataFrame) -> None:
    means = table.pivot(index="every", columns="sigma_t", values="mean")
    step = max(1, len(SHADES) // max(1, len(means.columns)))
    for shade, (sigma, values) in zip(SHADES[::step], means.items(), strict=False):
        axes.plot(range(len(values)), values, color=shade, ms=4)
        axes.annotate(
            rf"$\sigma_t$ {sigma:g}",
            (0, values.iloc[0]),
            (-5, 0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=style.SMALL,
            color=style.FAINT,
        )
    axes.set_xticks(range(len(means)), [f"{k}" for k in means.index])
    axes.set_xlim(-1.4, len(means) - 0.8)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("every k-th camera is kept")
    if Column.parse(str(table["metric"].iloc[0])).metric.family.larger_is_better:
        axes.set_ylim(0, 1)


def _orders(axes: Axes, table: pd.DataFrame) -> None:
    """Draw a row for each metric: how often the better estimate wins, within and across rates."""
    orders = table.groupby("metric", sort=False)[["order", "order_across"]].mean()
    rows = range(len(orders))
    for row, (same, across) in zip(rows, orders.to_numpy(), strict=True):
        axes.plot([across, same], [row, row], color="0.8", lw=1.6, marker="", zorder=1)
    for column, colour, marker, label in (
        ("order", ONE_RATE, "o", "at one frame rate"),
        ("order_across", ACROSS, "D", "at different ones"),
    ):
        axes.plot(orders[column], rows, color=colour, ls="", marker=marker, ms=3.6, label=label)
    axes.set_yticks(rows, [style.metric_name(metric) for metric in orders.index])
    axes.invert_yaxis()
    axes.set_xlim(min(50, orders.to_numpy().min() - 2), 101)
    style.as_rows(axes)
    axes.set_xlabel("better of two estimates comes out better, %")
    axes.set_title("Order of two estimates")
    axes.legend(loc="upper left", fontsize=style.SMALL, handletextpad=0.2)
