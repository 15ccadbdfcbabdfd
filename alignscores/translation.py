"""Translation Alignment Score, TAS (section 3)."""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .arrays import Floats
from .histogram import AlignmentScore, equal_steps
from .registration import REGISTRATIONS, Registration
from .similarity import FARTHEST_SUMMABLE, Similarity, check_alignment
from .validation import (
    AlignmentWarning,
    check_positions,
    check_positive,
    check_same_length,
    finite_rows,
)

__all__ = ["TASResult", "closest_pair_distances", "closest_pair_quartile", "normalise", "tas"]

Normalised = tuple[Floats, Floats, float]  # positions, their origin and unit; see `normalise`
Seed = int | np.random.SeedSequence | np.random.Generator | None

IDENTITY = Similarity(1.0, np.eye(3), np.zeros(3))
MAX_WITHOUT_TREE = 128  # cameras; up to there it is faster to compute all distances


@dataclass(frozen=True, eq=False)
class TASResult(AlignmentScore):
    """Translation Alignment Score with all it was computed from.

    Parameters
    ----------
    errors : (n,) ndarray
        Position error of each camera in ground-truth units; infinite for a camera that was not
        estimated.
    thresholds : (K,) ndarray
        Error thresholds in ground-truth units.
    alignment : Similarity or None
        The registration, from ground truth to estimate; None where there is none.
    unit : float
        d of the paper: the upper quartile of the closest-pair distances, in ground-truth units.
    n_hypotheses : int
        Number of hypotheses the registration was chosen from.
    registration : str
        Name of the registration: scores under different ones do not compare.

    Attributes
    ----------
    score : float
        TAS, from 0 to 1; also ``float(result)``.
    cumulative_frequency : (K,) ndarray of int
        Number of errors below each threshold.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas
    >>> gt = np.random.default_rng(0).random((30, 3))
    >>> result = tas(gt, 2 * gt)
    >>> round(result.unit, 3), round(result.alignment.scale, 6), result.registration
    (0.27, 2.0, 'pcr99')
    """

    alignment: Similarity | None
    unit: float
    n_hypotheses: int
    registration: str


def tas(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    *,
    rng: Seed = 0,
    unit: float | None = None,
    n_hypotheses: int = 1000,
    max_threshold: float = 1.0,
    n_thresholds: int = 100,
    registration: str | Registration = "pcr99",
    alignment: str = "similarity",
    up: str = "z",
) -> TASResult:
    """Score how well estimated camera positions match the ground truth: TAS.

    The estimate may be in another world: it is registered to the ground truth by a similarity, or
    by what `alignment` allows. No rotations are needed.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Camera centres in the ground-truth world, in any unit; at least 4 of them, or `unit` must be
        given.
    est_positions : (n, 3) array_like
        Camera centres in the estimated world; row i is the camera of row i of the ground truth. A
        row that is not finite is a camera that was not estimated: it counts as a failure.
    rng : int, SeedSequence, Generator or None
        Seed of the registration's random sampling; the same seed gives the same score, bit for bit.
    unit : float, optional
        d in ground-truth units; by default the upper quartile of the closest-pair distances.
    n_hypotheses : int
        Number of hypotheses of the registration.
    max_threshold : float
        Largest error threshold in units of d.
    n_thresholds : int
        Number of equally spaced thresholds up to the largest.
    registration : {"pcr99", "refined"} or Registration
        "pcr99" is the registration of the paper. "refined" maximises the score, which then hardly
        depends on `rng`; it is higher, and not to be compared with published values. Any other is
        passed as a function (see `Registration`).
    alignment : {"similarity", "rigid", "yaw", "none"}
        What may differ between the two worlds: "similarity", the paper's, a rotation, a translation
        and the scale; "rigid" no scale; "yaw" a turn about the vertical axis and a translation;
        "none" nothing.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both worlds, for "yaw"; its sign changes nothing.

    Returns
    -------
    TASResult
        The score with errors, thresholds, cumulative frequency, alignment, d, the number of
        hypotheses and the name of the registration.

    Raises
    ------
    ValueError
        Where the input is malformed, or d does not exist: fewer than 4 cameras, or three quarters
        of the cameras coincide with another one. `unit` cures the latter two.
    TypeError
        Where a function that was passed as registration returns something else than it should.

    Warns
    -----
    AlignmentWarning
        Where the estimate cannot be aligned, for example since it has fewer than 3 distinct
        positions; the score is 0.

    Notes
    -----
    A camera that was not estimated has an infinite error. It also takes no part in the
    registration, which may then settle on another hypothesis: the score falls by the camera's share
    only up to the scatter of the registration.

    The published registration is random: the score scatters from seed to seed (standard deviation
    about 0.02 for 100 cameras). It is deterministic where no more than `n_hypotheses` triplets of
    cameras exist, up to 19 cameras by default. The refined one hardly scatters (``snakemake
    registration_study``: by at most 0.0006); ``docs/explanation/registration.md`` derives it.

    O(n log n + n_hypotheses * n) time, O(n) memory.

    With another alignment than "similarity" the score counts what that alignment keeps: the scale,
    the vertical axis, the world. "pcr99" then fits the alignment to the same triplets; "refined"
    aligns any estimate, even one camera.

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

    With noise the refined registration finds a better alignment, and from any seed the same:

    >>> est = gt + rng.normal(scale=0.05, size=gt.shape)
    >>> [round(tas(gt, est, rng=seed).score, 3) for seed in range(3)]
    [0.573, 0.564, 0.558]
    >>> [round(tas(gt, est, rng=seed, registration="refined").score, 3) for seed in range(3)]
    [0.663, 0.663, 0.663]

    An estimate of the wrong size is right up to scale, and wrong without:

    >>> [
    ...     tas(gt, 2 * gt, registration="refined", alignment=a).score
    ...     for a in ("similarity", "rigid")
    ... ]
    [1.0, 0.02]

    A registration may be any function:

    >>> from alignscores import Similarity
    >>> def least_squares(gt_positions, est_positions, **settings):
    ...     return Similarity.fit(gt_positions, est_positions), 1
    >>> result = tas(gt, est, registration=least_squares)
    >>> result.registration, round(result.score, 3)
    ('least_squares', 0.663)
    """
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=False)
    check_same_length(gt, est, "gt_positions", "est_positions")
    check_positive(n_hypotheses, "n_hypotheses", integer=True)
    check_alignment(alignment, up)
    register, name = _registration(registration)
    try:
        generator = np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rng must be a seed or a Generator, not {rng!r}: {error}") from None
    normalised_gt = normalise(gt)
    if unit is None:
        unit = _quartile(normalised_gt)
    check_positive(unit, "unit")
    thresholds = unit * equal_steps(max_threshold, n_thresholds, "max_threshold")

    estimated = finite_rows(est)
    errors = np.full(len(gt), np.inf)
    if 0 < np.count_nonzero(estimated) < len(gt):
        normalised_gt = normalise(gt[estimated])
    found, errors[estimated], n_used = _register(
        gt[estimated],
        est[estimated],
        normalised_gt,
        register,
        alignment,
        up,
        rank=max(4, (len(gt) + 5) // 10),
        threshold=float(thresholds[-1]),
        n_hypotheses=int(n_hypotheses),
        rng=generator,
    )
    if found is None:
        distinct = len(np.unique(est[estimated], axis=0))
        warnings.warn(
            "TAS is 0: the estimate cannot be aligned, since none of its camera triplets resembles "
            f"the ground truth ({distinct} distinct estimated positions of {len(gt)} cameras)",
            AlignmentWarning,
            stacklevel=2,
        )
    return TASResult(
        errors=errors,
        thresholds=thresholds,
        alignment=found,
        unit=float(unit),
        n_hypotheses=n_used,
        registration=name,
    )


def closest_pair_quartile(gt_positions: ArrayLike) -> float:
    """Return d of the paper: the upper quartile of the distances to the closest other camera.

    Parameters
    ----------
    gt_positions : (n, 3) array_like
        Finite camera centres, at least 4.

    Returns
    -------
    float
        The ceil(3n/4)-th smallest of the n distances, in the unit of the positions.

    Raises
    ------
    ValueError
        Where there are fewer than 4 cameras, or d is 0.

    References
    ----------
    Lee and Civera, "Alignment Scores", eq. 1.

    Examples
    --------
    >>> from alignscores import closest_pair_quartile
    >>> closest_pair_quartile([[0, 0, 0], [1, 0, 0], [3, 0, 0], [7, 0, 0]])
    2.0
    """
    return _quartile(normalise(check_positions(gt_positions, "gt_positions", complete=True)))


def _quartile(normalised_gt: Normalised) -> float:
    """Return d of normalised positions, in the unit that they had before."""
    n = len(normalised_gt[0])
    if n < 4:
        raise ValueError(
            f"TAS needs at least 4 ground-truth cameras to derive its unit, but there are {n}; "
            "pass unit= to set it by hand"
        )
    rank = (3 * n + 3) // 4
    d = float(np.partition(_closest_pair_distances(normalised_gt), rank - 1)[rank - 1])
    if d == 0:
        raise ValueError(
            "TAS has no unit: at least three quarters of the cameras in gt_positions coincide with "
            "another one; pass unit= to set it by hand"
        )
    return d


def closest_pair_distances(gt_positions: Floats) -> Floats:
    """Return the distance (n,) of each of at least 2 cameras to the closest other one."""
    return _closest_pair_distances(normalise(gt_positions))


def _closest_pair_distances(normalised_gt: Normalised) -> Floats:
    """Return the distances of normalised positions, in the unit that they had before."""
    local, _, unit = normalised_gt
    if len(local) <= MAX_WITHOUT_TREE:
        squares: Floats = scipy.spatial.distance.cdist(local, local, "sqeuclidean")
        np.fill_diagonal(squares, np.inf)
        closest: Floats = np.sqrt(squares.min(axis=0))
    else:
        # Options that build the tree quickly, since it is searched only once for each camera.
        tree = scipy.spatial.cKDTree(local, leafsize=24, compact_nodes=False, balanced_tree=False)
        closest = np.empty(len(local))
        # In the order of the leaves, so that successive searches visit the same part of the tree.
        closest[tree.indices] = tree.query(local[tree.indices], k=[2])[0][:, 0]
    with np.errstate(over="ignore"):
        distances: Floats = unit * closest
        return distances


def _registration(registration: str | Registration) -> tuple[Registration, str]:
    """Return a registration with its name."""
    if isinstance(registration, str) and registration in REGISTRATIONS:
        return REGISTRATIONS[registration], registration
    if isinstance(registration, str) or not callable(registration):
        raise ValueError(
            f"registration must be one of {sorted(REGISTRATIONS)} or a function, "
            f"not {registration!r}"
        )
    return registration, getattr(registration, "__name__", repr(registration))


def _register(
    gt: Floats,
    est: Floats,
    normalised_gt: Normalised,
    register: Registration,
    alignment: str,
    up: str,
    *,
    rank: int,
    threshold: float,
    n_hypotheses: int,
    rng: np.random.Generator,
) -> tuple[Similarity | None, Floats, int]:
    """Register finite positions; return the alignment, the errors and the number of hypotheses."""
    gt_local, gt_centre, gt_unit = normalised_gt
    errors = np.full(len(est), np.inf)
    if len(est) < (3 if alignment == "similarity" else 1):
        return None, errors, 0
    if alignment == "none":
        return IDENTITY, IDENTITY.position_errors(gt, est), 1
    est_local, est_centre, est_unit = normalise(est)
    if alignment != "similarity":  # the scale must stay what it is
        est_local, est_unit = est_local * (est_unit / gt_unit), gt_unit
    axes = np.roll(range(3), -1 - "xyz".index(up[-1]))  # the vertical one last
    registered = register(
        gt_local[:, axes],
        est_local[:, axes],
        rank=min(rank, len(est)),
        threshold=threshold / gt_unit,
        n_hypotheses=n_hypotheses,
        rng=rng,
        alignment=alignment,
    )
    match registered:
        case (Similarity() | None as local, int() | np.integer() as n_used):
            pass
        case _:
            raise TypeError(
                "registration must return a Similarity or None and the number of hypotheses, "
                f"not {registered!r}"
            )
    if local is None:
        return None, errors, n_used
    back = np.argsort(axes)
    local = Similarity(local.scale, local.rotation[np.ix_(back, back)], local.translation[back])
    errors = gt_unit * local.position_errors(gt_local, est_local)
    scale = local.scale * est_unit / gt_unit
    translation = est_centre + est_unit * local.translation - scale * local.rotation @ gt_centre
    return Similarity(scale, local.rotation, translation), errors, n_used


def normalise(positions: Floats) -> Normalised:
    """Return positions centred on their median and divided by their spread, with median and spread.

    Then neither a far-off origin nor squares of very large or small numbers cost any digits. Median
    and spread are robust: an outlier moves neither. The spread is about the median distance from
    the median along an axis, 1 where all positions coincide. It is a power of two, so that dividing
    by it rounds nothing.
    """
    positions = np.clip(positions, -FARTHEST_SUMMABLE, FARTHEST_SUMMABLE)
    centre = _upper_median(positions)
    with np.errstate(over="ignore"):  # beyond the largest number: infinitely far
        local = positions - centre
        distances = np.abs(local)
        moved = distances[distances > 0]
        unit = np.ldexp(1.0, np.frexp(_upper_median(moved))[1] - 1) if moved.size else 1.0
        return local / unit, centre, float(unit)


def _upper_median(values: Floats) -> Any:
    """Return the median of each column; of two middle values the upper one, not their mean."""
    half = len(values) // 2
    return np.partition(values, half, axis=0)[half]
