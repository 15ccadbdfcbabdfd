"""The page of estimates of one reference: one file that needs no network.

Needs plotly and Jinja, which the extra ``page`` brings.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from ..arrays import Floats
from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import collected_warnings
from ..texts import first_few, printable
from ..thresholds import N_THRESHOLDS, ScoreProfile, tas_profile
from ..validation import finite_rows
from . import tables
from .curves import BEYOND, Curve, curve, frames, over_expected, time_label, times, with_breaks
from .document import COLOURS, LAYOUT, RAMP, REFERENCE, inert, log_range, rectangles, render, style

__all__ = ["figures", "page_of"]

N_PROFILE = 16  # largest thresholds of a drawn profile


def page_of(
    scored: Sequence[Evaluation], reference: str = "reference", notes: Sequence[str] = ()
) -> str:
    """Return the page; `reference` is its file, `notes` are on it and on files that failed."""
    drawn = figures(scored)
    crosses = "With “colour: error”, crosses" if scored[1:] else "Crosses"
    sections: list[dict[str, Any]] = [
        {
            "heading": "Scores",
            "table": tables.rows_of(scored, longest=60),
            "notes": tables.notes_of(scored, notes),
            "terms": tables.terms(scored),
        },
        {
            "heading": "Aligned trajectories",
            "text": [
                "Drag to rotate; click a name to hide it, double-click it to see nothing else.",
                f"{crosses} are errors beyond the largest threshold, with a line from the "
                "reference; circles are lost frames.",
            ],
            "figure": drawn["trajectories"],
        },
        {
            "heading": "Errors over time"
            if scored[0].settings.file_format.ordered
            else "Errors by image",
            "text": [
                "Shaded: lost. Dotted: the largest threshold. Bars: the stretches that cost the "
                "score most."
            ],
            "figure": drawn["errors"],
        },
        {
            "heading": "Where the scores are lost",
            "table": tables.deficits_of(scored, longest=60),
        },
        {
            "heading": "Scores over their largest threshold",
            "text": ["Dotted: the largest threshold of the table."],
            "figure": drawn["profiles"],
        },
    ]
    if models := tables.models_of(scored, longest=60):
        sections.insert(1, {"heading": "Models of the estimates", "table": models})
    names = first_few([evaluation.name for evaluation in scored], 3)
    title = f"{names} against {printable(Path(reference).name)}"
    return render(title, tables.conditions(scored), sections)


def figures(scored: Sequence[Evaluation]) -> dict[str, go.Figure]:
    """Return the figures of the page."""
    return {
        "trajectories": _trajectories(scored),
        "errors": _errors(scored),
        "profiles": _profiles(scored),
    }


def _trajectories(scored: Sequence[Evaluation]) -> go.Figure:
    """Draw the aligned trajectories in 3D; buttons colour them by position error or by estimate.

    Positions count from the first one of the reference, since WebGL has 32 bits.
    """
    first, file_format = scored[0], scored[0].settings.file_format
    reference = first.reference.poses[first.matches.expected_rows, :3, 3]
    origin, path = reference[0], reference - reference[0]
    scale = _error_scale(curve(first, "TAS").limit, file_format.unit)
    figure = go.Figure()
    look: dict[str, Any] = {"mode": "markers", "marker": {"color": REFERENCE, "size": 3}}
    if file_format.ordered:
        look = {"mode": "lines", "line": {"color": REFERENCE, "width": 4}}
    points = with_breaks(first, path) if file_format.ordered else path
    group = {"name": "reference", "legendgroup": "reference"}
    figure.add_scatter3d(**_xyz(points), **group, hoverinfo="skip", **look)
    by_error: list[int] = []  # traces that a button shows
    for index, evaluation in enumerate(scored):
        positions = over_expected(evaluation, evaluation.positions, np.nan) - origin
        errors = curve(evaluation, "TAS").errors.astype(np.float32)
        labels, colour = _frame_labels(evaluation), COLOURS[index % len(COLOURS)]
        group = {"name": inert(evaluation.name), "legendgroup": str(index)}
        figure.add_scatter3d(
            **_xyz(positions),
            **group,
            mode="lines" if file_format.ordered else "markers",
            line={"color": colour, "width": 5},
            marker={"color": colour, "size": 4},
            text=labels,
            customdata=errors,
            hovertemplate=f"%{{text}}<br>position error %{{customdata:.3g}} {file_format.unit}",
        )
        for trace in _error_traces(positions, errors, path, {**scale, "showscale": index == 0}):
            by_error.append(len(figure.data))
            figure.add_scatter3d(**trace, **group, opacity=0.0 if scored[1:] else 1.0)
        lost = np.flatnonzero(~finite_rows(positions))
        if len(lost):
            figure.add_scatter3d(
                **_xyz(path[lost]),
                name=inert(f"{evaluation.name}: lost"),
                legendgroup=str(index),
                mode="markers",
                marker={"symbol": "circle-open", "size": 5, "color": "#333333"},
                text=[labels[row] for row in lost],
                hovertemplate="%{text}",
            )
    buttons = {
        "type": "buttons",
        "direction": "right",
        "active": int(len(scored) > 1),
        "buttons": [
            {"label": label, "method": "restyle", "args": [{"opacity": opacity}, by_error]}
            for label, opacity in (("colour: error", 1.0), ("colour: estimate", 0.0))
        ],
        **{"x": 0, "xanchor": "left", "y": 1, "yanchor": "top", "font": {"size": 12}},
    }
    scene = _scene(path, file_format.unit)
    figure.update_layout(**LAYOUT, height=600, scene=scene, updatemenus=[buttons])
    return figure.update_layout(margin={"l": 0, "r": 10, "b": 70})


def _xyz(points: Floats) -> dict[str, NDArray[np.float32]]:
    """Return the coordinates of points by axis."""
    return dict(zip("xyz", points.T.astype(np.float32), strict=True))


def _error_scale(limit: float, unit: str) -> dict[str, Any]:
    """Return how markers are coloured by errors up to a limit, and the bar that shows it."""
    ramp = [*zip(np.linspace(0, 0.999, len(RAMP)).tolist(), RAMP, strict=True), (1.0, BEYOND)]
    title = {"text": f"position error [{inert(unit)}]", "side": "top"}
    bar = {"title": title, "orientation": "h", "thickness": 12, "len": 0.6}
    bar |= {"y": 0, "yanchor": "top", "x": 1, "xanchor": "right"}
    return {"colorscale": ramp, "cmin": 0, "cmax": limit, "colorbar": bar, "size": 3}


def _error_traces(
    positions: Floats, errors: NDArray[np.float32], path: Floats, scale: dict[str, Any]
) -> list[dict[str, Any]]:
    """Return traces of positions coloured by error, and of lines from the reference to outliers."""
    has_pose, limit = finite_rows(positions), scale["cmax"]
    far = has_pose & (errors >= limit)
    marker = {
        **scale,
        "color": np.minimum(errors[has_pose], limit),
        "symbol": np.where(far[has_pose], "cross", "circle").tolist(),  # fonts may lack "x"
    }
    ways = np.stack([path, positions, np.full_like(path, np.nan)], axis=1)[far].reshape(-1, 3)
    no_name: dict[str, Any] = {"showlegend": False, "hoverinfo": "skip"}
    return [
        {**_xyz(positions[has_pose]), "mode": "markers", "marker": marker, **no_name},
        {**_xyz(ways), "mode": "lines", "line": {"color": BEYOND, "width": 1.5}, **no_name},
    ]


def _scene(path: Floats, unit: str) -> dict[str, Any]:
    """Return a box around the reference, which an estimate far away does not shrink, and a view.

    The axis along which the reference is shortest points up.
    """
    low, high = path.min(axis=0), path.max(axis=0)
    reach = np.maximum(0.55 * (high - low), 0.15 * float(np.max(high - low)) or 1.0)
    ranges = np.stack([(low + high) / 2 - reach, (low + high) / 2 + reach], axis=1).tolist()
    axes = {
        f"{name}axis": {"range": ends, "nticks": 4, "title": {"text": f"{name} [{unit}]"}}
        for name, ends in zip("xyz", ranges, strict=True)
    }
    thin = int(np.argmin(high - low))
    up = dict(zip("xyz", np.eye(3)[thin].tolist(), strict=True))
    eye, center = (  # the labels are below the box and to the left, also on a narrow screen
        dict(zip("xyz", np.roll(point, thin).tolist(), strict=True))
        for point in ([2.7, -1.9, -1.9], [-0.1, -0.15, 0.15])
    )
    return {**axes, "aspectmode": "data", "camera": {"up": up, "eye": eye, "center": center}}


def _frame_labels(evaluation: Evaluation) -> list[str]:
    """Return the time of each expected frame, its number, or the name of the image."""
    if evaluation.matches.timed:
        return [f"{time:.2f} s" for time in times(evaluation).tolist()]
    keys = evaluation.reference.keys[evaluation.matches.expected_rows].tolist()
    word = "" if isinstance(keys[0], str) else "frame "
    return [inert(f"{word}{key}") for key in keys]


def _errors(scored: Sequence[Evaluation]) -> go.Figure:
    """Draw the errors over time on logarithmic axes, lost time, and what costs the scores most."""
    scores = ["TAS", "RAS"] if any(evaluation.has_rotations for evaluation in scored) else ["TAS"]
    n = len(scored)
    figure = make_subplots(
        rows=2 * len(scores),
        shared_xaxes=True,
        row_heights=[0.08 + 0.015 * n, 0.5] * len(scores),
        vertical_spacing=0.02,
    )
    first, ordered = scored[0], scored[0].settings.file_format.ordered
    dots = "lines" if ordered else "markers"
    for k, score in enumerate(scores):
        curves = {
            index: curve(evaluation, score)
            for index, evaluation in enumerate(scored)
            if score == "TAS" or evaluation.has_rotations
        }
        low, high = log_range(
            [drawn.errors for drawn in curves.values()], next(iter(curves.values())).limit
        )
        above, below = {"row": 2 * k + 1, "col": 1}, {"row": 2 * k + 2, "col": 1}
        for index, drawn in curves.items():
            evaluation = scored[index]
            group = {"legendgroup": str(index), "name": inert(evaluation.name), "showlegend": False}
            colour = COLOURS[index % len(COLOURS)]
            x, y = rectangles(drawn.lost, low, high)
            area = {"fill": "toself", "fillcolor": colour, "opacity": 0.18, "mode": "none"}
            if len(x):
                figure.add_scatter(x=x, y=y, **area, **group, hoverinfo="skip", **below)
            errors = np.where(np.isfinite(drawn.errors), np.maximum(drawn.errors, low), np.nan)
            values = [frames(evaluation), errors, drawn.errors]
            x, y, true = with_breaks(evaluation, np.column_stack(values)).T if ordered else values
            unit = drawn.label.partition("[")[2].rstrip("]")
            figure.add_scatter(
                x=x,
                y=y,
                customdata=np.where(np.isfinite(true), true, np.nan).astype(np.float32),
                text=None if ordered else _frame_labels(evaluation),
                mode=dots,
                line={**style(index), "width": 1.5},
                hovertemplate=f"{'' if ordered else '%{text}: '}%{{customdata:.3g}} {unit}",
                **{**group, "showlegend": k == 0},
                **below,
            )
            figure.add_scatter(**_bars(drawn, index), **group, **above)
        limit = next(iter(curves.values())).limit
        figure.add_hline(limit, line={"dash": "dot", "color": "#444", "width": 1}, **below)
        label = next(iter(curves.values())).label
        ends = np.log10([low, high]).tolist()
        axis = {"range": ends, "nticks": 3, "tickformat": "~g"}  # with more, labels may overlap
        figure.update_yaxes(type="log", title_text=label, **axis, **below)
        figure.update_yaxes(visible=False, range=[n - 0.4, -0.6], **above)
        note = {"text": f"what costs the {score} most", "showarrow": False, "font": {"size": 11}}
        edge = {"x": 0, "xanchor": "left", "y": 1, "yanchor": "bottom"}
        domain = {"xref": "x domain", "yref": f"y{2 * k + 1 if k else ''} domain"}
        figure.add_annotation(**note, **edge, **domain)
    last = 2 * len(scores)
    figure.update_xaxes(title_text=time_label(first).partition(" ")[0], row=last, col=1)
    timed = first.matches.timed
    figure.update_xaxes(hoverformat=".2f" if timed else "d", ticksuffix=" s" if timed else "")
    height = 340 * len(scores) + 12 * n * len(scores)
    return figure.update_layout(**LAYOUT, height=height, hovermode="x unified")


def _bars(drawn: Curve, index: int) -> dict[str, Any]:
    """Return a trace with the stretches that cost a score most, each with what it costs."""
    x, texts = [], []
    for begin, end, deficit in drawn.deficits:
        text = f"{deficit.cause}: costs {deficit.cost:.3f} of the {deficit.score}, "
        text += f"{deficit.share:.1%} of what is missing"
        x += [begin, (begin + end) / 2, end, None]
        texts += [text, text, text, None]
    line = {"color": COLOURS[index % len(COLOURS)], "width": 8}
    hover = {"text": texts, "hovertemplate": "%{text}"}
    return {"x": x, "y": [index] * len(x), "mode": "lines", "line": line, **hover}


def _profiles(scored: Sequence[Evaluation]) -> go.Figure:
    """Draw the scores over their largest thresholds."""
    scores = ["TAS", "RAS"] if any(evaluation.has_rotations for evaluation in scored) else ["TAS"]
    figure = make_subplots(rows=len(scores), vertical_spacing=0.2)
    for k, score in enumerate(scores):
        cell = {"row": k + 1, "col": 1}
        unit = scored[0].settings.file_format.unit if score == "TAS" else "deg"
        limit = curve(scored[0], score).limit
        largest = limit * np.geomspace(0.01, 10, N_PROFILE)
        for index, evaluation in enumerate(scored):
            if score == "RAS" and not evaluation.has_rotations:
                continue
            figure.add_scatter(
                x=largest,
                y=_scores(evaluation, score, largest),
                name=inert(evaluation.name),
                legendgroup=str(index),
                showlegend=k == 0,
                mode="lines",
                line={**style(index), "width": 2},
                hovertemplate="%{y:.3f}",
                **cell,
            )
        figure.add_vline(limit, line={"dash": "dot", "color": "#444", "width": 1}, **cell)
        title = f"largest threshold [{unit}]"
        figure.update_xaxes(type="log", title_text=title, dtick=1, tickformat="~g", **cell)
        figure.update_xaxes(hoverformat=".3g", **cell)
        figure.update_yaxes(range=[0, 1.02], title_text=score, **cell)
    return figure.update_layout(**LAYOUT, height=320 * len(scores), hovermode="x unified")


def _scores(evaluation: Evaluation, score: str, largest: Floats) -> Floats:
    """Return a score at each largest threshold; refined aligns anew at each."""
    matches, settings = evaluation.matches, evaluation.settings
    if score == "RAS" or settings.registration != "refined":
        errors = np.sort(curve(evaluation, score).result.errors)
        return ScoreProfile(largest, [errors], N_THRESHOLDS).scores
    with collected_warnings():  # the TAS has said them
        return tas_profile(
            matches.gt_poses[:, :3, 3],
            matches.est_poses[:, :3, 3],
            largest,
            rng=settings.seed,
            alignment=settings.alignment,
            up=settings.up,
        ).scores
