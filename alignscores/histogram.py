"""Cumulative frequency histogram of alignment errors and the score that is its area (eq. 3, 4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import Floats
from .validation import check_positive

__all__ = ["AlignmentScore", "area", "cumulative_frequency", "equal_steps", "score_of"]


@dataclass(frozen=True, eq=False, repr=False)
class AlignmentScore:
    """Base of the alignment scores' results; ``float(result)`` is the score.

    Parameters
    ----------
    score : float
        From 0 to 1; also ``float(result)``.
    errors : (n,) ndarray
        Error of each camera after the alignment; infinite where the camera was not estimated or
        nothing could be aligned.
    thresholds : (K,) ndarray
        Error thresholds in ascending order, in the unit of the errors.
    cumulative_frequency : (K,) ndarray of int
        Number of errors below (not at) each threshold, ``f_k`` in the paper.

    Examples
    --------
    >>> from alignscores import ras
    >>> from scipy.spatial.transform import Rotation
    >>> gt = Rotation.identity(4)
    >>> result = ras(
    ...     gt, Rotation.from_euler("x", [[0], [0], [0], [3]], degrees=True), n_thresholds=2
    ... )
    >>> result.score, result.cumulative_frequency
    (1.0, array([4, 4]))
    """

    score: float
    errors: Floats
    thresholds: Floats
    cumulative_frequency: NDArray[np.int64]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.score:.4f}, n={len(self.errors)})"

    def __float__(self) -> float:
        return self.score


def cumulative_frequency(errors: Floats, thresholds: Floats) -> NDArray[np.int64]:
    """Return the number of errors strictly below each threshold: ``f_k`` of figure 1."""
    return np.sort(errors).searchsorted(thresholds).astype(np.int64, copy=False)


def area(frequency: NDArray[np.int64], n: int) -> float:
    """Return the score: the normalised sum of the cumulative frequencies of n errors (eq. 3, 4)."""
    return int(frequency.sum()) / (len(frequency) * n)  # one division: perfect is exactly 1


def score_of(errors: Floats, thresholds: Floats) -> float:
    """Return the score of errors."""
    return area(cumulative_frequency(errors, thresholds), len(errors))


def equal_steps(largest: float, count: int, name: str) -> Floats:
    """Return ``count`` equally spaced thresholds up to the largest; `name` is for the error."""
    check_positive(largest, name)
    check_positive(count, "n_thresholds", integer=True)
    return largest * np.arange(1.0, count + 1) / count
