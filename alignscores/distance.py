"""Half-score distance and angle: the smallest range of thresholds that reaches a score."""

import warnings
from collections.abc import Callable
from math import floor, inf, nan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .aligner import Aligner, Seed, one_scene
from .arrays import Floats
from .histogram import equal_steps
from .registration import Registration
from .rotation import ras
from .similarity import FARTHEST_SUMMABLE
from .validation import AlignmentWarning, check_positive

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "FITTED",
    "extent",
    "ras_angle",
    "search_unit",
    "smallest_unit",
    "tas_distance",
    "too_few",
]

ErrorsAt = Callable[[float], Floats]  # of the best alignment at a largest threshold

FITTED = {"similarity": 2, "rigid": 1, "yaw": 1, "none": 0}  # cameras, whatever the estimate
N_THRESHOLDS = 100  # of a score, as by default
GAIN = 1e-3  # relative; the search ends with the first step that gains less
ROUNDING = 1e-12  # of the extent; smaller units are rounding errors
MARGIN = 1e-12  # relative, beyond the rounding of a sum of errors
SHRINK = 2.0**-40  # of errors whose sums overflow; it rounds nothing
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)  # a smaller unit is rounded to 0


def tas_distance(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    score: float = 0.5,
    *,
    rng: Seed = 0,
    n_hypotheses: int = 1000,
    registration: str | Registration = "refined",
    alignment: str = "similarity",
    up: str = "z",
) -> float:
    """Return the smallest d at which the TAS reaches a score: the half-score distance.

    It is an error in the unit of the ground truth and needs no d. Up to a share ``1 - score`` of
    outliers it is finite, wherever they are.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Camera centres in the ground-truth frame.
    est_positions : (n, 3) array_like
        Estimated camera centres; a row that is not finite was not estimated.
    score : float
        Above 0, at most 1.
    rng : int, SeedSequence, Generator or None
        See `tas`.
    n_hypotheses : int
        Number of hypotheses of the registration.
    registration : {"refined", "pcr99"} or Registration
        See `tas`. The alignment of "pcr99" is the same at every threshold.
    alignment, up : str
        See `tas`.

    Returns
    -------
    float
        The distance in ground-truth units; infinite if the score is never reached, NaN if there are
        too few cameras: ``2 / score`` or fewer (a similarity fits two cameras exactly), with
        another alignment ``1 / score``.

    Raises
    ------
    ValueError
        If the input is malformed, or the score is out of range.

    Warns
    -----
    AlignmentWarning
        If the estimate cannot be aligned, so that the distance is infinite, or there are too few
        cameras.

    References
    ----------
    ``docs/explanation/scores.md``. Not in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas_distance
    >>> rng = np.random.default_rng(0)
    >>> gt = np.cumsum(rng.normal(size=(400, 3)), axis=0)
    >>> est = gt + rng.normal(scale=0.6, size=gt.shape)
    >>> est[:100] = np.nan
    >>> [round(tas_distance(gt, est, score), 2) for score in (0.25, 0.5)]
    [1.42, 2.9]
    """
    aligner = Aligner(
        *one_scene(gt_positions, est_positions),
        registration=registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
        keep=True,
    )
    if reason := too_few(len(aligner.gt), score, alignment):
        warnings.warn(reason, AlignmentWarning, stacklevel=2)
        return nan
    if aligner.has_one_alignment:
        errors = np.sort(aligner.align(1.0).errors)
        distance = smallest_unit(errors, score, N_THRESHOLDS)
    else:
        distance, errors = search_unit(
            lambda unit: aligner.align(unit).errors, extent(aligner.gt), score, N_THRESHOLDS
        )
    if np.isinf(errors).all():
        warnings.warn(
            "the distance is infinite: the estimate cannot be aligned",
            AlignmentWarning,
            stacklevel=2,
        )
    return distance


def ras_angle(
    gt_rotations: "ArrayLike | Rotation",
    est_rotations: "ArrayLike | Rotation",
    score: float = 0.5,
    *,
    alignment: str = "similarity",
    up: str = "z",
) -> float:
    """Return the smallest range of thresholds at which the RAS reaches a score.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations; see `ras`.
    score : float
        Above 0, at most 1; one half gives the half-score angle.
    alignment, up : str
        See `ras`.

    Returns
    -------
    float
        The angle in degrees, for any number of cameras; infinite if the score is never reached.

    Raises
    ------
    ValueError
        If the input is malformed, or the score is out of range.

    Warns
    -----
    AlignmentWarning
        If no camera was estimated; the angle is infinite.

    References
    ----------
    ``docs/explanation/scores.md``. Not in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import ras_angle
    >>> gt = Rotation.random(5, rng=np.random.default_rng(0))
    >>> est = Rotation.from_euler("x", [[0], [0], [0], [2], [90]], degrees=True) * gt
    >>> round(ras_angle(gt, est, 0.75), 2)
    7.6
    """
    result = ras(gt_rotations, est_rotations, alignment=alignment, up=up)
    return smallest_unit(np.sort(result.errors), score, N_THRESHOLDS)


def too_few(n: int, score: float, alignment: str) -> str:
    """Return the reason why n cameras have no distance, or an empty string."""
    _check_score(score)
    fitted = FITTED[alignment]
    if score * n > fitted:
        return ""
    return (
        f"no distance at a score of {score:g} for {n} cameras: {floor(fitted / score) + 1} are "
        f"needed, since any alignment fits {fitted} of them exactly"
    )


def search_unit(
    errors_at: ErrorsAt, start: float, score: float, n_thresholds: int
) -> tuple[float, Floats]:
    """Return the smallest unit at which a score is reached, and the errors that reach it.

    If an alignment reaches the score below the unit u, the best one at u reaches it below u, too:
    this is the next unit. If the unit stays, no smaller one reaches the score. The method is
    Dinkelbach's ("On nonlinear fractional programming", Management Science 1967).
    """
    _check_score(score)
    start = start if 0 < start < inf else 1.0
    unit, before, smallest, best = start, inf, inf, np.empty(0)
    while 0 < unit < (1 - GAIN) * before:
        before = unit if best.size else inf  # the first step may go up
        errors = np.sort(errors_at(unit))
        unit = _continuous_unit(errors, score)
        if unit <= smallest:
            smallest, best = unit, errors
        if unit < ROUNDING * start:
            break
    return smallest_unit(best, score, n_thresholds), best


def smallest_unit(sorted_errors: Floats, score: float, n_thresholds: int) -> float:
    """Return the smallest number at which the score of sorted errors is reached, to the last bit.

    Error e falls below threshold k of K at the unit u = e K / k, and the score counts these steps.
    It is at most 1/K above the score with infinitely many thresholds, and never below, so the
    number lies between the units of these two.
    """
    _check_score(score)
    if sorted_errors[sorted_errors < inf].max(initial=0.0) > FARTHEST_SUMMABLE:
        return smallest_unit(sorted_errors * SHRINK, score, n_thresholds) / SHRINK
    n, steps = len(sorted_errors), equal_steps(1.0, n_thresholds, "unit")
    rank = int((np.arange(1, n + 1) / n >= score).argmax())  # all errors up to it must be below
    if sorted_errors[rank] == inf:
        return inf
    highest = min(_continuous_unit(sorted_errors, score), n_thresholds * sorted_errors[rank])
    lowest = _continuous_unit(sorted_errors, score - 1 / n_thresholds)
    if highest < SMALLEST_NORMAL * n_thresholds:
        return 0.0
    low, high = lowest * (1 - MARGIN), highest * (1 + MARGIN)
    while low < (middle := (low + high) / 2) < high:  # until they are neighbours
        frequency = int(sorted_errors.searchsorted(middle * steps).sum())
        if frequency / (n_thresholds * n) >= score:
            high = middle
        else:
            low = middle
    return float(high)


def extent(gt: Floats) -> float:
    """Return roughly the largest distance between cameras; 0 if they coincide."""
    with np.errstate(over="ignore"):
        local = gt - gt.mean(axis=0)
        largest = float(np.abs(local).max())
        if not 0 < largest < inf:
            return largest
        return 2 * largest * float(np.linalg.norm(local / largest, axis=1).max())


def _continuous_unit(sorted_errors: Floats, score: float) -> float:
    """Return the unit u at which ``mean(max(0, 1 - e / u))`` is a score.

    Each sum over the j smallest errors is a lower bound, and one of them is the mean: u is the
    smallest ``(e_1 + ... + e_j) / (j - score n)``.
    """
    n = len(sorted_errors)
    if score <= 0:
        return 0.0
    missing = np.arange(1, n + 1) - score * n
    first = int(missing.searchsorted(0.0, side="right"))
    if first == n:
        return inf
    with np.errstate(over="ignore"):
        return float((sorted_errors.cumsum()[first:] / missing[first:]).min())


def _check_score(score: float) -> None:
    check_positive(score, "score")
    if score > 1:
        raise ValueError(f"score must be at most 1, not {score!r}")
