"""Trials as curves: a panel for each metric, noise along the x axis, a colour for each curve.

Every second curve is dashed, so that neighbours differ without colour, too.

The height of a grey column is the range of all trials at a noise level, the height of a bar above
"all" the range of all trials of a colour over all noise levels: the captions of the paper compare
these ranges. On a logarithmic axis heights are ratios, so there are no bars.
"""

from collections.abc import Sequence
from math import ceil

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from alignscores.arrays import Floats
from alignscores.metrics import Metric
from experiments.command import ConfigError
from experiments.grid import CELL_SETTINGS, KEY_COLUMNS
from experiments.metrics import metric as find

from . import style

TEXTS = ("settings", "geometry", "experiment")
NAMES = {  # of the settings: above the key of colours, and below an axis
    "sigma_t": "σₜ (units)",
    "sigma_r_deg": "σᵣ",
    "n_outliers": "number of outliers",
    "n_cameras": "number of cameras",
    **{name: name for name in TEXTS},
}
ALONG_X = ("sigma_t", "sigma_r_deg", "n_outliers", "n_cameras")  # the first one that varies
IN_COLOUR = ("n_outliers", "n_cameras", "sigma_r_deg", "sigma_t", *TEXTS)

GROUP = 0.76  # width of the strokes around a level, in levels, if there are ten or more
STRIP = 0.3  # width of the bars at the right, as a share of the levels' width
THICK, THIN = 1.6, 0.5  # first and last curve in points: coinciding ones are seen as stripes
KEY = 2.6  # of the lines in the key of colours, in points
LOG = 300  # largest by smallest mean of an error, above which its axis is logarithmic
MAX_BLOCKS = 12  # combinations of the settings that have neither an axis nor colours


def draw_trials(trials: pd.DataFrame, metrics: Sequence[str] = (), heading: str = "") -> Figure:
    """Draw metrics of a table of trials against noise; by default all metrics.

    The first setting that varies runs along the x axis (noise before the numbers of outliers and of
    cameras), the next one has the colours, and each combination of the others has its own panels.
    Values that are not finite are left out; the title of the panel has their number. The heading
    stands above the key of the colours.

    Raises
    ------
    ValueError
        If a column is missing, if one has text instead of numbers, or if too many settings vary.
    """
    names = check_metrics(trials, metrics)
    x, series, others = arrange(trials)
    blocks = list(trials.groupby(others, sort=False)) if others else [((), trials)]
    if len(blocks) > MAX_BLOCKS:
        problem = f"{len(blocks)} combinations of {', '.join(others)} do not fit into one figure"
        raise ValueError(f"{problem}; keep the rows of at most {MAX_BLOCKS}")
    columns = len(names) if len(names) <= 3 else min(4, ceil(len(names) / 2))
    width = style.COLUMN if columns <= 2 else style.PAGE
    figure = new_figure(width, len(blocks) * ceil(len(names) / columns), len(blocks))
    parts = figure.subfigures(len(blocks), 1, squeeze=False)[:, 0]
    for part, (values, block) in zip(parts, blocks, strict=True):
        named = zip(others, values, strict=True)
        title = ", ".join(f"{NAMES[name]} = {write(name, value)}" for name, value in named)
        draw_block(part, block, names, columns, x, series, title or heading)
    explain_glyphs(figure, trials, x)
    return figure


def check_metrics(trials: pd.DataFrame, metrics: Sequence[str] = ()) -> list[str]:
    """Return the metrics to draw; check that they and the settings of the cells are numbers."""
    missing = [name for name in (*CELL_SETTINGS, *metrics) if name not in trials]
    if missing:
        raise ValueError(f"has no column {missing[0]}")
    names = list(metrics) or [
        str(name) for name in trials if name not in (*KEY_COLUMNS, "settings")
    ]
    if not names or trials.empty:
        raise ValueError("has no row" if names else "has no column with a metric")
    for name in (*CELL_SETTINGS, *names):
        numbers = pd.to_numeric(trials[name], errors="coerce")
        wrong = numbers.isna() & (trials[name].notna() | (name in CELL_SETTINGS))
        if wrong.any():
            raise ValueError(
                f"has {str(trials[name][wrong].iloc[0])!r} in column {name}, not a number"
            )
    return names


def arrange(trials: pd.DataFrame) -> tuple[list[str], str, list[str]]:
    """Return the settings along the x axis, the one that has the colours, and the others."""
    varying = [name for name in NAMES if name in trials and trials[name].nunique() > 1]
    first = next((name for name in ALONG_X if name in varying), ALONG_X[0])
    x = [first]
    for name in set(ALONG_X).intersection(varying) - {first}:
        pairs = trials[[first, name]].drop_duplicates()
        if pairs[first].is_unique and pairs[name].is_unique:
            x.append(name)  # rises together with the first
    left = [name for name in varying if name not in x]
    series = next(name for name in IN_COLOUR if name in (left or CELL_SETTINGS) and name not in x)
    return x, series, [name for name in left if name != series]


def new_figure(width: float, rows: int, blocks: int) -> Figure:
    """Return a figure for rows of panels in some blocks with a key each; sizes in inches."""
    height = 1.22 * rows + 0.3 * blocks + (0.35 if width == style.COLUMN else 0.22)
    layout = ConstrainedLayoutEngine(w_pad=0.03, h_pad=0.03, wspace=0.02, hspace=0.02)
    return Figure(figsize=(width, height), layout=layout)


def draw_block(
    part: SubFigure,
    trials: pd.DataFrame,
    metrics: Sequence[str],
    columns: int,
    x: Sequence[str],
    series: str,
    title: str = "",
) -> None:
    """Draw a panel for each metric, and above them the key of their colours."""
    panels = part.subplots(ceil(len(metrics) / columns), columns, squeeze=False).ravel()
    values = sorted(trials[series].unique())
    for i, metric in enumerate(metrics):
        draw_panel(panels[i], trials, metric, x, series)
        if i + columns < len(metrics):  # another panel below
            panels[i].set_xlabel("")
            panels[i].tick_params(labelbottom=False)
    for axes in panels[len(metrics) :]:
        axes.remove()
    colours, dashes = style.colours(series, len(values)), style.dashes(len(values))
    labels = [write(series, value) for value in values]
    n_characters = part.bbox.width / part.get_dpi() / 0.053 - 2
    fits = sum(len(label) + 3.6 for label in labels) <= n_characters
    part.legend(
        [Line2D([], [], c=c, ls=ls, lw=KEY) for c, ls in zip(colours, dashes, strict=True)],
        labels,
        loc="outside upper left",
        alignment="left",
        title=f"{title}: {NAMES[series]}" if title else NAMES[series],
        ncols=len(labels) if fits else max(1, int(n_characters / (3.6 + max(map(len, labels))))),
        handlelength=(2 * style.DASH + style.GAP) / style.SMALL,
        columnspacing=0.8,
    )


def draw_panel(
    axes: Axes, trials: pd.DataFrame, metric: str, x: Sequence[str], series: str
) -> None:
    """Draw a metric at equal steps of the levels, so that levels of any spacing stay apart."""
    finite = trials[np.isfinite(trials[metric])]
    values = sorted(trials[series].unique())
    levels = trials[list(x)].drop_duplicates().sort_values(x[0])
    groups = finite.groupby([series, x[0]])[metric]
    low, mean, high = (
        groups.agg(name).unstack().reindex(index=values, columns=levels[x[0]]).to_numpy(float)
        for name in ("min", "mean", "max")
    )

    positions = np.arange(len(levels))
    group = GROUP * min(1, len(levels) / 10)  # strokes of few, wide levels stay near their curve
    colours = style.colours(series, len(values))
    widths = np.linspace(THICK if len(values) > 1 else THIN, THIN, len(values))
    bottom, top = np.fmin.reduce(low), np.fmax.reduce(high)
    axes.bar(positions, top - bottom, 0.94, bottom, color=style.GREY_BAND, zorder=0.5)
    for j, (colour, dashes) in enumerate(zip(colours, style.dashes(len(values)), strict=True)):
        offset = group * ((j + 0.5) / len(values) - 0.5)
        red, green, blue = (1 - 0.65 * (1 - part) for part in colour)  # closer to white
        axes.vlines(positions + offset, low[j], high[j], (red, green, blue), linewidth=0.4)
        axes.plot(positions, mean[j], color=colour, linestyle=dashes, linewidth=widths[j])
    edges = len(levels) - 0.2 + max(STRIP * len(levels), 0.5) * np.linspace(0, 1, len(values) + 1)
    centres, width = (edges[:-1] + edges[1:]) / 2, 0.85 * (edges[1] - edges[0])
    bottom, top = np.fmin.reduce(low, axis=1), np.fmax.reduce(high, axis=1)
    describe(axes, metric, mean, float(np.fmin.reduce(bottom)), float(np.fmax.reduce(top)))

    labels = ["\n".join(map(write, x, row)) for row in levels.itertuples(index=False)]
    longest = max(len(line) for label in labels for line in label.split("\n"))
    every = ceil(len(labels) * (2 + longest) / 20)
    ticks, middle = positions[::every], centres.mean()
    if axes.get_yscale() == "linear":
        axes.bar(centres, top - bottom, width, bottom, color=colours)
        axes.set_xticks([*ticks, middle], [*labels[::every], "all"])
    else:
        axes.set_xticks(ticks, labels[::every])
    axes.set_xlim(-0.65, edges[-1])
    steps = np.diff(levels[x[0]].to_numpy(float))
    note = "" if np.allclose(steps, steps[:1]) else "\n(not to scale)"
    axes.set_xlabel(" and ".join(NAMES[name] for name in x) + note)
    if len(finite) < len(trials):
        n_missing = f"{len(trials) - len(finite)} trials without a value"
        axes.set_title(f"{axes.get_title('left')}\n({n_missing})")


def describe(axes: Axes, metric: str, mean: Floats, smallest: float, largest: float) -> None:
    """Name a metric and scale its axis: from 0 to 1 for scores, so that their ranges compare."""
    entry = _entry(metric)
    is_score, unit = (entry.larger_is_better, entry.unit) if entry else (False, "")
    lowest, highest = np.fmin.reduce(mean, axis=None), np.fmax.reduce(mean, axis=None)
    is_log = bool(not is_score and smallest > 0 and highest > LOG * lowest)
    if is_log:
        axes.set(yscale="log", ylim=(smallest / 1.3, largest * 1.2))
        axes.yaxis.set_major_locator(LogLocator(numticks=6))
        axes.yaxis.set_minor_locator(NullLocator())
    elif np.isfinite(largest):
        top = 1 if is_score and largest <= 1 else 1.04 * max(largest, 0) or 1
        axes.set_ylim(min(0, smallest), top)
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter("{x:g}°" if unit == "deg" else "{x:g}")
    arrow = "" if entry is None else " ↑" if is_score else " ↓"
    name, _, options = metric.partition("(")
    axes.set_title("\n".join([name + arrow, *options.removesuffix(")").split(", ")]).strip())
    remarks = (["units"] if unit == "units" else []) + (["log scale"] if is_log else [])
    remark = axes.set_title(", ".join(remarks), loc="right")
    remark.set(fontsize=style.SMALL, color=style.FAINT)


def _entry(metric: str) -> Metric | None:
    try:
        return find(metric)
    except ConfigError:
        return None  # a column of the user's


def write(setting: str, value: object) -> str:
    """Write a value of a setting."""
    if isinstance(value, str):
        return value or "default"
    return f"{value:g}°" if setting == "sigma_r_deg" else f"{value:g}"


def explain_glyphs(figure: Figure, trials: pd.DataFrame, x: Sequence[str]) -> None:
    """Draw the key of lines and bars below the panels."""
    cells = [*CELL_SETTINGS, *(name for name in TEXTS if name in trials)]
    n_trials = trials.groupby(cells).size().max()
    level = "noise" if x[0].startswith("sigma") else "level"
    remark = "" if all(axes.get_yscale() == "linear" for axes in figure.axes) else " (linear axes)"
    handles: dict[str, Artist] = {
        f"mean of {n_trials} trial{'s' if n_trials > 1 else ''}": Line2D([], [], color=style.FAINT),
        "their min to max": _stroke(0.5),
        f"min to max of all trials at this {level}": Patch(color=style.GREY_BAND),
        f"min to max of all trials of this colour{remark}": _stroke(2.2),
    }
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower left",
        ncols=2 if figure.get_figwidth() == style.COLUMN else 4,
    )


def _stroke(width: float) -> Line2D:
    return Line2D([], [], color=style.FAINT, ls="", marker="|", ms=7, mew=width)
