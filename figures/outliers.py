"""Figure 2: translation metrics against position noise, for each number of outliers."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from . import style
from .curves import Curves
from .panels import small_multiples

__all__ = ["draw"]


@style.applied()
def draw(trials: Trials) -> Figure:
    """Draw the trials of experiment ``outliers``."""
    curves = Curves(trials, ("ATE", "DTE", "mAA", "TAS"), series="n_outliers")
    return small_multiples(curves, columns=2, width=style.COLUMN)
