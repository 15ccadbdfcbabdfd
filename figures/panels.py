"""Small multiples: a panel for each metric, noise along the x axis, a colour for each series.

The grey is what all series span at a noise level, the bars at the right what each spans over all
levels: the heights of both are the ranges that the paper compares.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from alignscores.arrays import Floats
from alignscores.metrics import Metric
from experiments.metrics import metric as find

from . import style
from .curves import Curves, write_value

NAMES = {  # of the settings: under an axis, and for all of their values
    "n_cameras": ("cameras", "camera counts"),
    "n_outliers": ("outliers", "outlier counts"),
    "sigma_t": (r"$\sigma_t$ (units)", r"$\sigma_t$"),
    "sigma_r_deg": (r"$\sigma_r$", r"$\sigma_r$"),
}

GROUP = 0.70  # width of the series around a noise level, in levels
GAP = 0.06  # between the noise levels and the bars at the right, as a share of the panel
STRIP = 0.36  # width of these bars, as a share of the panel: each has its label
CLOSE = 0.03  # of the height of a panel: curves that are nearer to each other share a label
HIGH = 0.9  # of the height of a panel, above which there is no room for a label
MAX_LABELS = 7  # of bars: there is room for no more


def panel(axes: Axes, curves: Curves, metric: str, *, log: bool = False) -> None:
    """Draw one metric at equal steps of the noise, so that levels of any spacing stay apart."""
    smallest, mean, largest = curves.spread(metric)
    count, n_levels = mean.shape
    levels = np.arange(n_levels)
    offsets = GROUP * ((np.arange(count) + 0.5) / count - 0.5)
    edges = _strip(curves)
    strip, step = (edges[:-1] + edges[1:]) / 2, edges[1] - edges[0]

    bottom, top = smallest.min(axis=0), largest.max(axis=0)
    axes.bar(levels, top - bottom, 0.94, bottom, color=style.GREY_BAND, zorder=0.5)
    colours = style.colours(curves.series, count)
    tints = 1 - 0.72 * (1 - np.array(colours))  # closer to the paper's white
    for j, colour in enumerate(colours):
        label = write_value(curves.series, curves.values[j])
        axes.plot(levels, mean[j], color=colour, label=label, zorder=3)
        axes.vlines(levels + offsets[j], smallest[j], largest[j], tints[j], lw=0.4)
        low, high = smallest[j].min(), largest[j].max()
        axes.bar(strip[j], high - low, 0.8 * step, low, color=colour, linewidth=0.3, zorder=2)

    kind = find(metric)
    log = log and bool(bottom.min() > 0)
    _x_axis(axes, curves, strip, edges[[0, -1]])
    _y_axis(axes, kind, float(bottom.min()), float(top.max()), log)
    _title(axes, metric, kind, log)
    _name_coinciding(axes, curves, mean)


def _name_coinciding(axes: Axes, curves: Curves, mean: Floats) -> None:
    """Label most curves that coincide at all noise levels, which a key cannot show."""
    points = np.column_stack([np.zeros(mean.size), mean.ravel()])
    to_panel = axes.transData + axes.transAxes.inverted()
    heights = to_panel.transform(points)[:, 1].reshape(mean.shape)
    groups = [
        slice(first, after)
        for first, after in combinations(range(len(mean) + 1), 2)
        if after - first > 1 and np.ptp(heights[first:after], axis=0).max() <= CLOSE
    ]
    group = max(groups, key=lambda rows: rows.stop - rows.start, default=slice(0))
    free = np.flatnonzero(heights[group].max(axis=0, initial=0.0) < HIGH)
    if group.stop and len(free):
        values = (curves.values[group.start], curves.values[group.stop - 1])
        text = " to ".join(write_value(curves.series, value) for value in values)
        at = int(free[0]), float(mean[group, free[0]].max())
        label = style.note(axes, text, at, (0, 3), color=style.INK)
        label.set_path_effects([withStroke(linewidth=1.5, foreground="white")])


def _strip(curves: Curves) -> Floats:
    """Return the edges of the bars at the right."""
    width = len(curves.ticks) / (1 - GAP - STRIP)
    end = width - 0.5
    return np.linspace(end - STRIP * width, end, len(curves.values) + 1)


def _x_axis(axes: Axes, curves: Curves, strip: Floats, ends: Floats) -> None:
    """Two axes in one: the noise levels, and beyond a gap the series."""
    last = len(curves.ticks) - 1
    axes.set_xlim(-0.65, ends[1])
    axes.spines["bottom"].set_bounds(-0.65, last + 0.5)
    line: Any = {"color": style.INK, "linewidth": 0.5, "marker": "", "clip_on": False}
    axes.plot(ends, [0, 0], transform=axes.get_xaxis_transform(), **line)
    labels = {float(i): curves.ticks[i] for i in (0, last // 2, last)}
    every = -(-len(strip) // MAX_LABELS)
    bars = [write_value(curves.series, value) for value in curves.values[::every]]
    axes.set_xticks([*labels, *strip[::every]], [*labels.values(), *bars])
    axes.set_xticks([*range(last + 1), *strip], minor=True)
    for text in axes.get_xticklabels()[len(labels) :]:
        text.set_rotation(90)


def _y_axis(axes: Axes, kind: Metric, smallest: float, largest: float, log: bool) -> None:
    """Scores from 0 to 1, so that their ranges compare from panel to panel; errors from 0."""
    if log:
        axes.set(yscale="log", ylim=(smallest / 1.3, largest * 1.2))
        subs = (1.0,) if largest > 30 * smallest else (1.0, 2.0, 5.0)
        axes.yaxis.set_major_locator(LogLocator(subs=subs, numticks=6))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.tick_params(axis="y", which="minor", size=1.2)
    else:
        axes.set_ylim(0, 1 if kind.larger_is_better else 1.04 * largest or 1)
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    unit = "°" if kind.unit == "deg" else ""
    axes.yaxis.set_major_formatter(f"{{x:g}}{unit}")


def _title(axes: Axes, metric: str, kind: Metric, log: bool) -> None:
    title = axes.set_title(metric, pad=10.5)
    remarks = (["units"] if kind.unit == "units" else []) + (["log scale"] if log else [])
    if remarks:
        style.remark(axes, title, f"({', '.join(remarks)})")
    style.direction(axes, larger_is_better=kind.larger_is_better)


def x_labels(axes: Axes, curves: Curves) -> None:
    """Name the quantities of the two x axes below a panel."""
    last = len(curves.ticks) - 1
    noise = NAMES[curves.levels[0]][0]
    if len(curves.levels) > 1:
        noise = " and ".join(NAMES[setting][1] for setting in curves.levels) + "\nrise together"
    series = NAMES[curves.series][0]
    middle = float(_strip(curves).mean())
    for x, text, lines in ((last / 2, noise, len(curves.levels)), (middle, series, 2)):
        below = 0, -4 - 7 * lines  # the labels of the ticks
        beneath: Any = {"xycoords": ("data", "axes fraction"), "ha": "center", "va": "top"}
        style.note(axes, text, (x, 0), below, fontsize=style.TEXT, linespacing=1.1, **beneath)


def new_figure(columns: int, *, head: float, foot: float = 0.26) -> Figure:
    """Return a figure with two rows of panels, and inches for keys above and labels below."""
    width, height = style.COLUMN if columns == 2 else style.PAGE, head + foot + 2 * 1.37
    layout = ConstrainedLayoutEngine(
        rect=(0, 0, 1, 1 - head / height), w_pad=0.03, h_pad=0.03, wspace=0.03, hspace=0.02
    )
    figure = Figure(figsize=(width, height), layout=layout)
    for axes in figure.subplots(2, columns)[0]:
        axes.tick_params(labelbottom=False)
    return figure


def small_multiples(curves: Curves, log: Sequence[str] = ()) -> Figure:
    """Draw a panel for each metric, some on a logarithmic axis; the bars are the key of colours."""
    columns = len(curves.metrics) // 2
    figure = new_figure(columns, head=0.21)
    for axes, metric in zip(figure.axes, curves.metrics, strict=True):
        panel(axes, curves, metric, log=metric in log)
    for axes in figure.axes[columns:]:
        x_labels(axes, curves)
    glyph_key(figure, curves, 0.04)
    return figure


def glyph_key(figure: Figure, curves: Curves, y: float, *, series: str = "") -> None:
    """Draw the key of lines and bars; `series` says what they are where panels differ in it."""
    n = curves.trials.sweep.trials
    handles: dict[str, Artist] = {
        "mean": Line2D([], [], color=style.FAINT),
        "range of 1 trial" if n == 1 else f"range of {n} trials": _stroke(0.5),
        f"of all {series or NAMES[curves.series][1]}": Patch(color=style.GREY_BAND),
        "of all noise levels": _stroke(2.2),
    }
    width, height = figure.get_size_inches()
    placed = {"loc": "upper left", "bbox_to_anchor": (0.03 / width, 1 - y / height)}
    spaced = {"handlelength": 1.2, "handletextpad": 0.4, "columnspacing": 0.6}
    style.key(figure, handles, **placed, **spaced).set_in_layout(False)


def _stroke(width: float) -> Line2D:
    return Line2D([], [], color=style.FAINT, ls="", marker="|", ms=7, mew=width)
