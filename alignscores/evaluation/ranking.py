"""The order of several estimates of one reference, and which of them are tied."""

from collections.abc import Sequence

import numpy as np

from .evaluation import Evaluation

__all__ = ["are_ranked", "in_rank_order", "ranking_notes", "ranks"]

TIED = 2.0  # standard errors of their difference within which two means are tied


def are_ranked(evaluations: Sequence[Evaluation]) -> bool:
    """Tell whether estimates compare: not where they are in different numbers of parts."""
    return len({len(evaluation.parts) for evaluation in evaluations}) == 1


def in_rank_order(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the estimates, the best PAS first; as they are where they are not ranked."""
    if not are_ranked(evaluations):
        return list(evaluations)
    return sorted(evaluations, key=lambda evaluation: evaluation.pas, reverse=True)


def ranks(evaluations: Sequence[Evaluation]) -> list[tuple[int, int] | None]:
    """Return the best and the worst rank that each estimate may have; None where not ranked.

    An estimate is behind another one where their mean PAS differ by more than 2 standard errors of
    the difference, over the seeds. So tied estimates have ranks in common. To be tied is not
    transitive: a range of ranks, from one more than the number of estimates ahead to the number of
    those not behind, says which estimates are ahead and which are behind.
    """
    if not are_ranked(evaluations):
        return [None] * len(evaluations)
    means = np.array([evaluation.pas for evaluation in evaluations])
    variances = np.array(
        [(evaluation.pas_sd or 0.0) ** 2 / len(evaluation.tas_seeds) for evaluation in evaluations]
    )
    differences = np.subtract.outer(means, means)
    ahead = differences > TIED * np.sqrt(np.add.outer(variances, variances))  # row ahead of column
    best, worst = 1 + ahead.sum(axis=0), len(evaluations) - ahead.sum(axis=1)
    return list(zip(best.tolist(), worst.tolist(), strict=True))


def ranking_notes(evaluations: Sequence[Evaluation]) -> list[str]:
    """Say why scores do not compare, if they do not."""
    if not evaluations or are_ranked(evaluations):
        return []
    parts = {len(evaluation.parts) or 1 for evaluation in evaluations}
    return [
        f"the scores do not compare and stand in the order given: from {min(parts)} to "
        f"{max(parts)} parts are each aligned on their own, and more of them fit better"
    ]
