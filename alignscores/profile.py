"""Scores over all largest thresholds."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .aligner import Aligner, Seed, one_scene
from .arrays import Floats
from .distance import FITTED, extent, search_unit, smallest_unit
from .histogram import equal_steps
from .registration import Registration
from .rotation import ras
from .validation import AlignmentWarning, real_array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "DEGREES",
    "ScoreProfile",
    "extent_units",
    "ras_profile",
    "tas_profile",
]


N_UNITS = 64
SMALLEST_UNIT = 1e-5  # of the reference's extent, where the default units begin
DEGREES = np.geomspace(0.01, 180, N_UNITS)  # the default ones for rotations


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
        score that these reach alone is NaN.

    Attributes
    ----------
    scores : (U,) ndarray
        Score at each unit, from 0 to 1; it never falls.
    half : float
        Half-score distance or angle; infinite if one half is never reached, NaN if there are too
        few cameras.

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
    errors: Sequence[Floats] | Floats = field(repr=False)
    n_thresholds: int
    n_fitted: int = 0

    def __post_init__(self) -> None:
        steps = equal_steps(1.0, self.n_thresholds, "unit")
        scores = [_scores(errors, self.units, steps) for errors in self.errors]
        object.__setattr__(self, "scores", np.max(scores, axis=0))
        object.__setattr__(self, "half", self.unit_at(0.5))

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
    aligner = Aligner(
        *one_scene(gt_positions, est_positions),
        registration=registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
        keep=True,
    )
    grid = extent_units(aligner.gt) if units is None else _checked_units(units)
    rows: list[Floats] = []

    def errors_at(unit: float) -> Floats:
        rows.append(np.sort(aligner.align(unit).errors))
        return rows[-1]

    if aligner.has_one_alignment:
        errors_at(float(grid[0]))
    else:
        search_unit(errors_at, float(grid[-1]), 0.5, n_thresholds)
        for unit in grid.tolist():
            errors_at(unit)
    profile = ScoreProfile(grid, rows, n_thresholds, FITTED[alignment])
    if np.isinf(profile.errors).all():
        warnings.warn(
            "all scores are 0: the estimate cannot be aligned", AlignmentWarning, stacklevel=2
        )
    return profile


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


def extent_units(gt: Floats) -> Floats:
    """Return the default units of positions, or raise ValueError if they have no extent."""
    largest = extent(gt)
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


def _scores(sorted_errors: Floats, units: Floats, steps: Floats) -> Floats:
    """Return the score at each unit: the area of the cumulative histogram (eq. 4)."""
    frequency = np.searchsorted(sorted_errors, units[..., None] * steps)
    scores: Floats = frequency.sum(axis=-1) / (len(steps) * len(sorted_errors))
    return scores
