"""Figure 6: six metrics against noise in position and in rotation."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from . import style
from .curves import Curves
from .panels import small_multiples

__all__ = ["draw"]


@style.applied()
def draw(trials: Trials) -> Figure:
    """Draw the trials of experiment ``combined``."""
    curves = Curves(trials, ("ATE", "DTE", "mAA", "TAS", "RAS", "PAS"), series="sigma_r_deg")
    return small_multiples(curves, columns=3, width=style.PAGE)
