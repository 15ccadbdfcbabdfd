"""The ruler of all studies: how often a metric puts the better of two trials first.

It is P(X < Y) + P(X = Y) / 2 for a trial X at a better level and a trial Y at a worse one: 1/2 is
chance, 1 is certain, and no monotone rescaling of a metric changes it. The standard error is that
of DeLong, DeLong and Clarke-Pearson (Biometrics 1988), for the mean over several pairs of levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, inf

import numpy as np
import pandas as pd
import scipy

from alignscores.arrays import Floats
from alignscores.comparison.statistics import LEVEL, beats, win_probability
from experiments.grid import CELL_SETTINGS
from experiments.metrics import metric as find

REACH = float(scipy.special.ndtri(1 - LEVEL / 2))  # of a 95 % interval, in standard errors
ROUNDING = 12  # decimals, so that ties are ties


@dataclass(frozen=True)
class Order:
    """The probability of the right order, or a difference of two, and its standard error."""

    probability: float
    error: float

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % confidence interval."""
        return self.probability - REACH * self.error, self.probability + REACH * self.error

    @property
    def p_value(self) -> float:
        """The two-sided p-value of a difference against none."""
        size = round(abs(self.probability), ROUNDING)
        if round(self.error, ROUNDING) == 0:
            return float(not size)
        return float(2 * scipy.special.ndtr(-size / self.error))


@dataclass(frozen=True)
class Task:
    """Pairs of samples of trials that are to be put in order, the better one first."""

    samples: Sequence[pd.DataFrame]
    pairs: Sequence[tuple[int, int]]

    def shares(self, metric: str) -> Floats:
        """Return each trial's share of the probability of the right order, (samples, trials).

        A metric without a value (NaN) cannot put two trials in order: a tie. Each pair of trials is
        in the shares of both, so the means of all samples sum to twice the probability.
        """
        values = [sign(metric) * sample[metric].to_numpy() for sample in self.samples]
        totals = [np.zeros(len(sample)) for sample in values]
        for better, worse in self.pairs:
            right = in_order(values[better], values[worse])
            totals[better] += right.mean(axis=1) / len(self.pairs)
            totals[worse] += right.mean(axis=0) / len(self.pairs)
        return np.array(totals)


def sign(metric: str) -> int:
    """Return what a metric is multiplied by so that larger is worse."""
    return -find(metric).sign


def varies(trials: pd.DataFrame, setting: str) -> bool:
    """Return whether a setting has levels that could be put in order."""
    return trials[setting].nunique() > 1


def groups(trials: pd.DataFrame, level: str) -> list[pd.DataFrame]:
    """Return the trials that share all settings but a level and the settings that rise with it."""
    levels = trials[level].tolist()
    n_levels = len(set(levels))
    free = [
        name
        for name in CELL_SETTINGS
        if name != level and len(set(zip(levels, trials[name].tolist(), strict=True))) > n_levels
    ]
    return [group for _, group in trials.groupby(free)] if free else [trials]


def neighbouring_levels(trials: pd.DataFrame, level: str) -> Task:
    """Compare neighbouring levels where the other settings are equal."""
    samples: list[pd.DataFrame] = []
    pairs: list[tuple[int, int]] = []
    for group in groups(trials, level):
        first = len(samples)
        samples += [sample for _, sample in group.groupby(level)]
        pairs += pairwise(range(first, len(samples)))
    return Task(samples, pairs)


def in_order(better: Floats, worse: Floats) -> Floats:
    """Return whether each pair of trials is in the right order, (n, m); a tie is a half."""
    return beats(worse, better[:, None])  # larger is worse


def estimate(shares: Floats) -> Order:
    """Return the probability that shares sum to, with its error over independent trials."""
    probability = sum(float(unit.mean()) for unit in shares) / 2
    variance = sum(unit.var(ddof=1) / len(unit) if len(unit) > 1 else inf for unit in shares)
    return Order(probability, float(np.sqrt(variance)))


def orders(trials: pd.DataFrame, metric: str, level: str) -> list[float]:
    """Return the probability of the right order in each group that shares all other settings."""
    samples = [
        [-sign(metric) * values.to_numpy() for _, values in group.groupby(level)[metric]]
        for group in groups(trials, level)
    ]
    return [win_probability(list(pairwise(of_levels))) for of_levels in samples]


def trials_needed(probability: float) -> float:
    """Return how many trials at each of two levels a rank-sum test needs to find a difference.

    Two-sided at 5 %, with a power of 80 % (Noether, JASA 1987); infinite where the order is a
    matter of chance, or wrong.
    """
    if not probability > 0.5:
        return inf
    reach = REACH + scipy.special.ndtri(0.8)
    return float(ceil(reach**2 / (6 * (probability - 0.5) ** 2)))


def needed(order: Order) -> float:
    """Return `trials_needed` of an estimate; infinite where it may be chance."""
    return inf if order.interval[0] <= 0.5 else trials_needed(order.probability)
