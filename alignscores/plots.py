"""Figures of scored estimates: errors and poses over time, trajectories, and scores.

Needs Matplotlib, which the extra ``plots`` brings.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps, pyplot, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from .arrays import Floats
from .evaluation.evaluation import Evaluation
from .pages.charts import breaks
from .pages.estimates import over_expected
from .texts import shortened
from .validation import finite_rows

__all__ = ["KINDS", "MODES", "figure_of", "score_panel"]

MODES = "xy", "xz", "yz", "xyz"
SHADE = "#a8c4dc"
EDGE = "#1f4e79"
REFERENCE = "0.65"
OTHERS = "0.4"  # colour of estimates that are not named
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
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
}


def figure_of(
    scored: Sequence[Evaluation],
    kinds: Sequence[str] = (),
    *,
    plot_mode: str | None = None,
    interactive: bool = False,
) -> Figure:
    """Draw estimates of one reference; by default all `KINDS`, below each other.

    `plot_mode` is one of `MODES`, by default the two longest axes. `interactive`: as a figure of
    pyplot, which it shows.
    """
    if unknown := set(kinds) - set(KINDS):
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {unknown.pop()!r}")
    if plot_mode not in (None, *MODES):
        raise ValueError(f"plot_mode must be one of {', '.join(MODES)}, not {plot_mode!r}")
    kinds = kinds or list(KINDS)
    heights = [KINDS[kind][1] for kind in kinds]
    with rc_context(STYLE):
        figure = pyplot.figure() if interactive else Figure()
        figure.set_layout_engine("constrained")
        figure.set_size_inches(9, sum(heights))
        parts = figure.subfigures(len(kinds), 1, height_ratios=heights, squeeze=False)
        for kind, part in zip(kinds, parts[:, 0], strict=True):
            KINDS[kind][0](part, scored, plot_mode)
    return figure


def _draw_errors(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw the errors over time on logarithmic axes; the time without a pose is shaded."""
    panels = part.subplots(2, 1, sharex=True)
    first, unit = scored[0], scored[0].settings.form.unit
    for name, axes, label in (
        ("tas", panels[0], f"position error [{unit}]"),
        ("ras", panels[1], "rotation error [deg]"),
    ):
        for line, evaluation in zip(_lines(len(scored)), scored, strict=True):
            result = getattr(evaluation.result, name)
            errors = over_expected(evaluation, result.errors, np.inf)
            shown = np.where(np.isfinite(errors) & (errors > 0), errors, np.nan)
            _draw_line(axes, evaluation, shown, line)
            _shade(axes, evaluation, ~np.isfinite(errors), line["color"])
        largest = getattr(first.result, name).thresholds[-1]
        errors = np.concatenate([getattr(one.result, name).errors for one in scored])
        ends = [largest, *errors[np.isfinite(errors) & (errors > 0)]]
        axes.set(yscale="log", ylabel=label, ylim=(min(ends) / 1.5, max(ends) * 1.5))
        axes.axhline(largest, color="0.3", linewidth=0.7, linestyle=":")
        transform = axes.get_yaxis_transform()
        axes.text(1, largest, "largest threshold ", transform=transform, ha="right", va="top")
    panels[0].set_title("errors over time; shaded: lost")
    panels[1].set_xlabel(_time_label(first))
    _add_legend(panels[0], scored)


def _shade(axes: Axes, evaluation: Evaluation, lost: NDArray[np.bool_], colour: Any) -> None:
    """Shade the time of lost frames; images have no time between them."""
    if not evaluation.settings.form.ordered:
        return
    times, rows = _times(evaluation), np.flatnonzero(lost)
    half = float(np.median(np.diff(times))) / 2
    apart = np.flatnonzero((np.diff(rows) > 1) | np.isin(rows[1:], breaks(times))) + 1
    spans = [
        (times[run[0]] - half, times[run[-1]] - times[run[0]] + 2 * half)
        for run in np.split(rows, apart)
        if len(run)
    ]
    transform = axes.get_xaxis_transform()
    axes.broken_barh(spans, (0, 1), transform=transform, color=colour, alpha=0.15, linewidth=0)


def _draw_trajectories(part: SubFigure, scored: Sequence[Evaluation], mode: str | None) -> None:
    """Draw the aligned trajectories: a single one coloured by its error, several by estimate."""
    reference = scored[0].reference.poses[scored[0].matches.expected_rows, :3, 3]
    if mode is None:
        view = sorted(np.argsort(np.ptp(reference, axis=0), kind="stable")[1:])
    else:
        view = ["xyz".index(axis) for axis in mode]
    unit = scored[0].settings.form.unit
    axes = part.subplots(subplot_kw={"projection": "3d"} if len(view) == 3 else {})
    grey = {"color": REFERENCE, "linestyle": "-"}
    _draw_path(axes, scored[0], reference[:, view], grey)
    # A cube around the reference, so that an estimate far away does not shrink the rest.
    centre = (reference.min(axis=0) + reference.max(axis=0)) / 2
    reach = 0.55 * float(np.ptp(reference, axis=0).max()) or 1.0
    for name, axis in zip("xyz", view, strict=False):
        limits = centre[axis] - reach, centre[axis] + reach
        axes.set(**{f"{name}lim": limits, f"{name}label": f"{'xyz'[axis]} [{unit}]"})
    axes.set_aspect("equal")
    axes.set_title("aligned trajectories; grey: reference")
    if len(scored) > 1:
        for line, evaluation in zip(_lines(len(scored)), scored, strict=True):
            _draw_path(axes, evaluation, evaluation.positions[:, view], line)
        _add_legend(axes, scored)
        return
    errors, d = scored[0].result.tas.errors, scored[0].result.tas.unit
    finite = np.isfinite(errors)
    style: dict[str, Any] = {"s": 6, "cmap": ERRORS, "linewidth": 0, "c": errors[finite]}
    points = axes.scatter(
        *scored[0].positions[finite][:, view].T,
        vmin=0,
        vmax=max(d, float(np.percentile(errors[finite], 95))) if finite.any() else d,
        rasterized=len(errors) > 5000,
        **style,
    )
    label = f"position error [{unit}]; line: d"
    bar = part.colorbar(points, ax=axes, label=label, extend="max", aspect=30)
    bar.ax.axhline(d, color="white", linewidth=2.5)
    bar.ax.axhline(d, color="black", linewidth=1)


def _draw_time(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw x, y, z and roll, pitch, yaw over time, each in the alignment of its score."""
    panels = part.subplots(3, 2, sharex=True)
    first = scored[0]
    reference = first.reference.poses[first.matches.expected_rows]
    positions, angles = reference[:, :3, 3], _angles(reference[:, :3, :3])
    grey = {"color": REFERENCE, "linestyle": "-", "linewidth": 2}
    for k, name in enumerate(("roll", "pitch", "yaw")):
        panels[k, 0].set_ylabel(f"{'xyz'[k]} [{first.settings.form.unit}]")
        panels[k, 1].set_ylabel(f"{name} [deg]")
        _draw_line(panels[k, 0], first, positions[:, k], grey)
        _draw_line(panels[k, 1], first, angles[:, k], grey, jump=180)
    for line, evaluation in zip(_lines(len(scored)), scored, strict=True):
        points = over_expected(evaluation, evaluation.positions, np.nan)
        turned = over_expected(evaluation, _aligned_angles(evaluation), np.nan)
        times = _pose_times(evaluation)
        for k in range(3):
            _draw_line(panels[k, 0], evaluation, points[:, k], line, times=times)
            _draw_line(panels[k, 1], evaluation, turned[:, k], line, times=times, jump=180)
    panels[0, 0].set_title("positions over time; grey: reference")
    panels[0, 1].set_title("angles over time; grey: reference")
    for axes in panels[2]:
        axes.set_xlabel(_time_label(first))
    _add_legend(panels[0, 0], scored)


def _angles(rotations: Floats) -> Floats:
    """Return roll, pitch and yaw in degrees, NaN for rotations that are not finite."""
    angles = np.full((len(rotations), 3), np.nan)
    finite = finite_rows(rotations)
    if finite.any():
        angles[finite] = Rotation.from_matrix(rotations[finite]).as_euler("xyz", degrees=True)
    return angles


def _aligned_angles(evaluation: Evaluation) -> Floats:
    """Return the angles of the estimated rotations under the alignment of the RAS."""
    rotations = evaluation.matches.est_poses[:, :3, :3]
    if evaluation.result.ras.alignment is None:
        return np.full((len(rotations), 3), np.nan)
    return _angles(evaluation.result.ras.alignment.T @ rotations)


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
        for line, result in zip(_lines(len(scored)), results, strict=True):
            shares = result.cumulative_frequency / len(result.errors)
            axes.plot(result.thresholds, shares, clip_on=False, linewidth=1.3, **line)
        axes.set(title=name, xlim=(0, None), ylim=(0, 1), ylabel="share of frames below")
    _add_legend(panels[0], scored)


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


def _lines(n: int) -> list[dict[str, Any]]:
    """Return the styles of n estimates: colours and dashes for the first, grey for the others."""
    if n == 1:
        return [{"color": EDGE, "linestyle": "-"}]
    colours = np.linspace(0, 0.85, min(n, NAMED)).tolist()
    named = [
        {"color": ERRORS(colour), "linestyle": DASHES[k % len(DASHES)]}
        for k, colour in enumerate(colours)
    ]
    return [*named, *({"color": OTHERS, "linestyle": "-", "alpha": 0.3} for _ in range(n - NAMED))]


def _times(evaluation: Evaluation) -> NDArray[Any]:
    """Return the times of the expected frames from the reference's start, or their numbers."""
    keys, rows = evaluation.reference.keys, evaluation.matches.expected_rows
    return keys[rows] - keys[0] if keys.dtype.kind == "f" else rows


def _pose_times(evaluation: Evaluation) -> NDArray[Any]:
    """Return the times of the poses that the expected frames take, NaN where they are lost."""
    keys, rows = evaluation.estimate.keys, evaluation.matches.est_rows
    if keys.dtype.kind != "f":
        return _times(evaluation)
    times = np.where(rows < 0, np.nan, keys[rows] - evaluation.reference.keys[0])
    return over_expected(evaluation, times, np.nan)


def _time_label(evaluation: Evaluation) -> str:
    if evaluation.reference.keys.dtype.kind == "f":
        return "time [s]"
    return "frame" if evaluation.settings.form.ordered else "image"


def _draw_line(
    axes: Axes,
    evaluation: Evaluation,
    values: Floats,
    line: dict[str, Any],
    *,
    times: NDArray[Any] | None = None,
    jump: float = np.inf,
) -> None:
    """Draw values over time, with a break at gaps and jumps; of images as dots."""
    expected = _times(evaluation)
    times = expected if times is None else times
    jumps = np.flatnonzero(np.abs(np.diff(values)) > jump) + 1
    points = np.column_stack([times.astype(float), values])
    ends = np.union1d(breaks(expected), jumps)
    _draw_path(axes, evaluation, np.insert(points, ends, np.nan, axis=0), line)


def _draw_path(axes: Axes, evaluation: Evaluation, points: Floats, line: dict[str, Any]) -> None:
    """Draw points as a line, or as dots where they have no order, as images."""
    if not evaluation.settings.form.ordered:
        line = {**line, "linestyle": "", "marker": "o", "markersize": 3}
    axes.plot(*points.T, rasterized=len(points) > 5000, **{"linewidth": 1.0, **line})


def _add_legend(axes: Axes, scored: Sequence[Evaluation]) -> None:
    """Name the estimates, if there are several."""
    if len(scored) == 1:
        return
    handles = [axes.plot([], [], linewidth=1.3, **line)[0] for line in _lines(len(scored))[:NAMED]]
    legend = axes.legend(handles, map(str, range(len(handles))), loc="best", handlelength=3)
    for text, evaluation in zip(legend.get_texts(), scored, strict=False):
        name = evaluation.name  # set later, since a label that begins with _ would be hidden
        text.set(text=shortened(name, LONGEST), parse_math=False)
    if len(scored) > NAMED:
        legend.set_title(f"grey: {len(scored) - NAMED} others")


KINDS: dict[str, tuple[Callable[..., None], float]] = {  # how each is drawn, and its height
    "errors": (_draw_errors, 3.6),
    "trajectory": (_draw_trajectories, 4.6),
    "time": (_draw_time, 5.0),
    "scores": (_draw_scores, 2.8),
}
