"""The figure of a comparison: its runs, and the differences of the systems.

Needs Matplotlib, which the extra ``plots`` brings.
"""

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from ..comparison.comparison import Comparison
from ..comparison.tables import differences_of
from ..texts import distinct
from .plots import STYLE, new_figure

__all__ = ["figure_of_comparison"]

COLUMNS = 3  # panels next to each other
LONGEST = 28  # characters of a name
N_PAIRS = 24  # that are drawn
COLOUR = "#1f4e79"


def figure_of_comparison(comparison: Comparison, *, interactive: bool = False) -> Figure:
    """Draw all runs, and below them the differences of pairs of systems over all sequences.

    `interactive`: as a figure of pyplot, which it shows.
    """
    systems, pairs = comparison.overall["system"].tolist(), differences_of(comparison)[:N_PAIRS]
    sequences = comparison.distinct["sequence"].unique().tolist()
    columns = min(COLUMNS, len(sequences))
    rows = -(-len(sequences) // columns)
    heights = [0.4 + rows * (0.9 + 0.26 * len(systems))]
    if pairs:
        heights.append(1.2 + 0.26 * len(pairs))
    with rc_context(STYLE):
        figure = new_figure(interactive=interactive)
        figure.set_size_inches(10, sum(heights))
        parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
        _draw_runs(parts[0], comparison, rows, columns)
        if pairs:
            _draw_differences(parts[1], pairs, comparison.by)
    return figure


def _draw_runs(part: SubFigure, comparison: Comparison, rows: int, columns: int) -> None:
    """Draw a panel a sequence, a row a system, a dot a run; a line is the mean, a cross failed."""
    runs, by = comparison.distinct, comparison.by
    systems, sequences = comparison.overall["system"].tolist(), runs["sequence"].unique().tolist()
    panels = part.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for panel, sequence in zip(panels, sequences, strict=False):
        sequence_runs = runs[runs["sequence"] == sequence]
        rows_of_systems = sequence_runs["system"].map(systems.index)
        scored = (sequence_runs["status"] == "scored") & np.isfinite(sequence_runs[by])
        panel.plot(
            sequence_runs.loc[scored, by],
            rows_of_systems[scored],
            "o",
            color=COLOUR,
            alpha=0.6,
            ms=6,
        )
        means = sequence_runs[scored].groupby("system")[by].mean()
        panel.plot(means, means.index.map(systems.index), "k|", ms=15, mew=1.5)
        failed = (sequence_runs["status"] != "scored") & np.isfinite(sequence_runs[by])
        panel.plot(sequence_runs.loc[failed, by], rows_of_systems[failed], "x", color="k", ms=6)
        panel.set_title(sequence, parse_math=False)
        panel.grid(axis="x", alpha=0.3)
    for panel in panels[len(sequences) :]:
        panel.set_visible(False)
    _name_rows(panels[0], distinct(systems, LONGEST))
    part.supxlabel(by, fontsize="medium").set_parse_math(False)
    title = "runs; lines: means of the scored ones; crosses: failed ones"
    scales = "; each panel has its own scale" if len(sequences) > 1 else ""
    part.suptitle(title + scales, fontsize="medium")


def _draw_differences(part: SubFigure, pairs: list[dict[str, Any]], by: str) -> None:
    """Draw the difference of each pair with its interval, dashed where it is not significant."""
    axes = part.subplots()
    systems = list(dict.fromkeys(pair[name] for pair in pairs for name in "ab"))
    short = dict(zip(systems, distinct(systems, LONGEST), strict=True))
    axes.axvline(0, color="0.3", linewidth=0.8)
    for row, pair in enumerate(pairs):
        ahead, value = isinstance(pair["better"], str), pair["difference"]
        if np.isfinite(pair["low"]):
            ends, line = [pair["low"], pair["high"]], "-" if ahead else "--"
            axes.plot(ends, [row, row], line, color=COLOUR, linewidth=2 if ahead else 1)
        axes.plot(value, row, "o", color=COLOUR, ms=7, mfc=COLOUR if ahead else "white")
    _name_rows(axes, [f"{short[pair['a']]} − {short[pair['b']]}" for pair in pairs])
    right = axes.secondary_yaxis("right")  # beyond the axes, where no line is
    right.set_yticks(range(len(pairs)), [", ".join(pair["texts"]) for pair in pairs])
    axes.margins(x=0.1)
    axes.grid(axis="x", alpha=0.3)
    axes.set_xlabel(f"difference in {by}", parse_math=False)
    axes.set_title(
        "differences of means, intervals of 95 %; open, dashed: not significant or not tested"
    )


def _name_rows(axes: Axes, names: list[str]) -> None:
    """Name the rows, the first one at the top."""
    axes.set_yticks(range(len(names)), names, parse_math=False)
    axes.set_ylim(len(names) - 0.5, -0.5)
