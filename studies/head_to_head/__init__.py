"""Head to head: which metric puts neighbouring levels of the paper's trials in order best."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pandas as pd

from .. import paper
from ..study import Question, Study, Table
from .orders import compare_orders, joined

BESIDE = {  # what a metric of the paper is compared with on the same trials
    "mAA": ("auc@30:vggt",),
    "TAS": (
        "TAS(registration=refined)",
        "TAS(registration=refined,max_threshold=2)",
        "HalfDistance",
        "HalfDistance(score=0.25)",
    ),
    "RAS": ("HalfAngle", "HalfAngle(score=0.25)"),
}


def plan(overrides: Sequence[str] = ()) -> Mapping[str, Table]:
    """Return the paper's experiments once more, for the metrics that it does not have."""
    tables = {}
    for name, table in paper.plan(overrides).items():
        (sweep,) = table.sweeps
        if metrics := [other for metric in sweep.metrics for other in BESIDE.get(metric, ())]:
            tables[name] = Table((replace(sweep, metrics=metrics),))
    return tables


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return the comparison as a table."""
    return [compare_orders(joined(question.trials))]


STUDY = Study(
    name="head_to_head",
    title="Head to head",
    text="Order: the probability, in per cent, that one trial at each of two neighbouring levels "
    "come in the right order; 50 % is chance, and no monotone rescaling of a metric changes it. "
    "Each metric is compared with the best one of its experiment and level on paired trials (p, "
    "by Holm's method). Trials: how many at each level a rank-sum test needs to find a difference "
    "(at 5 %, power 80 %). HalfDistance and HalfAngle: the units at which TAS (refined "
    "registration) and RAS are one half, or the score that they name. Where TAS and PAS name no "
    "registration, it is the paper's.",
    plan=plan,
    ask=ask,
    position=10,
)
