"""Figure 5: rotation metrics against rotation noise, for each number of outliers."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from . import style
from .curves import Curves
from .panels import small_multiples

__all__ = ["draw"]

# Alignment by L1 (-1) above, by L2 (-2) below.
METRICS = ("Median-1", "Mean-1", "RMS-1", "DRE", "Median-2", "Mean-2", "RMS-2", "RAS")


@style.applied()
def draw(trials: Trials) -> Figure:
    """Draw the trials of experiment ``rotations``."""
    curves = Curves(trials, METRICS, series="n_outliers", levels=("sigma_r_deg",))
    figure = small_multiples(curves, columns=4, width=style.PAGE)
    for upper, lower in zip(figure.axes[:3], figure.axes[4:7], strict=True):
        top = max(upper.get_ylim()[1], lower.get_ylim()[1])
        upper.set_ylim(0, top)
        lower.set_ylim(0, top)
    return figure
