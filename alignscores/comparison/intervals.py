"""Intervals for differences of two systems, all pairs of systems at once.

A difference comes with its standard error and the degrees of freedom of that error:

- for new runs on these sequences: Welch's, with the variances of the runs of each system on each
  sequence;
- for new sequences like these: that of paired differences of the sequences' means.

Its interval is Student's at the level of Sidak, ``0.95 ** (1 / pairs)``: those of all pairs of
systems hold together. Quantiles of the studentized range would be shorter, but need a variance that
all pairs have in common: with errors of their own they hold too seldom on few sequences.

Runs that fail are counted: how probably a run fails has the exact interval of Clopper and Pearson
(Biometrika 1934). Differences of such probabilities, and of means in which failures count, have
intervals that are put together of those of their parts by the method of variance estimates recovery
(Zou and Donner, Statistics in Medicine 2008). So they know of failures that did not happen. The
parts have mid-P intervals (Lancaster, JASA 1961): put together, exact ones would be too wide.
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arrays import Floats

__all__ = [
    "LEVEL",
    "Difference",
    "Failures",
    "Interval",
    "error_of_pair",
    "joined",
    "largest_scatter",
]
__all__ += ["margin", "needed", "over_runs", "over_sequences"]


LEVEL = 0.95
POWER = 0.8  # how often systems are told apart by the runs that are said to do
MOST_NEEDED = 1000

Interval = tuple[float, float]


class Difference(NamedTuple):
    """A difference with its standard error, and the degrees of freedom of the error."""

    value: float
    error: float
    dof: float


class Failures(NamedTuple):
    """How many of some runs failed; of sequences the sum of the shares of failed runs."""

    failed: float
    of: float

    @property
    def share(self) -> float:
        """The share that failed."""
        return self.failed / self.of

    @property
    def with_one_more(self) -> float:
        """The share if one run more had failed."""
        return (self.failed + 1) / (self.of + 1)

    def more_until(self, share: float) -> float:
        """Return how many times as many runs have a smaller share, one more failed among them."""
        rest = share * self.of - self.failed
        return (1 - share) / rest if rest > 0 else math.inf

    def limits(self, error: float) -> Interval:
        """Return the interval of the probability of failing; it misses it as often as `error`."""
        rest = self.of - self.failed
        low = scipy.special.betaincinv(self.failed, rest + 1, error / 2) if self.failed else 0.0
        high = scipy.special.betaincinv(self.failed + 1, rest, 1 - error / 2) if rest else 1.0
        return float(low), float(high)

    def reach(self, error: float) -> Floats:
        """Return how far the mid-P interval reaches down and up from the share."""
        return np.abs(np.array(_mid_p(*self, error)) - self.share)


@cache
def _mid_p(failed: float, of: float, error: float) -> Interval:
    """Return the mid-P interval of a probability: of what was seen, a half is as extreme."""
    rest = of - failed

    def tail(p: float) -> float:
        fewer = scipy.special.betainc(failed, rest + 1, p) if failed else 1.0
        as_many = scipy.special.betainc(failed + 1, rest, p) if rest else 0.0
        return float(fewer + as_many) / 2

    low, high = (
        scipy.optimize.brentq(lambda p, aim=aim: tail(p) - aim, 0, 1) if there else end
        for aim, there, end in ((error / 2, failed, 0.0), (1 - error / 2, rest, 1.0))
    )
    return low, high


def error_of_pair(n_systems: int) -> float:
    """Return how often the interval of a pair may miss, so that those of all pairs hold."""
    n_pairs = max(math.comb(n_systems, 2), 1)
    return float(-math.expm1(math.log(LEVEL) / n_pairs))


def margin(difference: Difference, error: float) -> float:
    """Return half the length of the interval of a difference."""
    quantile = scipy.special.stdtrit(difference.dof, 1 - error / 2)
    return float(quantile) * difference.error


def over_runs(cells: Sequence[tuple[Sequence[float], Sequence[float]]]) -> Difference:
    """Compare two systems by independent runs, two or more of each on each sequence."""
    values = [of_one for cell in cells for of_one in cell]
    shares = np.array([np.var(of_one, ddof=1) / len(of_one) for of_one in values])
    total = shares.sum()
    free = np.array([len(of_one) - 1 for of_one in values])
    dof = total**2 / (shares**2 / free).sum() if total > 0 else math.inf
    value = np.mean([np.mean(a) - np.mean(b) for a, b in cells])
    return Difference(float(value), float(np.sqrt(total) / len(cells)), float(dof))


def over_sequences(differences: ArrayLike) -> Difference:
    """Compare two systems by the differences of their means on two or more sequences."""
    values = np.asarray(differences)
    error = values.std(ddof=1) / np.sqrt(len(values))
    return Difference(float(values.mean()), float(error), len(values) - 1)


def joined(value: float, *parts: Interval | Floats) -> Interval:
    """Return the interval of a sum, of how far that of each part reaches down and up."""
    down, up = np.sqrt(sum(np.square(part) for part in parts))
    return value - float(down), value + float(up)


def needed(difference: Difference, n: float, error: float, least: float = 0.0) -> int | None:
    """Return how many runs, or sequences, instead of n tell this difference with `POWER`.

    They are more than `least`; None where more than `MOST_NEEDED` do not.
    """

    def enough(count: int) -> bool:
        reach = _reach(difference.dof * (count - 1) / (n - 1), error)
        return reach * difference.error * math.sqrt(n / count) <= abs(difference.value)

    counts = range(max(2, math.floor(min(least, MOST_NEEDED)) + 1), MOST_NEEDED + 1)
    first = bisect_left(counts, True, key=enough)
    return counts[first] if difference.value and first < len(counts) else None


def largest_scatter(value: float, n_runs: int, error: float) -> float:
    """Return with what standard deviation that many runs of each tell a difference apart."""
    return abs(value) / (_reach(2.0 * (n_runs - 1), error) * math.sqrt(2 / n_runs))


def _reach(dof: float, error: float) -> float:
    """Return how many standard errors from 0 a difference has to be, to be told with `POWER`."""
    return float(scipy.special.stdtrit(dof, 1 - error / 2) + scipy.special.stdtrit(dof, POWER))
