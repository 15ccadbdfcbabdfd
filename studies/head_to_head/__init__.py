"""Head to head: which metric puts neighbouring levels of the paper's trials in order best."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from experiments.config import to_overrides
from experiments.tables import Trials

from .. import paper
from ..study import Study
from .orders import compare_orders, joined

COMPARED = {  # with a metric of the paper, on the same trials
    "mAA": ("auc@30:vggt",),
    "TAS": (
        "TAS(registration=refined)",
        "TAS(registration=refined,max_threshold=2)",
        "HalfDistance",
        "HalfDistance(score=0.25)",
    ),
    "RAS": ("HalfAngle", "HalfAngle(score=0.25)"),
}


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the paper's experiments once more, for the metrics that it does not have."""
    tables = {}
    for name, own in paper.plan(settings).items():
        evaluated = paper.load_experiment(to_overrides(own)).metrics
        if metrics := [other for metric in evaluated for other in COMPARED.get(metric, ())]:
            tables[name] = {**own, "metrics": metrics}
    return tables


def answer(trials: Sequence[Trials], n_jobs: int = 1) -> list[pd.DataFrame | str]:
    """Return the comparison as a table."""
    return [compare_orders(joined(trials))]


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
    answer=answer,
    position=10,
)
