"""Distances and angles: the smallest range of thresholds at which TAS or RAS reaches a score."""

import warnings
from collections.abc import Callable, Generator
from math import ceil, floor, inf, nan
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
    "unit_search",
]

ErrorsAt = Callable[[float], Floats]  # of the best alignment at a largest threshold

FITTED = {"similarity": 2, "rigid": 1, "yaw": 1, "none": 0}  # cameras, whatever the estimate
N_THRESHOLDS = 100  # of a score, as by default
GAIN = 1e-3  # relative; the search ends with the first step that gains less
ROUNDING = 1e-12  # of the extent; smaller units are those of rounding errors
ULPS = 1e-12  # relative, beyond the rounding of a sum of errors
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
    """Return the smallest d at which the TAS is at least a score: the half-score distance.

    It is an accuracy in the unit of the ground truth, which needs no d: the smaller the better. It
    ignores which share of the cameras is lost, as long as it is less than ``1 - score``.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Camera centres in the ground-truth world.
    est_positions : (n, 3) array_like
        Camera centres in the estimated world; a row that is not finite was not estimated.
    score : float
        From 0 to 1, without 0.
    rng : int, SeedSequence, Generator or None
        Seed of the registration; see `tas`.
    n_hypotheses : int
        Number of hypotheses of the registration.
    registration : {"refined", "pcr99"} or Registration
        See `tas`. The alignment of "pcr99" is the same at every threshold.
    alignment : {"similarity", "rigid", "yaw", "none"}
        What may differ between the two worlds; see `tas`.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both worlds, for "yaw".

    Returns
    -------
    float
        The distance in ground-truth units; infinite where the score is never reached, since too
        many cameras are lost; NaN where there are too few cameras.

    Raises
    ------
    ValueError
        Where the input is malformed, or the score is not in its range.

    Warns
    -----
    AlignmentWarning
        Where the estimate cannot be aligned, so that the distance is infinite, or there are too few
        cameras.

    Notes
    -----
    A similarity fits two cameras exactly, whatever the estimate, a rigid or a yaw alignment one. So
    of ``2 / score`` cameras (``1 / score``) or fewer there is no distance. Near the score 1 it is
    that of the worst camera times the number of thresholds, 100, and says little.

    References
    ----------
    ``docs/explanation/profiles.md``. Not in the paper.

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
    n, start = len(aligner.gt), extent(aligner.gt)
    if reason := too_few(n, score, alignment):
        warnings.warn(reason, AlignmentWarning, stacklevel=2)
        return nan
    if aligner.has_one_alignment:
        errors = aligner.align(np.ones(1)).errors
        distance = smallest_unit(np.sort(errors), score, N_THRESHOLDS)
    else:
        distance, errors = search_unit(
            lambda unit: aligner.align(np.array([unit])).errors, start, score, N_THRESHOLDS
        )
    if np.isinf(errors).all():
        warnings.warn("the estimate cannot be aligned", AlignmentWarning, stacklevel=2)
    return distance


def ras_angle(
    gt_rotations: "ArrayLike | Rotation",
    est_rotations: "ArrayLike | Rotation",
    score: float = 0.5,
    *,
    alignment: str = "similarity",
    up: str = "z",
) -> float:
    """Return the smallest range of thresholds at which the RAS is at least a score.

    At one half it is the half-score angle.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations; see `ras`.
    score : float
        From 0 to 1, without 0.
    alignment : {"similarity", "rigid", "yaw", "none"}
        How the two worlds may be turned; see `ras`.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both worlds, for "yaw".

    Returns
    -------
    float
        The angle in degrees; infinite where the score is never reached.

    Raises
    ------
    ValueError
        Where the input is malformed, or the score is not in its range.

    Warns
    -----
    AlignmentWarning
        Where no camera was estimated; the angle is infinite.

    Notes
    -----
    Other than the distance, it is given for any number of cameras: the rotations are averaged, not
    aligned for the score, so that no camera need be fitted exactly. Of one camera alone it is 0.

    References
    ----------
    ``docs/explanation/profiles.md``. Not in the paper.

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


def too_few(n: int, score: float, alignment: str, n_worlds: int = 1) -> str:
    """Say why n cameras, in worlds that are each aligned, have no distance; else nothing."""
    _check_score(score)
    fitted = FITTED[alignment]
    if score * n > fitted * n_worlds:
        return ""
    least = floor(fitted * n_worlds / score) + 1
    return (
        f"no distance at a score of {score:g} for {n} cameras: it takes {least}, since any "
        f"alignment fits {fitted * n_worlds} of them exactly"
    )


def search_unit(
    errors_at: ErrorsAt, start: float, score: float, n_thresholds: int
) -> tuple[float, Floats]:
    """Return the smallest unit at which a score is reached, and the errors that reach it."""
    search = unit_search(start, score, n_thresholds)
    unit = next(search)
    while True:
        try:
            unit = search.send(errors_at(unit))
        except StopIteration as stop:
            found: tuple[float, Floats] = stop.value
            return found


def unit_search(
    start: float, score: float, n_thresholds: int
) -> Generator[float, Floats, tuple[float, Floats]]:
    """Search for the smallest unit as `search_unit`: yield units, and be sent the errors at each.

    Where any alignment reaches the score below a unit u, the best one at u does, too: at a unit u',
    which is the next. Where the unit stays, no alignment scores more than asked for, so that no
    smaller unit reaches it. This is the method of Dinkelbach ("On nonlinear fractional
    programming", Management Science 1967), which converges faster than linearly.
    """
    _check_score(score)
    start = start if 0 < start < inf else 1.0
    unit, before, smallest, best = start, inf, inf, np.empty(0)
    while 0 < unit < (1 - GAIN) * before:
        before = unit if best.size else inf  # the first step may go up
        errors = np.sort((yield unit))
        unit = _continuous_unit(errors, score)
        if unit <= smallest:
            smallest, best = unit, errors
        if unit < ROUNDING * start:
            break
    return smallest_unit(best, score, n_thresholds), best


def smallest_unit(sorted_errors: Floats, score: float, n_thresholds: int) -> float:
    """Return the smallest number at which the score of sorted errors is reached, to the last bit.

    As the unit u grows, error e falls below threshold k of K at u = e K / k. So many of these steps
    make the score. With K thresholds it is at most 1/K above that of infinitely many, and never
    below, so that the last of them lies between the two units of these.
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

    def reached(bits: int) -> bool:
        unit = float(np.int64(bits).view(np.float64))
        frequency = int(sorted_errors.searchsorted(unit * steps).sum())
        return frequency / (n_thresholds * n) >= score

    step = np.float64(_step(sorted_errors, score, n_thresholds, lowest, highest))
    bits = int(step.view(np.int64))
    while reached(bits):  # the rounding of units and thresholds moves it by a bit or two
        bits -= 1
    while not reached(bits):
        bits += 1
    return float(np.int64(bits).view(np.float64))


def _step(
    sorted_errors: Floats, score: float, n_thresholds: int, lowest: float, highest: float
) -> float:
    """Return the step at which the score is reached, up to rounding, between two units."""
    errors = n_thresholds * sorted_errors[: sorted_errors.searchsorted(highest, side="right")]
    first = np.maximum(np.ceil(errors / (highest * (1 + ULPS))), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        last = np.fmin(np.floor(errors / (lowest * (1 - ULPS))), n_thresholds)
    counts = np.maximum(last - first + 1, 0).astype(np.intp)
    ends = np.cumsum(counts)
    offsets = np.arange(ends[-1]) - np.repeat(ends - counts, counts)
    steps = np.repeat(errors, counts) / (np.repeat(first, counts) + offsets)
    needed = score * n_thresholds * len(sorted_errors)
    passed = n_thresholds * len(errors) - np.maximum(last, first - 1).sum()  # below the lowest
    index = min(max(ceil(needed - passed - ROUNDING) - 1, 0), len(steps) - 1)
    return float(np.partition(steps, index)[index])


def extent(gt: Floats) -> float:
    """Return about the largest distance between cameras; 0 where they coincide."""
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
