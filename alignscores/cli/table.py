"""The table of the estimates, no wider than the terminal."""

import sys
from collections.abc import Sequence

from ..comparison.tables import Cell, Table, as_text
from ..evaluation.evaluation import Evaluation
from ..metrics import header, metric
from ..texts import shortened, text_width

__all__ = ["LEGEND", "metric_table", "table"]

ALWAYS = 5  # columns that no terminal is too narrow for
LONGEST = 28  # characters of a name
LEGEND = """\
TAS, RAS, PAS  scores of positions, of rotations, and their mean, from 0 to 1; lost frames score 0
half           largest threshold at which the TAS, or the RAS, would be one half: about twice the
               median error, and possibly above d; - if the score never reaches it
median         error of the tracked frames, under the same alignment as the scores
ATE            RMSE of the positions after the least-squares alignment, as evo's
tracked        share of the expected frames, or images, covered by a pose
d              upper quartile of the distances from each expected frame to the closest other one;
               thresholds go up to {max_threshold:g} d, and to {max_threshold_deg:g} degrees
refined        the alignment with the best TAS; pcr99: the paper's, the best of random ones"""


def table(evaluations: Sequence[Evaluation], columns: int) -> tuple[str, list[str]]:
    """Return the table of all estimates, and the headers for which the terminal is too narrow."""
    headers = ["estimate", *evaluations[0].row]
    rows = [
        [Cell(shortened(one.name, LONGEST)), *map(Cell, one.row.values())] for one in evaluations
    ]
    left_out: list[str] = []
    while True:
        text = as_text(Table(headers, rows), sys.maxsize)
        if len(headers) == ALWAYS or text_width(text.splitlines()[0]) <= columns:
            return text, left_out
        left_out.insert(0, headers.pop(-2))
        for row in rows:
            row.pop(-2)


def metric_table(evaluations: Sequence[Evaluation], columns: int) -> str:
    """Return the table of the metrics of estimates, in blocks of at most so many columns."""
    settings = evaluations[0].settings
    names = [header(name, settings.form.unit) for name in settings.metrics]
    rows = []
    for one in evaluations:
        values = [_metric(name, one.value(name)) for name in settings.metrics]
        rows.append(list(map(Cell, [shortened(one.name, LONGEST), *values])))
    return as_text(Table(["estimate", *names], rows), columns)


def _metric(name: str, value: float | None) -> str:
    digits = {"": ".4f", "%": ".2f"}.get(metric(name).unit, ".4g")
    return "-" if value is None else f"{value:{digits}}"
