"""Figure 7, from the experiments ``maa_vs_pas_outliers``, ``_length`` and ``_collinear``."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from . import style
from .curves import Curves
from .panels import glyph_key, new_figure, panel, x_labels

METRICS = ("mAA", "PAS")
NOISE = ("sigma_t", "sigma_r_deg")
COLUMNS = (
    ("(a) Random poses", "by number of outliers", "n_outliers"),
    ("(b) Random poses", "by number of cameras", "n_cameras"),
    ("(c) Collinear poses", "by number of outliers", "n_outliers"),
)


def draw(outliers: Trials, length: Trials, collinear: Trials) -> Figure:
    """Figure 7: mAA and PAS against noise in position and rotation that rises together."""
    figure = new_figure(len(COLUMNS), head=0.4, foot=0.46)
    columns = zip(COLUMNS, (outliers, length, collinear), strict=True)
    for i, ((heading, remark, series), trials) in enumerate(columns):
        curves = Curves(trials, METRICS, series, NOISE)
        top, bottom = figure.axes[i :: len(COLUMNS)]
        for axes, metric in zip((top, bottom), METRICS, strict=True):
            panel(axes, curves, metric)
        x_labels(bottom, curves)
        left = 0.05 + i * style.PAGE / len(COLUMNS)
        corner = left / style.PAGE, 1 - 0.04 / figure.get_figheight()
        title = figure.text(*corner, heading, size=style.TITLE, weight="bold", va="top")
        style.remark(top, title, remark).set_in_layout(False)
    glyph_key(figure, curves, 0.22, series="outlier or camera counts")
    return figure
