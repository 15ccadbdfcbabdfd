"""The order of the estimates: whether their scores compare, and which of them are tied."""

from collections.abc import Sequence

import numpy as np

from .scoring import Scored

__all__ = ["comparable", "ranks"]

SAME_UNIT = 1.03  # largest ratio of two d whose scores compare: the seed changes the TAS by more
TIED = 2.0  # standard errors of their difference within which two means are tied


def comparable(scored: Sequence[Scored]) -> bool:
    """Tell whether d is about the same for all, and so many parts, so that the scores compare."""
    units = [one.result.tas.unit for one in scored]
    same_parts = len({len(one.parts) for one in scored}) <= 1
    return same_parts and (not units or max(units) <= SAME_UNIT * min(units))


def ranks(scored: Sequence[Scored]) -> list[tuple[int, int]]:
    """Return the best and the worst rank that each estimate may have, by its mean PAS.

    An estimate is behind another one where their means differ by more than 2 standard errors of
    the difference, over the seeds. So tied estimates have ranks in common. To be tied is not
    transitive: a range of ranks says which estimates are ahead and which are behind for each.

    Parameters
    ----------
    scored : sequence of Scored
        Estimates whose scores compare.

    Returns
    -------
    list of (int, int)
        One more than the number of estimates ahead, and the number of those not behind.
    """
    means = np.array([one.pas for one in scored])
    variances = np.array([(one.pas_sd or 0.0) ** 2 / len(one.tas_seeds) for one in scored])
    best, worst = [], []
    for mean, variance in zip(means, variances, strict=True):
        margin = TIED * np.sqrt(variances + variance)
        best.append(1 + int(np.sum(means - mean > margin)))
        worst.append(len(means) - int(np.sum(mean - means > margin)))
    return list(zip(best, worst, strict=True))
