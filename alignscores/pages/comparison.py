"""The page of a comparison: verdict, notes, tables and drawings, without scripts."""

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

import pandas as pd

from ..comparison.baseline import Changes, changes_table
from ..comparison.comparison import Comparison
from ..comparison.tables import HTML, by_sequence, conditions, legend, overall
from ..texts import printable
from .charts import LEGEND, key
from .document import document, html_table
from .drawings import differences, errors_over_time, runs

__all__ = ["overview", "page"]

MEDIANS = """\
<p class="small">Median over the runs of a system, shaded where most have no pose; below, a band for
each run.</p>"""
MORE = """\
<p class="small"><code>alignscores REF EST... --save_page FILE.html</code> writes a page of one
sequence, with its trajectories and the errors of each frame.</p>"""


def overview(found: Comparison) -> str:
    """Return verdict, notes and tables for a notebook."""
    lines = "<br>".join(map(escape, [*found.verdict, *found.notes, *legend(found)]))
    return (
        f"<p>{lines}</p>{''.join(_table(table(found, HTML)) for table in (overall, by_sequence))}"
    )


def page(found: Comparison, changed: Changes | None = None) -> str:
    """Return the page."""
    by = found.by
    verdict = found.verdict or [f"{by} of {', '.join(found.overall['system'])}"]
    title = re.split(r": .+ wins \d|: it wins \d|\.$", verdict[0])[0]
    sections = _sections(found)
    if changed:
        caption = escape(f"Against {printable(Path(changed.file).name)}")
        table = _table(changes_table(changed, HTML), caption)
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
        f"<header><h1>{escape(title)}</h1>{lead}{_list(found.notes)}"
        f'<nav aria-label="Sections"><ul>{links}</ul></nav></header>\n<main>{body}</main>',
        ["style.css"],
    )


def _sections(found: Comparison) -> list[tuple[str, str, str]]:
    """Return name, heading and content of each section."""
    by, sequences = found.by, found.runs["sequence"].unique().tolist()
    legends = [*legend(found), *conditions(found.settings)]
    pairs = found.pairs[found.pairs["sequence"].isna()]
    of_runs = [(s, runs(found, s)) for s in sequences]
    sections = [
        ("overall", "All sequences", _table(overall(found, HTML)) + _list(legends)),
        ("sequences", f"{by} by sequence", _table(by_sequence(found, HTML))),
    ]
    if pairs["difference"].notna().any():
        sections.append(("differences", f"Differences in {by}", differences(pairs, by)))
    sections.append(("runs", f"{by} of each run", _panels(of_runs)))
    if found.errors:
        errors = [(s, errors_over_time(found, s)) for s in sequences]
        systems = sorted(found.overall["system"])
        over_time = key(systems) + MEDIANS + LEGEND + _panels(errors) + MORE
        sections.append(("errors", "Errors over time", over_time))
    return sections


def _table(table: pd.DataFrame, caption: str = "") -> str:
    """Return a table whose texts are HTML."""
    return html_table(list(table.columns), table.to_numpy().tolist(), caption)


def _list(lines: Sequence[str]) -> str:
    if not lines:
        return ""
    return f'<ul class="small">{"".join(f"<li>{escape(line)}</li>" for line in lines)}</ul>'


def _panels(drawings: Sequence[tuple[str, str]]) -> str:
    """Return drawings, each with its caption."""
    figures = (
        f"<figure><figcaption>{escape(name)}</figcaption>{drawing}</figure>"
        for name, drawing in drawings
    )
    return f'<div class="panels">{"".join(figures)}</div>'
