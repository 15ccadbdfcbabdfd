"""Figure 3: translation metrics of collinear cameras against position noise, for outliers."""

from matplotlib.figure import Figure

from experiments.tables import Trials

from . import style
from .curves import Curves
from .panels import small_multiples

__all__ = ["draw"]


@style.applied()
def draw(trials: Trials) -> Figure:
    """Draw the trials of experiment ``collinear``."""
    curves = Curves(trials, ("ATE", "DTE", "mAA", "TAS"), series="n_outliers")
    # One outlier multiplies ATE and DTE by a hundred: the curves without any would lie on the axis.
    return small_multiples(curves, columns=2, width=style.COLUMN, log=("ATE", "DTE"))
