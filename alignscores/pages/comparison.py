"""The page of a comparison: verdict, tables and drawings, without scripts."""

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from ..comparison.baseline import Changes
from ..comparison.comparison import Comparison
from ..comparison.tables import as_html, conditions, legend, tables
from ..texts import printable
from .charts import LEGEND, key
from .document import document
from .drawings import differences, errors_over_time, runs

__all__ = ["page"]

MEDIANS = """\
<p class="small">Median over the runs of a system, shaded where most have no pose; below, a band for
each run.</p>"""
MORE = """\
<p class="small"><code>alignscores REF EST... --save_page FILE.html</code> writes a page of one
sequence, with its trajectories and the errors of each frame.</p>"""


def page(comparison: Comparison, by: str, changed: Changes | None = None) -> str:
    """Return the page; `by` is the metric of the verdict and of the drawings."""
    verdict = comparison.verdict(by) or [f"{by} of {', '.join(comparison.summary.systems)}"]
    title = re.split(r": .+ wins \d|: it wins \d|\.$", verdict[0])[0]
    sections = _sections(comparison, by)
    if changed:
        caption = f"Against {printable(Path(changed.file).name)}"
        table = as_html(changed.table(), caption)
        sections.insert(0, ("changes", f"Changes in {by}", table + _list(changed.notes)))
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
        ["style.css"],
    )


def _sections(comparison: Comparison, by: str) -> list[tuple[str, str, str]]:
    """Return name, heading and content of each section."""
    summary, settings = comparison.summary, comparison.settings
    overall, by_sequence = tables(summary, by)
    notes = [*legend(summary, settings), *conditions(settings)]
    pairs = summary.pairs_by(by)
    of_runs = [(s, runs(summary, by, s)) for s in summary.sequences]
    errors = [(s, errors_over_time(comparison, s)) for s in summary.sequences]
    over_time = key(sorted(summary.systems)) + MEDIANS + LEGEND + _panels(errors) + MORE
    sections = [
        ("overall", "All sequences", as_html(overall) + _list(notes)),
        ("sequences", f"{by} by sequence", as_html(by_sequence)),
        ("differences", f"Differences in {by}", differences(pairs, by)),
        ("runs", f"{by} of each run", _panels(of_runs)),
        ("errors", "Errors over time", over_time),
    ]
    return [section for section in sections if pairs or section[0] != "differences"]


def _list(lines: Sequence[str]) -> str:
    return f'<ul class="small">{"".join(f"<li>{escape(line)}</li>" for line in lines)}</ul>'


def _panels(drawings: Sequence[tuple[str, str]]) -> str:
    """Return drawings, each with its caption."""
    figures = (
        f"<figure><figcaption>{escape(name)}</figcaption>{drawing}</figure>"
        for name, drawing in drawings
    )
    return f'<div class="panels">{"".join(figures)}</div>'
