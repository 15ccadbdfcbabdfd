"""The paper's claims, ``configs/claims.yaml``: the trials that they need, and the verdicts."""

from collections.abc import Mapping, Sequence

import pandas as pd

from experiments.command import CommandError
from experiments.config import split_override

from ..study import Question, Study, Table
from .claims import load_claims
from .plan import replicates
from .verdicts import decide, select_trials


def plan(overrides: Sequence[str]) -> Mapping[str, Table]:
    """Return a table for each replicate study."""
    given = dict(split_override(override) for override in overrides)
    others = [one for one in overrides if split_override(one)[0] != "replicates"]
    return replicates(load_claims(given.get("replicates")), others)


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return the verdicts, those under other readings of the paper, and by other criteria."""
    if len(question.trials) < 2:
        raise CommandError(
            "verdicts take at least two replicate studies: the spread is between them"
        )
    for number, trials in enumerate(question.trials):
        if trials.record.sweep.replicate != number:
            raise CommandError(f"{trials.path} is not replicate {number}: name them in order, once")
    claims = load_claims(len(question.trials))
    return list(decide(claims, list(map(select_trials, question.trials)), n_jobs=question.n_jobs))


STUDY = Study(
    name="claims",
    title="Verdicts",
    plan=plan,
    ask=ask,
    position=1,
    trials="replicates",
    keys=["replicates"],
)
