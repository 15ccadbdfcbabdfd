"""Distance and angle, read at each score: what they order, how they scatter."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from figures import style

from .levels import Level, summaries

KINDS = {"HalfDistance": "Distance", "HalfAngle": "Angle"}
CHANCE = 50
MARKERS = "osD^vP"
DASHES = {"HalfDistance": "-", "HalfAngle": "--"}


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Figure: at which score to read the distance."""
    figure = Figure(figsize=(style.PAGE, 2.3), layout="constrained")
    spread, *orders = figure.subplots(1, 3)
    found = summaries(table)
    of = {kind: [one for one in found if one.metric.startswith(kind)] for kind in KINDS}
    for axes, (kind, title) in zip(orders, KINDS.items(), strict=True):
        _orders(axes, of[kind])
        axes.set_title(title)
    handles, labels = orders[0].get_legend_handles_labels()
    small = style.SMALL
    figure.legend(
        *(handles, labels),
        loc="outside right center",
        title="lost",
        title_fontsize=small,
        fontsize=small,
    )
    orders[0].set_ylabel("right order of noise, %")
    for kind, levels in of.items():
        spread.plot(*_points(levels, "scatter"), color="#1f4e79", ls=DASHES[kind], marker="o", ms=3)
        spread.annotate(
            KINDS[kind].lower(),
            (levels[-1].score, levels[-1].scatter),
            (0, 4),
            textcoords="offset points",
            ha="right",
            fontsize=style.SMALL,
        )
    spread.set_ylim(bottom=0)
    spread.set_title("Scatter, %")
    for axes in (*orders, spread):
        axes.set_xlabel("score at which it is read")
        axes.set_xlim(0.05, 0.95)
    return figure


def _orders(axes: Axes, levels: list[Level]) -> None:
    """Draw a line for each number of lost cameras."""
    counts = list(levels[0].noise)
    colours = style.colours("n_outliers", len(counts))
    for n, colour, marker in zip(counts, colours, MARKERS, strict=False):
        orders = [level.noise[n].order for level in levels]
        scores = [level.score for level in levels]
        axes.plot(
            scores,
            orders,
            color=colour,
            marker=marker,
            ms=3,
            lw=1,
            label=f"{n} %" if n else "0, any noise",
        )
    axes.axhline(CHANCE, color=style.FAINT, lw=0.6, ls=":", marker="")
    axes.set_ylim(35, 102)


def _points(levels: list[Level], name: str) -> tuple[list[float], list[float]]:
    return [level.score for level in levels], [getattr(level, name) for level in levels]
