"""Figures of scored estimates: trajectories, scores, errors and poses over time.

Needs Matplotlib, which the extra ``plots`` brings.
"""

import warnings
from collections.abc import Callable, Sequence
from io import BytesIO
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..arrays import Booleans, Floats, Indices
from ..evaluation.evaluation import Evaluation
from ..texts import distinct
from ..validation import finite_rows
from . import PLOT_MODES
from .curves import BEYOND, Curve, curve, frames, over_expected, time_label, with_breaks

__all__ = ["STYLE", "figure_of", "new_figure", "picture", "score_panel"]

SHADE = "#a8c4dc"
EDGE = "#1f4e79"
REFERENCE: dict[str, Any] = {"color": "0.65", "linestyle": "-"}
# Estimates without a name.
OTHERS: dict[str, Any] = {"color": "0.4", "linestyle": "-", "alpha": 0.3}
N_NAMED = 8  # estimates that have a colour and a name
LONGEST = 40  # characters of a name in a legend
N_MARKS = 60  # of outliers, or of lost frames
DASHES = "-", "--", "-.", ":"
# Dark to light, so that the order survives greyscale and colour blindness, without the light end,
# which cannot be seen on white.
ERRORS = ListedColormap(colormaps["inferno"](np.linspace(0.0, 0.82, 256)), "errors").with_extremes(
    over=BEYOND
)
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
    "legend.fontsize": 9,
}
WIDTH = 10  # inches, of a whole figure


def figure_of(
    scored: Sequence[Evaluation],
    kind: str | None = None,
    *,
    plot_mode: str | None = None,
    interactive: bool = False,
) -> Figure:
    """Draw estimates of one reference, by one of `KINDS` or by all.

    `plot_mode` is one of `PLOT_MODES`, by default the two longest axes. `interactive`: as a figure
    of pyplot, which it shows.
    """
    if kind not in (None, *KINDS):
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {kind!r}")
    if plot_mode not in (None, *PLOT_MODES):
        raise ValueError(f"plot_mode must be one of {', '.join(PLOT_MODES)}, not {plot_mode!r}")
    with rc_context(STYLE):
        figure = new_figure(interactive=interactive)
        if kind:
            figure.set_size_inches(*SIZES[kind])
            parts = {kind: figure.subfigures(1, 1, squeeze=False)[0, 0]}
        else:
            heights = SIZES["trajectory"][1], SIZES["errors"][1], SIZES["time"][1]
            figure.set_size_inches(WIDTH, sum(heights))
            rows = figure.subfigures(3, 1, height_ratios=heights, squeeze=False)
            top, errors, time = rows[:, 0]
            widths = SIZES["trajectory"][0], SIZES["scores"][0]
            trajectory, scores = top.subfigures(1, 2, width_ratios=widths, squeeze=False)[0]
            parts = dict(zip(KINDS, (trajectory, scores, errors, time), strict=True))
        for name, part in parts.items():
            KINDS[name](part, scored, plot_mode)
        if len(scored) > 1:
            _add_legend(next(iter(parts.values())), scored)
    return figure


def new_figure(*, interactive: bool) -> Figure:
    """Return an empty figure, one of pyplot if it is `interactive`."""
    figure = Figure()
    if interactive:
        from matplotlib import pyplot  # has its own state, which no file needs

        figure = pyplot.figure()
    figure.set_layout_engine("constrained")
    return figure


def picture(figure: Figure, suffix: str) -> bytes:
    """Return a figure as the content of a file with a suffix such as ``.png``."""
    buffer = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # of names in letters that the font lacks
        figure.savefig(buffer, format=suffix.removeprefix("."), dpi=200)
    return buffer.getvalue()


def _draw_trajectories(part: SubFigure, scored: Sequence[Evaluation], mode: str | None) -> None:
    """Draw the aligned trajectories: a single one coloured by its error, several by estimate."""
    first, unit = scored[0], scored[0].settings.file_format.unit
    reference = first.reference.poses[first.matches.expected_rows, :3, 3]
    longest = sorted(np.argsort(np.ptp(reference, axis=0), kind="stable")[1:])
    view = ["xyz".index(axis) for axis in mode] if mode else longest
    axes = part.subplots(subplot_kw={"projection": "3d"} if len(view) == 3 else {})
    _draw_path(axes, first, reference[:, view], {**REFERENCE, "linewidth": 2})
    for name, axis in zip("xyz", view, strict=False):
        axes.set(**{f"{name}label": f"{'xyz'[axis]} [{unit}]"})
    limit = f"{curve(first, 'TAS').limit:.3g} {unit}"
    (name,) = distinct([first.name], LONGEST)
    title = f"aligned trajectories; crosses: beyond {limit}" if scored[1:] else f"{name}, aligned"
    axes.set_title(title, parse_math=False)
    if len(scored) == 1:
        _draw_by_error(part, axes, first, reference, view)
    else:
        for line, evaluation in zip(_lines(scored), scored, strict=True):
            _draw_path(axes, evaluation, evaluation.positions[:, view], line)
            tas = curve(evaluation, "TAS")
            positions = over_expected(evaluation, evaluation.positions, np.nan)
            far = _thinned(finite_rows(positions) & (tas.errors >= tas.limit))
            cross = {"color": line["color"], "linestyle": "", "marker": "x", "markersize": 5}
            axes.plot(*positions[far][:, view].T, **cross)
    # A box around the reference, so that an estimate far away does not shrink the rest.
    low, high = reference[:, view].min(axis=0), reference[:, view].max(axis=0)
    if len(view) == 3:
        margin = 0.06 * float(np.max(high - low)) or 1.0
        ends = zip("xyz", low - margin, high + margin, strict=True)
        axes.set(aspect="equal", **{f"{name}lim": (begin, end) for name, begin, end in ends})
    else:  # which grows until it fills its place
        axes.dataLim.set_points(np.stack([low, high]))
        axes.margins(0.06)
        axes.set_aspect("equal", adjustable="datalim")


def _thinned(chosen: Booleans) -> Indices:
    """Return some rows that are chosen, the first of each stretch among them."""
    rows = np.flatnonzero(chosen)
    stretches = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    step = max(1, len(rows) // N_MARKS)
    return np.concatenate([stretch[::step] for stretch in stretches])


def _draw_by_error(
    part: SubFigure, axes: Axes, evaluation: Evaluation, reference: Floats, view: list[int]
) -> None:
    """Draw positions coloured by their error, outliers as crosses, and lost frames."""
    tas, unit = curve(evaluation, "TAS"), evaluation.settings.file_format.unit
    positions = over_expected(evaluation, evaluation.positions, np.nan)
    lost = ~finite_rows(positions)
    far = ~lost & (tas.errors >= tas.limit)
    near = ~lost & ~far
    # From the reference to each outlier, which may be outside the box.
    ways = np.stack([reference, positions, np.full_like(reference, np.nan)], axis=1)[far]
    axes.plot(*ways.reshape(-1, 3)[:, view].T, color=BEYOND, linewidth=0.6, alpha=0.6)
    dots: dict[str, Any] = {"c": tas.errors[near], "s": 20, "linewidth": 0, "zorder": 3}
    dots |= {"cmap": ERRORS, "vmin": 0, "vmax": tas.limit}
    crosses: dict[str, Any] = {"marker": "x", "s": 28, "c": BEYOND, "linewidth": 1.2, "zorder": 4}
    holes: dict[str, Any] = {"marker": "o", "s": 16, "c": "none", "edgecolor": "0.2"}
    holes |= {"linewidth": 0.8, "zorder": 4}
    points = axes.scatter(*positions[near][:, view].T, **dots)
    axes.scatter(*positions[far][:, view].T, **crosses)
    axes.scatter(*reference[_thinned(lost)][:, view].T, **holes)
    part.colorbar(points, ax=axes, label=f"position error [{unit}]", extend="max", aspect=30)
    legend = {
        "reference": Line2D([], [], linewidth=2, **REFERENCE),
        f"beyond {tas.limit:.3g} {unit}": Line2D([], [], marker="x", color=BEYOND, linestyle=""),
        "lost": Line2D([], [], marker="o", color="0.2", linestyle="", fillstyle="none", ms=5),
    }
    part.legend(legend.values(), legend.keys(), loc="outside lower left", ncols=3, frameon=False)


def _draw_scores(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw the share of frames below each threshold; the area is the score."""
    panels = part.subplots(2, 1)
    for axes, name in zip(panels, ("TAS", "RAS"), strict=True):
        unit = scored[0].settings.file_format.unit if name == "TAS" else "deg"
        axes.set_xlabel(f"threshold [{unit}]")
        results = [curve(evaluation, name).result for evaluation in scored]
        if len(results) == 1:
            (only,) = results
            n, frequency = len(only.errors), only.cumulative_frequency
            score_panel(axes, only.thresholds, frequency, n, name=name, score=only.score)
            axes.set_ylabel("frames below")
            continue
        for line, result in zip(_lines(scored), results, strict=True):
            shares = result.cumulative_frequency / len(result.errors)
            axes.plot(result.thresholds, shares, clip_on=False, linewidth=1.5, **line)
        title = f"{name}: the area below a curve"
        axes.set(title=title, xlim=(0, None), ylim=(0, 1), ylabel="share of frames below")


def _draw_errors(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw the errors over time on logarithmic axes, lost time, and what costs the scores most."""
    panels = part.subplots(2, 1, sharex=True)
    what = "errors over time" if scored[0].settings.file_format.ordered else "errors by image"
    for axes, name in zip(panels, ("TAS", "RAS"), strict=True):
        curves = [curve(evaluation, name) for evaluation in scored]
        axes.set(yscale="log", ylabel=curves[0].label)
        drawn_lines = zip(_lines(scored), scored, curves, strict=True)
        for row, (line, evaluation, drawn) in enumerate(drawn_lines, int(len(scored) > 1)):
            x, colour = frames(evaluation), line["color"]
            is_positive = np.isfinite(drawn.errors) & (drawn.errors > 0)
            _draw_line(axes, evaluation, x, np.where(is_positive, drawn.errors, np.nan), line)
            for low, high in drawn.lost:
                axes.axvspan(low, high, color=colour, alpha=0.15, linewidth=0)
            if row <= N_NAMED:
                _mark_deficits(axes, drawn, x, colour, row)
        axes.axhline(curves[0].limit, color="0.3", linewidth=0.8, linestyle=":")
        axes.margins(x=0)
        n_rows = max(len(drawn.deficits) for drawn in curves) if len(scored) == 1 else len(scored)
        pad = 8 + (11 if len(scored) == 1 else 4) * min(n_rows, N_NAMED)
        title = f"{what}; bars: what costs the {name} most"
        title += f", as shares of 1 − {name}" if len(scored) == 1 else ""
        axes.set_title(title, pad=pad)
    panels[1].set_xlabel(f"{time_label(scored[0])} (shaded: lost; dotted: largest threshold)")


def _mark_deficits(axes: Axes, drawn: Curve, x: Floats, colour: Any, row: int) -> None:
    """Draw the stretches that cost a score most above the axes, each with its share and cause.

    A single estimate, of row 0, has a row a stretch; of several each has its row, without words.
    """
    low, high = x.min(), x.max()
    for k, (start, end, deficit) in enumerate(drawn.deficits):
        points = 8 + 11 * k if row == 0 else 4 * row
        up = ScaledTranslation(0, points / 72, axes.figure.dpi_scale_trans)
        style_of_bar: dict[str, Any] = {
            "transform": axes.get_xaxis_transform() + up,
            "clip_on": False,
        }
        wide = 5 if row == 0 else 2.5
        axes.plot([start, end], [1, 1], color=colour, linewidth=wide, **style_of_bar)
        if row:
            continue
        text = f"{deficit.share:.0%} {deficit.cause}"
        style: dict[str, Any] = {"fontsize": 8, "va": "center_baseline"}
        if end < low + 0.8 * (high - low):
            axes.text(end, 1, f"  {text}", ha="left", **style, **style_of_bar)
        elif start > low + 0.2 * (high - low):
            axes.text(start, 1, f"{text}  ", ha="right", **style, **style_of_bar)
        else:
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1}
            axes.text((start + end) / 2, 1, text, ha="center", bbox=box, **style, **style_of_bar)


def _draw_time(part: SubFigure, scored: Sequence[Evaluation], _mode: str | None) -> None:
    """Draw x, y, z and roll, pitch, yaw over time, each in the alignment of its score."""
    panels = part.subplots(3, 2, sharex=True)
    first, unit = scored[0], scored[0].settings.file_format.unit
    poses = first.reference.poses[first.matches.expected_rows]
    order = _order_of_axes(poses[:, :3, :3])
    columns = np.argsort([*order])  # of x, y, z
    angles = _continuous(_angles(poses[:, :3, :3], order))
    truth = np.column_stack([poses[:, :3, 3], angles[:, columns]])
    drawn = [(first, frames(first), truth, {**REFERENCE, "linewidth": 2.5})]
    for line, each in zip(_lines(scored), scored, strict=True):
        alignment, rotations = each.result.ras.alignment, each.matches.est_poses[:, :3, :3]
        aligned = rotations * np.nan if alignment is None else alignment.T @ rotations
        estimated = _nearest(over_expected(each, _angles(aligned, order), np.nan), angles)
        values = np.column_stack(
            [over_expected(each, each.positions, np.nan), estimated[:, columns]]
        )
        drawn.append((each, _pose_times(each), values, line))
    names = f"x [{unit}]", f"y [{unit}]", f"z [{unit}]", "roll [deg]", "pitch [deg]", "yaw [deg]"
    for k, (axes, name) in enumerate(zip(panels.T.flat, names, strict=True)):
        axes.set_ylabel(name)
        axes.margins(x=0)
        for evaluation, times, values, line in drawn:
            _draw_line(axes, evaluation, times, values[:, k], line)
    part.align_ylabels()
    panels[0, 0].set_title("positions; grey: reference")
    panels[0, 1].set_title(f"angles (order {order}), continued beyond 180 degrees")
    for axes in panels[2]:
        axes.set_xlabel(time_label(first))


def _order_of_axes(rotations: Floats) -> str:
    """Return the order of rotations about x, y and z that stays farthest from gimbal lock."""
    return min(
        ("xyz", "yzx", "zxy"), key=lambda order: np.abs(_angles(rotations, order)[:, 1]).max()
    )


def _angles(rotations: Floats, order: str) -> Floats:
    """Return angles in degrees, (n, 3), about the axes in this order; NaN where not finite."""
    angles = np.full((len(rotations), 3), np.nan)
    finite = finite_rows(rotations)
    if finite.any():
        with warnings.catch_warnings():  # one of many solutions where the second is 90 degrees
            warnings.filterwarnings("ignore", "Gimbal lock")
            angles[finite] = Rotation.from_matrix(rotations[finite]).as_euler(order, degrees=True)
    return angles


def _continuous(angles: Floats) -> Floats:
    """Return the same rotations without jumps: each row is the solution nearest to the last one."""
    angles = angles.copy()
    for row in range(1, len(angles)):
        angles[row : row + 1] = _nearest(angles[row : row + 1], angles[row - 1 : row])
    return angles


def _nearest(angles: Floats, towards: Floats) -> Floats:
    """Return the angles of the same rotations, (n, 3), that are nearest to other ones.

    Each has two solutions, (a, b, c) and (a + 180, 180 - b, c + 180), and turns of 360 degrees.
    """
    both = np.stack([angles, angles * [1, -1, 1] + 180])
    both += 360 * np.round((towards - both) / 360)
    second = np.sum((both[1] - towards) ** 2, axis=1) < np.sum((both[0] - towards) ** 2, axis=1)
    nearest: Floats = np.where(second[:, None], both[1], both[0])
    return nearest


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
    colours = ERRORS(np.linspace(0.15, 0.85, min(len(scored), N_NAMED)))
    styles = [{"color": colour, "linestyle": dash} for colour, dash in zip(colours, cycle(DASHES))]
    return [*styles, *[OTHERS] * (len(scored) - N_NAMED)]


def _pose_times(evaluation: Evaluation) -> NDArray[Any]:
    """Return the times of the poses that the expected frames take, NaN where they are lost."""
    keys, rows = evaluation.estimate.keys, evaluation.matches.est_rows
    if not evaluation.matches.timed:
        return frames(evaluation)
    times = np.where(rows < 0, np.nan, keys[rows] - evaluation.reference.keys[0])
    return over_expected(evaluation, times, np.nan)


def _draw_line(
    axes: Axes, evaluation: Evaluation, x: NDArray[Any], values: Floats, line: dict[str, Any]
) -> None:
    """Draw values over time, with a break at gaps of the reference."""
    points = np.column_stack([x, values])
    _draw_path(axes, evaluation, with_breaks(evaluation, points), line)


def _draw_path(axes: Axes, evaluation: Evaluation, points: Floats, line: dict[str, Any]) -> None:
    """Draw points as a line, or as dots where they have no order, as images."""
    if not evaluation.settings.file_format.ordered:
        line = {**line, "linestyle": "", "marker": "o", "markersize": 4}
    axes.plot(*points.T, **{"linewidth": 1.2, **line})


def _add_legend(part: SubFigure, scored: Sequence[Evaluation]) -> None:
    """Name the first estimates; the style of each is the same everywhere."""
    handles = [Line2D([], [], linewidth=2.5, **REFERENCE)]
    handles += [Line2D([], [], linewidth=1.5, **line) for line in _lines(scored)[:N_NAMED]]
    numbers = map(str, range(len(handles)))
    legend = part.legend(handles, numbers, loc="outside lower left", handlelength=3, frameon=False)
    names = distinct([evaluation.name for evaluation in scored], LONGEST)
    for text, name in zip(legend.get_texts(), ["reference", *names], strict=False):
        # Set later, since a label that begins with _ would be hidden.
        text.set(text=name, parse_math=False)
    if len(scored) > N_NAMED:
        legend.set_title(f"grey: {len(scored) - N_NAMED} others")


KINDS: dict[str, Callable[..., None]] = {
    "trajectory": _draw_trajectories,
    "scores": _draw_scores,
    "errors": _draw_errors,
    "time": _draw_time,
}
SIZES = {  # width and height in inches
    "trajectory": (6.2, 5.2),
    "scores": (3.8, 5.2),
    "errors": (WIDTH, 5.0),
    "time": (WIDTH, 5.0),
}
