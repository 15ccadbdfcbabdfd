"""The order of several estimates: what they are ranked by, and which of them are tied."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ..arrays import Booleans
from ..trajectories.association import is_denser
from .evaluation import Evaluation

__all__ = ["TIED_HALF", "RankedBy", "in_rank_order", "ranked_by", "ranks", "units_notes"]

SAME_UNIT = 1.03  # largest ratio of two d whose scores compare: the seed changes the TAS by more
TIED = 2.0  # standard errors of their difference within which two means are tied
TIED_HALF = 1e-2  # relative difference of half-score distances that the search may leave

RankedBy = Literal["PAS", "half_distance"]


def ranked_by(evaluations: Sequence[Evaluation]) -> RankedBy | None:
    """Return what the estimates are ranked by; nothing where their numbers of parts differ.

    It is the PAS where d is about the same for all, else the half-score distance, which does not
    depend on d.
    """
    if len({len(evaluation.parts) for evaluation in evaluations}) != 1:
        return None
    units = [evaluation.result.tas.unit for evaluation in evaluations]
    return "PAS" if max(units) <= SAME_UNIT * min(units) else "half_distance"


def in_rank_order(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the estimates, the best one first; as they are where they are not ranked."""
    if ranked_by(evaluations) == "PAS":
        return sorted(evaluations, key=lambda evaluation: evaluation.pas, reverse=True)
    if ranked_by(evaluations) == "half_distance":
        return sorted(evaluations, key=lambda evaluation: evaluation.half_distance)
    return list(evaluations)


def ranks(evaluations: Sequence[Evaluation]) -> list[tuple[int, int] | None]:
    """Return the best and the worst rank that each estimate may have; None where not ranked.

    By the mean PAS an estimate is behind another one where their means differ by more than 2
    standard errors of the difference, over the seeds; by the half-score distance where it is larger
    by more than the search for it leaves. To be tied is not transitive: so ranks are from one more
    than the number of estimates ahead to the number of those not behind.
    """
    by = ranked_by(evaluations)
    if by is None:
        return [None] * len(evaluations)
    ahead = _ahead_by_pas(evaluations) if by == "PAS" else _ahead_by_half(evaluations)
    best, worst = 1 + ahead.sum(axis=0), len(evaluations) - ahead.sum(axis=1)
    return list(zip(best.tolist(), worst.tolist(), strict=True))


def _ahead_by_pas(evaluations: Sequence[Evaluation]) -> Booleans:
    """Tell which estimate, of the row, is ahead of which, of the column."""
    means = np.array([evaluation.pas for evaluation in evaluations])
    variances = np.array(
        [(evaluation.pas_sd or 0.0) ** 2 / len(evaluation.tas_seeds) for evaluation in evaluations]
    )
    differences = np.subtract.outer(means, means)
    ahead: Booleans = differences > TIED * np.sqrt(np.add.outer(variances, variances))
    return ahead


def _ahead_by_half(evaluations: Sequence[Evaluation]) -> Booleans:
    halves = np.array([evaluation.half_distance for evaluation in evaluations])
    return (1 + TIED_HALF) * halves[:, None] < halves


def units_notes(evaluations: Sequence[Evaluation]) -> list[str]:
    """Say why scores do not compare, if they do not, and which options give scores that do."""
    if not evaluations or ranked_by(evaluations) == "PAS":
        return []
    if ranked_by(evaluations) is None:
        parts = {len(evaluation.parts) or 1 for evaluation in evaluations}
        return [
            f"the scores do not compare and stand in the order given: from {min(parts)} to "
            f"{max(parts)} parts are each aligned on their own, and more of them fit better"
        ]
    form, reference = evaluations[0].settings.form, evaluations[0].reference
    units = [evaluation.result.tas.unit for evaluation in evaluations]
    largest = max(evaluations, key=lambda evaluation: len(evaluation.matches.keys))
    note = (
        "ranked by the half-score distance, as TAS and PAS do not compare: d is from "
        f"{min(units):.4g} to {max(units):.4g} {form.unit}, since the estimates differ in their "
        f"cameras; --unit {largest.result.tas.unit:.4g} gives all one d"
    )
    if not form.timed or not any(
        is_denser(reference.keys, evaluation.matches.keys) for evaluation in evaluations
    ):
        note += ", --missing fail also the same cameras"
    return [note]
