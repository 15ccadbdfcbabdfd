"""100 cameras of each path from above, with the directions that they look in."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.scenes import PATHS
from figures import style

NAMES = {
    "random_walk": "steps in random directions",
    "orbit": "looking at the centre",
    "helix": "from the side: round a tower",
    "survey": "looking down, line by line",
    "car": "looking ahead",
    "uneven": "clusters, the fuller the denser",
}
N_CAMERAS = 100
ABOVE = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])  # what is seen of each axis
SIDE = np.array([[1.0, 0.0], [0.0, 0.6], [0.0, 1.0]])
VIEW = 0.05  # length of a viewing direction, as a share of the view
SEED = 1


@style.applied()
def draw() -> Figure:
    """Figure: the camera paths that the paper leaves out, seen from above."""
    figure = Figure(figsize=(style.PAGE, 4.7), layout="constrained")
    for axes, (name, remark) in zip(figure.subplots(2, 3).flat, NAMES.items(), strict=True):
        _view(axes, name)
        style.remark(axes, axes.set_title(name), remark)
    return figure


def _view(axes: Axes, name: str) -> None:
    rotations, positions = PATHS[name](np.random.default_rng(SEED), N_CAMERAS, 1.0)
    seen = SIDE if name == "helix" else ABOVE
    x, y = (positions @ seen).T
    look_x, look_y = VIEW * max(np.ptp(x), np.ptp(y)) * (rotations[:, :, 2] @ seen).T
    axes.plot([x, x + look_x], [y, y + look_y], color="0.6", linewidth=0.5, marker="")
    line = "" if name == "uneven" else "-"
    axes.plot(x, y, color=style.INK, linestyle=line, linewidth=0.4, marker=".", markersize=2.5)
    axes.plot(x[0], y[0], color=style.INK, marker="o", markersize=4, fillstyle="none")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(visible=False)
    axes.locator_params(nbins=5, min_n_ticks=3)
