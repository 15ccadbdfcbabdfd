"""One look for all figures: sizes on the printed page, type, lines and colours."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Annotation, Text

from alignscores.arrays import Floats

COLUMN = 3.3  # width of a column of the paper in inches
PAGE = 6.9  # width of its text

SMALL, TEXT, TITLE = 6.0, 6.5, 7.5  # sizes of the type in points

INK = "0.15"  # text and axes
FAINT = "0.38"  # remarks
GREY_BAND = "0.935"  # what all series together span

# Dark to light in even steps of lightness, so that the order survives greyscale and colour
# blindness; another hue for each quantity. First, second and last position in the colour map: no
# outlier stands apart from one, and the light end, which would vanish on paper, is cut off.
Colour = tuple[float, float, float]
COLOURS = {
    "n_outliers": ("inferno", 0.00, 0.26, 0.77),
    "n_cameras": ("YlGnBu_r", 0.00, 0.11, 0.60),
    "sigma_r_deg": ("viridis", 0.00, 0.20, 0.80),
}
OTHER_COLOURS = ("cividis", 0.00, 0.20, 0.85)

# Neighbouring curves differ without colour: every second one is dashed.
DASH, GAP = 3.0, 1.2  # in points

TICKS = {  # on either axis
    "color": INK,
    "labelsize": SMALL,
    "major.size": 2.2,
    "major.width": 0.5,
    "major.pad": 2,
    "minor.size": 1.2,
    "minor.width": 0.4,
}
SETTINGS: dict[Any, Any] = {  # the font is Matplotlib's own, the same on every machine
    "font.size": TEXT,
    "text.color": INK,
    "axes.titlesize": TITLE,
    "axes.titlelocation": "left",
    "axes.titlepad": 4,
    "axes.labelsize": TEXT,
    "axes.labelpad": 2,
    "axes.labelcolor": INK,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": "0.86",
    "grid.linewidth": 0.35,
    "lines.linewidth": 0.8,
    "lines.scale_dashes": False,  # thin lines have the same dashes as thick ones
    "lines.solid_capstyle": "butt",
    "patch.linewidth": 0,
    **{f"{axis}tick.{key}": value for axis in "xy" for key, value in TICKS.items()},
    "ytick.minor.size": 0,
    "legend.frameon": False,
    "legend.fontsize": SMALL,
    "legend.title_fontsize": SMALL,
    "legend.borderpad": 0,
    "legend.borderaxespad": 0.5,
    "legend.handlelength": 1.2,
    "legend.handletextpad": 0.4,
    "legend.columnspacing": 1.2,
    "figure.dpi": 300,  # the layout measures text at it; smaller, hinted text is narrower
    "savefig.dpi": 300,
    "pdf.fonttype": 42,  # TrueType: text that can be searched, and that publishers accept
}


# Applies the style within a block, whatever the user's own settings.
applied = partial(matplotlib.style.context, ["default", SETTINGS])


def colours(column: str, count: int) -> list[Colour]:
    """Return a colour for each of `count` values of a key column, in their order."""
    name, first, second, last = COLOURS.get(column, OTHER_COLOURS)
    positions = [first, *np.linspace(last, second, count - 1)[::-1]]
    return [(r, g, b) for r, g, b, _ in matplotlib.colormaps[name](positions).tolist()]


def dashes(count: int) -> list[Any]:
    """Return the line style of each of `count` curves in their order."""
    return [(0, (DASH, GAP)) if j % 2 else "-" for j in range(count)]


def direction(axes: Axes, *, larger_is_better: bool) -> None:
    """Write which values are the good ones, between a panel and its title."""
    text = "↑ higher is better" if larger_is_better else "↓ lower is better"
    note(axes, text, (0, 1), (0, 3), xycoords="axes fraction", color=FAINT)


def draw_cells(axes: Axes, shares: Floats, texts: Sequence[Sequence[str]], size: float) -> None:
    """Draw a table of cells, from 0 (light) to 1 (dark), without a colour for NaN, with texts."""
    edges = (np.arange(n + 1) - 0.5 for n in shares.shape[::-1])
    lines: Any = {"edgecolor": "white", "linewidth": 0.8}
    axes.pcolormesh(*edges, shares, cmap="Blues", vmin=0, vmax=1, **lines)  # reads in greyscale
    for (row, column), share in np.ndenumerate(shares):
        colour = FAINT if np.isnan(share) else "white" if share > 0.62 else INK
        placed: Any = {"ha": "center", "va": "center_baseline", "size": size}
        axes.text(column, row, texts[row][column], color=colour, **placed)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def as_rows(axes: Axes) -> None:
    """Draw vertical grid lines only: each row has its name at the left."""
    axes.grid(visible=True, axis="x")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def remark(axes: Axes, title: Text, text: str) -> Annotation:
    """Write a remark behind a title, on its line."""
    offset = (2.5, 1.75)  # the title's box reaches below its line
    return note(axes, text, (1, 0), offset, xycoords=title, color=FAINT)


def note(
    axes: Axes, text: str, at: tuple[float, float], offset: tuple[float, float], **options: Any
) -> Annotation:
    """Write in small type at a place, some points away from it."""
    return axes.annotate(
        text, at, offset, textcoords="offset points", **{"fontsize": SMALL, **options}
    )
