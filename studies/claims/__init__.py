"""The paper's claims, ``configs/claims.yaml``: the trials that they need, and the verdicts."""

from collections.abc import Mapping, Sequence

import pandas as pd

from experiments.config import split_override

from ..study import Question, Study, Table
from .claims import CLAIMS_FILE, load_claims
from .plan import replicates
from .verdicts import check_alike, decide, select_trials


def plan(overrides: Sequence[str]) -> Mapping[str, Table]:
    """Return a table for each replicate study."""
    given = dict(split_override(override) for override in overrides)
    others = [one for one in overrides if split_override(one)[0] != "replicates"]
    return replicates(load_claims(given.get("replicates")), others)


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return the verdicts, those under other readings of the paper, and by other criteria."""
    trials = question.trials
    claims = load_claims(max(len(trials), 2))
    check_alike(claims, [one.path for one in trials], [one.record for one in trials])
    tables = [select_trials(claims, replicate) for replicate in trials]
    return list(decide(claims, tables, n_jobs=question.n_jobs))


STUDY = Study(
    name="claims",
    title="Verdicts",
    plan=plan,
    ask=ask,
    answers=("claims.csv", "tables/readings.csv", "tables/criteria.csv"),
    place=1,
    trials="replicates",
    keys=["replicates"],
    files=[CLAIMS_FILE],
    is_parallel=True,
)
