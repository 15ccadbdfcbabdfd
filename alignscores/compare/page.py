"""One self-contained page: table, heat map, profiles, errors along the way, and scattered runs."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from .runs import Outcome, larger_is_better
from .summary import Summary
from .tables import HEADERS, number, rank_text

__all__ = ["page"]

Floats = NDArray[np.float64]

DASHES = "", "6 3", "2 3", "8 3 2 3", "1 2"  # tell curves apart without colours
N_COLOURS = 8
CURVE = 640, 260  # width and height of the drawings, without their margins
LEFT, TOP, BOTTOM = 52, 12, 40
STRETCHES = 120  # parts of a trajectory whose median error is drawn
FRACTIONS = np.linspace(0.005, 1, 60)


def page(summary: Summary, by: str, names: Mapping[str, str], footnotes: Sequence[str]) -> str:
    """Return the page; the same input gives the same bytes.

    Parameters
    ----------
    summary : Summary
        What is shown.
    by : str
        Metric of the heat map and of the scattered runs.
    names : mapping of str to str
        Names of systems and sequences as they are shown.
    footnotes : sequence of str
        What is said below the table.
    """
    title = f"{len(summary.systems)} systems on {len(summary.sequences)} sequences"
    sections = [
        ("overall", "Over all sequences", _table(summary, names, footnotes)),
        ("sequences", f"{by} by sequence", _heat_map(summary, by, names)),
        ("differences", f"Differences in {by}, over all", _differences(summary, by, names)),
        (
            "runs",
            f"{by} of each run",
            _each(summary, lambda one: _runs(summary, by, one, names), names),
        ),
        (
            "profiles",
            "Share of the cameras within an error",
            _key(summary, names) + _each(summary, lambda one: _profiles(summary, one), names),
        ),
        (
            "errors",
            "Position error along the way",
            _key(summary, names) + _each(summary, lambda one: _errors(summary, one), names),
        ),
    ]
    own = files(__package__)
    links = "".join(
        f'<li><a href="#{key}">{escape(heading)}</a></li>' for key, heading, _ in sections
    )
    body = "".join(
        f'<section id="{key}" aria-labelledby="{key}-title"><h2 id="{key}-title">'
        f"{escape(heading)}</h2>{content}</section>"
        for key, heading, content in sections
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n<style>\n{own.joinpath('page.css').read_text('utf-8')}"
        f"</style>\n</head>\n<body>\n<header><h1>{escape(title)}</h1>"
        f'<nav aria-label="Sections"><ul>{links}</ul></nav></header>\n<main>{body}</main>\n'
        f"<script>\n{own.joinpath('page.js').read_text('utf-8')}</script>\n</body>\n</html>\n"
    )


def _table(summary: Summary, names: Mapping[str, str], footnotes: Sequence[str]) -> str:
    """Return the sortable table of the systems over all sequences."""
    headers = ["system", *(HEADERS.get(name, name) for name in summary.metrics)]
    headers += ["failed runs", "lost frames"]
    head = "".join(f'<th scope="col">{escape(header)}</th>' for header in headers)
    rows = []
    for system in summary.systems:
        entry = summary.entries[system, None]
        cells = [
            _cell(entry[name], f"{number(entry[name])}", entry["rank"][name])
            for name in summary.metrics
        ]
        cells.append(_cell(entry["failed_runs"], f"{entry['failed_runs']}/{entry['runs']}"))
        lost = entry["failures"] / max(entry["n"], 1)
        cells.append(_cell(lost, f"{lost:.1%}"))
        rows.append(f'<tr><th scope="row">{escape(names[system])}</th>{"".join(cells)}</tr>')
    notes = "".join(f"<li>{escape(note)}</li>" for note in footnotes)
    return (
        '<div class="scroll" tabindex="0" role="group" aria-labelledby="overall-title">'
        f'<table class="sortable"><thead><tr>{head}</tr></thead>'
        f'<tbody>{"".join(rows)}</tbody></table></div><ul class="small">{notes}</ul>'
    )


def _cell(value: float, text: str, rank: Sequence[int] = ()) -> str:
    key = f"{value:.9g}" if math.isfinite(value) else "1e999"
    place = f' <span class="rank">({rank_text(rank)})</span>' if rank else ""
    best = ' class="best"' if tuple(rank) == (1, 1) else ""
    return f'<td data-key="{key}"{best}>{text}{place}</td>'


def _heat_map(summary: Summary, by: str, names: Mapping[str, str]) -> str:
    """Return the table of systems by sequences, shaded from the worst to the best value."""
    values = [
        summary.entries[system, sequence][by]
        for system in summary.systems
        for sequence in summary.sequences
    ]
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    if larger_is_better(by):
        low, high = 0.0, max(1.0, high) if high <= 1 else high
    head = "".join(f'<th scope="col">{escape(names[one])}</th>' for one in summary.sequences)
    rows = []
    for system in summary.systems:
        cells = []
        for sequence in summary.sequences:
            entry = summary.entries[system, sequence]
            value = min(max(entry[by], low), high)
            share = (value - low) / (high - low) if high > low else 1.0
            share = share if larger_is_better(by) else 1 - share
            failed = entry["failed_runs"]
            lost = f'<span class="small">{failed} failed</span>' if failed else ""
            best = " best" if tuple(entry["rank"][by]) == (1, 1) else ""
            cells.append(
                f'<td class="heat{best}" style="--share:{round(100 * share)}%">{number(entry[by])} '
                f'<span class="rank">({rank_text(entry["rank"][by])})</span>{lost}</td>'
            )
        rows.append(f'<tr><th scope="row">{escape(names[system])}</th>{"".join(cells)}</tr>')
    return (
        '<div class="scroll" tabindex="0" role="group" aria-labelledby="sequences-title">'
        f'<table><thead><tr><th scope="col">system</th>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _differences(summary: Summary, by: str, names: Mapping[str, str]) -> str:
    rows = [
        f'<tr><th scope="row">{escape(names[one["a"]])} − {escape(names[one["b"]])}</th>'
        f"<td>{_signed(one['difference'])}</td><td>{_signed(one['low'])} to "
        f"{_signed(one['high'])}</td><td>{'yes' if one['distinguishable'] else 'no'}</td></tr>"
        for one in summary.comparisons
        if one["sequence"] is None and one["metric"] == by
    ]
    if not rows:
        return "<p>There is one system.</p>"
    return (
        '<div class="scroll" tabindex="0" role="group" aria-labelledby="differences-title"><table>'
        '<thead><tr><th scope="col">systems</th><th scope="col">difference</th>'
        '<th scope="col">95 %, all pairs at once</th><th scope="col">told apart</th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _signed(value: float) -> str:
    return f"{value:+.4f}".replace("-", "−") if math.isfinite(value) else "unknown"


def _each(summary: Summary, draw: Callable[[str], str], names: Mapping[str, str]) -> str:
    """Return a drawing for each sequence, the first of them unfolded."""
    return "".join(
        f"<details{' open' if index == 0 else ''}><summary>{escape(names[sequence])}</summary>"
        f'<div class="scroll" tabindex="0" role="group" aria-label="{escape(names[sequence])}">'
        f"{draw(sequence)}</div></details>"
        for index, sequence in enumerate(summary.sequences)
    )


def _key(summary: Summary, names: Mapping[str, str]) -> str:
    items = "".join(
        f'<li><svg width="34" height="10" aria-hidden="true"><path {_style(index)} d="M0 5H34"/>'
        f"</svg> {escape(names[system])}</li>"
        for index, system in enumerate(_in_key(summary))
    )
    return f'<ul class="key">{items}</ul>'


def _in_key(summary: Summary) -> list[str]:
    return sorted(summary.systems)


def _style(index: int) -> str:
    dash = DASHES[index // N_COLOURS % len(DASHES)] or DASHES[index % 2]
    return f'class="curve c{index % N_COLOURS}" stroke-dasharray="{dash or "none"}"'


def _outcomes(summary: Summary, system: str, sequence: str) -> list[Outcome]:
    """Return the runs of a system that were scored."""
    return [
        outcome
        for run, outcome in summary.runs
        if (run.system, run.sequence) == (system, sequence) and outcome.n
    ]


def _runs(summary: Summary, by: str, sequence: str, names: Mapping[str, str]) -> str:
    """Draw each run as a dot on the line of its system."""
    width, row = CURVE[0], 26
    label = 130
    results = {
        system: [
            {**one, **one["metrics"]}[by]
            for one in summary.results
            if (one["system"], one["sequence"]) == (system, sequence)
        ]
        for system in summary.systems
    }
    finite = [one for own in results.values() for one in own if math.isfinite(one)]
    low, high = min([0.0, *finite]), max([*finite, 1.0 if larger_is_better(by) else 1e-9])
    marks = []
    for index, (system, own) in enumerate(results.items()):
        y = row * index + row / 2
        name = escape(names[system][:18])
        marks.append(
            f'<text x="{label - 8}" y="{y + 4:g}" text-anchor="end">{name}</text>'
            f'<path class="axis" d="M{label} {y:g}H{width}"/>'
        )
        for value in own:
            if math.isfinite(value):
                x = label + (width - label - 8) * (value - low) / (high - low)
                marks.append(f'<circle class="dot" cx="{x:.1f}" cy="{y:g}" r="4"/>')
    height = row * len(results) + 22
    marks.append(
        f'<text x="{label}" y="{height - 4}">{low:.3g}</text>'
        f'<text x="{width}" y="{height - 4}" text-anchor="end">{high:.3g}</text>'
    )
    spoken = "; ".join(
        f"{system}: {', '.join(number(value) for value in own)}" for system, own in results.items()
    )
    return _svg(width, height, marks, f"{by} of each run. {spoken}")


def _profiles(summary: Summary, sequence: str) -> str:
    """Draw the cumulative share of the position errors up to 4 d, means over the runs."""
    units = [one.unit for system in summary.systems for one in _outcomes(summary, system, sequence)]
    if not units:
        return "<p>No run was scored.</p>"
    limit = 4 * max(units)
    curves = {}
    for system in _in_key(summary):
        runs = _outcomes(summary, system, sequence)
        n_runs = summary.entries[system, sequence]["runs"]
        total = sum(
            (np.mean(one.position_errors[:, None] < FRACTIONS * limit, axis=0) for one in runs),
            np.zeros(len(FRACTIONS)),
        )
        curves[system] = (FRACTIONS, total / n_runs)
    spoken = "; ".join(
        f"{system}: {values[len(values) // 4 - 1]:.0%} within d"
        for system, (_, values) in curves.items()
    )
    return _plot(
        curves, ("0", f"error {limit:.3g} (4 d)"), ("0", "100 %"), f"Share of cameras. {spoken}"
    )


def _errors(summary: Summary, sequence: str) -> str:
    """Draw the median position error in each part of the trajectory, over the runs, up to 4 d."""
    curves = {}
    units = [1.0]
    for system in _in_key(summary):
        runs = _outcomes(summary, system, sequence)
        if runs:
            places = np.concatenate([one.places for one in runs])
            errors = np.concatenate([one.position_errors for one in runs]) / runs[0].unit
            units = [runs[0].unit]
            part = np.minimum((places * STRETCHES).astype(int), STRETCHES - 1)
            order = np.argsort(part, kind="stable")
            found, starts = np.unique(part[order], return_index=True)
            medians = [np.median(piece) for piece in np.split(errors[order], starts[1:])]
            curves[system] = ((found + 0.5) / STRETCHES, np.minimum(medians, 4.0) / 4)
    if not curves:
        return "<p>No run was scored.</p>"
    spoken = "; ".join(
        f"{system}: {4 * float(np.median(values)):.2g} d" for system, (_, values) in curves.items()
    )
    return _plot(
        curves,
        ("start", "end of the trajectory"),
        ("0", f"≥ {4 * units[0]:.3g} (4 d)"),
        f"Median position error along the way, up to 4 d. Typical: {spoken}",
        _in_key(summary),
    )


def _plot(
    curves: Mapping[str, tuple[Floats, Floats]],
    across: tuple[str, str],
    up: tuple[str, str],
    spoken: str,
    order: Sequence[str] = (),
) -> str:
    """Draw curves in a unit square."""
    width, height = CURVE
    marks = [
        f'<path class="axis" d="M{LEFT} {TOP}V{TOP + height}H{LEFT + width}"/>',
        f'<text x="{LEFT}" y="{TOP + height + 18}">{across[0]}</text>',
        f'<text x="{LEFT + width}" y="{TOP + height + 18}" text-anchor="end">{across[1]}</text>',
        f'<text x="{LEFT - 6}" y="{TOP + height}" text-anchor="end">{up[0]}</text>',
        f'<text x="{LEFT + 6}" y="{TOP + 10}">{up[1]}</text>',
    ]
    places = list(order or curves)
    for system, (x, y) in curves.items():
        points = " ".join(
            f"{LEFT + width * one:.1f},{TOP + height * (1 - other):.1f}"
            for one, other in zip(x, y, strict=True)
        )
        marks.append(f'<polyline {_style(places.index(system))} points="{points}"/>')
    return _svg(LEFT + width + 8, TOP + height + BOTTOM, marks, spoken)


def _svg(width: int, height: int, marks: Iterable[str], spoken: str) -> str:
    return (
        f'<svg class="drawing" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{escape(spoken)}">{"".join(marks)}</svg>'
    )
