"""Pictures of scored estimates: cumulative histograms, aligned trajectories, score profiles.

Needs Matplotlib, which the extra ``plots`` brings.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike, NDArray

from .arrays import Floats
from .evaluation.evaluation import Evaluation
from .histogram import AlignmentScore
from .trajectories.association import Matches

__all__ = ["profile_panel", "score_figure", "score_panel", "trajectory_panel"]


SHADE = "#a8c4dc"
EDGE = "#1f4e79"
REFERENCE = "0.72"
OTHERS = "0.4"  # curves of the estimates that are not named
# Dark to light, so that the order survives greyscale and colour blindness, without the light end,
# which cannot be seen on white.
ERRORS = ListedColormap(colormaps["inferno"](np.linspace(0.0, 0.82, 256)))
ROWS = 4  # up to so many estimates have a row each, more share their axes
FLAT = 0.1  # a score this close to 0 or 1 tells nothing of an estimate
NAMED = 8  # estimates that share axes: the first so many can be told apart
LONGEST = 36  # characters of a name in the legend
DASHES = "-", "--", "-.", ":"
DECADES = 2.5  # on a wider axis labels at 2 and 5 would overlap
STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
}


def score_figure(
    scored: Sequence[Evaluation],
    *,
    unit: str = "m",
    title: str = "",
    figure: Figure | None = None,
) -> Figure:
    """Draw histograms of TAS and RAS, the aligned trajectories and the profiles of the estimates.

    Up to four estimates have a row each, and there is a row with the profiles of all. More share
    their axes: the first eight in colour and in the legend, the others in grey, without a
    trajectory. `unit` is the reference's unit of length; `figure` may be one that is to be shown.
    """
    with rc_context(STYLE):
        figure = Figure() if figure is None else figure
        figure.set_layout_engine("constrained")
        figure.suptitle(title, fontsize=8)
        rows = len(scored) if len(scored) <= ROWS else 1
        figure.set_size_inches(10.5, 0.3 + 2.9 * (rows + 1))
        grid = figure.subplots(rows + 1, 3, width_ratios=(1, 1, 1.2))
        if len(scored) <= ROWS:
            _draw_rows(grid[:-1], scored)
        else:
            _draw_together(grid[0], scored)
        _draw_profiles(grid[-1], scored, unit)
    return figure


def _draw_rows(grid: NDArray[np.object_], scored: Sequence[Evaluation]) -> None:
    """Draw a row of panels for each estimate."""
    for evaluation, row in zip(scored, grid, strict=True):
        result = evaluation.result
        _histogram(row[0], "TAS", result.tas, result.tas.unit)
        _histogram(row[1], "RAS", result.ras, 1.0)
        row[0].set_title(f"{evaluation.name}\nposition errors", parse_math=False)
        row[0].set(
            xlabel=f"threshold in units of d (d = {result.tas.unit:.4g})",
            ylabel="cameras below the threshold",
        )
        row[1].set(title="rotation errors", xlabel="threshold in degrees")
        trajectory_panel(row[2], evaluation)


def _draw_together(panels: NDArray[np.object_], scored: Sequence[Evaluation]) -> None:
    """Draw all estimates into one row of panels."""
    results = [evaluation.result for evaluation in scored]
    for axes, curves in (
        (panels[0], [_frequency(result.tas, result.tas.unit) for result in results]),
        (panels[1], [_frequency(result.ras, 1.0) for result in results]),
    ):
        axes.set(xlim=(0, max(curve[-1, 0] for curve in curves)), ylim=(0, 1))
        _curves(axes, curves)
    panels[0].set(
        title="position errors",
        xlabel="threshold in units of d",
        ylabel="share of cameras below the threshold",
    )
    panels[1].set(title="rotation errors", xlabel="threshold in degrees")

    all_matches = [evaluation.matches for evaluation in scored]
    view = _draw_reference(panels[2], max(all_matches, key=lambda matches: len(matches.keys)))
    for line, evaluation in zip(_lines(len(scored)), scored, strict=False):
        if evaluation.result.tas.alignment is not None:
            ordered = _is_ordered(evaluation.matches)
            points = evaluation.positions[:, view]
            _draw_path(panels[2], points, ordered=ordered, linewidth=0.9, **line)
    shown = "" if len(scored) <= NAMED else f", the first {NAMED}"
    panels[2].set_title(f"aligned trajectories{shown};\ngrey: reference")


def _draw_profiles(panels: NDArray[np.object_], scored: Sequence[Evaluation], unit: str) -> None:
    """Draw the profiles of all estimates, and what their lines are."""
    profiles = [evaluation.profiles for evaluation in scored]
    distances = [evaluation.half_distance for evaluation in scored]
    angles = [evaluation.half_angle for evaluation in scored]
    tas, ras = zip(*profiles, strict=True)
    profile_panel(panels[0], tas[0].units, [profile.scores for profile in tas], distances)
    profile_panel(panels[1], ras[0].units, [profile.scores for profile in ras], angles)
    panels[0].set(
        title="TAS over its threshold",
        xlabel=f"largest threshold in {unit} (refined registration)",
        ylabel="score; dots: half-score distances",
    )
    panels[1].set(
        title="RAS over its threshold",
        xlabel="largest threshold in degrees",
        ylabel="score; dots: half-score angles",
    )
    panels[2].axis("off")
    handles = panels[0].get_lines()[: len(scored[:NAMED])]
    legend = panels[2].legend(
        handles,
        map(str, range(len(handles))),  # a label may begin with _, which would hide it
        loc="center left",
        handlelength=3.5,
        labelspacing=0.8,
        frameon=False,
        alignment="left",
    )
    for text, evaluation in zip(legend.get_texts(), scored, strict=False):
        name = evaluation.name
        name = name if len(name) <= LONGEST else f"..{name[2 - LONGEST :]}"
        halves = f"half: {evaluation.half_distance:.4g} {unit}, {evaluation.half_angle:.4g} deg"
        text.set(text=f"{name}\n{halves.replace('inf', '-')}", parse_math=False)
    if len(scored) > NAMED:
        legend.set_title(f"the first {NAMED} in the table; in grey {len(scored) - NAMED} others")


def profile_panel(
    axes: Axes, units: Floats, scores: Sequence[Floats], halves: Sequence[float]
) -> None:
    """Draw the scores of estimates at all units; dots are where they are one half.

    Units at which all scores are about 0, or all about 1, are left out.
    """
    low, high = np.min(scores, axis=0), np.max(scores, axis=0)
    telling = np.flatnonzero((high > FLAT) & (low < 1 - FLAT))
    if len(telling):
        shown = slice(max(telling[0] - 1, 0), telling[-1] + 2)
        units, scores = units[shown], [values[shown] for values in scores]
    _curves(axes, [np.column_stack([units, values]) for values in scores])
    axes.axhline(0.5, color="0.5", linewidth=0.8, zorder=0.5)
    for line, half in zip(_lines(len(halves)), halves, strict=False):
        if units[0] <= half <= units[-1]:
            axes.plot(half, 0.5, "o", color=line["color"], markersize=4)
    axes.set(xscale="log", xlim=(units[0], units[-1]), ylim=(0, 1))
    # By default, over little more than a decade, the ticks between have labels that overlap.
    wide = units[-1] > 10**DECADES * units[0]
    axes.xaxis.set_major_locator(LogLocator(subs=(1,) if wide else (1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _lines(n: int) -> list[dict[str, Any]]:
    """Return the lines of the estimates that are named.

    They share the colours evenly. Neighbours differ in their dashes, too, for greyscale and colour
    blindness.
    """
    named = min(n, NAMED)
    shares = np.linspace(0, 1, named)
    return [
        {"color": ERRORS(share), "linestyle": DASHES[rank % len(DASHES)]}
        for rank, share in enumerate(shares.tolist())
    ]


def _frequency(score: AlignmentScore, unit: float) -> Floats:
    """Return the share of the cameras below each threshold; estimates may differ in cameras."""
    shares = score.cumulative_frequency / len(score.errors)
    return np.column_stack([score.thresholds / unit, shares])


def _curves(axes: Axes, curves: Sequence[Floats]) -> None:
    """Draw the curves of all estimates, the first ones so that they can be told apart."""
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
    for line, curve in zip(_lines(len(curves)), curves, strict=False):
        axes.plot(*curve.T, linewidth=1.3, clip_on=False, **line)


def score_panel(
    axes: Axes, thresholds: ArrayLike, frequency: ArrayLike, n: int, *, name: str, score: float
) -> None:
    """Draw a cumulative frequency histogram of n cameras; the shaded share of the box is the score.

    The thresholds are equally spaced, the k-th one k times the first.
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


def trajectory_panel(axes: Axes, evaluation: Evaluation) -> None:
    """Draw the estimate over the reference, aligned as in the TAS and coloured by its errors.

    The view is along the axis of the reference world in which the reference is thinnest. Cameras
    with an error of d or more, which count for nothing in the TAS, are crosses.
    """
    view, tas = _draw_reference(axes, evaluation.matches), evaluation.result.tas
    axes.set_title("aligned trajectory")
    if tas.alignment is None:
        axes.text(0.5, 0.5, "could not be aligned", transform=axes.transAxes, ha="center")
        return
    _draw_errors(axes, evaluation.positions[:, view], tas.errors, tas.unit)


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
