"""Figure 3: translation metrics of collinear cameras against position noise, for outliers."""

import pandas as pd
from matplotlib.figure import Figure

from . import style
from .panels import small_multiples
from .tables import Sweep

__all__ = ["draw"]


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Draw the trials of experiment ``collinear``."""
    sweep = Sweep(table, ("ATE", "DTE", "mAA", "TAS"), series="n_outliers")
    # One outlier multiplies ATE and DTE by a hundred: the curves without any would lie on the axis.
    return small_multiples(sweep, columns=2, width=style.COLUMN, log=("ATE", "DTE"))
