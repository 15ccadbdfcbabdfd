"""A comparison as it is printed and saved."""

import json
from dataclasses import dataclass
from textwrap import fill

from ..comparison.baseline import Changes
from ..comparison.comparison import Comparison, finite
from ..comparison.tables import as_csv, as_markdown, as_text, conditions, legend, markdown, tables
from ..pages.comparison import page
from ..texts import printable
from .output import table_width

__all__ = ["Report"]


@dataclass(frozen=True, eq=False)
class Report:
    """A comparison by one metric, what changed since a saved one, and why the build fails."""

    comparison: Comparison
    by: str
    changed: Changes | None
    reasons: list[str]

    def written(self, form: str, *, verbose: bool = False) -> str:
        """Return it as text, json, csv, markdown or html."""
        match form:
            case "json":
                baseline = {"baseline": finite(self.changed.to_dict())} if self.changed else {}
                content = self.comparison.to_dict() | baseline
                return json.dumps(content, indent=2, allow_nan=False) + "\n"
            case "csv":
                return as_csv(self.comparison.summary)
            case "html":
                return page(self.comparison, self.by, self.changed)
            case "markdown":
                return self._markdown()
        return self._text(verbose=verbose)

    def _text(self, *, verbose: bool) -> str:
        """Return verdict, tables and what changed for a terminal."""
        summary, settings, width = self.comparison.summary, self.comparison.settings, table_width()
        verdict = [fill(line, width) for line in self.comparison.verdict(self.by)]
        shown = [as_text(table, width) for table in tables(summary, self.by)]
        below = legend(summary, settings) + (conditions(settings) if verbose else [])
        parts = ["\n".join(verdict), *shown, "\n".join(below)]
        if self.changed:
            header = f"{self.by} against {printable(self.changed.file)}"
            table = as_text(self.changed.table(), width)
            parts.append("\n".join([header, table, *self.changed.notes]))
        return "\n\n".join(filter(None, parts)) + "\n"

    def _markdown(self) -> str:
        """Return verdict, what changed, and tables in Markdown."""
        summary, settings = self.comparison.summary, self.comparison.settings
        parts = [f"**Fails:** {markdown(reason)}" for reason in self.reasons]
        parts += map(markdown, self.comparison.verdict(self.by))
        if self.changed:
            parts.append(f"{self.by} against {markdown(printable(self.changed.file))}:")
            parts.append(as_markdown(self.changed.table()))
            parts += map(markdown, self.changed.notes)
        parts += [as_markdown(table) for table in tables(summary, self.by)]
        return "\n\n".join([*parts, *map(markdown, legend(summary, settings))]) + "\n"
