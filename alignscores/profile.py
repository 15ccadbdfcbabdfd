"""Scores over their thresholds, and the threshold at which a score is one half."""

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .histogram import equal_steps
from .registration import Registration
from .registration.refined import Search
from .rotation import ras
from .similarity import Similarity
from .translation import Seed, tas
from .validation import AlignmentWarning, check_positions, check_positive

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["ScoreProfile", "ras_profile", "tas_profile"]


# Units of d where a search for the half-score distance looks first; it finds its way from any.
HALF_UNITS = np.geomspace(1 / 16, 4, 7)
N_UNITS = 64
SMALLEST_UNIT = 1e-5  # of the reference's extent, where the default units begin
DEGREES = np.geomspace(0.01, 180, N_UNITS)  # the default ones for rotations
GAIN = 1e-3  # relative; the search for the half-score unit ends with the first step that gains less
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)  # a smaller unit is rounded to 0


@dataclass(frozen=True, eq=False)
class ScoreProfile:
    """A score over the unit of its thresholds.

    Parameters
    ----------
    units : (U,) ndarray
        Largest thresholds, ascending: in ground-truth units for positions, degrees for rotations.
    errors : (A, n) ndarray
        Errors of the cameras under each alignment that was found, each row in ascending order. The
        score at a unit is that of the alignment that scores best.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.

    Attributes
    ----------
    scores : (U,) ndarray
        Score at each unit, from 0 to 1; it never falls.
    half : float
        Unit at which the score reaches one half: the half-score distance or angle. Infinite where
        it is never reached.

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
    scores: Floats = field(init=False)
    half: float = field(init=False)
    errors: Floats = field(repr=False)
    n_thresholds: int

    def __post_init__(self) -> None:
        steps = equal_steps(1.0, self.n_thresholds, "unit")
        scores = [_scores(errors, self.units, steps) for errors in self.errors]
        object.__setattr__(self, "scores", np.max(scores, axis=0))
        object.__setattr__(self, "half", self.unit_at(0.5))

    def unit_at(self, score: float) -> float:
        """Return the smallest unit at which a score is reached; infinite where it never is.

        Parameters
        ----------
        score : float
            From 0 to 1, without 0.

        Returns
        -------
        float
            The unit.

        Raises
        ------
        ValueError
            Where the score is not in that range.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import ScoreProfile
        >>> profile = ScoreProfile(np.array([1.0]), np.array([[0.0, 1.0, 2.0]]), n_thresholds=100)
        >>> round(profile.unit_at(0.9), 2), round(profile.unit_at(1), 2)
        (9.52, 200.0)
        """
        check_positive(score, "score")
        if score > 1:
            raise ValueError(f"score must be at most 1, not {score!r}")
        steps = equal_steps(1.0, self.n_thresholds, "unit")
        smallest = np.inf
        for errors in self.errors:
            smallest = _smallest_unit(errors, steps, score, smallest)
        return smallest if smallest > SMALLEST_NORMAL else 0.0

    def at(self, score: float) -> float:
        """Return `unit_at` of a score; the name is deprecated since 1.1."""
        warnings.warn(
            "ScoreProfile.at is deprecated; use ScoreProfile.unit_at",
            DeprecationWarning,
            stacklevel=2,
        )
        return self.unit_at(score)


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
    """Score camera positions over all units: the TAS as a function of d.

    The TAS depends on d, the distance between neighbouring cameras, and so on the frame rate. The
    unit at which the score is one half, the half-score distance, does not: it is an error in the
    unit of the ground truth, and says how far off the cameras are.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Camera centres; see `tas`. Three cameras suffice.
    units : (U,) array_like, optional
        Units at which to score, positive and ascending; by default 64 from a hundred-thousandth of
        the extent of the ground truth to the whole, in equal ratios. The half-score distance
        hardly depends on them.
    rng : int, SeedSequence, Generator or None
        Seed of the registration; see `tas`.
    n_hypotheses : int
        Number of hypotheses of the registration.
    n_thresholds : int
        Number of equally spaced thresholds up to each unit.
    registration : {"refined", "pcr99"} or Registration
        See `tas`. The alignment of "pcr99" is the same at every unit. Any other aligns anew at each
        unit; an alignment that was found at one unit counts at all of them.
    alignment : {"similarity", "rigid", "yaw", "none"}
        What may differ between the two worlds; see `tas`.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both worlds, for "yaw".

    Returns
    -------
    ScoreProfile
        The scores over the units, with the half-score distance.

    Raises
    ------
    ValueError
        Where the input is malformed, or all cameras of the ground truth coincide and there are no
        `units`.

    Warns
    -----
    AlignmentWarning
        Where the estimate cannot be aligned; all scores are 0.

    References
    ----------
    ``docs/explanation/profiles.md``. Not in the paper.

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
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    grid = extent_units(gt) if units is None else _checked_units(units)
    errors_at = _errors_at(
        gt,
        est_positions,
        registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        n_thresholds=n_thresholds,
        alignment=alignment,
        up=up,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        first = errors_at(grid[0])
        if first is not None and registration != "pcr99" and alignment != "none":
            return _searched(grid, first, errors_at, n_thresholds)
    if first is None:
        warnings.warn(
            "all scores are 0: the estimate cannot be aligned", AlignmentWarning, stacklevel=2
        )
        first = np.full(len(gt), np.inf)
    return _profile(grid, [first], n_thresholds)


def ras_profile(
    gt_rotations: "ArrayLike | Rotation",
    est_rotations: "ArrayLike | Rotation",
    units: ArrayLike | None = None,
    *,
    n_thresholds: int = 100,
    alignment: str = "similarity",
    up: str = "z",
) -> ScoreProfile:
    """Score camera rotations over all largest thresholds.

    Parameters
    ----------
    gt_rotations, est_rotations : (n, 3, 3) array_like or scipy Rotation
        Camera-to-world rotations; see `ras`.
    units : (U,) array_like, optional
        Largest thresholds in degrees, positive and ascending; by default 64 from 0.01 to 180, in
        equal ratios.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.
    alignment : {"similarity", "rigid", "yaw", "none"}
        How the two worlds may be turned; see `ras`.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both worlds, for "yaw".

    Returns
    -------
    ScoreProfile
        The scores over the thresholds, with the half-score angle in degrees.

    Raises
    ------
    ValueError
        Where the input is malformed, or a matrix is no rotation.

    Warns
    -----
    AlignmentWarning
        Where no camera was estimated; all scores are 0.

    References
    ----------
    ``docs/explanation/profiles.md``. Not in the paper.

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
    return _profile(grid, [result.errors], n_thresholds)


def _errors_at(
    gt: Floats, est: ArrayLike, registration: str | Registration, **options: Any
) -> Callable[[float], Floats | None]:
    """Return a function from a unit to the errors of its alignment, None where there is none."""
    register = _searching_once(registration)

    def errors_at(unit: float) -> Floats | None:
        result = tas(gt, est, unit=unit, registration=register, **options)
        return None if result.alignment is None else result.errors

    return errors_at


def _searching_once(registration: str | Registration) -> str | Registration:
    """Return a refined registration that draws once and starts from what it found before."""
    if registration != "refined":
        return registration
    searches: list[Search] = []

    def refined(
        gt: Floats, est: Floats, /, *, threshold: float, **settings: Any
    ) -> tuple[Similarity | None, int]:
        if not searches:
            del settings["rank"]
            searches.append(Search(gt, est, **settings))
        return searches[0].best(threshold), searches[0].n_used

    return refined


def _searched(
    units: Floats,
    first: Floats,
    errors_at: Callable[[float], Floats | None],
    n_thresholds: int,
) -> ScoreProfile:
    """Return the profile of the alignments found at all units and at the half-score unit."""
    found = [first, *(errors for u in units[1:] if (errors := errors_at(float(u))) is not None)]
    profile = _profile(units, found, n_thresholds)
    before = np.inf
    while 0 < profile.half < (1 - GAIN) * before and np.isfinite(profile.half):
        before = profile.half
        errors = errors_at(before)
        if errors is not None:
            profile = _profile(units, [*profile.errors, errors], n_thresholds)
    return profile


def _profile(units: Floats, errors: Iterable[Floats], n_thresholds: int) -> ScoreProfile:
    return ScoreProfile(units, np.sort(np.array(list(errors)), axis=1), n_thresholds)


def extent_units(gt: Floats) -> Floats:
    """Return the default units of positions; ValueError where they have no extent."""
    with np.errstate(over="ignore"):
        extent = 2 * float(np.linalg.norm(gt - gt.mean(axis=0), axis=1).max())
    if not 0 < extent < np.inf:
        raise ValueError(
            "the ground truth has no extent to derive units from: all cameras in gt_positions "
            "coincide, or are too far apart to square their distance; pass units="
        )
    return extent * np.geomspace(SMALLEST_UNIT, 1, N_UNITS)


def _checked_units(units: ArrayLike) -> Floats:
    try:
        grid = np.asarray(units, dtype=np.float64)
    except (TypeError, ValueError):
        grid = np.empty(0)
    valid = grid.ndim == 1 and grid.size > 0 and np.isfinite(grid).all()
    if not valid or grid[0] <= 0 or np.any(np.diff(grid) <= 0):
        raise ValueError(f"units must be positive, finite and ascending numbers, not {units!r}")
    return grid


def _scores(sorted_errors: Floats, units: Floats, steps: Floats) -> Floats:
    """Return the score at each unit: the area of the cumulative histogram (eq. 4)."""
    frequency = np.searchsorted(sorted_errors, units[..., None] * steps)
    scores: Floats = frequency.sum(axis=-1) / (len(steps) * len(sorted_errors))
    return scores


def _smallest_unit(sorted_errors: Floats, steps: Floats, score: float, bound: float) -> float:
    """Return the smallest number at which the score is reached, or the bound if that is smaller.

    Positive numbers have the order of their bits, so that 63 steps of bisection decide all of them.
    """

    def reached(bits: int) -> bool:
        unit = np.array(bits, dtype=np.int64).view(np.float64)
        return bool(_scores(sorted_errors, unit, steps) >= score)

    low, high = 0, int(np.array(min(bound, np.finfo(np.float64).max)).view(np.int64))
    if not reached(high):
        return bound
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if reached(middle) else (middle, high)
    return float(np.array(high).view(np.float64))
