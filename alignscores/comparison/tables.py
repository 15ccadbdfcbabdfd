"""The comparison as tables: for a terminal, CSV, Markdown and HTML."""

import math
import re
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

from ..evaluation.settings import Settings
from ..metrics import metric
from ..texts import WIDTH, csv_text, padded, text_width
from .summary import Entry, Summary

__all__ = ["Cell", "Table", "as_csv", "as_html", "as_markdown", "as_text"]
__all__ += ["conditions", "legend", "markdown", "number", "tables"]


class Cell(NamedTuple):
    """A text, what stands behind it, and whether it is bold."""

    text: str
    mark: str = ""
    best: bool = False

    def __str__(self) -> str:
        return f"{self.text} {self.mark}".rstrip()


class Table(NamedTuple):
    """Rows of cells below a header; the first cell of a row names it."""

    header: list[str]
    rows: list[list[Cell]]


def tables(summary: Summary, by: str) -> list[Table]:
    """Return the table of the systems over all, and the table of one metric by sequence."""
    return [_overall(summary, by), _by_sequence(summary, by)]


def _overall(summary: Summary, by: str) -> Table:
    """Return rank, means, failed runs and time without a pose of each system."""
    partly = any((a, s) not in summary.entries for a in summary.systems for s in summary.sequences)
    header = ["system", "rank", *summary.headers.values(), *(["sequences"] if partly else [])]
    rows = []
    for system in summary.ranked(by):
        entry = summary.entries[system, None]
        low, high = entry.failing
        rows.append(
            [
                Cell(system),
                _rank(entry, by),
                *(_value(entry, name, name == by) for name in summary.headers),
                *([Cell(f"{len(entry.results)}/{len(summary.sequences)}")] if partly else []),
                Cell(f"{entry.failed}/{entry.runs}", f"({100 * low:.0f}-{100 * high:.0f} %)"),
                Cell(f"{entry.lost:.1%}"),
            ]
        )
    return Table([*header, "failed runs", "no pose"], rows)


def _by_sequence(summary: Summary, by: str) -> Table:
    """Return a metric of each system on each sequence, and d."""
    header = [summary.headers[by], *summary.sequences]
    rows = []
    for system in summary.ranked(by):
        entries = [summary.entries.get((system, sequence)) for sequence in summary.sequences]
        cells = [
            _value(entry, by, ranked=True) if entry else Cell("not tried") for entry in entries
        ]
        rows.append([Cell(system), *cells])
    units = map(summary.unit, summary.sequences)
    rows.append(
        [
            Cell(f"d [{summary.length}]" if summary.length else "d"),
            *(Cell(f"{unit:.4g}") for unit in units),
        ]
    )
    return Table(header, rows)


def _rank(entry: Entry, by: str) -> Cell:
    """Return a rank, or the first and the last that a system may have."""
    if rank := entry.ranks[by]:
        return Cell("-".join(map(str, dict.fromkeys(rank))))
    return Cell("1 run" if entry.runs == len(entry.results) else "-")


def _value(entry: Entry, name: str, ranked: bool) -> Cell:
    """Return a mean, with its rank on a sequence and the number of failed runs.

    An error that some runs lack is the mean of the others.
    """
    rank = entry.ranks[name] if ranked else None
    larger = metric(name).larger_is_better
    value = entry.mean(name) if larger else entry.mean_of_scored(name)
    marks = [_rank(entry, name).text.join("()")] if rank and entry.sequence else []
    marks += [f"†{entry.failed}"] if entry.failed and entry.sequence else []
    return Cell(number(value), " ".join(marks), rank is not None and rank == (1, 1))


def number(value: float) -> str:
    """Return a value with four digits; a dash for one that is unknown."""
    if not math.isfinite(value):
        return "∞" if value == math.inf else "-"
    return f"{value:.4f}" if abs(value) < 10 else f"{value:.4g}"


def as_text(table: Table, columns: int = WIDTH) -> str:
    """Return a table for a terminal, in parts where it is wider than some columns."""
    rows = [table.header, *([str(cell) for cell in row] for row in table.rows)]
    blocks, start = [], 1
    while start < len(rows[0]):
        end = len(rows[0])
        while end > start + 1 and text_width(_block(rows, start, end)[0]) > columns:
            end -= 1
        blocks.append("\n".join(line.rstrip() for line in _block(rows, start, end)))
        start = end
    return "\n\n".join(blocks)


def _block(table: Sequence[Sequence[str]], start: int, end: int) -> list[str]:
    """Return some columns with the first, their cells below each other."""
    rows = [[row[0], *row[start:end]] for row in table]
    first, *others = [max(map(text_width, column)) for column in zip(*rows, strict=True)]
    widths = [first, *(-width for width in others)]  # numbers end below each other
    return ["  ".join(map(padded, row, widths)) for row in rows]


def as_markdown(table: Table) -> str:
    """Return a table in Markdown, the best in bold where it is significantly ahead."""
    rule = ["---", *["---:"] * (len(table.header) - 1)]
    rows = [[*map(markdown, table.header)], rule, *(map(_markdown_cell, row) for row in table.rows)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _markdown_cell(cell: Cell) -> str:
    text = f"**{markdown(cell.text)}**" if cell.best else markdown(cell.text)
    return f"{text} {markdown(cell.mark)}".rstrip()


def as_html(table: Table, caption: str = "") -> str:
    """Return a table, whose cells stand below each other where the screen is too narrow."""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in table.header)
    rows = "".join(
        f'<tr><th scope="row">{escape(first.text)}</th>'
        f"{''.join(map(_html_cell, table.header[1:], cells))}</tr>"
        for first, *cells in table.rows
    )
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    return (
        f'<table class="stacked">{title}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    )


def _html_cell(name: str, cell: Cell) -> str:
    """Return a cell with the name of its column, for narrow screens."""
    best = ' class="best"' if cell.best else ""
    mark = f' <span class="rank">{escape(cell.mark)}</span>' if cell.mark else ""
    return f'<td data-label="{escape(name)}"{best}><span>{escape(cell.text)}{mark}</span></td>'


def as_csv(summary: Summary) -> str:
    """Return one line a system and sequence, and one over all with an empty sequence."""
    rows = [entry.to_dict() for entry in summary.entries.values()]
    lines = [["" if v is None or v != v else v for v in row.values()] for row in rows]  # NaN
    return csv_text(list(rows[0]), lines)


def markdown(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return re.sub(r"([\\`*\[\]<>|~&]|\b_|_\b)", r"\\\1", text)


def legend(summary: Summary, settings: Settings) -> list[str]:
    """Return the two lines below the tables."""
    lines = [f"means over runs, then sequences; a failed run scores 0; {settings.how_aligned}"]
    marks = []
    ranks = [rank for entry in summary.entries.values() for rank in entry.ranks.values() if rank]
    if any(best != worst for best, worst in ranks):
        marks.append("(1-2): not significantly different (5 %, all pairs of a column)")
    if any(result.failed for result in summary.results):
        marks.append("†1: a failed or missing run; errors are of the others")
    return lines + (["; ".join(marks)] if marks else [])


def conditions(settings: Settings) -> list[str]:
    """Return what else there is to say about the numbers."""
    lines = [
        "failed runs: in brackets the 95 % interval of how often a run fails",
        f"missing cameras: {settings.missing}",
    ]
    if settings.form.timed:
        lines.append("no pose: share of the expected time without a pose")
    return lines
