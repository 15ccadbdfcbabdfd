"""The paper's claims, ``configs/claims.yaml``: the trials that they need, and the verdicts."""

from collections.abc import Sequence

import pandas as pd

from experiments.command import CommandError
from experiments.tables import Trials

from ..study import Study
from .claims import load_claims
from .verdicts import decide, select_trials


def answer(trials: Sequence[Trials], n_jobs: int = 1) -> list[pd.DataFrame | str]:
    """Return the verdicts, those under other readings of the paper, and by other criteria."""
    if len(trials) < 2:
        raise CommandError(
            "verdicts take at least two replicate studies: the spread is between them"
        )
    for number, table in enumerate(trials):
        if table.sweep.replicate != number:
            raise CommandError(f"{table.path} is not replicate {number}: name them in order, once")
    return list(decide(load_claims(len(trials)), list(map(select_trials, trials)), n_jobs=n_jobs))


STUDY = Study(name="claims", title="Verdicts", answer=answer, position=1, keys=["replicates"])
