"""The order of the estimates: what they are ranked by, and which of them are tied."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..arrays import Booleans

if TYPE_CHECKING:
    from .scoring import Scored

__all__ = ["in_rank_order", "ranked_by", "ranks"]


SAME_UNIT = 1.03  # largest ratio of two d whose scores compare: the seed changes the TAS by more
TIED = 2.0  # standard errors of their difference within which two means are tied
TIED_HALF = 1e-2  # relative difference of half-score distances that the search may leave

RankedBy = Literal["PAS", "half_distance"]


def ranked_by(scored: "Sequence[Scored]") -> RankedBy | None:
    """Return the key of the JSON output that the estimates are ranked by, if any.

    The PAS where d is about the same for all, else the half-score distance, which does not depend
    on d; nothing where they are in different numbers of parts.
    """
    if len({len(one.parts) for one in scored}) != 1:
        return None
    units = [one.result.tas.unit for one in scored]
    return "PAS" if max(units) <= SAME_UNIT * min(units) else "half_distance"


def in_rank_order(scored: "Sequence[Scored]") -> "list[Scored]":
    """Return the estimates, the best one first; as they are where they are not ranked."""
    if ranked_by(scored) == "PAS":
        return sorted(scored, key=lambda one: one.pas, reverse=True)
    if ranked_by(scored) == "half_distance":
        return sorted(scored, key=lambda one: one.half_distance)
    return list(scored)


def ranks(scored: "Sequence[Scored]") -> list[tuple[int, int] | None]:
    """Return the best and the worst rank that each estimate may have.

    By the mean PAS an estimate is behind another one where their means differ by more than 2
    standard errors of the difference, over the seeds; by the half-score distance where it is larger
    by more than the search for it leaves. So tied estimates have ranks in common. To be tied is not
    transitive: a range of ranks says which estimates are ahead and which are behind for each.

    Parameters
    ----------
    scored : sequence of Scored
        The estimates.

    Returns
    -------
    list of (int, int) or None
        One more than the number of estimates ahead, and the number of those not behind; None where
        the estimates are not ranked.
    """
    by = ranked_by(scored)
    if by is None:
        return [None] * len(scored)
    ahead = _ahead_by_pas(scored) if by == "PAS" else _ahead_by_half(scored)
    best, worst = 1 + ahead.sum(axis=0), len(scored) - ahead.sum(axis=1)
    return list(zip(best.tolist(), worst.tolist(), strict=True))


def _ahead_by_pas(scored: "Sequence[Scored]") -> Booleans:
    """Tell which estimate, of the row, is ahead of which, of the column."""
    means = np.array([one.pas for one in scored])
    variances = np.array([(one.pas_sd or 0.0) ** 2 / len(one.tas_seeds) for one in scored])
    ahead: Booleans = np.subtract.outer(means, means) > TIED * np.sqrt(
        np.add.outer(variances, variances)
    )
    return ahead


def _ahead_by_half(scored: "Sequence[Scored]") -> Booleans:
    halves = np.array([one.half_distance for one in scored])
    return (1 + TIED_HALF) * halves[:, None] < halves
