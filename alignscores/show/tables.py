"""Tables of evaluations and what stands below them: for a terminal, Markdown, LaTeX and CSV.

The table of a terminal needs no pandas, which the extra ``tables`` brings.
"""

import math
from collections.abc import Sequence
from textwrap import wrap
from typing import Any

import numpy as np

from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import scale_note
from ..extras import require
from ..metrics import SCORES, header, metric
from ..texts import (
    aligned,
    distinct,
    in_latex,
    in_markdown,
    printable,
    text_table,
    text_width,
    with_footnotes,
)
from .curves import time_label

__all__ = [
    "as_csv",
    "conditions",
    "csv",
    "deficits_of",
    "latex",
    "markdown",
    "models_of",
    "notes_of",
    "rows_of",
    "terms",
    "text",
]

MIN_COLUMNS = 5
LONGEST = 28  # characters of a name
FOOTNOTE = 80  # characters of a line below a table in LaTeX, which is hardly wider
Rows = list[list[str]]  # the first is the header


def rows_of(scored: Sequence[Evaluation], longest: int = LONGEST) -> Rows:
    """Return the table of the estimates; of their metrics where the settings have any."""
    names, settings = _names(scored, longest), scored[0].settings
    if not settings.metrics:
        rows = [
            [name, *_row(evaluation).values()]
            for name, evaluation in zip(names, scored, strict=True)
        ]
        return [["estimate", *_row(scored[0])], *rows]
    headers = [header(name, settings.file_format.unit) for name in settings.metrics]
    rows = [
        [name, *(_number(key, evaluation.value(key)) for key in settings.metrics)]
        for name, evaluation in zip(names, scored, strict=True)
    ]
    return [["estimate", *headers], *rows]


def _row(evaluation: Evaluation) -> dict[str, str]:
    """Return the row of an estimate: texts by the headers of the columns."""
    unit = evaluation.settings.file_format.unit
    scores = {"TAS": evaluation.tas, "RAS": evaluation.ras, "PAS": evaluation.pas}
    errors = {
        f"half [{unit}]": evaluation.half_distance,
        "half [deg]": evaluation.half_angle,
        f"median [{unit}]": evaluation.median_distance,
        "median [deg]": evaluation.median_angle,
        f"ATE [{unit}]": evaluation.ate,
    }
    return {
        **{name: _text(score, ".3f") for name, score in scores.items()},
        **{name: _text(error, "#.3g") for name, error in errors.items()},
        "coverage": f"{1 - evaluation.lost:.1%}",
    }


def _text(value: float | None, number_format: str) -> str:
    """Return a number, a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    return format(value, number_format).rstrip(".")  # 100. has all its digits


def _names(scored: Sequence[Evaluation], longest: int) -> list[str]:
    return distinct([printable(evaluation.name) for evaluation in scored], longest)


def _number(name: str, value: float | None) -> str:
    """Return our scores as in the other table, and metrics of other projects with a digit more."""
    unit = metric(name).unit
    if metric(name).name in SCORES:
        return _text(value, "#.3g" if unit else ".3f")
    return _text(value, {"": ".4f", "%": ".2f"}.get(unit, "#.4g"))


def deficits_of(scored: Sequence[Evaluation], longest: int = LONGEST) -> Rows:
    """Return the table of where the scores are lost."""
    first = scored[0]
    unit = " [s]" if first.matches.timed else ""
    names = _names(scored, longest)
    header = ["estimate", "score", f"from{unit}", f"to{unit}"]
    header += [time_label(first).partition(" ")[0].replace("time", "frame") + "s"]
    rows = [[*header, "cause", "cost", "share of 1 - score"]]
    for name, evaluation in zip(names, scored, strict=True):
        for stretch in evaluation.deficits:
            ends = (stretch.start, stretch.end) if stretch.start is not None else ("rest", "")
            texts = [f"{e:.1f}" if isinstance(e, float) else printable(str(e)) for e in ends]
            costs = [f"{stretch.cost:.3f}", f"{stretch.share:.1%}"]
            rows.append([name, stretch.score, *texts, str(stretch.frames), stretch.cause, *costs])
    return rows


def text(scored: Sequence[Evaluation], columns: int) -> str:
    """Return the table of the estimates, no wider than the terminal.

    Columns are left out before the last one, and named below the table; those of metrics follow in
    blocks.
    """
    rows = rows_of(scored)
    if scored[0].settings.metrics:
        return text_table(rows, columns)
    left_out: list[str] = []
    while len(rows[0]) > MIN_COLUMNS and text_width(aligned(rows)[0]) > columns:
        left_out.insert(0, rows[0][-2])
        rows = [[*row[:-2], row[-1]] for row in rows]
    below = [f"too narrow for: {', '.join(left_out)}"] if left_out else []
    return "\n".join([*aligned(rows), *below])


def models_of(
    scored: Sequence[Evaluation], longest: int = LONGEST, max_models: int | None = None
) -> Rows:
    """Return the table of the models of estimates of several, at most so many; [] without any."""
    rows = [["estimate", "model", "images", "coverage", "TAS", "RAS", "PAS"]]
    for name, evaluation in zip(_names(scored, longest), scored, strict=True):
        for model in evaluation.models[:max_models]:
            scores = [_number(key, getattr(model, key)) for key in ("TAS", "RAS", "PAS")]
            size = [str(model.images), f"{model.coverage:.1%}"]
            rows.append([name, printable(model.name), *size, *scores])
        if rest := len(evaluation.models[max_models:]) if max_models else 0:
            rows.append([name, f"{rest} more", *5 * [""]])
    return rows if rows[1:] else []


def _frame(rows: Rows) -> Any:
    """Return a table as a DataFrame of texts."""
    return require("pandas", "tables").DataFrame(rows[1:], columns=rows[0])


def markdown(scored: Sequence[Evaluation], more_notes: Sequence[str] = ()) -> str:
    """Return the table in Markdown, with the conditions and all notes."""
    require("tabulate", "tables")
    rows = [list(map(in_markdown, row)) for row in rows_of(scored, longest=200)]
    table = _frame(rows).to_markdown(
        index=False, disable_numparse=True, colalign=["left", *["right"] * (len(rows[0]) - 1)]
    )
    notes = [f"- {in_markdown(note)}" for note in notes_of(scored, more_notes)]
    below = list(map(in_markdown, conditions(scored)))
    if models := models_of(scored):
        rows = [list(map(in_markdown, row)) for row in models]
        below.append(_frame(rows).to_markdown(index=False, disable_numparse=True))
    return "\n\n".join([table, *below, *(["\n".join(notes)] if notes else [])]) + "\n"


def latex(scored: Sequence[Evaluation]) -> str:
    """Return the table in LaTeX, for the package booktabs, with its conditions at the end."""
    require("jinja2", "tables")
    rows = [list(map(in_latex, row)) for row in rows_of(scored, longest=200)]
    n = len(rows[0])
    table: str = _frame(rows).to_latex(index=False, column_format="l" + "r" * (n - 1))
    how_scored, *others = conditions(scored)
    comments = "".join(f"% {printable(line)}\n" for line in others)
    return comments + with_footnotes(table, n, map(in_latex, wrap(how_scored, FOOTNOTE)))


def csv(scored: Sequence[Evaluation]) -> str:
    """Return the numbers of `Evaluation.to_frame`, a line an estimate.

    What a spreadsheet would take for a formula gets an apostrophe.
    """
    table = require("pandas", "tables").concat([evaluation.to_frame() for evaluation in scored])
    return as_csv(table)


def as_csv(table: Any) -> str:
    """Return a DataFrame as CSV whose texts are neither formulas nor control characters."""

    def inert(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        plain = printable(value)
        return f"'{plain}" if plain.startswith(("=", "+", "-", "@")) else plain

    result: str = table.map(inert).to_csv(index=False, lineterminator="\n")
    return result


def conditions(scored: Sequence[Evaluation]) -> list[str]:
    """Return a line on how the estimates were scored, and one on their scales if they are off."""
    settings = scored[0].settings
    lines = [_conditions(scored[0])]
    scales = {evaluation.name: evaluation.scale for evaluation in scored}
    if not settings.metrics and (scale := scale_note(scales, settings)):
        lines.append(scale)
    return lines


def _conditions(first: Evaluation) -> str:
    """Return the alignment, the frames, and d in one line; other metrics have only the frames."""
    settings = first.settings
    what = "frames" if settings.file_format.ordered else "images"
    frames = f"{len(first.matches.expected_rows)} {what}"
    if settings.frames is not None:
        frames += " that were given"
    elif first.matches.timed:
        step = 1.1 / settings.frames_per_second  # of a reference that is slower, or `all`
        stamps = first.reference.keys[first.matches.expected_rows]
        is_slower = len(stamps) > 1 and float(np.median(np.diff(stamps))) > step
        frames += " at the reference's own stamps" if is_slower else f" at {settings.rate:g} Hz"
    if first.matches.timed:
        gaps = f"gaps up to {settings.max_gap:g} s and standstill covered"
        frames += f", {gaps if settings.max_gap else 'each needs a pose'}"
    if settings.missing == "ignore":
        frames += ", lost ones left out"
    ours = [metric(name).name in SCORES for name in settings.metrics]
    if ours and not any(ours):
        return frames
    times_d = "d" if settings.max_threshold == 1 else f"{settings.max_threshold:g} d"
    largest = settings.max_threshold * first.result.tas.unit
    unit = f"TAS up to {times_d} = {largest:.3g} {settings.file_format.unit}"
    half = [] if settings.metrics else ["half: threshold at score 0.5"]
    return "; ".join([settings.how_aligned, frames, unit, *half])


def notes_of(scored: Sequence[Evaluation], more: Sequence[str] = ()) -> list[str]:
    """Return all notes, those on the reference and on files that failed first."""
    return [
        *more,
        *(note.named(evaluation.name) for evaluation in scored for note in evaluation.notes),
    ]


def terms(scored: Sequence[Evaluation]) -> list[tuple[str, str]]:
    """Return what the columns and the conditions mean."""
    settings = scored[0].settings
    limits = f"{settings.max_threshold:g} d, and to {settings.max_threshold_deg:g} degrees"
    return [
        (
            "TAS, RAS, PAS",
            "scores of positions, of rotations, and their mean, from 0 to 1; lost frames score 0",
        ),
        (
            "half",
            "largest threshold at which the TAS, or the RAS, would be one half: about twice the "
            "median error, and possibly above d; - if the score never reaches it",
        ),
        ("median", "error of the frames with a pose, under the same alignment as the scores"),
        ("ATE", "RMSE of the positions after the least-squares alignment, as evo's"),
        ("coverage", "share of the expected frames, or images, with a pose; the others are lost"),
        (
            "d",
            "upper quartile of the distances from each expected frame to the closest other one; "
            f"thresholds go up to {limits}",
        ),
        ("refined", "the alignment with the best TAS; pcr99: the paper's, the best of random ones"),
        (
            "cost",
            "what frames cost a score; all costs add up to 1 - score. Listed are the stretches "
            "where frames cost more than the average frame, and the rest",
        ),
    ]
