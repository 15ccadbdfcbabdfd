"""Translation Alignment Score, TAS (section 3)."""

import warnings
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .histogram import AlignmentScore, area, cumulative_frequency, equal_steps
from .registration import Registration, Search, Seed, kernel
from .similarity import Similarity
from .validation import (
    AlignmentWarning,
    check_groups,
    check_position_pair,
    check_positions,
    check_positive,
    finite_rows,
)

__all__ = ["TASResult", "UndefinedUnitError", "closest_pair_quartile", "tas"]

NEGLIGIBLE = 1e-9  # of the extent of the cameras; a smaller d is rounding, no spacing


class UndefinedUnitError(ValueError):
    """The ground truth has no d."""


@dataclass(frozen=True, eq=False, repr=False)
class TASResult(AlignmentScore):
    """Translation Alignment Score and what it was computed from.

    Parameters
    ----------
    score : float
        TAS, from 0 to 1; also ``float(result)``.
    errors : (n,) ndarray
        Position error of each camera in ground-truth units; infinite for a camera that was not
        estimated.
    thresholds : (K,) ndarray
        Error thresholds in ground-truth units.
    cumulative_frequency : (K,) ndarray of int
        Number of errors below each threshold.
    alignment : Similarity or None
        From ground truth to estimate; None if the estimate cannot be aligned.
    unit : float
        d of the paper: the upper quartile of the closest-pair distances, in ground-truth units.
    n_hypotheses : int
        Number of hypotheses that the alignment was chosen from.
    registration : str
        Name of the registration; scores under different ones are not comparable.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas
    >>> gt = np.random.default_rng(0).random((30, 3))
    >>> result = tas(gt, 2 * gt)
    >>> result
    TASResult(1.0000, n=30, registration='pcr99')
    >>> round(result.unit, 3), round(result.alignment.scale, 6)
    (0.27, 2.0)
    """

    alignment: Similarity | None
    unit: float
    n_hypotheses: int
    registration: str

    def __repr__(self) -> str:
        n = len(self.errors)
        return f"TASResult({self.score:.4f}, n={n}, registration={self.registration!r})"


def tas(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    *,
    rng: Seed = 0,
    unit: float | None = None,
    groups: ArrayLike | None = None,
    n_hypotheses: int = 1000,
    max_threshold: float = 1.0,
    n_thresholds: int = 100,
    registration: str | Registration = "pcr99",
    alignment: str = "similarity",
    up: str = "z",
) -> TASResult:
    """Score how well estimated camera positions match the ground truth: TAS.

    The estimate may be in another coordinate frame: it is aligned with the ground truth by a
    similarity, or by what `alignment` allows. No rotations are needed.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Camera centres in the ground-truth frame, in any unit; at least 4, unless `unit` is given.
    est_positions : (n, 3) array_like
        Estimated camera centres; row i is the camera of row i of the ground truth. A row that is
        not finite is a camera that was not estimated: it counts as a failure.
    rng : int, SeedSequence, Generator or None
        Seed of the registration; the same seed gives the same score, bit for bit.
    unit : float, optional
        d in ground-truth units; by default the upper quartile of the closest-pair distances.
    groups : (n,) array_like, optional
        Labels of rows: those of the same label are cameras of one rig frame and no neighbours of
        each other, so that d is the spacing of the rig's positions and not its baseline.
    n_hypotheses : int
        Number of hypotheses of the registration.
    max_threshold : float
        Largest error threshold in units of d.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.
    registration : {"pcr99", "refined"} or Registration
        "pcr99" is the registration of the paper. "refined" maximises the score, which then hardly
        depends on `rng`; it is higher, and not comparable with published values. Or a function
        (see `Registration`).
    alignment : {"similarity", "rigid", "yaw", "none"}
        What the alignment may change: "similarity", the paper's, rotation, translation and scale;
        "rigid" no scale; "yaw" only a rotation about the vertical axis and a translation; "none"
        nothing.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both frames, for "yaw"; its sign has no effect.

    Returns
    -------
    TASResult
        The score with errors, thresholds, cumulative frequency, alignment, d, the number of
        hypotheses and the name of the registration.

    Raises
    ------
    ValueError
        If the input is malformed, or d is undefined: fewer than 4 cameras, or three quarters of the
        cameras coincide with another one (d is below 1e-9 of the extent). Then give `groups` or
        `unit`.
    TypeError
        If a function passed as registration returns anything but an alignment and a number.

    Warns
    -----
    AlignmentWarning
        If the estimate cannot be aligned, for example since it has fewer than 3 distinct
        positions; the score is 0.

    Notes
    -----
    The paper's registration is random: the score varies with the seed (standard deviation about
    0.02 for 100 cameras). Up to 19 cameras (with 1000 hypotheses) all triplets are tried and
    nothing is random; with "refined" up to 30 cameras, and beyond that it varies by at most 0.0006.
    See ``docs/explanation/registration.md``.

    A camera that was not estimated takes no part in the registration, which may then settle on
    another hypothesis.

    O(n log n + n_hypotheses * n) time, O(n) memory.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 3.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas
    >>> rng = np.random.default_rng(1)
    >>> gt = rng.random((50, 3))
    >>> est = 10 * gt + [5, 0, 0]
    >>> tas(gt, est).score
    1.0
    >>> est[:5] = np.nan
    >>> tas(gt, est).score
    0.9

    With noise the refined registration finds a better alignment, and the same from any seed:

    >>> est = gt + rng.normal(scale=0.05, size=gt.shape)
    >>> [round(tas(gt, est, rng=seed).score, 3) for seed in range(3)]
    [0.573, 0.564, 0.558]
    >>> [round(tas(gt, est, rng=seed, registration="refined").score, 3) for seed in range(3)]
    [0.663, 0.663, 0.663]

    An estimate of the wrong size matches up to scale, and fails without:

    >>> twice = 2 * gt
    >>> tas(gt, twice, alignment="similarity").score, tas(gt, twice, alignment="rigid").score
    (1.0, 0.0174)

    A registration may be any function:

    >>> from alignscores import Similarity
    >>> def least_squares(gt_positions, est_positions, **settings):
    ...     return Similarity.fit(gt_positions, est_positions), 1
    >>> result = tas(gt, est, registration=least_squares)
    >>> result.registration, round(result.score, 3)
    ('least_squares', 0.663)
    """
    gt, est = check_position_pair(gt_positions, est_positions)
    steps = equal_steps(max_threshold, n_thresholds, "max_threshold")
    search = Search(
        gt,
        est,
        registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
    )
    # Step 1: d, the upper quartile of the closest-pair distances (eq. 1).
    d = closest_pair_quartile(gt, groups=groups) if unit is None else check_positive(unit, "unit")
    thresholds = d * steps
    # Step 2: register the estimate robustly, by default with PCR-99.
    fitted, n_used = search.register(thresholds[-1])
    # Step 3: the distance errors, and their cumulative frequencies f_k.
    errors = search.errors(fitted)
    frequency = cumulative_frequency(errors, thresholds)
    # Step 4: the TAS is the normalised sum of the f_k (eq. 3).
    score = area(frequency, len(gt))
    if fitted is None:
        distinct = len(np.unique(est[finite_rows(est)], axis=0))
        warnings.warn(
            "TAS is 0: the estimate cannot be aligned, since none of its camera triplets resembles "
            f"the ground truth ({distinct} distinct estimated positions of {len(gt)} cameras)",
            AlignmentWarning,
            stacklevel=2,
        )
    return TASResult(
        score=score,
        errors=errors,
        thresholds=thresholds,
        cumulative_frequency=frequency,
        alignment=search.similarity(fitted),
        unit=d,
        n_hypotheses=n_used,
        registration=search.name,
    )


def closest_pair_quartile(gt_positions: ArrayLike, *, groups: ArrayLike | None = None) -> float:
    """Return d of the paper: the upper quartile of the distances to the closest other camera.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Finite camera centres, at least 4.
    groups : (n,) array_like, optional
        Labels of rows: those of the same label are cameras of one rig frame, which counts as one
        camera at their mean position.

    Returns
    -------
    float
        The ceil(3n/4)-th smallest of the n distances, in the unit of the positions.

    Raises
    ------
    ValueError
        If there are fewer than 4 cameras (rig frames), or d is below 1e-9 of their extent.

    References
    ----------
    Lee and Civera, "Alignment Scores", eq. 1. Rig frames are not in the paper.

    Examples
    --------
    >>> from alignscores import closest_pair_quartile
    >>> closest_pair_quartile([[0, 0, 0], [1, 0, 0], [3, 0, 0], [7, 0, 0]])
    2.0

    A stereo rig with a baseline of 0.1 at the same positions:

    >>> rig = [[x, y, 0] for x in (0, 1, 3, 7) for y in (0, 0.1)]
    >>> closest_pair_quartile(rig), closest_pair_quartile(rig, groups=[0, 0, 1, 1, 2, 2, 3, 3])
    (0.1, 2.0)
    """
    positions = check_positions(gt_positions, "gt_positions", complete=True)
    cameras, by_hand = "cameras", "pass unit= to set it by hand"
    if groups is not None:
        positions, cameras = _rig_positions(positions, groups), "rig frames"
    n = len(positions)
    if n < 4:
        raise UndefinedUnitError(
            f"TAS needs at least 4 ground-truth {cameras} to derive its unit, but there are {n}; "
            f"{by_hand}"
        )
    distances, extent = kernel.closest_distances(np.ascontiguousarray(positions))
    rank = (3 * n + 3) // 4  # ceil(3n/4), from 1
    d = float(np.partition(distances, rank - 1)[rank - 1])
    if not NEGLIGIBLE * extent < d < inf:
        raise UndefinedUnitError(
            f"TAS has no unit: at least three quarters of the {cameras} in gt_positions coincide "
            f"with another one; pass groups= if they are cameras of one rig, or {by_hand}"
        )
    return d


def _rig_positions(positions: Floats, groups: ArrayLike) -> Floats:
    """Return the mean position of each rig frame."""
    labels = check_groups(groups, len(positions), "gt_positions")
    shares = positions / np.bincount(labels)[labels, None]
    return np.column_stack([np.bincount(labels, share) for share in shares.T])
