"""The page of a comparison: one file that needs no network.

Needs plotly and Jinja, which the extra ``page`` brings.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from markupsafe import Markup
from plotly.subplots import make_subplots

from ..arrays import Floats
from ..comparison.baseline import Changes, changes_table
from ..comparison.comparison import Comparison
from ..comparison.runs import Errors
from ..comparison.tables import (
    HTML,
    by_sequence,
    conditions,
    differences_of,
    legend,
    notes_of,
    overall,
)
from ..texts import distinct, first_few
from .document import COLOURS, LAYOUT, inert, log_range, rectangles, render, style

__all__ = ["figures_of_comparison", "page_of_comparison"]

SYMBOLS = "circle", "diamond", "square", "triangle-up", "star", "hexagon", "pentagon", "bowtie"
N_BINS = 160  # largest number of medians along a curve
LONGEST = 24  # characters of a name next to an axis
MORE = (
    "Median over the runs of a system; shaded: most of its runs are lost. Dotted: the largest "
    "threshold of the TAS.",
    "alignscores REF EST... --save_page FILE.html writes a page of one sequence, with its "
    "trajectories and the errors of each frame.",
)


def page_of_comparison(
    comparison: Comparison, changed: Changes | None = None, reasons: Sequence[str] = ()
) -> str:
    """Return the page; `reasons` say why the build fails."""
    by, drawn = comparison.by, figures_of_comparison(comparison)
    sections: list[dict[str, Any]] = []
    if notes := notes_of(comparison, reasons):
        sections.append({"heading": "Notes", "notes": notes})
    if changed:
        sections.append(
            {
                "heading": f"{by} against {Path(changed.file).name}",
                "table": _rows(changes_table(changed, HTML)),
                "notes": changed.notes,
            }
        )
    better = "larger" if comparison.larger else "smaller"
    sections += [
        {
            "heading": "All sequences",
            "text": [*legend(comparison, HTML), *conditions(comparison.settings)],
            "table": _rows(overall(comparison, HTML)),
        },
        {"heading": f"{by} by sequence", "table": _rows(by_sequence(comparison, HTML))},
    ]
    if "differences" in drawn:
        sections.append(
            {
                "heading": f"Differences in {by}",
                "text": [
                    f"Means of the first system minus those of the second; {better} values of {by} "
                    "are better. Intervals of 95 %; open and dashed: not significant, or not "
                    "tested."
                ],
                "figure": drawn["differences"],
            }
        )
    sections.append(
        {
            "heading": f"{by} of each run",
            "text": ["Filled marks: runs. Lines: means of the scored runs. Crosses: failed runs."],
            "figure": drawn["runs"],
        }
    )
    if "errors" in drawn:
        sections.append({"heading": "Errors over time", "text": MORE, "figure": drawn["errors"]})
    systems = first_few(comparison.overall["system"].tolist(), 3)
    return render(f"{by} of {systems}", comparison.verdict, sections)


def _rows(table: pd.DataFrame) -> list[list[Markup]]:
    """Return a table whose texts are HTML, the header first."""
    return [[Markup(cell) for cell in row] for row in [list(table), *table.to_numpy().tolist()]]


def figures_of_comparison(comparison: Comparison) -> dict[str, go.Figure]:
    """Return the figures of the page."""
    figures = {"runs": _runs(comparison)}
    if pairs := differences_of(comparison):
        figures["differences"] = _differences(pairs, comparison.by)
    if comparison.errors:
        figures["errors"] = _errors(comparison)
    return figures


def _differences(pairs: Sequence[Mapping[str, Any]], by: str) -> go.Figure:
    """Draw the difference of each pair with its interval, dashed where it is not significant."""
    systems = list(dict.fromkeys(pair[name] for pair in pairs for name in "ab"))
    short = dict(zip(systems, distinct(systems, LONGEST), strict=True))
    labels, figure = [], go.Figure()
    for pair in pairs:
        names = f"{inert(short[pair['a']])} − {inert(short[pair['b']])}"
        texts = "<br>".join(pair["texts"])
        labels.append(f"{names}<br><span style='font-size:11px'>{texts}</span>")
    rows = range(len(pairs))
    for significant, name, symbol, line in (
        (True, "significant", "circle", {"width": 2}),
        (False, "not significant, or not tested", "circle-open", {"width": 1, "dash": "dash"}),
    ):
        chosen = [row for row in rows if isinstance(pairs[row]["better"], str) == significant]
        drawn = [pairs[row] for row in chosen]
        figure.add_scatter(
            x=[end for pair in drawn for end in (pair["low"], pair["high"], None)],
            y=np.repeat(chosen, 3),
            mode="lines+markers",
            line={"color": COLOURS[0], **line},
            marker={"symbol": "line-ns-open", "size": 9, "color": COLOURS[0]},
            hoverinfo="skip",
            legendgroup=name,
            showlegend=False,
        )
        figure.add_scatter(
            x=[pair["difference"] for pair in drawn],
            y=chosen,
            name=name,
            legendgroup=name,
            mode="markers",
            marker={"symbol": symbol, "size": 11, "color": COLOURS[0], "line": {"width": 2}},
            hovertemplate="%{y}: %{x:+.4g}<extra></extra>",
        )
    figure.add_vline(0, line={"color": "#444", "width": 1})
    figure.update_yaxes(
        tickvals=list(rows),
        ticktext=labels,
        range=[len(pairs) - 0.5, -0.5],
        automargin=True,
        showgrid=False,
        zeroline=False,
    )
    figure.update_xaxes(title_text=f"difference in {inert(by)}", tickformat="~g")
    row_height = 14 * (1 + max(len(pair["texts"]) for pair in pairs)) + 14
    return figure.update_layout(**LAYOUT, height=140 + row_height * len(pairs))


def _runs(comparison: Comparison) -> go.Figure:
    """Draw each run on each sequence as a mark, a system a row and a colour."""
    runs, by = comparison.distinct, comparison.by
    systems, sequences = comparison.overall["system"].tolist(), runs["sequence"].unique().tolist()
    finite = runs.loc[np.isfinite(runs[by]), by]
    worst = (finite.min() if comparison.larger else finite.max()) if len(finite) else 0.0
    step = 0.8 / len(systems)
    figure = go.Figure()
    for index, (system, name) in enumerate(zip(systems, distinct(systems, 40), strict=True)):
        of_system = runs[runs["system"] == system]
        y = of_system["sequence"].map(sequences.index) + step * (index - (len(systems) - 1) / 2)
        scored = (of_system["status"] == "scored") & np.isfinite(of_system[by])
        means = of_system[scored].groupby("sequence", sort=False)[by].mean()
        height = y.groupby(of_system["sequence"], sort=False).first()
        colour = COLOURS[index % len(COLOURS)]
        group: dict[str, Any] = {"name": inert(name), "legendgroup": str(index), "mode": "markers"}
        hover = f"{inert(name)}, run %{{customdata}}"
        dot = {"symbol": SYMBOLS[index % len(SYMBOLS)], "size": 8, "color": colour, "opacity": 0.7}
        figure.add_scatter(
            x=of_system.loc[scored, by],
            y=y[scored],
            marker=dot,
            customdata=[inert(run) for run in of_system.loc[scored, "run"]],
            hovertemplate=f"{hover}: %{{x:.4g}}<extra></extra>",
            **group,
        )
        group["showlegend"] = False
        figure.add_scatter(
            x=means,
            y=height[means.index],
            marker={"symbol": "line-ns", "size": 14, "line": {"width": 2, "color": colour}},
            hovertemplate=f"{inert(name)}, mean: %{{x:.4g}}<extra></extra>",
            **group,
        )
        failed = of_system[of_system["status"] != "scored"]
        if len(failed):
            figure.add_scatter(
                x=failed[by].where(np.isfinite(failed[by]), worst),
                y=y[failed.index],
                marker={"symbol": "x-thin", "size": 9, "line": {"width": 2, "color": colour}},
                customdata=[inert(run) for run in failed["run"]],
                hovertemplate=f"{hover}: failed<extra></extra>",
                **group,
            )
    figure.update_yaxes(
        tickvals=list(range(len(sequences))),
        ticktext=[inert(name) for name in distinct(sequences, LONGEST)],
        range=[len(sequences) - 0.5, -0.5],
        automargin=True,
        zeroline=False,
        showgrid=False,
    )
    for edge in range(1, len(sequences)):
        figure.add_hline(edge - 0.5, line={"color": "#ddd", "width": 1})
    figure.update_xaxes(title_text=inert(by), zeroline=False)
    sequence_height = max(40, 20 * len(systems))
    return figure.update_layout(**LAYOUT, height=150 + sequence_height * len(sequences))


def _errors(comparison: Comparison) -> go.Figure:
    """Draw the median position error of each system over the time of each sequence."""
    settings, systems = comparison.settings, comparison.overall["system"].tolist()
    assert settings is not None  # where there are errors
    sequences = list(dict.fromkeys(run.sequence for run in comparison.errors))
    height = 230
    figure = make_subplots(
        rows=len(sequences),
        vertical_spacing=min(65 / (height * len(sequences)), 0.2),
        subplot_titles=[inert(sequence) for sequence in sequences],
    )
    in_legend: set[str] = set()
    for row, sequence in enumerate(sequences, 1):
        of_sequence = {
            system: [
                errors
                for run, errors in comparison.errors.items()
                if (run.system, run.sequence) == (system, sequence)
            ]
            for system in systems
        }
        times, medians = _medians(of_sequence)
        unit = comparison.runs.loc[comparison.runs["sequence"] == sequence, "unit"].dropna().iloc[0]
        limit = settings.max_threshold * float(unit)
        low, high = log_range(list(medians.values()), limit)
        cell = {"row": row, "col": 1}
        for index, (system, name) in enumerate(zip(systems, distinct(systems, 40), strict=True)):
            if system not in medians:
                continue
            errors = medians[system]
            group = {"name": inert(name), "legendgroup": str(index)}
            x, y = rectangles(_stretches(times, np.isinf(errors)), low, high)
            area = {"fill": "toself", "fillcolor": COLOURS[index % len(COLOURS)], "opacity": 0.15}
            if len(x):
                area |= {"mode": "none", "hoverinfo": "skip", "showlegend": False}
                figure.add_scatter(x=x, y=y, **area, **group, **cell)
            ordered = settings.file_format.ordered
            figure.add_scatter(
                x=(times[1:] + times[:-1]) / 2,
                y=np.where(np.isfinite(errors), np.maximum(errors, low), np.nan),
                customdata=np.where(np.isfinite(errors), errors, np.nan),
                mode="lines" if ordered else "markers",
                line={**style(index), "width": 1.5},
                showlegend=system not in in_legend,
                hovertemplate=f"%{{customdata:.3g}} {settings.file_format.unit}",
                **group,
                **cell,
            )
            in_legend.add(system)
        figure.add_hline(limit, line={"dash": "dot", "color": "#444", "width": 1}, **cell)
        ends = np.log10([low, high]).tolist()
        title = f"error [{settings.file_format.unit}]"
        axis = {"range": ends, "nticks": 3, "tickformat": "~g"}  # with more, labels may overlap
        figure.update_yaxes(type="log", title_text=title, **axis, **cell)
    timed = next(iter(comparison.errors.values())).timed
    figure.update_xaxes(hoverformat=".1f", ticksuffix=" s" if timed else "")
    title = "time" if timed else "frame" if settings.file_format.ordered else "image"
    figure.update_xaxes(title_text=title, row=len(sequences), col=1)
    height = 140 + height * len(sequences)
    return figure.update_layout(**LAYOUT, height=height, hovermode="x unified")


def _medians(runs: Mapping[str, Sequence[Errors]]) -> tuple[Floats, dict[str, Floats]]:
    """Return the edges of parts of the time from the start, and the median errors in each.

    The median is infinite where most frames are lost, and NaN where none is expected.
    """
    scored = [run for of_system in runs.values() for run in of_system]
    start = min(run.time[0] for run in scored)
    span = max(run.time[-1] for run in scored) - start or 1.0
    edges = np.linspace(0, span, min(N_BINS, max(len(scored[0].time) // 2, 1)) + 1)
    medians = {}
    for system, of_system in runs.items():
        if not of_system:
            continue
        times = np.concatenate([run.time for run in of_system]) - start
        errors = np.concatenate([run.position for run in of_system])
        parts = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(edges) - 2)
        medians[system] = np.full(len(edges) - 1, np.nan)
        for part in np.unique(parts):
            medians[system][part] = np.median(errors[parts == part])
    return edges, medians


def _stretches(edges: Floats, chosen: Any) -> Floats:
    """Return begin and end of each stretch of chosen parts between edges, (m, 2)."""
    changes = np.diff(np.r_[False, chosen, False].astype(int))
    begins, ends = (np.flatnonzero(changes == step) for step in (1, -1))
    return np.column_stack([edges[begins], edges[ends]])
