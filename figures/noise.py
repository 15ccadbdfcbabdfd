"""Figures 2 to 6: metrics against noise, a curve for each number of outliers or the like."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from .curves import Curves
from .panels import small_multiples

POSITIONS = ("ATE", "DTE", "mAA", "TAS")
# Alignment by L1 (-1) above, by L2 (-2) below.
ROTATIONS = ("Median-1", "Mean-1", "RMS-1", "DRE", "Median-2", "Mean-2", "RMS-2", "RAS")


def outliers(trials: Trials) -> Figure:
    """Figure 2: translation metrics against position noise, for each number of outliers."""
    return small_multiples(Curves(trials, POSITIONS, series="n_outliers"))


def collinear(trials: Trials) -> Figure:
    """Figure 3: translation metrics of collinear cameras against position noise, for outliers."""
    # One outlier multiplies ATE and DTE by a hundred: the curves without any would lie on the axis.
    return small_multiples(Curves(trials, POSITIONS, series="n_outliers"), log=("ATE", "DTE"))


def trajectory_length(trials: Trials) -> Figure:
    """Figure 4: translation metrics against position noise, for each number of cameras."""
    return small_multiples(Curves(trials, POSITIONS, series="n_cameras"))


def rotations(trials: Trials) -> Figure:
    """Figure 5: rotation metrics against rotation noise, for each number of outliers."""
    figure = small_multiples(Curves(trials, ROTATIONS, "n_outliers", levels=("sigma_r_deg",)))
    for upper, lower in zip(figure.axes[:3], figure.axes[4:7], strict=True):
        top = max(upper.get_ylim()[1], lower.get_ylim()[1])
        upper.set_ylim(0, top)
        lower.set_ylim(0, top)
    return figure


def combined(trials: Trials) -> Figure:
    """Figure 6: six metrics against noise in position and in rotation."""
    curves = Curves(trials, ("ATE", "DTE", "mAA", "TAS", "RAS", "PAS"), series="sigma_r_deg")
    return small_multiples(curves)
