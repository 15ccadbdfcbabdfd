"""Figures of scored estimates: errors and poses over time, trajectories, and scores.

Needs Matplotlib, which the extra ``plots`` brings.
"""

from collections.abc import Callable, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import colormaps, pyplot, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from .arrays import Floats
from .evaluation.evaluation import PLOT_MODES, Evaluation
from .evaluation.time import breaks
from .texts import shortened
from .validation import finite_rows

__all__ = ["KINDS", "figure_of", "score_panel"]

SHADE = "#a8c4dc"
EDGE = "#1f4e79"
REFERENCE = {"color": "0.65", "linestyle": "-"}
OTHERS = {"color": "0.4", "linestyle": "-", "alpha": 0.3}  # estimates that are not named
NAMED = 8  # estimates that have a colour and a name
LONGEST = 40  # characters of a name in a legend
DASHES = "-", "--", "-.", ":"
# Dark to light, so that the order survives greyscale and colour blindness, without the light end,
# which cannot be seen on white.
ERRORS = ListedColormap(colormaps["inferno"](np.linspace(0.0, 0.82, 256)))
STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
}


def figure_of(
    scored: Sequence[Evaluation],
    kinds: Sequence[str] = (),
    *,
    plot_mode: str | None = None,
    interactive: bool = False,
) -> Figure:
    """Draw estimates of one reference; by default all `KINDS`, below each other.

    `plot_mode` is one of `PLOT_MODES`, by default the two longest axes. `interactive`: as a figure
    of pyplot, which it shows.
    """
    if unknown := set(kinds) - set(KINDS):
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {unknown.pop()!r}")
    if plot_mode not in (None, *PLOT_MODES):
        raise ValueError(f"plot_mode must be one of {', '.join(PLOT_MODES)}, not {plot_mode!r}")
    kinds = kinds or list(KINDS)
    heights = [KINDS[kind][1] for kind in kinds]
    with rc_context(STYLE):
        figure = pyplot.figure() if interactive else Figure()
        figure.set_layout_engine("constrained")
        figure.set_size_inches(9, sum(heights))
        parts = figure.subfigures(len(kinds), 1, height_ratios=heights, squeeze=False)
        for kind, part in zip(kinds, parts[:, 0], strict=True):
            KINDS[kind][0](part, scored, plot_mode)
            if len(scored) > 1:
                _add_legend(part, scored)
    return figure


def _draw_errors(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw the errors over time on logarithmic axes; the time without a pose is shaded."""
    panels = part.subplots(2, 1, sharex=True)
    for axes, name, label in (
        (panels[0], "tas", f"position error [{scored[0].settings.form.unit}]"),
        (panels[1], "ras", "rotation error [deg]"),
    ):
        axes.set(yscale="log", ylabel=label)
        for line, evaluation in zip(_lines(scored), scored, strict=True):
            errors = evaluation.over_expected(getattr(evaluation.result, name).errors, np.inf)
            shown = np.where(np.isfinite(errors) & (errors > 0), errors, np.nan)
            _draw_line(axes, evaluation, evaluation.times, shown, line)
            _shade(axes, evaluation, ~np.isfinite(errors), line["color"])
        largest = getattr(scored[0].result, name).thresholds[-1]
        axes.axhline(largest, color="0.3", linewidth=0.7, linestyle=":")
        transform = axes.get_yaxis_transform()
        axes.text(1, largest, "largest threshold ", transform=transform, ha="right", va="top")
    panels[0].set_title("errors over time; shaded: lost")
    panels[1].set_xlabel(scored[0].time_label)


def _shade(axes: Axes, evaluation: Evaluation, lost: NDArray[np.bool_], colour: Any) -> None:
    """Shade the time of lost frames."""
    times = evaluation.times
    edges = np.concatenate([times[:1], (times[:-1] + times[1:]) / 2, times[-1:]])
    both, where = np.repeat(edges, 2)[1:-1], np.repeat(lost, 2)
    style: dict[str, Any] = {"color": colour, "alpha": 0.15, "linewidth": 0}
    axes.fill_between(both, 0, 1, where, transform=axes.get_xaxis_transform(), **style)


def _draw_trajectories(part: SubFigure, scored: Sequence[Evaluation], mode: str | None) -> None:
    """Draw the aligned trajectories: a single one coloured by its error, several by estimate."""
    reference = scored[0].reference.poses[scored[0].matches.expected_rows, :3, 3]
    longest = sorted(np.argsort(np.ptp(reference, axis=0), kind="stable")[1:])
    view = ["xyz".index(axis) for axis in mode] if mode else longest
    unit = scored[0].settings.form.unit
    axes = part.subplots(subplot_kw={"projection": "3d"} if len(view) == 3 else {})
    _draw_path(axes, scored[0], reference[:, view], REFERENCE)
    # A cube around the reference, so that an estimate far away does not shrink the rest.
    centre = (reference.min(axis=0) + reference.max(axis=0)) / 2
    reach = 0.55 * float(np.ptp(reference, axis=0).max()) or 1.0
    for name, axis in zip("xyz", view, strict=False):
        limits = centre[axis] - reach, centre[axis] + reach
        axes.set(**{f"{name}lim": limits, f"{name}label": f"{'xyz'[axis]} [{unit}]"})
    axes.set_aspect("equal")
    axes.set_title("aligned trajectories; grey: reference")
    if len(scored) > 1:
        for line, evaluation in zip(_lines(scored), scored, strict=True):
            _draw_path(axes, evaluation, evaluation.positions[:, view], line)
        return
    errors, d = scored[0].result.tas.errors, scored[0].result.tas.unit
    finite = np.isfinite(errors)
    largest = max(d, np.percentile(errors[finite], 95)) if finite.any() else d
    style: dict[str, Any] = {"c": errors[finite], "s": 6, "cmap": ERRORS, "linewidth": 0}
    where = scored[0].positions[finite][:, view]
    points = axes.scatter(*where.T, vmin=0, vmax=largest, **style)
    label = f"position error [{unit}]; line: d"
    bar = part.colorbar(points, ax=axes, label=label, extend="max", aspect=30)
    bar.ax.axhline(d, color="white", linewidth=2)


def _draw_time(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw x, y, z and roll, pitch, yaw over time, each in the alignment of its score."""
    panels = part.subplots(3, 2, sharex=True)
    first, unit = scored[0], scored[0].settings.form.unit
    poses = first.reference.poses[first.matches.expected_rows]
    coordinates = _coordinates(poses[:, :3, 3], poses[:, :3, :3])
    drawn = [(first, first.times, coordinates, {**REFERENCE, "linewidth": 2})]
    for line, one in zip(_lines(scored), scored, strict=True):
        alignment, rotations = one.result.ras.alignment, one.matches.est_poses[:, :3, :3]
        turned = rotations * np.nan if alignment is None else alignment.T @ rotations
        coordinates = one.over_expected(_coordinates(one.positions, turned), np.nan)
        drawn.append((one, _pose_times(one), coordinates, line))
    names = f"x [{unit}]", f"y [{unit}]", f"z [{unit}]", "roll [deg]", "pitch [deg]", "yaw [deg]"
    for k, (axes, name) in enumerate(zip(panels.T.flat, names, strict=True)):
        axes.set_ylabel(name)
        for evaluation, times, values, line in drawn:
            jump = 180 if k >= 3 else np.inf  # from 180 to -180 degrees
            _draw_line(axes, evaluation, times, values[:, k], line, jump=jump)
    panels[0, 0].set_title("positions over time; grey: reference")
    panels[0, 1].set_title("angles over time; grey: reference")
    for axes in panels[2]:
        axes.set_xlabel(first.time_label)


def _coordinates(positions: Floats, rotations: Floats) -> Floats:
    """Return x, y, z, and roll, pitch, yaw in degrees; NaN for rotations that are not finite."""
    angles = np.full((len(rotations), 3), np.nan)
    finite = finite_rows(rotations)
    if finite.any():
        angles[finite] = Rotation.from_matrix(rotations[finite]).as_euler("xyz", degrees=True)
    return np.column_stack([positions, angles])


def _draw_scores(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw the share of frames below each threshold; the area is the score."""
    panels = part.subplots(1, 2)
    unit = scored[0].settings.form.unit
    for axes, word, name in zip(panels, (unit, "deg"), ("TAS", "RAS"), strict=True):
        results = [one.result.tas if name == "TAS" else one.result.ras for one in scored]
        axes.set_xlabel(f"threshold [{word}]")
        if len(results) == 1:
            (only,) = results
            n, frequency = len(only.errors), only.cumulative_frequency
            score_panel(axes, only.thresholds, frequency, n, name=name, score=only.score)
            axes.set_ylabel("frames below the threshold")
            continue
        for line, result in zip(_lines(scored), results, strict=True):
            shares = result.cumulative_frequency / len(result.errors)
            axes.plot(result.thresholds, shares, clip_on=False, linewidth=1.3, **line)
        axes.set(title=name, xlim=(0, None), ylim=(0, 1), ylabel="share of frames below")


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


def _lines(scored: Sequence[Evaluation]) -> list[dict[str, Any]]:
    """Return the styles of estimates: colours and dashes for the first, grey for the others."""
    colours = ERRORS(np.linspace(0.15, 0.85, min(len(scored), NAMED)))
    named = [{"color": one, "linestyle": dash} for one, dash in zip(colours, cycle(DASHES))]
    return [*named, *[OTHERS] * (len(scored) - NAMED)]


def _pose_times(evaluation: Evaluation) -> NDArray[Any]:
    """Return the times of the poses that the expected frames take, NaN where they are lost."""
    keys, rows = evaluation.estimate.keys, evaluation.matches.est_rows
    if keys.dtype.kind != "f":
        return evaluation.times
    times = np.where(rows < 0, np.nan, keys[rows] - evaluation.reference.keys[0])
    return evaluation.over_expected(times, np.nan)


def _draw_line(
    axes: Axes,
    evaluation: Evaluation,
    times: NDArray[Any],
    values: Floats,
    line: dict[str, Any],
    *,
    jump: float = np.inf,
) -> None:
    """Draw values over time, with a break at gaps of the reference and jumps."""
    jumps = np.flatnonzero(np.abs(np.diff(values)) > jump) + 1
    ends = np.union1d(breaks(evaluation.times), jumps)
    points = np.column_stack([times.astype(float), values])
    _draw_path(axes, evaluation, np.insert(points, ends, np.nan, axis=0), line)


def _draw_path(axes: Axes, evaluation: Evaluation, points: Floats, line: dict[str, Any]) -> None:
    """Draw points as a line, or as dots where they have no order, as images."""
    if not evaluation.settings.form.ordered:
        line = {**line, "linestyle": "", "marker": "o", "markersize": 3}
    axes.plot(*points.T, **{"linewidth": 1.0, **line})


def _add_legend(part: SubFigure, scored: Sequence[Evaluation]) -> None:
    """Name the first estimates next to the panels."""
    handles = [Line2D([], [], linewidth=1.3, **line) for line in _lines(scored)[:NAMED]]
    numbers = map(str, range(len(handles)))
    legend = part.legend(handles, numbers, loc="outside right upper", handlelength=3)
    for text, one in zip(legend.get_texts(), scored, strict=False):
        # Set later, since a label that begins with _ would be hidden.
        text.set(text=shortened(one.name, LONGEST), parse_math=False)
    if len(scored) > NAMED:
        legend.set_title(f"grey: {len(scored) - NAMED} others")


KINDS: dict[str, tuple[Callable[..., None], float]] = {  # how each is drawn, and its height
    "errors": (_draw_errors, 3.6),
    "trajectory": (_draw_trajectories, 4.6),
    "time": (_draw_time, 5.0),
    "scores": (_draw_scores, 2.8),
}
