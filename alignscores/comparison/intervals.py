"""Intervals for differences of two systems, all pairs of systems at once.

A difference comes with its standard error and the degrees of freedom of that error:

- over runs, of two systems with several runs each: Welch's;
- over stretches of the trajectory, where there are fewer runs, with the alignments fixed: the
  moving-block bootstrap, whose variance of a mean needs no drawing; over cameras where they have no
  order;
- over sequences, paired: of the differences of the sequences' means.

Its interval is Student's at the level of Sidak, ``0.95 ** (1 / pairs)``: those of all pairs of
systems hold together. Quantiles of the studentized range would be shorter, but need a variance that
all pairs have in common: with errors of their own they hold too seldom on few sequences.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arrays import Floats

__all__ = [
    "BLOCKS",
    "LEVEL",
    "Difference",
    "margin",
    "over_runs",
    "over_sequences",
    "over_stretches",
    "series",
]


LEVEL = 0.95
BLOCKS = 10  # stretches of a trajectory that are taken for independent
EFFICIENCY = 1.5  # degrees of freedom of overlapping blocks, for each of those side by side


class Difference(NamedTuple):
    """A difference with its standard error, and the degrees of freedom of the error."""

    value: float
    error: float
    dof: float


def margin(difference: Difference, n_systems: int) -> float:
    """Return half the length of the interval of a difference, for all pairs of the systems."""
    n_pairs = max(n_systems * (n_systems - 1) // 2, 1)
    quantile = scipy.special.stdtrit(difference.dof, (1 + LEVEL ** (1 / n_pairs)) / 2)
    return float(quantile) * difference.error


def over_runs(a: ArrayLike, b: ArrayLike) -> Difference:
    """Compare two systems by their independent runs, two or more each, by Welch's method."""
    of_a, of_b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    shares = np.array([np.var(values, ddof=1) / len(values) for values in (of_a, of_b)])
    total = shares.sum()
    dof = total**2 / (shares**2 / [len(of_a) - 1, len(of_b) - 1]).sum() if total > 0 else math.inf
    return Difference(float(of_a.mean() - of_b.mean()), float(np.sqrt(total)), float(dof))


def over_sequences(differences: ArrayLike) -> Difference:
    """Compare two systems by the differences of their means on two or more sequences."""
    values = np.asarray(differences, dtype=np.float64)
    error = values.std(ddof=1) / np.sqrt(len(values))
    return Difference(float(values.mean()), float(error), len(values) - 1)


def series(places: Floats, scores: Floats, n_cells: int) -> Floats:
    """Return by how much the cameras in each of equal parts of a trajectory lift the mean score.

    With s and n the sums of the scores, and the numbers of cameras, in the m parts, and r the mean
    of all scores, it is m (s - r n) / sum(n): the linearised ratio sum(s) / sum(n). Their mean is
    0; the mean of those in a new draw of parts is the change of the mean score.
    """
    cell = np.minimum((places * n_cells).astype(int), n_cells - 1)
    centred = np.bincount(cell, weights=scores - scores.mean(), minlength=n_cells)
    return np.asarray(centred * (n_cells / len(scores)), dtype=np.float64)


def over_stretches(value: float, differences: Floats, *, ordered: bool) -> Difference | None:
    """Compare two systems by the differences of their `series`; None where these are too short.

    Where the parts are `ordered`, neighbours may depend on each other. The variance of the mean of
    circular blocks, drawn with replacement, is the variance of the blocks' means over their number.
    It is too small by 1 - length / m, where the parts are independent. A block, a tenth of the
    trajectory, should be longer than errors are correlated.
    """
    m = len(differences)
    if m < 2 * BLOCKS:
        return None
    length = m // BLOCKS if ordered else 1
    wrapped = np.concatenate([differences, differences[: length - 1]])
    means = np.convolve(wrapped, np.full(length, 1 / length), mode="valid")
    variance = np.mean((means - differences.mean()) ** 2) * length / (m - length)
    dof = EFFICIENCY * (m / length - 1) if ordered else m - 1
    return Difference(value, float(np.sqrt(variance)), float(dof))
