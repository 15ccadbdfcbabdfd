"""Figure 6: six metrics against noise in position and in rotation."""

import pandas as pd
from matplotlib.figure import Figure

from . import style
from .panels import small_multiples
from .tables import Sweep

__all__ = ["draw"]


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Draw the trials of experiment ``combined``."""
    sweep = Sweep(table, ("ATE", "DTE", "mAA", "TAS", "RAS", "PAS"), series="sigma_r_deg")
    return small_multiples(sweep, columns=3, width=style.PAGE)
