"""Pictures of scored estimates: cumulative frequency histograms and aligned trajectories.

Needs Matplotlib, which the extra ``plots`` brings.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray

from ..histogram import AlignmentScore
from ..pose import PASResult
from ..trajectories.association import Matches

__all__ = ["score_figure", "score_panel", "trajectory_panel"]

Floats = NDArray[np.float64]

SHADE = "#a8c4dc"
EDGE = "#1f4e79"
REFERENCE = "0.72"
OTHERS = "0.4"  # curves of the estimates that are not named
# Dark to light, so that the order survives greyscale and colour blindness, without the light end,
# which cannot be seen on white.
ERRORS = ListedColormap(colormaps["inferno"](np.linspace(0.0, 0.82, 256)))
ROWS = 4  # up to so many estimates have a row each, more share their axes
NAMED = 8  # estimates that share axes: the first so many can be told apart
LONGEST = 48  # characters of a name in the legend
# Neighbours differ in their dashes, too, for greyscale and colour blindness.
LINES: list[dict[str, Any]] = [
    {"color": ERRORS(rank / (NAMED - 1)), "linestyle": ("-", "--", "-.", ":")[rank % 4]}
    for rank in range(NAMED)
]
STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
}


def score_figure(
    scored: Mapping[str, tuple[Matches, PASResult]],
    *,
    title: str = "",
    figure: Figure | None = None,
) -> Figure:
    r"""Draw the histograms of TAS and RAS and the aligned trajectories of the estimates.

    Parameters
    ----------
    scored : mapping
        Name of each estimate -> its poses and its result.
    title : str
        Title of the whole.
    figure : Figure, optional
        Where to draw, such as one of pyplot's that is to be shown; by default a new one.

    Returns
    -------
    Figure
        Up to four estimates have a row each. More share their axes: the first eight in colour and
        in the legend, the others in grey, without a trajectory.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import pas
    >>> from alignscores.trajectories.association import match
    >>> from alignscores.trajectories.files import Trajectory
    >>> from alignscores.cli.plots import score_figure
    >>> poses = np.tile(np.eye(4), (20, 1, 1))
    >>> poses[:, :3, 3] = np.random.default_rng(0).random((20, 3))
    >>> trajectory = Trajectory(np.arange(20), poses)
    >>> matches = match(trajectory, trajectory)
    >>> figure = score_figure({"itself": (matches, pas(poses, poses))})
    >>> [axes.get_title(loc="left") for axes in figure.axes[:2]]
    ['itself\nposition errors', 'rotation errors']
    """
    with rc_context(STYLE):
        figure = Figure() if figure is None else figure
        figure.set_layout_engine("constrained")
        figure.suptitle(title, fontsize=8)
        draw = _draw_rows if len(scored) <= ROWS else _draw_together
        draw(figure, scored)
    return figure


def _draw_rows(figure: Figure, scored: Mapping[str, tuple[Matches, PASResult]]) -> None:
    """Draw a row of panels for each estimate."""
    figure.set_size_inches(10.5, 0.3 + 2.9 * len(scored))
    grid = figure.subplots(len(scored), 3, squeeze=False, width_ratios=(1, 1, 1.2))
    for (name, (matches, result)), row in zip(scored.items(), grid, strict=True):
        _histogram(row[0], "TAS", result.tas, result.tas.unit)
        _histogram(row[1], "RAS", result.ras, 1.0)
        row[0].set_title(f"{name}\nposition errors", parse_math=False)
        row[0].set(
            xlabel=f"threshold in units of d (d = {result.tas.unit:.4g})",
            ylabel="cameras below the threshold",
        )
        row[1].set(title="rotation errors", xlabel="threshold in degrees")
        trajectory_panel(row[2], matches, result)


def _draw_together(figure: Figure, scored: Mapping[str, tuple[Matches, PASResult]]) -> None:
    """Draw all estimates into one row of panels."""
    panels = figure.subplots(1, 3, width_ratios=(1, 1, 1.2))
    results = [result for _, result in scored.values()]
    _curves(panels[0], [(one.tas, one.tas.unit) for one in results])
    _curves(panels[1], [(one.ras, 1.0) for one in results])
    panels[0].set(
        title="position errors",
        xlabel="threshold in units of d",
        ylabel="share of cameras below the threshold",
    )
    panels[1].set(title="rotation errors", xlabel="threshold in degrees")

    widest, _ = max(scored.values(), key=lambda pair: len(pair[0].keys))
    view = _draw_reference(panels[2], widest)
    for line, (matches, result) in zip(LINES, scored.values(), strict=False):
        if result.tas.alignment is not None:
            points = result.tas.alignment.inverse().apply(matches.est_poses[:, :3, 3])[:, view]
            _draw_path(panels[2], points, ordered=_is_ordered(matches), linewidth=0.9, **line)
    shown = "" if len(scored) <= NAMED else f", the first {NAMED}"
    panels[2].set_title(f"aligned trajectories{shown}; grey: reference")

    handles = panels[0].get_lines()
    labels = [name if len(name) <= LONGEST else f"..{name[2 - LONGEST :]}" for name in scored]
    columns = 4 if max(map(len, labels[:NAMED])) < 28 else 2
    figure.set_size_inches(10.5, 3.5 + 0.16 * -(-len(handles) // columns))
    legend = figure.legend(
        handles,
        map(str, range(len(handles))),  # a label may begin with _, which would hide it
        loc="outside lower center",
        ncols=columns,
        handlelength=3.5,
        frameon=False,
    )
    for text, label in zip(legend.get_texts(), labels, strict=False):
        text.set(text=label, parse_math=False)
    if len(scored) > NAMED:
        legend.set_title(f"the first {NAMED} in the table; in grey {len(scored) - NAMED} others")


def _curves(axes: Axes, scores: Sequence[tuple[AlignmentScore, float]]) -> None:
    """Draw cumulative frequencies of all estimates, whose cameras may differ in number."""
    curves = []
    for score, unit in scores:
        shares = score.cumulative_frequency / len(score.errors)
        curves.append(np.column_stack([score.thresholds / unit, shares]))
    axes.set(xlim=(0, max(curve[-1, 0] for curve in curves)), ylim=(0, 1))
    others = curves[NAMED:]
    alpha = min(0.35, max(0.06, 20 / len(curves)))  # so that very many show where they are dense
    axes.add_collection(
        LineCollection(
            others,
            colors=OTHERS,
            linewidths=0.6,
            alpha=alpha,
            rasterized=len(others) > 50,
            zorder=1,
        )
    )
    for line, curve in zip(LINES, curves, strict=False):
        axes.plot(*curve.T, linewidth=1.3, clip_on=False, **line)


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

    # The curve rises: a high one leaves room at the lower right, a low one at the upper left.
    x, y, align = (0.96, 0.22, "right") if score >= 0.5 else (0.04, 0.82, "left")
    value = axes.text(x, y, f"{name} = {score:.3f}", fontsize="large", fontweight="bold")
    meaning = axes.text(x, y - 0.14, "shaded share of the box")
    for text in (value, meaning):
        text.set(transform=axes.transAxes, horizontalalignment=align)


def trajectory_panel(axes: Axes, matches: Matches, result: PASResult) -> None:
    """Draw the estimate over the reference, aligned as in the TAS and coloured by its errors.

    The view is along the axis of the reference world in which the reference is thinnest. Cameras
    with an error of d or more, which count for nothing in the TAS, are crosses.

    Parameters
    ----------
    axes : Axes
        Where to draw.
    matches : Matches
        The poses.
    result : PASResult
        Their score.
    """
    view = _draw_reference(axes, matches)
    axes.set_title("aligned trajectory")
    if result.tas.alignment is None:
        axes.text(0.5, 0.5, "could not be aligned", transform=axes.transAxes, ha="center")
        return
    aligned = result.tas.alignment.inverse().apply(matches.est_poses[:, :3, 3])
    _draw_errors(axes, aligned[:, view], result.tas.errors, result.tas.unit)


def _draw_reference(axes: Axes, matches: Matches) -> list[int]:
    """Draw the reference, on a square around it; return the two axes of the world that are seen."""
    gt = matches.gt_poses[:, :3, 3]
    view = sorted(np.argsort(np.ptp(gt, axis=0), kind="stable")[1:])
    _draw_path(axes, gt[:, view], ordered=_is_ordered(matches), color=REFERENCE, linewidth=1.2)
    # A square around the reference, so that an estimate far away does not shrink the rest.
    centre = (gt.min(axis=0) + gt.max(axis=0)) / 2
    reach = 0.55 * float(np.ptp(gt, axis=0).max()) or 1.0
    low, high = centre - reach, centre + reach
    across, up = view
    axes.set(xlim=(low[across], high[across]), xlabel="xyz"[across])
    axes.set(ylim=(low[up], high[up]), ylabel="xyz"[up])
    axes.set_aspect("equal")
    return view


def _draw_path(axes: Axes, points: Floats, *, ordered: bool, linewidth: float, **line: Any) -> None:
    """Draw positions as a line, or as dots where they come in no order, as images do."""
    if ordered:
        line["linewidth"] = linewidth
    else:
        line |= {"linestyle": "", "marker": "o", "markersize": 10 * linewidth / 3}
    axes.plot(*points.T, rasterized=len(points) > 5000, zorder=1, **line)


def _is_ordered(matches: Matches) -> bool:
    return matches.keys.dtype.kind != "U"


def _draw_errors(axes: Axes, points: Floats, errors: Floats, unit: float) -> None:
    """Draw positions coloured by their errors, with a colour bar on which d is marked."""
    finite = np.isfinite(errors)
    largest = max(unit, float(np.percentile(errors[finite], 95)))
    within = finite & (errors < unit)
    options: dict[str, Any] = {
        "cmap": ERRORS,
        "vmin": 0.0,
        "vmax": largest,
        "rasterized": len(points) > 5000,
    }
    for chosen, marker, size in ((finite & ~within, "x", 11), (within, "o", 7)):
        artist = axes.scatter(
            points[chosen, 0],
            points[chosen, 1],
            c=errors[chosen],
            marker=marker,
            s=size,
            linewidth=0.7 if marker == "x" else 0,
            **options,
        )
    figure = axes.get_figure()
    assert figure is not None
    bar = figure.colorbar(artist, ax=axes, label="position error", aspect=25)
    bar.ax.axhline(unit, color="white", linewidth=2.5)
    bar.ax.axhline(unit, color="black", linewidth=1)
    bar.ax.text(-0.3, unit, "d", ha="right", va="center", transform=bar.ax.get_yaxis_transform())
    beyond, lost = int(np.sum(finite & ~within)), int(np.sum(~finite))
    axes.set_title(f"aligned; × {beyond} of {len(errors)} off by d or more,\n{lost} not estimated")


def _histogram(axes: Axes, name: str, score: Any, unit: float) -> None:
    frequency, n = score.cumulative_frequency, len(score.errors)
    score_panel(axes, score.thresholds / unit, frequency, n, name=name, score=score.score)
