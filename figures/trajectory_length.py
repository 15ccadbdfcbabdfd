"""Figure 4: translation metrics against position noise, for each number of cameras."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from . import style
from .curves import Curves
from .panels import small_multiples

__all__ = ["draw"]


@style.applied()
def draw(trials: Trials) -> Figure:
    """Draw the trials of experiment ``trajectory_length``."""
    curves = Curves(trials, ("ATE", "DTE", "mAA", "TAS"), series="n_cameras")
    return small_multiples(curves, columns=2, width=style.COLUMN)
