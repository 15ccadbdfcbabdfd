"""Scores at all largest thresholds, and the threshold at which a score is reached.

The score at a unit u is that with u in the place of d: the profile is the score over u, the
half-score distance (angle) the u at which the score is one half. Not in the paper.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import floor, inf, nan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .histogram import equal_steps
from .registration import Registration, Search, Seed
from .rotation import ras
from .similarity import FARTHEST_SUMMABLE
from .validation import AlignmentWarning, check_position_pair, check_positive, real_array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "DEGREES",
    "N_THRESHOLDS",
    "ScoreProfile",
    "extent_units",
    "ras_angle",
    "ras_profile",
    "smallest_unit",
    "tas_distance",
    "tas_profile",
    "too_few_cameras",
]

# Cameras that an alignment fits exactly, whatever the estimate.
N_CAMERAS_FITTED_EXACTLY = {"similarity": 2, "rigid": 1, "yaw": 1, "none": 0}
N_THRESHOLDS = 100  # of a score, as by default
N_UNITS = 64
SMALLEST_UNIT = 1e-5  # of the reference's extent, where the default units begin
DEGREES = np.geomspace(0.01, 180, N_UNITS)  # the default units of rotations
GAIN = 1e-3  # relative; the search ends with the first step that gains less
ROUNDING = 1e-12  # of the extent; smaller units are rounding errors
MARGIN = 1e-12  # relative, beyond the rounding of a sum of errors
SHRINK = 2.0**-40  # of errors whose sums overflow; it rounds nothing
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)  # a smaller unit is rounded to 0


@dataclass(frozen=True, eq=False)
class ScoreProfile:
    """A score over the unit of its thresholds.

    Parameters
    ----------
    units : (U,) ndarray
        Largest thresholds, ascending: in ground-truth units for positions, degrees for rotations.
    errors : (A, n) sequence of float
        Errors of the cameras under each alignment, in ascending order. The score at a unit is that
        of the best alignment.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.
    n_fitted : int
        Number of cameras that an alignment fits exactly, whatever the estimate. The unit of a
        score that only these reach is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import ScoreProfile
    >>> errors = np.array([[0.0, 1.0, 2.0]])
    >>> profile = ScoreProfile(np.array([1.0, 10.0]), errors, n_thresholds=100)
    >>> profile.scores.round(2), round(profile.half, 2)
    (array([0.33, 0.9 ]), 1.96)
    """

    units: Floats
    errors: Sequence[Floats] | Floats = field(repr=False)
    n_thresholds: int
    n_fitted: int = 0

    @cached_property
    def scores(self) -> Floats:
        """Score at each unit, from 0 to 1; it never falls.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import ScoreProfile
        >>> errors = np.array([[0.0, 1.0, 2.0]])
        >>> ScoreProfile(np.array([1.0, 10.0]), errors, n_thresholds=100).scores.round(2)
        array([0.33, 0.9 ])
        """
        grid = self.units[:, None] * equal_steps(1.0, self.n_thresholds, "unit")
        areas = [np.searchsorted(errors, grid).sum(axis=1) for errors in self.errors]
        scores: Floats = np.max(areas, axis=0) / (self.n_thresholds * len(self.errors[0]))
        return scores

    @cached_property
    def half(self) -> float:
        """Half-score distance or angle: the unit at which the score is one half.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import ScoreProfile
        >>> profile = ScoreProfile(np.array([1.0]), np.array([[0.0, 1.0, 2.0]]), n_thresholds=100)
        >>> profile.half == profile.unit_at(0.5)
        True
        """
        return self.unit_at(0.5)

    def unit_at(self, score: float) -> float:
        """Return the smallest unit at which a score is reached.

        It is infinite if the score is never reached, and NaN if there are too few cameras.

        Parameters
        ----------
        score : float
            Above 0, at most 1.

        Returns
        -------
        float
            The unit.

        Raises
        ------
        ValueError
            If the score is out of range.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import ScoreProfile
        >>> profile = ScoreProfile(np.array([1.0]), np.array([[0.0, 1.0, 2.0]]), n_thresholds=100)
        >>> round(profile.unit_at(0.9), 2), round(profile.unit_at(1), 2)
        (9.52, 200.0)
        """
        unit = min(smallest_unit(errors, score, self.n_thresholds) for errors in self.errors)
        return unit if score * len(self.errors[0]) > self.n_fitted else nan


def tas_profile(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    units: ArrayLike | None = None,
    *,
    rng: Seed = 0,
    n_hypotheses: int = 1000,
    n_thresholds: int = 100,
    registration: str | Registration = "refined",
    alignment: str = "similarity",
    up: str = "z",
) -> ScoreProfile:
    """Return the TAS as a function of d.

    The TAS depends on d, the distance between neighbouring cameras, and so on the frame rate. The
    half-score distance does not: it is an error in the unit of the ground truth.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Camera centres; see `tas`. Three cameras suffice.
    units : (U,) array_like, optional
        Units at which to score, positive and ascending; by default 64 from a hundred-thousandth of
        the extent of the ground truth to the whole, in equal ratios.
    rng : int, SeedSequence, Generator or None
        See `tas`.
    n_hypotheses : int
        Number of hypotheses of the registration.
    n_thresholds : int
        Number of equally spaced thresholds up to each unit.
    registration : {"refined", "pcr99"} or Registration
        See `tas`. The alignment of "pcr99" is the same at every unit; others align at each unit,
        and an alignment found at one counts at all of them.
    alignment, up : str
        See `tas`.

    Returns
    -------
    ScoreProfile
        The scores over the units, with the half-score distance.

    Raises
    ------
    ValueError
        If the input is malformed, or all cameras of the ground truth coincide and there are no
        `units`.

    Warns
    -----
    AlignmentWarning
        If the estimate cannot be aligned; all scores are 0.

    References
    ----------
    ``docs/explanation/scores.md``. Not in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas, tas_profile
    >>> rng = np.random.default_rng(0)
    >>> gt = np.cumsum(rng.normal(size=(400, 3)), axis=0)
    >>> est = gt + rng.normal(scale=0.6, size=gt.shape)
    >>> every, fourth = tas_profile(gt, est), tas_profile(gt[::4], est[::4])
    >>> round(every.half, 2), round(fourth.half, 2)
    (1.94, 1.97)
    >>> round(tas(gt, est).score, 2), round(tas(gt[::4], est[::4]).score, 2)
    (0.24, 0.5)
    """
    gt, est = check_position_pair(gt_positions, est_positions)
    search = Search(
        gt,
        est,
        registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
        at_several=True,
    )
    grid = extent_units(gt) if units is None else _checked_units(units)
    if search.has_one_alignment:
        rows = [_sorted_errors(search, float(grid[0]))]
    else:
        _, rows = _search_unit(search, float(grid[-1]), 0.5, n_thresholds)
        rows += [_sorted_errors(search, unit) for unit in grid.tolist()]
    if np.isinf(rows).all():
        warnings.warn(
            "all scores are 0: the estimate cannot be aligned", AlignmentWarning, stacklevel=2
        )
    return ScoreProfile(grid, rows, n_thresholds, N_CAMERAS_FITTED_EXACTLY[alignment])


def ras_profile(
    gt_rotations: "ArrayLike | Rotation",
    est_rotations: "ArrayLike | Rotation",
    units: ArrayLike | None = None,
    *,
    n_thresholds: int = 100,
    alignment: str = "similarity",
    up: str = "z",
) -> ScoreProfile:
    """Return the RAS as a function of the largest threshold.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations; see `ras`.
    units : (U,) array_like, optional
        Largest thresholds in degrees, positive and ascending; by default 64 from 0.01 to 180, in
        equal ratios.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.
    alignment, up : str
        See `ras`.

    Returns
    -------
    ScoreProfile
        The scores over the thresholds, with the half-score angle in degrees.

    Raises
    ------
    ValueError
        If the input is malformed, or a matrix is not a rotation.

    Warns
    -----
    AlignmentWarning
        If no camera was estimated; all scores are 0.

    References
    ----------
    ``docs/explanation/scores.md``. Not in the paper.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import ras_profile
    >>> gt = Rotation.random(5, rng=np.random.default_rng(0))
    >>> est = Rotation.from_euler("x", [[0], [0], [0], [2], [90]], degrees=True) * gt
    >>> profile = ras_profile(gt, est, [1.0, 10.0])
    >>> profile.scores, round(profile.unit_at(0.75), 2)
    (array([0.588, 0.762]), 7.6)
    """
    grid = DEGREES if units is None else _checked_units(units)
    result = ras(gt_rotations, est_rotations, n_thresholds=n_thresholds, alignment=alignment, up=up)
    return ScoreProfile(grid, [np.sort(result.errors)], n_thresholds)


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
    gt, est = check_position_pair(gt_positions, est_positions)
    search = Search(
        gt,
        est,
        registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
        at_several=True,
    )
    if reason := too_few_cameras(len(gt), score, alignment):
        warnings.warn(reason, AlignmentWarning, stacklevel=2)
        return nan
    if search.has_one_alignment:
        rows = [_sorted_errors(search, 1.0)]
        distance = smallest_unit(rows[0], score, N_THRESHOLDS)
    else:
        distance, rows = _search_unit(search, _extent(gt), score, N_THRESHOLDS)
    if np.isinf(rows).all():
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


def too_few_cameras(n: int, score: float, alignment: str) -> str:
    """Return the reason why n cameras have no distance, or an empty string."""
    _check_score(score)
    fitted = N_CAMERAS_FITTED_EXACTLY[alignment]
    if score * n > fitted:
        return ""
    return (
        f"no distance at a score of {score:g} for {n} cameras: {floor(fitted / score) + 1} are "
        f"needed, since any alignment fits {fitted} of them exactly"
    )


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


def extent_units(gt: Floats) -> Floats:
    """Return the default units of positions, or raise ValueError if they have no extent."""
    largest = _extent(gt)
    if not 0 < largest < np.inf:
        raise ValueError(
            "the ground truth has no extent to derive units from: all cameras in gt_positions "
            "coincide, or are too far apart to square their distance; pass units="
        )
    return largest * np.geomspace(SMALLEST_UNIT, 1, N_UNITS)


def _checked_units(units: ArrayLike) -> Floats:
    grid = real_array(units, "units")
    valid = grid.ndim == 1 and grid.size > 0 and np.isfinite(grid).all()
    if not valid or grid[0] <= 0 or np.any(np.diff(grid) <= 0):
        raise ValueError(f"units must be positive, finite and ascending numbers, not {units!r}")
    return grid


def _sorted_errors(search: Search, threshold: float) -> Floats:
    """Return the errors under the best alignment for a largest threshold, in ascending order."""
    alignment, _ = search.register(threshold)
    return np.sort(search.errors(alignment))


def _search_unit(
    search: Search, start: float, score: float, n_thresholds: int
) -> tuple[float, list[Floats]]:
    """Return the smallest unit at which a score is reached, and the errors under each alignment.

    If an alignment reaches the score below the unit u, the best one at u reaches it below u, too:
    this is the next unit. If the unit stays, no smaller one reaches the score. The method is
    Dinkelbach's ("On nonlinear fractional programming", Management Science 1967).
    """
    _check_score(score)
    start = start if 0 < start < inf else 1.0
    unit, before, smallest, best = start, inf, inf, np.empty(0)
    rows: list[Floats] = []
    while 0 < unit < (1 - GAIN) * before:
        before = unit if rows else inf  # the first step may go up
        rows.append(_sorted_errors(search, unit))
        unit = _continuous_unit(rows[-1], score)
        if unit <= smallest:
            smallest, best = unit, rows[-1]
        if unit < ROUNDING * start:
            break
    return smallest_unit(best, score, n_thresholds), rows


def _extent(gt: Floats) -> float:
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
