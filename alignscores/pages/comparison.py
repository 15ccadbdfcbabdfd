"""The page of a comparison: verdict, tables and drawings, without scripts."""

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from ..comparison.baseline import Changes
from ..comparison.comparison import Comparison
from ..comparison.runs import Outcome
from ..comparison.summary import Summary
from ..comparison.tables import as_html, conditions, legend, tables
from ..texts import printable
from .document import document, source
from .drawings import dots, errors_over_time, forest, style

__all__ = ["page"]

MORE = """\
<p>Trajectories and the errors of each frame of one sequence:
<code>alignscores REF EST... --save_page FILE.html</code></p>"""


def page(comparison: Comparison, by: str, changed: Changes | None = None) -> str:
    """Return the page; `by` is the metric of the verdict and of the drawings."""
    verdict = comparison.verdict(by) or [
        f"{by} of {', '.join(comparison.summary.system_names.values())}"
    ]
    title = re.split(r": .+ wins \d|: it wins \d|\.$", verdict[0])[0]
    sections = _sections(comparison, by)
    if changed:
        table = as_html(
            changed.table(comparison.summary.system_names), f"Against {_short(changed.file)}"
        )
        content = table + _list(changed.notes)
        sections.insert(0, ("changes", f"Changes in {by}", content))
    links = "".join(
        f'<li><a href="#{name}">{escape(heading)}</a></li>' for name, heading, _ in sections
    )
    body = "".join(
        f'<section id="{name}" aria-labelledby="{name}-title"><h2 id="{name}-title">'
        f"{escape(heading)}</h2>{content}</section>"
        for name, heading, content in sections
    )
    lead = "".join(f"<p>{escape(line)}</p>" for line in verdict)
    return document(
        title,
        f"<header><h1>{escape(title)}</h1>{lead}"
        f'<nav aria-label="Sections"><ul>{links}</ul></nav></header>\n<main>{body}</main>',
        styles=("style.css", "page.css"),
    )


def _short(file: str) -> str:
    return printable(Path(file).name)


def _sections(comparison: Comparison, by: str) -> list[tuple[str, str, str]]:
    """Return name, heading and content of each section."""
    summary, settings = comparison.summary, comparison.settings
    overall, by_sequence = tables(summary, by)
    notes = [*legend(summary, settings), *conditions(settings)]
    pairs = summary.pairs_by(by)
    runs = {summary.sequence_names[s]: _runs(summary, by, s) for s in summary.sequences}
    errors = {summary.sequence_names[s]: _errors(comparison, s) for s in summary.sequences}
    sections = [
        ("overall", "All sequences", as_html(overall) + _list(notes)),
        ("sequences", f"{by} by sequence", as_html(by_sequence)),
        ("differences", f"Differences in {by}", forest(pairs, by, summary.system_names)),
        ("runs", f"{by} of each run", _panels(runs)),
        (
            "errors",
            "Errors over time",
            _key(summary) + source("bands.html") + _panels(errors) + MORE,
        ),
    ]
    return [section for section in sections if pairs or section[0] != "differences"]


def _list(lines: Sequence[str]) -> str:
    return f'<ul class="small">{"".join(f"<li>{escape(line)}</li>" for line in lines)}</ul>'


def _panels(drawings: dict[str, str]) -> str:
    """Return drawings, each with its caption."""
    figures = (
        f"<figure><figcaption>{escape(name)}</figcaption>{drawing}</figure>"
        for name, drawing in drawings.items()
    )
    return f'<div class="panels">{"".join(figures)}</div>'


def _key(summary: Summary) -> str:
    items = "".join(
        f'<li><svg width="34" height="10" aria-hidden="true"><path {style(index)} d="M0 5H34"/>'
        f"</svg> {escape(summary.system_names[system])}</li>"
        for index, system in enumerate(sorted(summary.systems))
    )
    return f'<ul class="key">{items}</ul>'


def _outcomes(summary: Summary, system: str, sequence: str) -> list[Outcome]:
    """Return the runs of a system that were scored."""
    return [r.outcome for r in summary.of(system, sequence) if not r.failed]


def _runs(summary: Summary, by: str, sequence: str) -> str:
    """Draw the scored runs of all systems that were tried on a sequence."""
    values = {}
    for system in summary.ranked(by):
        if entry := summary.entries.get((system, sequence)):
            failed = f" †{entry.failed}" if entry.failed else ""
            scored = [r.outcome.scores[by] for r in summary.of(system, sequence) if not r.failed]
            values[summary.system_names[system] + failed] = scored
    return dots(values, by)


def _errors(comparison: Comparison, sequence: str) -> str:
    """Draw the errors of all systems on a sequence over time."""
    summary, settings = comparison.summary, comparison.settings
    runs = {system: _outcomes(summary, system, sequence) for system in summary.systems}
    shown = {summary.system_names[a]: own for a, own in runs.items() if own}
    if not shown:
        return "<p>No run was scored.</p>"
    return errors_over_time(
        shown,
        [summary.system_names[system] for system in sorted(summary.systems)],
        (settings.max_threshold, settings.max_threshold_deg),
    )
