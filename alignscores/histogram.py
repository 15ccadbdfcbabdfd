"""Cumulative frequency histogram of alignment errors and the score that is its area (eq. 3, 4)."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .arrays import Floats
from .validation import check_positive

__all__ = ["AlignmentScore", "cumulative_frequency", "equal_steps"]


@dataclass(frozen=True, eq=False)
class AlignmentScore:
    """What every alignment score has in common; ``float(result)`` is the score.

    Parameters
    ----------
    errors : (n,) ndarray
        Error of each camera after the alignment; infinite where the camera was not estimated or
        nothing could be aligned.
    thresholds : (K,) ndarray
        Error thresholds in ascending order, in the unit of the errors.

    Attributes
    ----------
    score : float
        From 0 to 1; also ``float(result)``.
    cumulative_frequency : (K,) ndarray of int
        Number of errors below (not at) each threshold, ``f_k`` in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import AlignmentScore
    >>> result = AlignmentScore(np.array([0.1, 0.3, np.inf]), np.array([0.2, 0.4]))
    >>> result.score, result.cumulative_frequency
    (0.5, array([1, 2]))
    """

    score: float = field(init=False)
    errors: Floats
    thresholds: Floats
    cumulative_frequency: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        frequency = cumulative_frequency(self.errors, self.thresholds)
        # Whole numbers until the one division: a perfect estimate scores exactly 1.
        score = int(frequency.sum()) / (len(self.thresholds) * len(self.errors))
        score = math.nan if np.isnan(self.errors).all() else score
        object.__setattr__(self, "cumulative_frequency", frequency)
        object.__setattr__(self, "score", score)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.score:.4f}, n={len(self.errors)})"

    def __float__(self) -> float:
        return self.score


def cumulative_frequency(errors: Floats, thresholds: Floats) -> NDArray[np.int64]:
    """Return the number of errors strictly below each threshold: ``f_k`` of figure 1."""
    return np.searchsorted(np.sort(errors), thresholds, side="left").astype(np.int64, copy=False)


def equal_steps(largest: float, count: int, name: str) -> Floats:
    """Return ``count`` equally spaced thresholds up to the largest; `name` is for the error."""
    check_positive(largest, name)
    check_positive(count, "n_thresholds", integer=True)
    return largest * np.arange(1.0, count + 1) / count
