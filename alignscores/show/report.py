"""A comparison in words and tables: for a terminal, Markdown and JSON."""

import json
from collections.abc import Sequence
from textwrap import fill

from ..comparison.baseline import Changes, changes_table
from ..comparison.comparison import Comparison
from ..comparison.tables import (
    MARKDOWN,
    as_markdown,
    as_text,
    by_sequence,
    conditions,
    legend,
    notes_of,
    overall,
)
from ..texts import in_markdown, printable

__all__ = ["json_report", "markdown_report", "text_report"]


def text_report(
    comparison: Comparison, changed: Changes | None = None, *, columns: int, verbose: bool = False
) -> str:
    """Return verdict, notes, tables and what changed for a terminal."""
    notes = [
        f"note: {note}" for note in comparison.notes + (comparison.low_scores if verbose else [])
    ]
    parts = [
        "\n".join(fill(line, columns) for line in lines) for lines in (comparison.verdict, notes)
    ]
    parts += [as_text(table, columns) for table in (overall(comparison), by_sequence(comparison))]
    parts.append(
        "\n".join(legend(comparison) + (conditions(comparison.settings) if verbose else []))
    )
    if changed:
        header = f"{comparison.by} against {printable(changed.file)}"
        table = as_text(changes_table(changed), columns)
        parts.append("\n".join([header, table, *changed.notes]))
    return "\n\n".join(filter(None, parts)) + "\n"


def markdown_report(
    comparison: Comparison, changed: Changes | None = None, reasons: Sequence[str] = ()
) -> str:
    """Return verdict, all notes, what changed, and tables in Markdown."""
    parts = [f"**Fails:** {in_markdown(reason)}" for reason in reasons]
    parts += map(in_markdown, comparison.verdict)
    parts.append("\n".join(f"- {in_markdown(note)}" for note in notes_of(comparison)))
    if changed:
        parts.append(f"{comparison.by} against {in_markdown(changed.file)}:")
        parts.append(as_markdown(changes_table(changed, MARKDOWN)))
        parts += map(in_markdown, changed.notes)
    parts += [as_markdown(table(comparison, MARKDOWN)) for table in (overall, by_sequence)]
    parts += map(in_markdown, legend(comparison, MARKDOWN))
    return "\n\n".join(filter(None, parts)) + "\n"


def json_report(comparison: Comparison, changed: Changes | None = None) -> str:
    """Return the comparison, and what changed, as JSON."""
    baseline = {"baseline": changed.to_dict()} if changed else {}
    return json.dumps(comparison.to_dict() | baseline, indent=2, allow_nan=False) + "\n"
