"""Scores that give points for distances: of the Hilti SLAM Challenge and of LaMAria."""

import numpy as np
from numpy.typing import ArrayLike

from ..aligner import Seed
from ..arrays import Floats
from ..validation import check_positive
from .cameras import NoValueError, Positions
from .colmap import locally_optimised_ransac
from .trajectory import aligned_distances

__all__ = ["hilti_score", "lamaria_recall", "lamaria_score"]

HILTI_BOUNDS = (0.01, 0.03, 0.06, 0.1)  # metres; an error at a bound belongs to the next class
HILTI_POINTS = (10, 6, 3, 1, 0)
LAMARIA_ERRORS = (0.05, 0.2, 0.5, 1.0, 2.0, 5.0)  # metres; between them points are interpolated
LAMARIA_POINTS = (20, 18, 15, 12, 8, 4)
LAMARIA_END = 10.0, 0  # metres, points
LAMARIA_INLIER = 5.0  # metres
PYCOLMAP_CONFIDENCE, PYCOLMAP_TRIALS = 0.9999, (1000, 100_000)  # defaults of its robust similarity


def hilti_score(gt_positions: ArrayLike, est_positions: ArrayLike) -> float:
    """Points for the distances after a rigid alignment, as in the Hilti SLAM Challenge 2022.

    A position earns 10 points below 1 cm, 6 below 3 cm, 3 below 6 cm, 1 below 10 cm, else none.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Positions in metres, row i of both the same: in the challenge of some surveyed points. An
        estimate that is not finite earns nothing, and does not enter the alignment.

    Returns
    -------
    float
        Percent of the points that can be earned; in the challenge the score of a sequence.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Notes
    -----
    0 where evo, with which the challenge aligns, refuses to. The challenge first moves the estimate
    from the IMU to the tip of a pole, and adds the sequences up.

    References
    ----------
    Hilti-Research/hilti-slam-challenge-2022, evaluation-2022/batch_evaluation.py at e4aacf7.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import hilti_score
    >>> gt = np.random.default_rng(0).random((4, 3))
    >>> hilti_score(gt, gt + 1)
    100.0
    """
    positions = Positions.check(gt_positions, est_positions)
    try:
        errors = aligned_distances(*positions.matched(), "se3")
    except NoValueError:
        return 0.0
    earned = np.array(HILTI_POINTS)[np.searchsorted(HILTI_BOUNDS, errors, side="right")]
    return float(100 * earned.sum() / (HILTI_POINTS[0] * len(positions.gt)))


def lamaria_score(gt_positions: ArrayLike, est_positions: ArrayLike, *, rng: Seed = 0) -> float:
    """Points for horizontal distances after a robust similarity, as LaMAria's control point score.

    A position earns 20 points up to 5 cm, 18 at 20 cm, 15 at 50 cm, 12 at 1 m, 8 at 2 m, 4 at 5 m,
    none from 10 m on; between these the points are interpolated.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        Positions in metres, row i of both the same, the z axis vertical. An estimate that is not
        finite earns nothing.
    rng : int, SeedSequence, Generator or None
        Seed of the alignment: COLMAP's robust similarity with inliers up to 5 m.

    Returns
    -------
    float
        Percent of the points that can be earned.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Notes
    -----
    LaMAria scores surveyed control points that are triangulated from the images, and refines the
    similarity by their uncertainty; files of poses have neither. Here positions stand for them,
    without the refinement. 0 where there is no similarity.

    References
    ----------
    cvg/lamaria, lamaria/utils/metrics.py and lamaria/eval/sparse_evaluation.py at b9f53a3.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import lamaria_score
    >>> gt = np.random.default_rng(0).random((6, 3))
    >>> est = gt.copy()
    >>> est[5] = np.nan
    >>> round(lamaria_score(gt, est), 1)
    83.3
    """
    errors = _horizontal_errors(gt_positions, est_positions, rng)
    end, nothing = LAMARIA_END
    points = np.interp(errors, [*LAMARIA_ERRORS, end], [*LAMARIA_POINTS, nothing])
    return float(100 * points.mean() / LAMARIA_POINTS[0])


def lamaria_recall(
    gt_positions: ArrayLike, est_positions: ArrayLike, max_error: float, *, rng: Seed = 0
) -> float:
    """Share of positions within a horizontal distance, aligned as in `lamaria_score`.

    Parameters
    ----------
    gt_positions, est_positions : (n, 3) array_like
        As there.
    max_error : float
        Largest distance in metres; LaMAria has 1 and 5.
    rng : int, SeedSequence, Generator or None
        As there.

    Returns
    -------
    float
        Percent.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import lamaria_recall
    >>> gt = np.random.default_rng(0).random((6, 3))
    >>> lamaria_recall(gt, gt, 1)
    100.0
    """
    check_positive(max_error, "max_error")
    errors = _horizontal_errors(gt_positions, est_positions, rng)
    return 100 * float(np.mean(errors <= max_error))


def _horizontal_errors(gt_positions: ArrayLike, est_positions: ArrayLike, rng: Seed) -> Floats:
    """Return the horizontal distances after the robust similarity; infinite without a position."""
    positions = Positions.check(gt_positions, est_positions)
    gt, est = positions.matched()
    errors = np.full(len(positions.gt), np.inf)
    to_gt = locally_optimised_ransac(
        *(est, gt, LAMARIA_INLIER, np.random.default_rng(rng)),
        confidence=PYCOLMAP_CONFIDENCE,
        trials=PYCOLMAP_TRIALS,
    )
    if to_gt is not None:
        moved = to_gt.scale * est @ to_gt.rotation.T + to_gt.translation
        errors[positions.estimated] = np.linalg.norm((moved - gt)[:, :2], axis=1)
    return errors
