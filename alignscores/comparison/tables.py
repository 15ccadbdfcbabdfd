"""The comparison as text: for a terminal, CSV, Markdown and LaTeX."""

import csv
import math
import re
from collections.abc import Callable, Mapping, Sequence
from io import StringIO
from typing import Any

from ..evaluation.names import WIDTH, padded, text_width
from ..evaluation.notes import scale_note
from ..evaluation.settings import Settings
from ..metrics import metric
from .summary import Summary

__all__ = ["as_csv", "as_latex", "as_markdown", "as_text", "footnotes"]

Row = list[str]


def as_text(summary: Summary, by: str, names: dict[str, str]) -> str:
    """Return the tables for a terminal: over all, then sequence by sequence as far as they fit."""
    blocks = []
    for header, *rows in (
        _overall_rows(summary, by, names, _text_cell),
        _sequence_rows(summary, by, names, _text_cell),
    ):
        start = 1
        while start < len(header):
            end = len(header)
            while end > start + 1 and text_width(_block([header, *rows], start, end)[0]) > WIDTH:
                end -= 1
            blocks.append(_block([header, *rows], start, end))
            start = end
    return "\n\n".join("\n".join(line.rstrip() for line in lines) for lines in blocks)


def as_markdown(summary: Summary, by: str, names: dict[str, str]) -> str:
    """Return both tables in Markdown, the best in bold where it is certain."""
    escaped = {key: _markdown(name) for key, name in names.items()}

    def table(header: Row, *rows: Row) -> str:
        rule = ["---", *["---:"] * (len(header) - 1)]
        return "\n".join(f"| {' | '.join(row)} |" for row in (header, rule, *rows))

    return "\n\n".join(
        table(*rows(summary, by, escaped, _markdown_cell))
        for rows in (_overall_rows, _sequence_rows)
    )


def as_latex(summary: Summary, by: str, names: dict[str, str]) -> str:
    """Return one table for the package booktabs, the best in bold where it is certain."""
    escaped = {key: _tex(name) for key, name in names.items()}
    (_, *columns), *rows = _sequence_rows(summary, by, escaped, _tex_cell, overall=True)
    n_systems = len(summary.systems)
    lost = ", ".join(
        f"{names[system]} {summary.entries[system, None]['lost']:.1%}" for system in summary.systems
    )
    lines = [
        f"% {by}: mean over runs; bold: better than all others (95 % for all pairs of a column)",
        f"\\begin{{tabular}}{{l{'r' * len(columns)}}}",
        "\\toprule",
        " & ".join([_tex(summary.headers[by]), *columns]) + r" \\",
        "\\midrule",
        *(" & ".join(row) + r" \\" for row in rows),
        "\\bottomrule",
        "\\end{tabular}",
        f"% lost: {_tex(lost)}",
    ]
    return "\n".join(lines if n_systems > 1 else lines[1:])


def as_csv(summary: Summary) -> str:
    """Return one line a system and sequence, and one over all with an empty sequence."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns = [column for name in summary.headers for column in (name, f"{name}_sd")]
    counts = ["runs", "failed_runs", "n", "failures", "lost"]
    writer.writerow(["system", "sequence", *columns, "rank_best", "rank_worst", *counts])
    for entry in summary.in_order():
        writer.writerow(
            [
                entry["system"],
                entry["sequence"] or "",
                *("" if entry[column] is None else entry[column] for column in columns),
                *(entry["rank"]["PAS"] or ("", "")),
                *(entry[count] for count in counts),
            ]
        )
    return text.getvalue()


def number(value: float) -> str:
    """Return a value with four digits; a dash for one that is unknown."""
    if not math.isfinite(value):
        return "∞" if value > 0 else "-"
    return f"{value:.4f}" if abs(value) < 10 else f"{value:.4g}"


def rank_text(rank: Sequence[int] | None) -> str:
    """Return a rank, or the first and the last of those that systems share; a dash for none."""
    return "-" if rank is None else "-".join(map(str, dict.fromkeys(rank)))


def _text_cell(entry: Mapping[str, Any], name: str) -> str:
    """Return a value with its rank, and the number of runs that failed."""
    if not entry["runs"]:
        return "not tried"
    failed = f" †{entry['failed_runs']}" if entry["failed_runs"] and entry["sequence"] else ""
    return f"{number(entry[name])} ({rank_text(entry['rank'][name])}){failed}"


def _markdown_cell(entry: Mapping[str, Any], name: str) -> str:
    text = _text_cell(entry, name)
    if is_best(entry, name):
        value, _, rest = text.partition(" ")
        text = f"**{value}** {rest}"
    return text


def _tex_cell(entry: Mapping[str, Any], name: str) -> str:
    if not entry["runs"]:
        return "--"
    value = "$\\infty$" if entry[name] == math.inf else number(entry[name])
    failed = f"\\textsuperscript{{\\dag{entry['failed_runs']}}}" if entry["failed_runs"] else ""
    return (f"\\textbf{{{value}}}" if is_best(entry, name) else value) + failed


def is_best(entry: Mapping[str, Any], name: str) -> bool:
    """Tell whether a system is better than every other one, beyond doubt."""
    return bool(entry["rank"][name] == [1, 1])


Cell = Callable[[Mapping[str, Any], str], str]


def _overall_rows(summary: Summary, by: str, names: dict[str, str], cell: Cell) -> list[Row]:
    """Return a header and the values of each system over all sequences."""
    partly = _partly_tried(summary)
    header = ["system", f"rank ({summary.headers[by]})", *summary.headers.values()]
    rows = []
    for system in _by(summary, by):
        entry = summary.entries[system, None]
        rows.append(
            [
                names[system],
                rank_text(entry["rank"][by]),
                *(cell(entry, name) for name in summary.headers),
                *([f"{entry['sequences']}/{len(summary.sequences)}"] if partly else []),
                f"{entry['failed_runs']}/{entry['runs']}",
                f"{entry['lost']:.1%}",
            ]
        )
    header += ["sequences"] if partly else []
    return [[*header, "failed runs", "lost"], *rows]


def _sequence_rows(
    summary: Summary, by: str, names: dict[str, str], cell: Cell, *, overall: bool = False
) -> list[Row]:
    """Return a header and the values of each system on each sequence."""
    columns = [*summary.sequences, *([None] if overall else [])]
    rows = [
        [summary.headers[by], *(names[sequence] if sequence else "overall" for sequence in columns)]
    ]
    for system in _by(summary, by):
        cells = [cell(summary.entries[system, sequence], by) for sequence in columns]
        rows.append([names[system], *cells])
    return rows


def _by(summary: Summary, by: str) -> list[str]:
    """Return the systems from the best to the worst by a metric, over all."""
    sign = -1 if metric(by).family.larger_is_better else 1
    return sorted(summary.systems, key=lambda system: sign * summary.entries[system, None][by])


def _block(table: Sequence[Row], start: int, end: int) -> list[str]:
    """Return some columns beside the first, with their cells below each other."""
    rows = [[row[0], *row[start:end]] for row in table]
    widths = [max(map(text_width, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            [padded(row[0], widths[0])]
            + [padded(cell, -width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        )
        for row in rows
    ]


TEX = str.maketrans(
    {
        **{letter: f"\\{letter}" for letter in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        "[": "{[}",  # at the start of a row it, or a star, would be an option
        "*": "{*}",
    }
)


def _tex(text: str) -> str:
    return text.translate(TEX)


def _markdown(text: str) -> str:
    return re.sub(r"([\\`*\[\]<>|~&]|\b_|_\b)", r"\\\1", text)


def footnotes(summary: Summary, settings: Settings) -> list[str]:
    """Return what is said below the tables."""
    lines = [
        f"means over runs, overall over sequences; {settings.how_aligned}",
        "failed and missing runs count as failures",
    ]
    if settings.missing_cameras:
        lines[1] = f"missing cameras: {settings.missing_cameras}; {lines[1]}"
    if settings.form.timed:
        lines.append("lost: share of the time that was due without a pose")
    if note := scale_note(_scales(summary), settings):
        lines.append(note)
    if _partly_tried(summary):
        lines.append(
            "sequences: those that a system was tried on; pairs are ranked by those of both"
        )
    if len(summary.systems) > 1:
        ranked = all(entry["rank"][name] for entry in summary.in_order() for name in entry["rank"])
        lines.append(
            "(1-2): ranks, shared where they cannot be told apart (95 % for all pairs of a column)"
            if ranked
            else "no ranks where models are in different numbers of parts, which do not compare"
        )
    if any(entry["failed_runs"] for entry in summary.entries.values()):
        lines.append("†1: so many runs failed or are missing")
    return lines


def _scales(summary: Summary) -> dict[str, float | None]:
    """Return the scale of each system's runs that is farthest from 1, the one to be explained."""
    scales: dict[str, float | None] = dict.fromkeys(summary.systems)
    for result in summary.results:
        known, scale = scales[result["system"]], result["scale"]
        if scale and (known is None or abs(math.log(scale)) > abs(math.log(known))):
            scales[result["system"]] = scale
    return scales


def _partly_tried(summary: Summary) -> bool:
    """Tell whether some system was not tried on some sequence."""
    return any(not entry["runs"] for entry in summary.entries.values())
