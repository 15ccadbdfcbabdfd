"""Figure 4: translation metrics against position noise, for each number of cameras."""

import pandas as pd
from matplotlib.figure import Figure

from . import style
from .panels import small_multiples
from .tables import Sweep

__all__ = ["draw"]


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Draw the trials of experiment ``trajectory_length``."""
    sweep = Sweep(table, ("ATE", "DTE", "mAA", "TAS"), series="n_cameras")
    return small_multiples(sweep, columns=2, width=style.COLUMN)
