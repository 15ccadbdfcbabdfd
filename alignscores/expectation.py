"""What TAS to expect from errors of a known distribution, and how many runs tell two apart."""

from dataclasses import dataclass
from math import ceil, inf, sqrt
from typing import Any, Protocol

import numpy as np

from .similarity import check_alignment
from .validation import check_positive

__all__ = ["ExpectedScore", "expected_tas", "runs_needed"]

PARAMETERS = {"similarity": 7, "rigid": 6, "yaw": 4, "none": 0}  # that are fitted
N_THRESHOLDS = 100  # of a score, as by default
N_STEPS = 10_000  # of the integral of pdf(e) / e
MOST_FITTED = 1 / 3  # of the score; the expansion leads astray beyond
REACH = 1.959964 + 0.841621  # standard errors: two-sided at 5 %, with a power of 80 %


class Distribution(Protocol):
    """Of errors: frozen distributions of `scipy.stats` have both functions."""

    def cdf(self, x: Any) -> Any:
        """Return the share of errors of at most `x`."""

    def pdf(self, x: Any) -> Any:
        """Return the density at `x`."""


@dataclass(frozen=True)
class ExpectedScore:
    """Mean and standard deviation of a score over runs.

    Parameters
    ----------
    mean : float
        The expected score.
    sd : float
        Its standard deviation from one run to the next.

    Examples
    --------
    >>> from alignscores import ExpectedScore, runs_needed
    >>> runs_needed(ExpectedScore(0.62, 0.02), ExpectedScore(0.60, 0.03))
    26.0
    """

    mean: float
    sd: float


def expected_tas(
    errors: Distribution,
    n_cameras: int,
    unit: float = 1.0,
    *,
    lost: float = 0.0,
    alignment: str = "similarity",
) -> ExpectedScore:
    """Return what TAS to expect from cameras whose errors are independent, and its scatter.

    The registration is the refined one, which maximises the score.

    Parameters
    ----------
    errors : distribution
        Of the distance of an estimated position from the true one, before the alignment, with
        methods ``cdf`` and ``pdf``, such as ``scipy.stats.maxwell(scale=0.02)``: Gaussian errors
        of 0.02 in x, y and z. All directions are equally likely.
    n_cameras : int
        Number of cameras.
    unit : float
        Largest threshold, d, in the unit of the errors.
    lost : float
        Probability that a camera is lost or far off, from 0 to 1, without 1.
    alignment : {"similarity", "rigid", "yaw", "none"}
        What the alignment may change: seven, six, four parameters or none.

    Returns
    -------
    ExpectedScore
        Mean and standard deviation. The latter leaves out that the fit also evens scores out, so it
        is rather too large.

    Raises
    ------
    ValueError
        Where an argument is out of its range, or where the fit would explain more than a third of
        the score: too few cameras are within the unit.

    Notes
    -----
    The mean holds to first order in 1/n. The page "How many cameras or runs do I need?" derives
    both and compares them with simulations.

    Examples
    --------
    >>> from alignscores import expected_tas
    >>> from scipy.stats import maxwell
    >>> expected = expected_tas(maxwell(scale=0.02), 100, unit=0.1, lost=0.1)
    >>> round(expected.mean, 3), round(expected.sd, 3)
    (0.622, 0.024)
    """
    check_positive(n_cameras, "n_cameras", integer=True)
    if not 0 <= lost < 1:
        raise ValueError(f"lost must be from 0 to 1, without 1, not {lost}")
    check_positive(unit, "unit")
    check_alignment(alignment, "z")
    steps = np.arange(1, N_THRESHOLDS + 1)
    below = errors.cdf(unit * steps / N_THRESHOLDS)
    mean = (1 - lost) * float(np.mean(below))
    square = (1 - lost) * float((2 * (N_THRESHOLDS - steps) + 1) @ below) / N_THRESHOLDS**2
    parameters = PARAMETERS[alignment]
    fitted = parameters * _gain(errors, unit) / n_cameras if parameters else 0.0
    if fitted > MOST_FITTED * mean:
        raise ValueError(
            f"of {n_cameras} cameras too few are within the unit {unit:g}: the fit would explain "
            f"{fitted:.2g} beside a score of {mean:.2g}; take a larger unit or more cameras"
        )
    return ExpectedScore(mean + fitted, sqrt((square - mean**2) / n_cameras))


def _gain(errors: Distribution, unit: float) -> float:
    """Return what a parameter adds to the sum of the scores of all cameras.

    It is half the mean squared slope of a camera's score in a direction over its mean curvature.
    """
    middles = unit * (np.arange(N_STEPS) + 0.5) / N_STEPS
    inverse = unit * float(np.mean(errors.pdf(middles) / middles))  # mean of 1/e, of those within
    slope = float(errors.cdf(unit)) / unit
    curvature = 2 * inverse - float(errors.pdf(unit))
    return slope / (2 * curvature) if curvature > 0 else inf


def runs_needed(first: ExpectedScore, second: ExpectedScore) -> float:
    """Return how many runs of each of two systems tell their scores apart.

    By a two-sided z-test of the means at 5 %, with a power of 80 %.

    Parameters
    ----------
    first, second : ExpectedScore
        Mean and standard deviation of both, from `expected_tas` or from runs.

    Returns
    -------
    float
        A whole number; infinite where both have the same mean.

    Examples
    --------
    Errors that differ by a tenth take four runs with 100 cameras and one with 500:

    >>> from alignscores import expected_tas, runs_needed
    >>> from scipy.stats import maxwell
    >>> better, worse = maxwell(scale=0.02), maxwell(scale=0.022)
    >>> [runs_needed(expected_tas(better, n, 0.1), expected_tas(worse, n, 0.1)) for n in (100, 500)]
    [4.0, 1.0]
    """
    if first.mean == second.mean:
        return inf
    variance = first.sd**2 + second.sd**2
    return float(max(1, ceil(REACH**2 * variance / (first.mean - second.mean) ** 2)))
