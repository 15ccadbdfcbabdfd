"""The runs as a picture: a panel a sequence, a row a system, a dot a run."""

import warnings
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ..extras import require
from .comparison import Comparison

__all__ = ["figure_of", "picture"]

COLUMNS = 3  # panels next to each other


def figure_of(found: Comparison) -> Any:
    """Return a figure of Matplotlib with all scored runs, and the mean of each system."""
    figures = require("matplotlib.figure", "plots")
    runs, systems = found.distinct, found.overall["system"].tolist()
    sequences = runs["sequence"].unique().tolist()
    columns = min(COLUMNS, len(sequences))
    rows = -(-len(sequences) // columns)
    size = 0.4 + 3.2 * columns, rows * (0.9 + 0.28 * len(systems))
    figure = figures.Figure(figsize=size, layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for panel, sequence in zip(panels, sequences, strict=False):
        own = runs[(runs["sequence"] == sequence) & np.isfinite(runs[found.by])]
        own = own[own["status"] == "scored"]
        panel.plot(own[found.by], own["system"].map(systems.index), "o", alpha=0.5, ms=5)
        means = own.groupby("system")[found.by].mean()
        panel.plot(means, means.index.map(systems.index), "k|", ms=14)
        panel.set_title(sequence.replace("$", r"\$"), fontsize="medium")
        panel.grid(axis="x", alpha=0.3)
    for panel in panels[len(sequences) :]:
        panel.set_visible(False)
    names = [name.replace("$", r"\$") for name in systems]
    panels[0].set_yticks(range(len(systems)), names)
    panels[0].set_ylim(len(systems) - 0.5, -0.5)
    figure.supxlabel(found.by, fontsize="medium")
    return figure


def picture(found: Comparison, path: Path) -> bytes:
    """Return the figure in the format of the file's suffix."""
    buffer = BytesIO()
    figure = figure_of(found)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # of names in letters that the font lacks
        figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    return buffer.getvalue()
