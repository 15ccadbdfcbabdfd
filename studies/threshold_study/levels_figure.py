"""Distance and angle, read at each score: what they order, how they scatter."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from figures import style

from .levels import summaries

KINDS = {"HalfDistance": "Distance", "HalfAngle": "Angle"}
CHANCE = 50
MARKERS = "osD^vP"
DASHES = {"HalfDistance": "-", "HalfAngle": "--"}


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Figure: at which score to read the distance."""
    figure = Figure(figsize=(style.PAGE, 2.3), layout="constrained")
    spread, *orders = figure.subplots(1, 3)
    numbers, _ = summaries(table)
    for axes, (kind, title) in zip(orders, KINDS.items(), strict=True):
        levels = numbers[numbers.index.str.startswith(kind)].set_index("score")
        _orders(axes, levels.filter(like="lost"))
        axes.set_title(title)
        scatter = levels["scatter"]
        spread.plot(scatter.index, scatter, color="#1f4e79", ls=DASHES[kind], marker="o", ms=3)
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


def _orders(axes: Axes, orders: pd.DataFrame) -> None:
    """Draw a line for each number of lost cameras."""
    colours = style.colours("n_outliers", orders.shape[1])
    for name, colour, marker in zip(map(str, orders), colours, MARKERS, strict=False):
        label = "0, any noise" if "none" in name else name.replace("lost", "%")
        axes.plot(orders.index, orders[name], color=colour, marker=marker, ms=3, lw=1, label=label)
    axes.axhline(CHANCE, color=style.FAINT, lw=0.6, ls=":", marker="")
    axes.set_ylim(35, 102)
