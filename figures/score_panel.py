"""One panel of figure 1: a cumulative frequency histogram and the score that is its area.

It knows nothing of the simulation: it draws any result of `alignscores.tas` or `alignscores.ras`.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

__all__ = ["score_panel"]

SHADE = "#a8c4dc"
EDGE = "#1f4e79"


def score_panel(
    axes: Axes, thresholds: ArrayLike, frequency: ArrayLike, n: int, *, name: str, score: float
) -> None:
    """Draw a cumulative frequency histogram; the shaded share of the box is the score.

    Parameters
    ----------
    axes : Axes
        Where to draw; its labels and title are left to the caller.
    thresholds : (K,) array_like
        Equally spaced error thresholds, the k-th one k times the first, in the unit of the x axis.
    frequency : (K,) array_like of int
        Number of cameras with an error below each threshold.
    n : int
        Number of cameras.
    name : str
        Name of the score.
    score : float
        Its value.
    """
    edges = np.concatenate([[0.0], np.asarray(thresholds, dtype=float)])
    axes.stairs(frequency, edges, fill=True, color=SHADE, linewidth=0)
    axes.stairs(frequency, edges, baseline=None, color=EDGE, linewidth=0.9, clip_on=False)
    axes.set(xlim=(0, edges[-1]), ylim=(0, n))
    ticks = np.asarray(MaxNLocator(5, integer=True).tick_values(0, n))
    axes.set_yticks([*ticks[ticks < 0.93 * n], n])
    axes.xaxis.set_major_formatter("{x:g}")
    axes.spines[:].set_visible(True)
    axes.grid(visible=False)

    # The curve rises: a high one leaves room below it at the right, a low one above it at the left.
    x, y, align = (0.96, 0.22, "right") if score >= 0.5 else (0.04, 0.82, "left")
    value = axes.text(x, y, f"{name} = {score:.3f}", fontsize="large", fontweight="bold")
    meaning = axes.text(x, y - 0.14, "shaded share of the box")
    for text in (value, meaning):
        text.set(transform=axes.transAxes, horizontalalignment=align)
