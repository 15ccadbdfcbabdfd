"""Head to head: which metric puts neighbouring levels of the paper's trials in order best."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from ..paper import Experiments
from ..study import Answer, Question, Study, Table
from .rankings import METHOD, compare_orders, rankings, side_by_side

BESIDE = {  # what a score is compared with besides the paper's metrics, at equal registration
    "TAS": (
        "TAS(registration=refined)",
        "TAS(registration=refined,max_threshold=2)",
        "HalfDistance",
        "HalfDistance(score=0.25)",
    ),
    "RAS": ("HalfAngle", "HalfAngle(score=0.25)"),
}


def plan(overrides: Sequence[str] = ()) -> Mapping[str, Table]:
    """Return the paper's experiments once more, for distances, angles and refined scores alone."""
    tables = {}
    for name, table in Experiments(overrides).items():
        (sweep,) = table.sweeps
        if metrics := [other for metric in sweep.metrics for other in BESIDE.get(metric, ())]:
            tables[name] = Table((replace(sweep, metrics=metrics),))
    return tables


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return the comparison as a table."""
    return [compare_orders(side_by_side(question.trials))]


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
