"""One self-contained page: table, heat map, sliders, trajectories, and scattered runs."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np

from ..arrays import Floats
from ..comparison.baseline import Changes
from ..comparison.comparison import Comparison
from ..comparison.intervals import MOST_NEEDED
from ..comparison.runs import Outcome
from ..comparison.summary import Summary
from ..comparison.tables import (
    Names,
    failures_text,
    footnotes,
    is_best,
    number,
    rank_text,
    some_failed,
)
from ..explorer import source
from ..explorer.document import data_element, document
from ..metrics import metric
from ..texts import printable
from .sequences import sequences_data
from .trajectories import packed, page_without_data

__all__ = ["page"]


DASHES = "", "6 3", "2 3", "8 3 2 3", "1 2"  # tell curves apart without colours
N_COLOURS = 8
CURVE = 640, 260  # width and height of the drawings, without their margins
LEFT, TOP, BOTTOM = 52, 20, 40
STRETCHES = 120  # parts of a trajectory whose median error is drawn
# Quantiles of the errors of a system on a sequence; scores by them are off by 0.00125 at most.
N_QUANTILES = 400
SCRIPTS = "scores.js", "charts.js", "controls.js", "tables.js"
MOST = 15  # megabytes of trajectories
FOR = {  # what a difference is to hold for, and what it takes more of
    "new_runs": ("new runs on these sequences", "runs"),
    "new_sequences": ("new sequences like these", "sequences"),
}


def page(comparison: Comparison, by: str, changed: Changes | None = None) -> str:
    """Return the page; `by` is the metric of the heat map and of the scattered runs."""
    counts = {
        "system": len(comparison.summary.systems),
        "sequence": len(comparison.summary.sequences),
    }
    title = " on ".join(f"{count} {what}{'s' * (count > 1)}" for what, count in counts.items())
    sections = _sections(comparison, by)
    if changed:
        sections.insert(1, ("changes", f"Changes in {by}", _changes(changed)))
    links = "".join(
        f'<li><a href="#{name}">{escape(heading)}</a></li>' for name, heading, _ in sections
    )
    body = "".join(
        f'<section id="{name}" aria-labelledby="{name}-title"><h2 id="{name}-title">'
        f"{escape(heading)}</h2>{content}</section>"
        for name, heading, content in sections
    )
    return document(
        title,
        f"<header><h1>{escape(title)}</h1>"
        f'<nav aria-label="Sections"><ul>{links}</ul></nav></header>\n<main>{body}</main>',
        styles=[source("style.css"), _file("page.css")],
        scripts=[*map(source, SCRIPTS), _file("page.js")],
        data=_data(comparison),
        allowed="frame-src blob:",
    )


def _file(name: str) -> str:
    """Return a file of this folder, to be put into the page."""
    return files(__package__).joinpath(name).read_text("utf-8")


def _sections(comparison: Comparison, by: str) -> list[tuple[str, str, str]]:
    """Return name, heading and content of each section."""
    summary, names, settings = comparison.summary, comparison.names, comparison.settings
    key = _key(summary, names)
    notes = footnotes(summary, by, names, settings)
    runs = _each(summary, lambda sequence: _runs(summary, by, sequence, names), names)
    errors = _each(summary, lambda sequence: _errors(summary, sequence, names), names)
    trajectories = _trajectories(sequences_data(comparison, by), by, names)
    return [
        ("overall", "Over all sequences", _table(summary, by, names, notes)),
        ("sequences", f"{by} by sequence", _heat_map(summary, by, names)),
        ("differences", f"Differences in {by}, over all", _differences(summary, by, names)),
        ("runs", f"{by} of each run", runs),
        ("thresholds", "Scores at other thresholds", _file("thresholds.html") + key),
        ("errors", "Position error along the way", key + errors),
        ("trajectories", "Trajectories, camera by camera", trajectories),
    ]


def _data(comparison: Comparison) -> dict[str, Any]:
    """Return what the scripts read."""
    summary, names, settings = comparison.summary, comparison.names, comparison.settings
    key = _in_key(summary)
    return {
        "systems": [names.systems[system] for system in summary.systems],
        "lines": [_colour_and_dash(key.index(system)) for system in summary.systems],
        "sequences": [names.sequences[sequence] for sequence in summary.sequences],
        "setting": {
            "threshold": settings.max_threshold,
            "degrees": settings.max_threshold_deg,
            "weight": settings.weight,
        },
        "errors": [
            [_pooled_errors(summary, system, sequence) for system in summary.systems]
            for sequence in summary.sequences
        ],
    }


def _table(summary: Summary, by: str, names: Names, footnotes: Sequence[str]) -> str:
    """Return the sortable table of the systems over all sequences."""
    failed = some_failed(summary)
    headers = ["system", *summary.headers.values()]
    headers += [*([f"{by} of scored runs"] if failed else []), "failed runs", "lost"]
    rows = []
    for system in summary.systems:
        entry = summary.entries[system, None]
        cells = [
            _cell(entry[name], number(entry[name]), entry["rank"][name]) for name in summary.headers
        ]
        if failed:
            cells.append(_cell(entry["scored"][by], number(entry["scored"][by])))
        cells.append(_cell(entry["failed_runs"], failures_text(entry)))
        cells.append(_cell(entry["lost"], f"{entry['lost']:.1%}"))
        rows.append(
            f'<tr><th scope="row">{escape(names.systems[system])}</th>{"".join(cells)}</tr>'
        )
    notes = "".join(f"<li>{escape(note)}</li>" for note in footnotes)
    caption = "Means over all sequences."
    if any(entry["rank"][by] for entry in summary.entries.values()):
        caption += " Bold: ahead of every other system, with 95 % for all pairs."
    return _scrolling("overall", caption, headers, rows) + f'<ul class="small">{notes}</ul>'


def _cell(value: float, text: str, rank: Sequence[int] | None = None) -> str:
    key = f"{value:.9g}" if math.isfinite(value) else "1e999"
    best = ' class="best"' if rank == [1, 1] else ""
    return f'<td data-key="{key}"{best}>{text}{_place(rank)}</td>'


def _place(rank: Sequence[int] | None) -> str:
    return f' <span class="rank">({rank_text(rank)})</span>' if rank else ""


def _heat_map(summary: Summary, by: str, names: Names) -> str:
    """Return the table of systems by sequences, shaded from the worst to the best value."""
    values = [
        summary.entries[system, sequence][by]
        for system in summary.systems
        for sequence in summary.sequences
        if summary.entries[system, sequence]["runs"]
    ]
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    if metric(by).family.larger_is_better:
        low, high = 0.0, max(1.0, high)
    rows = []
    for system in summary.systems:
        cells = []
        for sequence in summary.sequences:
            entry = summary.entries[system, sequence]
            if not entry["runs"]:
                cells.append("<td>not tried</td>")
                continue
            value = min(max(entry[by], low), high)
            share = (value - low) / (high - low) if high > low else 1.0
            share = share if metric(by).family.larger_is_better else 1 - share
            failed = entry["failed_runs"]
            lost = f'<span class="small">{failed} failed</span>' if failed else ""
            best = " best" if is_best(entry, by) else ""
            cells.append(
                f'<td class="heat{best}" style="--share:{round(100 * share)}%">{number(entry[by])}'
                f"{_place(entry['rank'][by])}{lost}</td>"
            )
        rows.append(
            f'<tr><th scope="row">{escape(names.systems[system])}</th>{"".join(cells)}</tr>'
        )
    caption = "Means over the runs, the stronger the colour, the better."
    headers = ["system", *(names.sequences[sequence] for sequence in summary.sequences)]
    return _scrolling("sequences", caption, headers, rows)


def _differences(summary: Summary, by: str, names: Names) -> str:
    """Return the table of the differences of all pairs, for new runs and for new sequences."""
    rows = [
        f'<tr><th scope="row">{first} − {second}</th><td>{words}</td>{_cells(answer)}'
        f"<td>{'first' if answer['better'] == 'a' else 'second' if answer['better'] else 'no'}</td>"
        f"<td>{_needed(answer['needed'])} {unit}</td>"
        f"{_cells(answer['failing'], answer['with_failures'])}</tr>"
        for pair in summary.comparisons
        if pair["sequence"] is None and pair["metric"] == by
        for first, second in [[escape(names.systems[pair[key]]) for key in "ab"]]
        for question, (words, unit) in FOR.items()
        if (answer := pair[question])
    ]
    if not rows:
        return "<p>There is nothing to compare: one system, or one run of each.</p>"
    caption = (
        "Differences with their intervals, 95 % for all pairs: of the scores of runs that did not "
        "fail, of how often runs fail, and of means in which failures count; and with how many "
        "runs, or sequences, of such a difference and scatter two systems are told apart."
    )
    headers = "systems", "for", "scores", "ahead", "would do", "failing", "with failures"
    return _scrolling("differences", caption, headers, rows)


def _changes(changed: Changes) -> str:
    """Return the table of what changed against a saved comparison, and the notes."""
    header, *table = changed.table()
    rows = [
        f'<tr><th scope="row">{escape(name)}</th>'
        + "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        + "</tr>"
        for name, *cells in table
    ]
    notes = "".join(f"<li>{escape(note)}</li>" for note in changed.notes)
    caption = f"Against {escape(printable(changed.file))}, on what is in both."
    return _scrolling("changes", caption, header, rows) + f'<ul class="small">{notes}</ul>'


def _cells(*differences: Mapping[str, Any]) -> str:
    """Return the cells of differences with their intervals."""
    return "".join(
        f"<td>{_signed(one['difference'])} ({_signed(one['low'])} to {_signed(one['high'])})</td>"
        if math.isfinite(one["low"])
        else "<td>unknown</td>"
        for one in differences
    )


def _needed(count: int | None) -> str:
    return f"more than {MOST_NEEDED}" if count is None else str(count)


def _scrolling(section: str, caption: str, headers: Iterable[str], rows: Iterable[str]) -> str:
    """Return the table of a section, which scrolls where the screen is too narrow."""
    head = "".join(f'<th scope="col">{escape(header)}</th>' for header in headers)
    return (
        f'<div class="scroll" tabindex="0" role="group" aria-labelledby="{section}-title"><table>'
        f"<caption>{caption}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _signed(value: float) -> str:
    return f"{value:+.3f}".replace("-", "−") if math.isfinite(value) else "unknown"


def _each(summary: Summary, draw: Callable[[str], str], names: Names) -> str:
    """Return a drawing for each sequence, the first of them unfolded."""
    return "".join(
        f"<details{' open' if index == 0 else ''}><summary>{escape(name)}</summary>"
        f'<div class="scroll" tabindex="0" role="group" aria-label="{escape(name)}">'
        f"{draw(sequence)}</div></details>"
        for index, (sequence, name) in enumerate(names.sequences.items())
    )


def _key(summary: Summary, names: Names) -> str:
    items = "".join(
        f'<li><svg width="34" height="10" aria-hidden="true"><path {_style(index)} d="M0 5H34"/>'
        f"</svg> {escape(names.systems[system])}</li>"
        for index, system in enumerate(_in_key(summary))
    )
    return f'<ul class="key">{items}</ul>'


def _in_key(summary: Summary) -> list[str]:
    return sorted(summary.systems)


def _style(index: int) -> str:
    colour, dash = _colour_and_dash(index)
    return f'class="curve" stroke="{colour}" stroke-dasharray="{dash}"'


def _colour_and_dash(index: int) -> tuple[str, str]:
    dash = DASHES[(2 * (index // N_COLOURS) + index % 2) % len(DASHES)]
    return f"var(--c{index % N_COLOURS})", dash or "none"


def _outcomes(summary: Summary, system: str, sequence: str) -> list[Outcome]:
    """Return the runs of a system that were scored."""
    return [
        outcome
        for run, outcome in summary.runs
        if (run.system, run.sequence) == (system, sequence) and outcome.n
    ]


def _runs(summary: Summary, by: str, sequence: str, names: Names) -> str:
    """Draw each run as a dot on the line of its system."""
    width, row = CURVE[0], 26
    label = 130
    results = {
        system: [
            {**result, **result["metrics"]}[by]
            for result in summary.results
            if (result["system"], result["sequence"]) == (system, sequence)
        ]
        for system in summary.systems
    }
    finite = [value for values in results.values() for value in values if math.isfinite(value)]
    low, high = (
        min([0.0, *finite]),
        max([*finite, 1.0 if metric(by).family.larger_is_better else 1e-9]),
    )
    marks = []
    for index, (system, values) in enumerate(results.items()):
        y = row * index + row / 2
        name = escape(names.systems[system][:18])
        marks.append(
            f'<text x="{label - 8}" y="{y + 4:g}" text-anchor="end">{name}</text>'
            f'<path class="axis" d="M{label} {y:g}H{width}"/>'
        )
        for value in values:
            if math.isfinite(value):
                x = label + (width - label - 8) * (value - low) / (high - low)
                marks.append(f'<circle class="dot" cx="{x:.1f}" cy="{y:g}" r="4"/>')
    height = row * len(results) + 22
    marks.append(
        f'<text x="{label}" y="{height - 4}">{low:.3g}</text>'
        f'<text x="{width}" y="{height - 4}" text-anchor="end">{high:.3g}</text>'
    )
    spoken = "; ".join(
        f"{names.systems[system]}: {', '.join(map(number, values))}"
        for system, values in results.items()
    )
    return _svg(width, height, marks, f"{by} of each run. {spoken}")


def _pooled_errors(summary: Summary, system: str, sequence: str) -> dict[str, str] | None:
    """Return errors of positions, in d, and of rotations that stand for those of all runs.

    None where the system was not tried.
    """
    runs = _outcomes(summary, system, sequence)
    n_runs = summary.entries[system, sequence]["runs"]
    if not n_runs:
        return None
    return {
        "position": _quantiles([run.position_errors / run.unit for run in runs], n_runs),
        "rotation": _quantiles([run.rotation_errors for run in runs], n_runs),
    }


def _quantiles(errors: Sequence[Floats], n_runs: int) -> str:
    """Return equally spaced quantiles of errors, packed; each run counts the same.

    Runs that failed, or are missing, have infinite errors.
    """
    together = np.concatenate([*errors, [np.inf]])
    share = np.concatenate(
        [*(np.full(len(of_run), 1 / len(of_run)) for of_run in errors), [np.inf]]
    )
    order = np.argsort(together, kind="stable")
    reached = np.cumsum(share[order]) / n_runs
    wanted = (np.arange(N_QUANTILES) + 0.5) / N_QUANTILES
    values = together[order][np.searchsorted(reached, wanted)]
    return packed(values, "<f4")


def _errors(summary: Summary, sequence: str, names: Names) -> str:
    """Draw the median position error in each part of the trajectory, over the runs, up to 4 d."""
    curves = {}
    for system in _in_key(summary):
        runs = _outcomes(summary, system, sequence)
        if runs:
            places = np.concatenate([run.places for run in runs])
            unit = runs[0].unit
            errors = np.concatenate([run.position_errors for run in runs]) / unit
            part = (places * STRETCHES).astype(int)
            order = np.argsort(part)
            found, starts = np.unique(part[order], return_index=True)
            medians = [np.median(piece) for piece in np.split(errors[order], starts[1:])]
            curves[system] = ((found + 0.5) / STRETCHES, np.minimum(medians, 4.0) / 4)
    if not curves:
        return "<p>No run was scored.</p>"
    spoken = "; ".join(
        f"{names.systems[system]}: {4 * float(np.median(values)):.2g} d"
        for system, (_, values) in curves.items()
    )
    return _plot(
        curves,
        ("start", "end of the trajectory"),
        ("0", f"≥ {4 * unit:.3g} (4 d)"),
        f"Median position error along the way, up to 4 d. Typical: {spoken}",
        _in_key(summary),
    )


def _trajectories(trajectories: Mapping[str, Mapping[str, Any]], by: str, names: Names) -> str:
    """Return the data of each sequence, which a script puts into a page of trajectories."""
    if not trajectories:
        return "<p>No run was scored.</p>"
    elements = [
        data_element(f"own-{index}", data) for index, data in enumerate(trajectories.values())
    ]
    if (size := sum(map(len, elements)) / 1e6) > MOST:
        return (
            f"<p>The trajectories would take {size:.3g} MB, more than {MOST} MB, and are left out. "
            "<code>alignscores FORMAT REFERENCE ESTIMATE... --save_page FILE.html</code> makes a "
            "page of one sequence.</p>"
        )
    options = "".join(
        f'<option value="{index}">{escape(names.sequences[sequence])}</option>'
        for index, sequence in enumerate(trajectories)
    )
    html = _file("trajectories.html").format(options=options, by=escape(by))
    return "".join([html, data_element("own-page", page_without_data()), *elements])


def _plot(
    curves: Mapping[str, tuple[Floats, Floats]],
    across: tuple[str, str],
    up: tuple[str, str],
    spoken: str,
    order: Sequence[str],
) -> str:
    """Draw curves in a unit square."""
    width, height = CURVE
    marks = [
        f'<path class="axis" d="M{LEFT} {TOP}V{TOP + height}H{LEFT + width}"/>',
        f'<text x="{LEFT}" y="{TOP + height + 18}">{across[0]}</text>',
        f'<text x="{LEFT + width}" y="{TOP + height + 18}" text-anchor="end">{across[1]}</text>',
        f'<text x="{LEFT - 6}" y="{TOP + height}" text-anchor="end">{up[0]}</text>',
        f'<text x="{LEFT + 6}" y="{TOP - 6}">{up[1]}</text>',
    ]
    for system, (x, y) in curves.items():
        points = " ".join(
            f"{LEFT + width * right:.1f},{TOP + height * (1 - top):.1f}"
            for right, top in zip(x, y, strict=True)
        )
        marks.append(f'<polyline {_style(order.index(system))} points="{points}"/>')
    return _svg(LEFT + width + 8, TOP + height + BOTTOM, marks, spoken)


def _svg(width: int, height: int, marks: Iterable[str], spoken: str) -> str:
    return (
        f'<svg class="drawing" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{escape(spoken)}">{"".join(marks)}</svg>'
    )
