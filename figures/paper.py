"""The figures of the paper, each a function of the tables of trials that it shows.

Figure 1 is a function of the settings of its table, from which it draws one trial again.
"""

from collections.abc import Callable

import pandas as pd
from matplotlib.figure import Figure

from . import style
from .curves import arrange, check_metrics, draw_block, draw_trials, explain_glyphs, new_figure
from .histogram import histogram

__all__ = ["FIGURES", "collinear", "combined", "histogram", "maa_vs_pas", "outliers"]
__all__ += ["rotations", "trajectory_length"]

POSITIONS = ("ATE", "DTE", "mAA", "TAS")


def outliers(trials: pd.DataFrame) -> Figure:
    """Figure 2: translation metrics against position noise, for each number of outliers."""
    return draw_trials(trials, POSITIONS, "Random positions")


def collinear(trials: pd.DataFrame) -> Figure:
    """Figure 3: translation metrics on a line against noise, for each number of outliers."""
    return draw_trials(trials, POSITIONS, "Collinear positions")


def trajectory_length(trials: pd.DataFrame) -> Figure:
    """Figure 4: translation metrics against position noise, for each number of cameras."""
    return draw_trials(trials, POSITIONS, "Random positions")


def rotations(trials: pd.DataFrame) -> Figure:
    """Figure 5: rotation metrics against rotation noise, for each number of outliers."""
    after_l1 = ("Median-1", "Mean-1", "RMS-1", "DRE")
    after_l2 = ("Median-2", "Mean-2", "RMS-2", "RAS")
    figure = draw_trials(trials, after_l1 + after_l2, "Random rotations")
    for upper, lower in zip(figure.axes[:3], figure.axes[4:7], strict=True):
        top = max(upper.get_ylim()[1], lower.get_ylim()[1])
        upper.set_ylim(0, top)
        lower.set_ylim(0, top)
    return figure


def combined(trials: pd.DataFrame) -> Figure:
    """Figure 6: six metrics against noise in position and in rotation."""
    return draw_trials(trials, ("ATE", "DTE", "mAA", "TAS", "RAS", "PAS"), "Random poses")


def maa_vs_pas(outliers: pd.DataFrame, length: pd.DataFrame, collinear: pd.DataFrame) -> Figure:
    """Figure 7: mAA and PAS against noise in position and rotation that rises together."""
    figure = new_figure(style.PAGE, 2, 1)
    titles = "(a) Random poses", "(b) Random poses", "(c) Collinear poses"
    parts = figure.subfigures(1, len(titles), squeeze=False)[0]
    for part, title, trials in zip(parts, titles, (outliers, length, collinear), strict=True):
        metrics = check_metrics(trials, ("mAA", "PAS"))
        x, series, _ = arrange(trials)
        draw_block(part, trials, metrics, 1, x, series, title)
    explain_glyphs(figure, outliers, x)
    return figure


# By name: the function that draws it, and the experiments that it shows.
FIGURES: dict[str, tuple[Callable[..., Figure], tuple[str, ...]]] = {
    "histogram": (histogram, ("combined",)),
    "outliers": (outliers, ("outliers",)),
    "collinear": (collinear, ("collinear",)),
    "trajectory_length": (trajectory_length, ("trajectory_length",)),
    "rotations": (rotations, ("rotations",)),
    "combined": (combined, ("combined",)),
    "maa_vs_pas": (
        maa_vs_pas,
        ("maa_vs_pas_outliers", "maa_vs_pas_length", "maa_vs_pas_collinear"),
    ),
}
