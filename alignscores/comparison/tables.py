"""The comparison as text: for a terminal, CSV, Markdown and LaTeX."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from ..evaluation.notes import scale_note
from ..evaluation.settings import Settings
from ..metrics import metric
from ..texts import WIDTH, column_widths, csv_text, padded, text_width
from .answers import QUESTIONS
from .intervals import MOST_NEEDED, error_of_pair, largest_scatter
from .summary import Summary

__all__ = ["Names", "as_csv", "as_latex", "as_markdown", "as_text", "footnotes", "some_failed"]

Row = list[str]


class Names(NamedTuple):
    """How systems and sequences are called."""

    systems: dict[str, str]
    sequences: dict[str, str]

    def written(self, write: Callable[[str], str]) -> "Names":
        """Return the names as they are written in some format."""
        return Names(*({key: write(name) for key, name in names.items()} for names in self))


def as_text(summary: Summary, by: str, names: Names, columns: int = WIDTH) -> str:
    """Return the tables for a terminal, in parts where they are wider than some columns."""
    blocks = []
    for header, *rows in (
        _overall_rows(summary, by, names, _text_cell),
        _sequence_rows(summary, by, names, _text_cell),
    ):
        start = 1
        while start < len(header):
            end = len(header)
            while end > start + 1 and text_width(_block([header, *rows], start, end)[0]) > columns:
                end -= 1
            blocks.append(_block([header, *rows], start, end))
            start = end
    return "\n\n".join("\n".join(line.rstrip() for line in lines) for lines in blocks)


def as_markdown(summary: Summary, by: str, names: Names) -> str:
    """Return both tables in Markdown, the best in bold where it is certain."""
    escaped = names.written(_markdown)

    def table(header: Row, *rows: Row) -> str:
        rule = ["---", *["---:"] * (len(header) - 1)]
        return "\n".join(f"| {' | '.join(row)} |" for row in (header, rule, *rows))

    return "\n\n".join(
        table(*rows(summary, by, escaped, _markdown_cell))
        for rows in (_overall_rows, _sequence_rows)
    )


def as_latex(summary: Summary, by: str, names: Names) -> str:
    """Return one table for the package booktabs, the best in bold where it is certain."""
    escaped = names.written(_tex)
    (_, *columns), *rows = _sequence_rows(summary, by, escaped, _tex_cell, overall=True)
    below: dict[str, Callable[[Mapping[str, Any]], str]] = {
        "lost": lambda entry: f"{entry['lost']:.1%}"
    }
    if some_failed(summary):
        below["failed runs"] = failures_text
        below[f"{by} of scored runs"] = lambda entry: number(entry["scored"][by])
    said = [
        f"{by}: mean over runs",
        *ranks_explained(summary, by, names, "bold: ahead of all others"),
    ]
    lines = [
        *(f"% {line}" for line in said),
        f"\\begin{{tabular}}{{l{'r' * len(columns)}}}",
        "\\toprule",
        " & ".join([_tex(summary.headers[by]), *columns]) + r" \\",
        "\\midrule",
        *(" & ".join(row) + r" \\" for row in rows),
        "\\bottomrule",
        "\\end{tabular}",
        *(
            f"% {_tex(what)}: "
            + ", ".join(
                _tex(f"{names.systems[system]} {told(summary.entries[system, None])}")
                for system in summary.systems
            )
            for what, told in below.items()
        ),
    ]
    return "\n".join(lines)


def as_csv(summary: Summary) -> str:
    """Return one line a system and sequence, and one over all with an empty sequence."""
    columns = [column for name in summary.headers for column in (name, f"{name}_sd")]
    counts = ["runs", "failed_runs", "n", "failures", "lost"]
    header = ["system", "sequence", *columns, "rank_best", "rank_worst", *counts]
    lines = (
        [
            entry["system"],
            entry["sequence"] or "",
            *("" if entry[column] is None else entry[column] for column in columns),
            *(entry["rank"]["PAS"] or ("", "")),
            *(entry[count] for count in counts),
        ]
        for entry in summary.in_order()
    )
    return csv_text(header, lines)


def number(value: float) -> str:
    """Return a value with four digits; a dash for one that is unknown."""
    if not math.isfinite(value):
        return "∞" if value == math.inf else "-"
    return f"{value:.4f}" if abs(value) < 10 else f"{value:.4g}"


def rank_text(rank: Sequence[int] | None) -> str:
    """Return a rank, or the first and the last of those that systems share; a dash for none."""
    return "-" if rank is None else "-".join(map(str, dict.fromkeys(rank)))


def _text_cell(entry: Mapping[str, Any], name: str) -> str:
    """Return a value with its rank, and the number of runs that failed."""
    if not entry["runs"]:
        return "not tried"
    failed = f" †{entry['failed_runs']}" if entry["failed_runs"] and entry["sequence"] else ""
    rank = f" ({rank_text(entry['rank'][name])})" if entry["rank"][name] else ""
    return f"{number(entry[name])}{rank}{failed}"


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
    """Tell whether a system is certainly ahead of every other one."""
    return bool(entry["rank"][name] == [1, 1])


Cell = Callable[[Mapping[str, Any], str], str]


def _overall_rows(summary: Summary, by: str, names: Names, cell: Cell) -> list[Row]:
    """Return a header and the values of each system over all sequences."""
    partly, failed = _partly_tried(summary), some_failed(summary)
    header = ["system", f"rank ({summary.headers[by]})", *summary.headers.values()]
    rows = []
    for system in _by(summary, by):
        entry = summary.entries[system, None]
        rows.append(
            [
                names.systems[system],
                rank_text(entry["rank"][by]),
                *(cell(entry, name) for name in summary.headers),
                *([f"{entry['sequences']}/{len(summary.sequences)}"] if partly else []),
                *([number(entry["scored"][by])] if failed else []),
                failures_text(entry),
                f"{entry['lost']:.1%}",
            ]
        )
    header += ["sequences"] if partly else []
    header += [f"{by} of scored runs"] if failed else []
    return [[*header, "failed runs", "lost"], *rows]


def failures_text(entry: Mapping[str, Any]) -> str:
    """Return how many runs failed, with the interval of the probability that one does."""
    low, high = entry["failing"]
    return f"{entry['failed_runs']}/{entry['runs']} ({100 * low:.0f}-{100 * high:.0f} %)"


def _sequence_rows(
    summary: Summary, by: str, names: Names, cell: Cell, *, overall: bool = False
) -> list[Row]:
    """Return a header and the values of each system on each sequence."""
    columns = [*summary.sequences, *([None] if overall else [])]
    rows = [
        [
            summary.headers[by],
            *(names.sequences[sequence] if sequence else "overall" for sequence in columns),
        ]
    ]
    for system in _by(summary, by):
        cells = [cell(summary.entries[system, sequence], by) for sequence in columns]
        rows.append([names.systems[system], *cells])
    return rows


def _by(summary: Summary, by: str) -> list[str]:
    """Return the systems from the best to the worst by a metric, over all."""
    larger_is_better = metric(by).family.larger_is_better

    def place(system: str) -> tuple[bool, float]:
        value = summary.entries[system, None][by]
        return math.isnan(value), -value if larger_is_better else value

    return sorted(summary.systems, key=place)


def _block(table: Sequence[Row], start: int, end: int) -> list[str]:
    """Return some columns beside the first, with their cells below each other."""
    rows = [[row[0], *row[start:end]] for row in table]
    first, *others = column_widths(rows)
    widths = [first, *(-width for width in others)]  # numbers end below each other
    return ["  ".join(map(padded, row, widths)) for row in rows]


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


def footnotes(summary: Summary, by: str, names: Names, settings: Settings) -> list[str]:
    """Return what is said below the tables."""
    lines = [
        f"means over runs, overall over sequences; {settings.how_aligned}",
        "failed and missing runs count as failures",
        "failed runs: in brackets, how often runs fail (95 %)",
    ]
    if settings.missing_cameras:
        lines[1] = f"missing cameras: {settings.missing_cameras}; {lines[1]}"
    if settings.form.timed:
        lines.append("lost: share of the time that was due without a pose")
    scales = {names.systems[system]: scale for system, scale in _scales(summary).items()}
    if note := scale_note(scales, settings):
        lines.append(note)
    if _partly_tried(summary):
        lines.append(
            "sequences: those that a system was tried on; pairs are ranked by those of both"
        )
    lines += ranks_explained(
        summary, by, names, "(1-2): ranks, shared where they cannot be told apart"
    )
    if some_failed(summary):
        lines.append("†1: so many runs failed or are missing")
    return lines


FOR = {  # by the questions of single sequences and over all
    ("new_runs", "new_runs"): "for new runs on these sequences",
    ("new_runs", "new_sequences"): "for new runs; over all, for new sequences like these",
    (None, "new_sequences"): "over all, for new sequences like these",
    ("new_runs", None): "on a sequence, for new runs",
}
NUMBERS = 3, 5, 10, 20, 50, 100  # of runs, of which is said what they can tell


def ranks_explained(summary: Summary, by: str, names: Names, what: str) -> list[str]:
    """Say what ranks are for and, where there are none or shared ones, how many runs would do."""
    pairs = [pair for pair in summary.comparisons if pair["metric"] == by]
    questions = {pair["sequence"]: pair["question"] for pair in pairs}
    over_all = questions.pop(None, None)
    on_sequences = next(filter(None, questions.values()), None)
    lines = []
    if over_all or on_sequences:
        lines.append(f"{what} (95 % for all pairs of a column)")
        lines.append(f"ranks are {FOR[on_sequences, over_all]}")
        lines.append(f"ranks are {_how_ranked(by)}")
    over_all_pairs = {
        frozenset((pair["a"], pair["b"])): pair for pair in pairs if pair["sequence"] is None
    }
    neighbours = [
        (over_all_pairs[frozenset(both)], " and ".join(names.systems[system] for system in both))
        for both in pairwise(_by(summary, by))
        if frozenset(both) in over_all_pairs
    ]
    if None in (over_all, *questions.values()) and neighbours:
        lines += _one_run(summary, *neighbours[0], by)
    what = "runs of each on each sequence" if over_all == QUESTIONS[0] else "sequences"
    lines += [
        f"{by} of {both}: {_certain_but(pair)}{_number_needed(pair)} {what} would do"
        for pair, both in neighbours
        if over_all and not pair["distinguishable"] and math.isfinite(pair["low"])
    ]
    if len(summary.systems) > 1 and not pairs:
        lines.append(
            "no ranks where models are in different numbers of parts, which do not compare"
        )
    return lines


def _how_ranked(by: str) -> str:
    if metric(by).family.larger_is_better:
        return "by means: a failure counts as 0, and one more would not change who is ahead"
    return "by errors of runs that did not fail, and by how often runs fail"


def _certain_but(pair: Mapping[str, Any]) -> str:
    """Say that failures alone leave the order open, where it is so."""
    certain = pair["low"] > 0 or pair["high"] < 0
    return "certain but for failures; " if certain else ""


def _number_needed(pair: Mapping[str, Any]) -> str:
    return f"about {pair['needed']}" if pair["needed"] else f"more than {MOST_NEEDED}"


def _one_run(summary: Summary, pair: Mapping[str, Any], both: str, by: str) -> list[str]:
    """Say why there are no ranks for new runs, and how many runs tell the first two apart."""
    lines = ["no ranks where systems have one run each: nothing tells how runs scatter"]
    gap = abs(pair["difference"])
    if gap and math.isfinite(gap):
        level = max(summary.entries[pair[key], None]["scored"][by] for key in "ab")
        least = (level / gap - 1) / pair["sequences"]  # so that one may fail
        enough = [n for n in NUMBERS if n > least or not metric(by).family.larger_is_better]
        error = error_of_pair(len(summary.systems))
        told = [f"{n} by {largest_scatter(gap, n, error):.2g}" for n in enough[:3]]
        lines.append(
            f"{by} of {both}: runs of each that would do, if they scatter (sd) at most: "
            + (", ".join(told) or f"more than {NUMBERS[-1]}")
        )
    return lines


def some_failed(summary: Summary) -> bool:
    """Tell whether some run failed or is missing."""
    return any(entry["failed_runs"] for entry in summary.entries.values())


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
