"""The table of estimates: its columns, and its text for a terminal."""

from collections.abc import Sequence

import numpy as np

from ..texts import padded, shortened, text_width
from .evaluation import Evaluation

__all__ = ["LEGEND", "cells", "headers", "table"]

COLUMNS = (  # a narrow terminal loses columns from the right
    *("TAS", "RAS", "PAS", "half [{unit}]", "half [deg]"),
    *("median [{unit}]", "median [deg]", "ATE [{unit}]", "tracked"),
)
ALWAYS = (0, 1, 2, 8)  # columns that no terminal is too narrow for
LONGEST = 28  # characters of a name
LEGEND = """\
TAS, RAS, PAS  scores of positions, of rotations, and their mean, from 0 to 1; lost frames score 0
half           largest threshold at which the TAS, or the RAS, would be one half: about twice the
               median error, and possibly above d; - if the score never reaches it
median         error of the tracked frames, under the same alignment as the scores
ATE            RMSE of the positions after the least-squares alignment, as evo's
tracked        share of the expected frames, or images, covered by a pose
d              largest threshold of the TAS: the upper quartile of the distances from each expected
               frame to the closest other one; for the RAS it is {degrees:g} degrees
refined        the alignment with the best TAS; pcr99: the paper's, the best of random ones"""


def table(evaluations: Sequence[Evaluation], columns: int) -> tuple[str, list[str]]:
    """Return the table of all estimates, and the headers for which the terminal is too narrow."""
    header = headers(evaluations)
    rows = [header, *map(cells, evaluations)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    names = ["estimate", *(shortened(evaluation.name, LONGEST) for evaluation in evaluations)]
    width = max(map(text_width, names))
    shown = list(range(len(header)))
    while width + sum(widths[k] + 2 for k in shown) > columns and len(shown) > len(ALWAYS):
        shown.remove(max(set(shown).difference(ALWAYS)))
    lines = [
        padded(name, width) + "".join("  " + row[k].rjust(widths[k]) for k in shown)
        for name, row in zip(names, rows, strict=True)
    ]
    return "\n".join(lines), [header[k] for k in range(len(header)) if k not in shown]


def headers(evaluations: Sequence[Evaluation]) -> list[str]:
    """Return the headers of the columns."""
    return [header.format(unit=evaluations[0].settings.form.unit) for header in COLUMNS]


def cells(evaluation: Evaluation) -> list[str]:
    """Return the texts of an estimate's columns."""
    return [
        *(
            "-" if np.isnan(score) else f"{score:.3f}"
            for score in (evaluation.tas, evaluation.ras, evaluation.pas)
        ),
        *(_number(value) for value in (evaluation.half_distance, evaluation.half_angle)),
        *(_number(value) for value in (evaluation.median_distance, evaluation.median_angle)),
        _number(evaluation.ate),
        f"{1 - evaluation.lost:.1%}",
    ]


def _number(value: float | None) -> str:
    return "-" if value is None or not np.isfinite(value) else f"{value:.3g}"
