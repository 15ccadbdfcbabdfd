"""What each metric still orders in the scenarios of a study: ``python -m figures.beyond``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.command import run_command
from experiments.config import split_metric
from experiments.findings import DISCERNS, findings_path
from experiments.scenarios import BEYOND, load_study
from experiments.tables import read_csv

from . import paths, style
from .output import write_figure

__all__ = ["draw", "main"]

PANELS = {  # column of the table, title, remark
    "noise_power": ("Noise", "ordered at every number of outliers"),
    "outlier_power": ("Outliers", "ordered at every noise level"),
}
COLUMNS = ["scenario", "geometry", "error", "outliers", "outlier_side", "metric", *PANELS]
PAPER = {"geometry": "cube", "error": "gaussian", "outliers": "uniform"}
SIDE = 10.0
COLOURS = "Blues"  # light to dark, so that it reads in greyscale
LARGEST = 1.15  # value of the darkest colour: tau stays below 0.9, since levels repeat
WHITE_ABOVE = 0.68  # the text
ROW = 0.155  # inches
TIGHT = 5.5  # size of the type in narrow columns, in points


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Draw a table of findings: a row for each scenario, a column for each metric, twice."""
    scenarios = table.drop_duplicates("scenario")
    size = (style.PAGE, 0.75 + ROW * len(scenarios))
    figure = Figure(figsize=size, layout="constrained")
    both = figure.subplots(1, 2, sharey=True)
    for axes, (column, (title, remark)) in zip(both, PANELS.items(), strict=True):
        powers = table.pivot(index="scenario", columns="metric", values=column)
        powers = powers.loc[scenarios["scenario"], table["metric"].unique()]
        _heat_map(axes, powers)
        style.remark(axes, axes.set_title(title, pad=5), remark)
    labels = [_label(row) for row in scenarios.to_dict("records")]
    both[0].set_yticks(range(len(labels)), labels)
    both[0].invert_yaxis()
    figure.supxlabel(
        f"Smallest Kendall τ, positive where the metric gets worse;  × below {DISCERNS:g}: "
        "does not order.",
        fontsize=style.SMALL,
        color=style.FAINT,
    )
    return figure


def _heat_map(axes: Axes, powers: pd.DataFrame) -> None:
    """Draw numbers on colours; what does not discern has a cross and no colour."""
    values = powers.to_numpy(dtype=float)
    shown = np.where(values >= DISCERNS, values, np.nan)
    axes.pcolormesh(
        np.arange(values.shape[1] + 1) - 0.5,
        np.arange(values.shape[0] + 1) - 0.5,
        shown,
        cmap=COLOURS,
        vmin=0,
        vmax=LARGEST,
        edgecolor="white",
        linewidth=0.8,
    )
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            orders = value >= DISCERNS
            number = f"{round(value, 2) + 0:.2f}".replace("-", "−").replace("0.", ".")
            colour = "white" if value > WHITE_ABOVE else style.INK
            axes.text(
                column,
                row,
                number if orders else f"×\N{THIN SPACE}{number}",
                color=colour,
                size=TIGHT,
                ha="center",
                va="center_baseline",
            )
    axes.set_xticks(range(values.shape[1]), list(map(_metric, powers.columns)))
    axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False)
    axes.tick_params(axis="x", labelsize=TIGHT)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _metric(metric: str) -> str:
    """Write a metric, the values of its options below it."""
    name, options = split_metric(metric)
    return "\n".join([name, *map(str, options.values())])


def _label(row: Mapping[Hashable, Any]) -> str:
    """Name a scenario, with what its name does not tell of the setting."""
    name = str(row["scenario"])
    others = [str(row[key]) for key, usual in PAPER.items() if row[key] != usual]
    others += [f"side {row['outlier_side']:g}"] if row["outlier_side"] != SIDE else []
    untold = ", ".join(other for other in others if other not in name)
    return (f"{name} ({untold})" if untold else name).replace("_", " ")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/figures/<study>`` and ``paths``, PDF and PNG; return the exit code."""
    parser = ArgumentParser(
        prog="python -m figures.beyond",
        description="Draw the findings of a study, and the paths that there are.",
        epilog="settings are those that the scenarios were run with",
    )
    parser.add_argument("--scenarios", type=Path, default=BEYOND, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    study = load_study(options.scenarios, options.overrides)
    drawn = {
        study.name: (draw(read_csv(findings_path(study), usecols=COLUMNS)), __doc__),
        "paths": (paths.draw(), paths.__doc__),
    }
    directory = Path(study.results_dir) / "figures"
    return [
        path
        for name, (figure, text) in drawn.items()
        for path in write_figure(figure, directory / name, (text or name).partition("\n")[0])
    ]


if __name__ == "__main__":
    sys.exit(main())
