"""The comparison as tables of texts: for a terminal, Markdown, HTML and LaTeX.

A style says how a text is escaped and how the best one is shown in bold; pandas writes the rest.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import pandas as pd

from ..evaluation.settings import Settings
from ..extras import require
from ..metrics import header
from ..texts import in_latex, in_markdown, text_table, with_footnotes
from .comparison import Comparison
from .statistics import LEVEL
from .summary import (
    best_means,
    common_sequences,
    larger_is_better,
    metric_columns,
    pairs_of,
    records,
)
from .verdict import contrast_text, p_text

__all__ = ["as_latex", "as_markdown", "as_text", "by_sequence", "conditions", "legend"]
__all__ += ["HTML", "MARKDOWN", "TEXT", "notes_of", "number", "overall"]
__all__ += ["differences_of", "problems_of"]

USUAL = "TAS", "RAS", "PAS", "half_distance", "half_angle"


@dataclass(frozen=True)
class TableStyle:
    """How a table escapes texts, and how it shows them in bold."""

    escape: Callable[[str], str]
    bold: Callable[[str], str]


BOLD = "bold: best mean, significant or not"
EQUAL_MARK, UNTESTED_MARK, FAILED_MARK = "$^{=}$", r"$^{\mathrm{n}}$", r"$^{\dagger}$"
AHEAD_MARK = "$^{>}$"
LATEX_LEGEND = {
    AHEAD_MARK: rf"{AHEAD_MARK}\,significantly ahead of the best mean in pairs of runs "
    rf"(false discovery rate {100 * LEVEL:.0f}\,\%)",
    EQUAL_MARK: rf"{EQUAL_MARK}\,not significantly different from the best "
    rf"(false discovery rate {100 * LEVEL:.0f}\,\%)",
    UNTESTED_MARK: rf"{UNTESTED_MARK}\,too few runs for a test against the best",
    FAILED_MARK: rf"{FAILED_MARK}\,mean without the failed runs",
}
TEXT = TableStyle(str, str)
MARKDOWN = TableStyle(in_markdown, lambda text: f"**{text}**")
HTML = TableStyle(escape, lambda text: f"<b>{text}</b>")


def number(value: float) -> str:
    """Return a value with four digits; a dash for one that is unknown."""
    if not math.isfinite(value):
        return "-" if math.isnan(value) else "∞" if value > 0 else "-∞"
    return f"{value:.4f}" if abs(value) < 10 else f"{value:.4g}"


def _metric_names(comparison: Comparison) -> list[str]:
    """Return the metrics of the table: the usual ones, those that were asked for, and `by`."""
    requested: Sequence[str] = metric_columns(comparison.runs, comparison.by)
    if comparison.settings is not None:
        requested = comparison.settings.metrics
    means = comparison.overall
    return [
        name
        for name in dict.fromkeys([*USUAL, *requested, comparison.by])
        if name == comparison.by or (name in means and means[name].notna().any())
    ]


def _header(name: str, comparison: Comparison) -> str:
    """Return the name of a metric at the head of a column, with its unit."""
    settings = comparison.settings
    in_metres = settings is not None and settings.file_format.unit == "m"
    try:
        return header(name, "m" if in_metres else "")
    except ValueError:  # of a table's own metric
        return name


def _larger(comparison: Comparison, name: str) -> bool:
    """Return whether larger values of a metric are better."""
    return comparison.larger if name == comparison.by else larger_is_better(name)


def _same_sequences(comparison: Comparison) -> bool:
    """Return whether all systems were run on all sequences."""
    return len(common_sequences(comparison.distinct)) == comparison.runs["sequence"].nunique()


def _rank(row: Mapping[str, Any]) -> str:
    """Return a rank, or the first and the last that a system may have."""
    if math.isnan(row["rank_best"]):
        return "-"
    return "-".join(dict.fromkeys(f"{row[name]:.0f}" for name in ("rank_best", "rank_worst")))


def _value(row: Mapping[str, Any], name: str) -> str:
    """Return a mean; one that failed runs make infinite is the mean of the others, with a mark."""
    if math.isinf(row[name]) and math.isfinite(row[f"{name}_scored"]):
        return f"{number(float(row[f'{name}_scored']))} †{row['failed']}"
    return number(float(row[name]))


def overall(comparison: Comparison, style: TableStyle = TEXT) -> pd.DataFrame:
    """Return rank, means, failed runs and coverage of each system; best means are bold."""
    n_sequences = comparison.runs["sequence"].nunique()
    names = _metric_names(comparison)
    best = {name: best_means(comparison.overall[name], _larger(comparison, name)) for name in names}
    rows = []
    for index, row in zip(comparison.overall.index, records(comparison.overall), strict=True):
        cells = {"system": style.escape(row["system"]), "rank": _rank(row)}
        for name in names:
            text = _value(row, name)
            text = style.bold(text) if best[name][index] else text
            cells[style.escape(_header(name, comparison))] = text
        if not _same_sequences(comparison):
            all_mean = number(float(row[f"{comparison.by}_all"]))
            cells[style.escape(f"{comparison.by} (all)")] = all_mean
            cells["sequences"] = f"{row['sequences']}/{n_sequences}"
        low, high = 100 * row["failing_low"], 100 * row["failing_high"]
        cells["failed runs"] = f"{row['failed']}/{row['runs']} ({low:.0f}-{high:.0f} %)"
        if comparison.runs["lost"].notna().any():
            cells["coverage"] = f"{1 - row['lost']:.1%}" if math.isfinite(row["lost"]) else "-"
        rows.append(cells)
    return pd.DataFrame(rows)


def by_sequence(comparison: Comparison, style: TableStyle = TEXT) -> pd.DataFrame:
    """Return the metric of each system on each sequence, the best in bold, and d."""
    sequences = comparison.runs["sequence"].unique()
    means = comparison.summary.dropna(subset="sequence")
    best = means.groupby("sequence")[comparison.by].transform(best_means, comparison.larger)
    by_key = {(row["system"], row["sequence"]): row for row in records(means.assign(best=best))}
    corner = style.escape(_header(comparison.by, comparison))
    rows = []
    for system in comparison.overall["system"]:
        cells = {corner: style.escape(system)}
        for sequence in sequences:
            text = "not tried"
            if row := by_key.get((system, sequence)):
                text = _value(row, comparison.by)
                text = style.bold(text) if row["best"] else text
                text += f" ({_rank(row)})" if not math.isnan(row["rank_best"]) else ""
                text += f" †{row['failed']}" if row["failed"] and "†" not in text else ""
            cells[style.escape(sequence)] = text
        rows.append(cells)
    if comparison.runs["unit"].notna().any():
        d = comparison.runs.groupby("sequence", sort=False)["unit"].first()
        name = "d [m]" if _header("half_distance", comparison).endswith("[m]") else "d"
        rows.append({corner: name, **{style.escape(s): f"{d[s]:.4g}" for s in sequences}})
    return pd.DataFrame(rows)


def as_text(table: pd.DataFrame, columns: int) -> str:
    """Return a table for a terminal, in parts where it is wider than some columns."""
    return text_table([list(table.columns), *table.to_numpy().tolist()], columns)


def as_markdown(table: pd.DataFrame) -> str:
    """Return a table of escaped texts in Markdown."""
    require("tabulate", "compare")
    aligned = ["left", *["right"] * (len(table.columns) - 1)]
    return str(table.to_markdown(index=False, disable_numparse=True, colalign=aligned))


def _latex_table(comparison: Comparison) -> pd.DataFrame:
    """Return systems by metrics with mean and standard deviation of the runs.

    The best mean has three digits and is bold; = marks systems that are not significantly different
    from it, > those ahead of it by their runs, n those that are not tested against it.
    """
    systems = comparison.overall["system"]
    columns = {"system": [in_latex(system) for system in systems]}
    for name in dict.fromkeys([*USUAL[:4], comparison.by]):
        if name not in comparison.overall:
            continue
        larger, pairs = _larger(comparison, name), comparison.pairs
        if name != comparison.by:
            pairs = pairs_of(comparison.distinct, name, larger, comparison.design)
        decimals, cells = _latex_column(comparison.overall, name, larger, pairs)
        columns[in_latex(_header(name, comparison))] = cells
        if name == comparison.by and not _same_sequences(comparison):
            all_means = comparison.overall[f"{name}_all"]
            columns[in_latex(f"{name} (all)")] = [_fixed(value, decimals) for value in all_means]
    return pd.DataFrame(columns)


def _latex_column(
    table: pd.DataFrame, name: str, larger: bool, pairs: pd.DataFrame
) -> tuple[int, list[str]]:
    """Return decimals and cells of a metric: mean and deviation, the best in bold, and marks."""
    failed = np.isinf(table[name])  # of an error: the mean is over the other runs
    means = table[name].where(~failed, table[f"{name}_scored"])
    best = table["system"][best_means(table[name], larger)].tolist()
    marks = {}
    for pair in records(pairs[pairs["sequence"].isna()]):
        if best[:1] in ([pair["a"]], [pair["b"]]):
            other = pair["b"] if pair["a"] == best[0] else pair["a"]
            of_better = {best[0]: "", other: AHEAD_MARK}
            untested = math.isnan(pair["p"])
            marks[other] = UNTESTED_MARK if untested else of_better.get(pair["better"], EQUAL_MARK)
    largest = abs(table[name].max() if larger else table[name].min())
    decimals = max(0, 3 - math.ceil(math.log10(largest))) if 1e-9 < largest < math.inf else 3
    cells = []
    for row, mean, without_failed in zip(records(table), means, failed, strict=True):
        text = _fixed(mean, decimals)
        text = rf"\textbf{{{text}}}" if row["system"] in best else text
        deviation = row[f"{name}_sd"]
        text += rf" $\pm$ {deviation:.{decimals}f}" if math.isfinite(deviation) else ""
        text += FAILED_MARK if without_failed and math.isfinite(mean) else ""
        cells.append(text + marks.get(row["system"], ""))
    return decimals, cells


def _fixed(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if math.isfinite(value) else "--"


def as_latex(comparison: Comparison) -> str:
    """Return the table for a paper with its legend, and verdict and notes as comments below."""
    require("jinja2", "compare")
    table = _latex_table(comparison)
    n = len(table.columns)
    text = str(table.to_latex(index=False, escape=False, column_format="l" + "r" * (n - 1)))
    means = f"mean over {_sequences(comparison)}"
    legend = [rf"{means} $\pm$ standard deviation of the runs on a sequence"]
    if comparison.settings is not None:
        legend.append(comparison.settings.how_aligned)
    legend += [BOLD] if r"\textbf" in text else []
    legend += [line for mark, line in LATEX_LEGEND.items() if mark in text]
    lines = [*comparison.verdict, *(f"note: {note}" for note in comparison.notes)]
    return with_footnotes(text, n, legend) + "".join(f"% {line}\n" for line in lines)


def _sequences(comparison: Comparison) -> str:
    """Return which sequences means are over."""
    n = len(common_sequences(comparison.distinct))
    if _same_sequences(comparison) or not n:
        return "sequences"
    return f"the {n} sequences that all systems have" if n > 1 else "the sequence all systems have"


def legend(comparison: Comparison, style: TableStyle = TEXT) -> list[str]:
    """Return the two lines below the tables."""
    lines = [f"means over runs, then {_sequences(comparison)}; a failed run has the worst value"]
    if comparison.settings is not None:
        lines[0] += f"; {comparison.settings.how_aligned}"
    marks = [BOLD] if style is not TEXT and _is_any_best(comparison) else []
    ranks = comparison.summary[["rank_best", "rank_worst"]].dropna()
    if (ranks["rank_best"] != ranks["rank_worst"]).any():
        marks.append(
            f"(1-2): not significantly different (false discovery rate {100 * LEVEL:.0f} %)"
        )
    if (comparison.distinct["status"] != "scored").any():
        marks.append("†1: one failed or missing run; errors are means over the other runs")
    return lines + (["; ".join(marks)] if marks else [])


def _is_any_best(comparison: Comparison) -> bool:
    """Return whether `overall` or `by_sequence` have a best mean."""
    overall, by = comparison.overall, comparison.by
    best = [best_means(overall[m], _larger(comparison, m)) for m in _metric_names(comparison)]
    for _, means in comparison.summary.dropna(subset="sequence").groupby("sequence"):
        best.append(best_means(means[by], comparison.larger))
    return any(is_best.any() for is_best in best)


def conditions(settings: Settings | None) -> list[str]:
    """Return further lines on what the numbers mean."""
    lines = ["failed runs: in brackets the 95 % interval of how often a run fails"]
    if settings is not None:
        lines.append(f"missing cameras: {settings.missing}")
        if settings.file_format.timed:
            lines.append("coverage: share of the expected time with a pose")
    return lines


def problems_of(comparison: Comparison) -> list[str]:
    """Return what was left out, and which runs failed."""
    return [
        *comparison.problems,
        *(f"{error}; it counts as a failure" for error in comparison.failed),
    ]


def notes_of(comparison: Comparison, reasons: Sequence[str] = ()) -> list[str]:
    """Return all notes and errors that the command prints, also why scores are low."""
    errors = [*problems_of(comparison), *reasons]
    return [*comparison.notes, *comparison.low_scores, *(f"error: {line}" for line in errors)]


def differences_of(comparison: Comparison) -> list[dict[str, Any]]:
    """Return the pairs of systems over all sequences that have a difference, tested ones first.

    The `texts` of a pair say how often the first system wins, with the p-value, and where the means
    differ the other way.
    """
    pairs = comparison.pairs[comparison.pairs["sequence"].isna()]
    n_tests = pairs["p"].count()
    rows = records(pairs[np.isfinite(pairs["difference"].astype(float))])
    for row in rows:
        p = "not tested" if math.isnan(row["p"]) else p_text(row["p"], n_tests)
        contrast = contrast_text(row["wins"], row["difference"], comparison.larger)
        row["texts"] = [f"wins {row['wins']:.0%}, {p}", *filter(None, [contrast])]
    return sorted(rows, key=lambda row: math.isnan(row["p"]))
