"""A comparison as it is printed and saved."""

import json
from dataclasses import dataclass
from textwrap import fill

from ..comparison.baseline import Changes, changes_table
from ..comparison.comparison import Comparison, csv_of_runs
from ..comparison.tables import (
    MARKDOWN,
    as_latex,
    as_markdown,
    as_text,
    by_sequence,
    conditions,
    legend,
    markdown,
    notes_of,
    overall,
)
from ..texts import printable
from .output import table_width

__all__ = ["Report"]


@dataclass(frozen=True, eq=False)
class Report:
    """A comparison, what changed since a saved one, and why the build fails."""

    found: Comparison
    changed: Changes | None
    reasons: list[str]

    def written(self, form: str, *, verbose: bool = False) -> str:
        """Return it as text, json, csv, markdown, latex or html."""
        match form:
            case "json":
                baseline = {"baseline": self.changed.to_dict()} if self.changed else {}
                content = self.found.to_dict() | baseline
                return json.dumps(content, indent=2, allow_nan=False) + "\n"
            case "csv":
                return csv_of_runs(self.found.runs)
            case "html":
                from ..show.comparison_page import page_of_comparison  # needs plotly

                return page_of_comparison(self.found, self.changed, self.reasons)
            case "markdown":
                return self._markdown()
            case "latex":
                return as_latex(self.found)
        return self._text(verbose=verbose)

    def _text(self, *, verbose: bool) -> str:
        """Return verdict, notes, tables and what changed for a terminal."""
        found, width = self.found, table_width()
        notes = [f"note: {note}" for note in found.notes + (found.low_scores if verbose else [])]
        parts = ["\n".join(fill(line, width) for line in lines) for lines in (found.verdict, notes)]
        parts += [as_text(table, width) for table in (overall(found), by_sequence(found))]
        parts.append("\n".join(legend(found) + (conditions(found.settings) if verbose else [])))
        if self.changed:
            header = f"{found.by} against {printable(self.changed.file)}"
            table = as_text(changes_table(self.changed), width)
            parts.append("\n".join([header, table, *self.changed.notes]))
        return "\n\n".join(filter(None, parts)) + "\n"

    def _markdown(self) -> str:
        """Return verdict, notes, what changed, and tables in Markdown."""
        found = self.found
        parts = [f"**Fails:** {markdown(reason)}" for reason in self.reasons]
        parts += map(markdown, found.verdict)
        parts.append("\n".join(f"- {markdown(note)}" for note in notes_of(found)))
        if self.changed:
            parts.append(f"{found.by} against {markdown(printable(self.changed.file))}:")
            parts.append(as_markdown(changes_table(self.changed, MARKDOWN)))
            parts += map(markdown, self.changed.notes)
        parts += [as_markdown(table(found, MARKDOWN)) for table in (overall, by_sequence)]
        return "\n\n".join(filter(None, [*parts, *map(markdown, legend(found))])) + "\n"
