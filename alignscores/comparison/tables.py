"""The comparison as tables of texts: for a terminal, Markdown, HTML and LaTeX.

A form says how a text is escaped and how the best one is shown in bold; pandas writes the rest.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import pandas as pd

from ..evaluation.settings import Settings
from ..extras import require
from ..metrics import header
from ..texts import text_table
from .comparison import Comparison
from .statistics import LEVEL
from .summary import common_sequences, larger_is_better, measured, pairs_of, records
from .verdict import p_text

__all__ = ["as_latex", "as_markdown", "as_text", "by_sequence", "conditions", "legend"]
__all__ += ["HTML", "MARKDOWN", "TEXT", "latex_table", "markdown", "notes_of", "number", "overall"]
__all__ += ["differences_of", "problems_of", "wins_text"]

SHOWN = "TAS", "RAS", "PAS", "half_distance", "half_angle"


@dataclass(frozen=True)
class Form:
    """How a text stands in a table, and how a bold one."""

    escape: Callable[[str], str]
    bold: Callable[[str], str]


def markdown(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return re.sub(r"([\\`*\[\]<>|~&]|\b_|_\b)", r"\\\1", text)


def latex(text: str) -> str:
    """Return a text that LaTeX shows as it is."""
    return text.translate(LATEX)


LATEX = str.maketrans(
    {
        **{letter: rf"\{letter}" for letter in "&%$#_{}"},
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "\\": r"\textbackslash{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': r"\textquotedbl{}",
    }
)
TEXT = Form(str, str)
MARKDOWN = Form(markdown, lambda text: f"**{text}**")
HTML = Form(escape, lambda text: f"<b>{text}</b>")


def number(value: float) -> str:
    """Return a value with four digits; a dash for one that is unknown."""
    if not math.isfinite(value):
        return "-" if math.isnan(value) else "∞" if value > 0 else "-∞"
    return f"{value:.4f}" if abs(value) < 10 else f"{value:.4g}"


def _shown(found: Comparison) -> list[str]:
    """Return the metrics of the table: the usual ones, those that were asked for, and `by`."""
    asked = [] if found.settings is None else list(found.settings.metrics)
    names = [*SHOWN, *asked, found.by]
    if found.settings is None:
        names = [*SHOWN, *measured(found.runs, found.by)]
    there = (name for name in dict.fromkeys(names) if name in found.overall)
    return [name for name in there if name == found.by or found.overall[name].notna().any()]


def _head(name: str, found: Comparison) -> str:
    length = "m" if found.settings is not None and found.settings.form.unit == "m" else ""
    try:
        return header(name, length)
    except ValueError:
        return name


def _rank(row: Mapping[str, Any]) -> str:
    """Return a rank, or the first and the last that a system may have."""
    if math.isnan(row["rank_best"]):
        return "-"
    return "-".join(dict.fromkeys(f"{row[name]:.0f}" for name in ("rank_best", "rank_worst")))


def _value(row: Mapping[str, Any], name: str) -> str:
    """Return a mean; one that failed runs make infinite is the mean of the others."""
    mean = row[name] if math.isfinite(row[name]) else row[f"{name}_scored"]
    return number(float(mean))


def overall(found: Comparison, form: Form = TEXT) -> pd.DataFrame:
    """Return rank, means, failed runs and coverage of each system."""
    common, n_sequences = common_sequences(found.distinct), found.runs["sequence"].nunique()
    rows = []
    for row in records(found.overall):
        cells = {"system": form.escape(row["system"]), "rank": _rank(row)}
        for name in _shown(found):
            text = _value(row, name)
            first = name == found.by and row["rank_best"] == row["rank_worst"] == 1
            cells[form.escape(_head(name, found))] = form.bold(text) if first else text
        if len(common) < n_sequences:
            everywhere = number(float(row[f"{found.by}_all"]))
            cells[form.escape(f"{found.by} (all)")] = everywhere
            cells["sequences"] = f"{row['sequences']}/{n_sequences}"
        low, high = 100 * row["failing_low"], 100 * row["failing_high"]
        cells["failed runs"] = f"{row['failed']}/{row['runs']} ({low:.0f}-{high:.0f} %)"
        if found.runs["lost"].notna().any():
            cells["coverage"] = f"{1 - row['lost']:.1%}" if math.isfinite(row["lost"]) else "-"
        rows.append(cells)
    return pd.DataFrame(rows)


def by_sequence(found: Comparison, form: Form = TEXT) -> pd.DataFrame:
    """Return the metric of each system on each sequence, and d."""
    sequences = found.runs["sequence"].unique()
    of_both = {(row["system"], row["sequence"]): row for row in records(found.summary)}
    first = form.escape(_head(found.by, found))
    rows = []
    for system in found.overall["system"]:
        cells = {first: form.escape(system)}
        for sequence in sequences:
            text = "not tried"
            if row := of_both.get((system, sequence)):
                text = _value(row, found.by)
                if row["rank_best"] == row["rank_worst"] == 1:
                    text = form.bold(text)
                text += f" ({_rank(row)})" if not math.isnan(row["rank_best"]) else ""
                text += f" †{row['failed']}" if row["failed"] else ""
            cells[form.escape(sequence)] = text
        rows.append(cells)
    if found.runs["d"].notna().any():
        d = found.runs.groupby("sequence", sort=False)["d"].first()
        name = "d [m]" if _head("half_distance", found).endswith("[m]") else "d"
        rows.append({first: name, **{form.escape(s): f"{d[s]:.4g}" for s in sequences}})
    return pd.DataFrame(rows)


def as_text(table: pd.DataFrame, columns: int) -> str:
    """Return a table for a terminal, in parts where it is wider than some columns."""
    return text_table([list(table.columns), *table.to_numpy().tolist()], columns)


def as_markdown(table: pd.DataFrame) -> str:
    """Return a table of escaped texts in Markdown."""
    require("tabulate", "compare")
    aligned = ["left", *["right"] * (len(table.columns) - 1)]
    return str(table.to_markdown(index=False, disable_numparse=True, colalign=aligned))


def latex_table(found: Comparison) -> pd.DataFrame:
    """Return systems by metrics with mean and standard deviation of the runs, three digits each.

    The best mean is bold; = marks systems that are not significantly different from it.
    """
    names = [name for name in (*SHOWN[:4], found.by) if name in found.overall]
    columns = {"system": [latex(system) for system in found.overall["system"]]}
    for name in dict.fromkeys(names):
        larger = found.larger if name == found.by else larger_is_better(name)
        pairs = (
            found.pairs
            if name == found.by
            else pairs_of(found.distinct, name, larger, found.design)
        )
        columns[latex(_head(name, found))] = _latex_column(found.overall, name, larger, pairs)
    return pd.DataFrame(columns)


def _latex_column(table: pd.DataFrame, name: str, larger: bool, pairs: pd.DataFrame) -> list[str]:
    """Return the cells of a metric: mean and deviation, the best mean bold, ties marked."""
    means = table[name].where(table[name].abs() < math.inf, table[f"{name}_scored"])
    if not table[name].notna().any():
        return len(table) * ["--"]
    best = table["system"].iloc[int(np.nanargmax(table[name] if larger else -table[name]))]
    marks = {}
    for pair in records(pairs[pairs["sequence"].isna()]):
        if best in (pair["a"], pair["b"]):
            other = pair["b"] if pair["a"] == best else pair["a"]
            untested, ahead = math.isnan(pair["p"]), isinstance(pair["better"], str)
            marks[other] = r"$^{\circ}$" if untested else "" if ahead else "$^{=}$"
    decimals = max(0, 2 - math.floor(math.log10(max(means.abs().min(), 0.1))))
    cells = []
    for system, mean, deviation in zip(table["system"], means, table[f"{name}_sd"], strict=True):
        text = f"{mean:.{decimals}f}" if math.isfinite(mean) else "--"
        text = rf"\textbf{{{text}}}" if system == best else text
        text += rf" $\pm$ {deviation:.{decimals}f}" if math.isfinite(deviation) else ""
        cells.append(text + marks.get(system, ""))
    return cells


def as_latex(found: Comparison) -> str:
    """Return the table for a paper, with verdict and notes as comments below."""
    require("jinja2", "compare")
    table = latex_table(found)
    aligned = "l" + "r" * (len(table.columns) - 1)
    text = str(table.to_latex(index=False, escape=False, column_format=aligned))
    lines = [
        "Mean over sequences, and standard deviation of the runs on a sequence. Bold: best mean;",
        f"=: not significantly different from it (false discovery rate {100 * LEVEL:.0f} %);",
        "o: too few runs for a test against it.",
        *found.verdict,
        *found.notes,
    ]
    return text + "".join(f"% {line}\n" for line in lines)


def legend(found: Comparison) -> list[str]:
    """Return the two lines below the tables."""
    lines = ["means over runs, then sequences; a failed run has the worst value"]
    if found.settings is not None:
        lines[0] += f"; {found.settings.how_aligned}"
    marks = []
    ranks = found.summary[["rank_best", "rank_worst"]].dropna()
    if (ranks["rank_best"] != ranks["rank_worst"]).any():
        marks.append(
            f"(1-2): not significantly different (false discovery rate {100 * LEVEL:.0f} %)"
        )
    if (found.distinct["status"] != "scored").any():
        marks.append("†1: a failed or missing run; errors are of the others")
    return lines + (["; ".join(marks)] if marks else [])


def conditions(settings: Settings | None) -> list[str]:
    """Return what else there is to say about the numbers."""
    lines = ["failed runs: in brackets the 95 % interval of how often a run fails"]
    if settings is not None:
        lines.append(f"missing cameras: {settings.missing}")
        if settings.form.timed:
            lines.append("coverage: share of the expected time with a pose")
    return lines


def problems_of(found: Comparison) -> list[str]:
    """Return what was left out, and which runs failed."""
    return [*found.problems, *(f"{error}; it counts as a failure" for error in found.failed)]


def notes_of(found: Comparison, reasons: Sequence[str] = ()) -> list[str]:
    """Return all notes and errors that the command prints, also why scores are low."""
    errors = [*problems_of(found), *reasons]
    return [*found.notes, *found.low_scores, *(f"error: {line}" for line in errors)]


def differences_of(found: Comparison) -> list[dict[str, Any]]:
    """Return the pairs of systems over all sequences that have a difference, tested ones first."""
    difference = found.pairs["difference"].astype(float)
    pairs = found.pairs[found.pairs["sequence"].isna() & np.isfinite(difference)]
    return sorted(records(pairs), key=lambda pair: math.isnan(pair["p"]))


def wins_text(pair: Mapping[str, Any]) -> str:
    """Return how often the first of a pair wins, and how certain that is."""
    certain = "not tested" if math.isnan(pair["p"]) else p_text(pair["p"])
    return f"wins {pair['wins']:.0%}, {certain}"
