"""Figure 7: mAA and PAS against noise in position and rotation that rises together."""

import pandas as pd
from matplotlib.figure import Figure

from . import style
from .panels import glyph_key, new_figure, panel, series_key, x_labels
from .tables import Sweep

__all__ = ["draw"]

METRICS = ("mAA", "PAS")
NOISE = ("sigma_t", "sigma_r_deg")
COLUMNS = (
    ("(a) Random poses", "by number of outliers", "n_outliers"),
    ("(b) Random poses", "by number of cameras", "n_cameras"),
    ("(c) Collinear poses", "by number of outliers", "n_outliers"),
)


@style.applied()
def draw(outliers: pd.DataFrame, length: pd.DataFrame, collinear: pd.DataFrame) -> Figure:
    """Draw the trials of experiments ``maa_vs_pas_outliers``, ``_length`` and ``_collinear``."""
    figure, grid = new_figure(len(METRICS), len(COLUMNS), width=style.PAGE, head=0.56, foot=0.46)
    columns = zip(COLUMNS, (outliers, length, collinear), strict=True)
    for i, ((heading, remark, series), table) in enumerate(columns):
        sweep = Sweep(table, METRICS, series, NOISE)
        for row, metric in zip(grid, METRICS, strict=True):
            panel(row[i], sweep, metric)
        x_labels(grid[-1][i], sweep)
        left = 0.05 + i * style.PAGE / len(COLUMNS)
        title = figure.text(
            left / style.PAGE,
            1 - 0.04 / figure.get_figheight(),
            heading,
            fontsize=style.TITLE,
            fontweight="bold",
            verticalalignment="top",
        )
        style.remark(grid[0][i], title, remark).set_in_layout(False)
        series_key(figure, sweep, left, 0.21, named=False)
    glyph_key(figure, sweep, 0.05, 0.37, series="outlier or camera counts")
    return figure
