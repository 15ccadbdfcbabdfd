"""Head to head: which metric puts neighbouring levels of the paper's trials in order best."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from ..paper import Experiments
from ..study import Answer, Question, Study, Table
from .rankings import METHOD, compare_orders, rankings, side_by_side, to_markdown

__all__ = ["STUDY", "plan"]

HALF_SCORES = {"TAS": "HalfDistance", "RAS": "HalfAngle"}  # what needs no threshold, by the score


def plan(overrides: Sequence[str] = ()) -> Mapping[str, Table]:
    """Return the paper's experiments once more, for the half-score distance and angle alone.

    They are not in the tables of the experiments, which have the paper's metrics.
    """
    tables = {}
    for name, table in Experiments(overrides).items():
        (sweep,) = table.sweeps
        if metrics := [HALF_SCORES[metric] for metric in sweep.metrics if metric in HALF_SCORES]:
            tables[name] = Table((replace(sweep, metrics=metrics),))
    return tables


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return the comparison as a table and in words."""
    table = compare_orders(side_by_side(question.trials))
    return [table, to_markdown(table)]


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    return {"rankings": rankings(answer.table), "method": METHOD, "table": answer.table}


STUDY = Study(
    name="head_to_head",
    title="Head to head",
    plan=plan,
    ask=ask,
    show=show,
    place=10,
    beside=["paper"],
)
