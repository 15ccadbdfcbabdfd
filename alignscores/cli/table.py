"""The table of the estimates, no wider than the terminal."""

from collections.abc import Sequence

from ..evaluation.evaluation import Evaluation
from ..texts import padded, shortened, text_width

__all__ = ["LEGEND", "table"]

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
    headers = list(evaluations[0].row)
    rows = [headers, *(list(evaluation.row.values()) for evaluation in evaluations)]
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    names = ["estimate", *(shortened(evaluation.name, LONGEST) for evaluation in evaluations)]
    width = max(map(text_width, names))
    shown = list(range(len(headers)))
    while width + sum(widths[k] + 2 for k in shown) > columns and len(shown) > len(ALWAYS):
        shown.remove(max(set(shown).difference(ALWAYS)))
    lines = [
        padded(name, width) + "".join("  " + row[k].rjust(widths[k]) for k in shown)
        for name, row in zip(names, rows, strict=True)
    ]
    return "\n".join(lines), [headers[k] for k in range(len(headers)) if k not in shown]
