"""Pose Alignment Score, PAS (section 5)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .registration import Registration, Seed
from .rotation import RASResult, _checked_ras
from .translation import TASResult, tas
from .validation import check_poses, check_same_length

__all__ = ["PASResult", "check_weight", "pas"]


@dataclass(frozen=True, eq=False)
class PASResult:
    """Pose Alignment Score, the weighted mean of two scores.

    Parameters
    ----------
    score : float
        PAS, from 0 to 1; also ``float(result)``.
    tas : TASResult
        The translation score.
    ras : RASResult
        The rotation score.
    weight : float
        Share of the TAS.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import pas
    >>> poses = np.tile(np.eye(4), (5, 1, 1))
    >>> poses[:, :3, 3] = np.random.default_rng(0).random((5, 3))
    >>> result = pas(poses, poses, weight=0.7)
    >>> result
    PASResult(1.0000, TAS 1.00, RAS 1.00, registration='pcr99')
    >>> float(result), result.weight
    (1.0, 0.7)
    """

    score: float
    tas: TASResult
    ras: RASResult
    weight: float

    def __repr__(self) -> str:
        scores = f"{self.score:.4f}, TAS {self.tas.score:.2f}, RAS {self.ras.score:.2f}"
        return f"PASResult({scores}, registration={self.tas.registration!r})"

    def __float__(self) -> float:
        return self.score


def pas(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    rng: Seed = 0,
    weight: float = 0.5,
    unit: float | None = None,
    groups: ArrayLike | None = None,
    n_hypotheses: int = 1000,
    max_threshold: float = 1.0,
    max_threshold_deg: float = 10.0,
    n_thresholds: int = 100,
    registration: str | Registration = "pcr99",
    alignment: str = "similarity",
    up: str = "z",
) -> PASResult:
    """Score how well estimated camera poses match the ground truth: PAS, the mean of TAS and RAS.

    Positions and rotations are aligned independently of each other.

    Parameters
    ----------
    gt_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses: the left 3 x 3 block holds the camera's axes, the last column its
        centre.
    est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Estimated poses; row i is the camera of row i of the ground truth. A camera whose centre
        (rotation) is not finite fails in the TAS (RAS).
    rng : int, SeedSequence, Generator or None
        See `tas`.
    weight : float
        Share of the TAS, from 0 to 1.
    unit : float, optional
        d in ground-truth units; see `tas`.
    groups : (n,) array_like, optional
        Labels of rows, the same for cameras of one rig frame; see `tas`.
    n_hypotheses : int
        Number of hypotheses of the registration.
    max_threshold : float
        Largest threshold of position errors in units of d.
    max_threshold_deg : float
        Largest threshold of rotation errors in degrees.
    n_thresholds : int
        Number of thresholds of each of the two scores.
    registration : {"pcr99", "refined"} or Registration
        See `tas`.
    alignment, up : str
        See `tas`.

    Returns
    -------
    PASResult
        ``weight * TAS + (1 - weight) * RAS`` with both results.

    Raises
    ------
    ValueError
        If the input is malformed, or d is undefined (see `tas`).

    Warns
    -----
    AlignmentWarning
        If the estimate cannot be aligned; that score is 0.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 5, eq. 5, and section 8 for the weight.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import pas
    >>> rng = np.random.default_rng(0)
    >>> gt = np.tile(np.eye(4), (40, 1, 1))
    >>> gt[:, :3, :3] = Rotation.random(40, rng=rng).as_matrix()
    >>> gt[:, :3, 3] = rng.random((40, 3))
    >>> est = gt.copy()
    >>> est[:10, :3, 3] = np.nan
    >>> result = pas(gt, est)
    >>> result.score, result.tas.score, result.ras.score
    (0.875, 0.75, 1.0)
    """
    gt_rotations, gt_positions = check_poses(gt_poses, "gt_poses", complete=True)
    est_rotations, est_positions = check_poses(est_poses, "est_poses", complete=False)
    check_same_length(gt_rotations, est_rotations, "gt_poses", "est_poses")
    weight = check_weight(weight)
    translation = tas(
        gt_positions,
        est_positions,
        rng=rng,
        unit=unit,
        groups=groups,
        n_hypotheses=n_hypotheses,
        max_threshold=max_threshold,
        n_thresholds=n_thresholds,
        registration=registration,
        alignment=alignment,
        up=up,
    )
    del gt_positions, est_positions  # their memory is needed
    rotation = _checked_ras(
        gt_rotations, est_rotations, max_threshold_deg, n_thresholds, alignment, up
    )
    # PAS = alpha TAS + (1 - alpha) RAS (eq. 5, with the weight alpha of section 8)
    score = weight * translation.score + (1 - weight) * rotation.score
    return PASResult(score=score, tas=translation, ras=rotation, weight=weight)


def check_weight(weight: float) -> float:
    """Return a share of the TAS, or raise ValueError."""
    number = isinstance(weight, (int, float, np.number)) and not isinstance(weight, bool)
    if not number or not 0 <= weight <= 1:
        raise ValueError(f"weight must be a number from 0 to 1, not {weight!r}")
    return float(weight)
