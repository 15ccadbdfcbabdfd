"""Shares of images within a distance and an angle: ACE0 and hloc."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..aligner import Seed
from ..arrays import Booleans, Floats, Indices
from ..averaging import rotation_angles
from ..validation import check_positive
from .alignment import Transform, block_size, fit, random_triplets
from .cameras import Cameras, check_choice
from .trajectory import least_squares_aligned

__all__ = ["ace0_recall", "hloc_median", "hloc_recall"]


FEWEST = 10  # cameras that an alignment needs
HYPOTHESES = 10_000
REFINED = 12
REFITS = 8


def ace0_recall(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    max_error: float = 0.05,
    max_error_deg: float = 5.0,
    *,
    true_angles: bool = False,
    rng: Seed = 0,
) -> float:
    """Share of images within a distance and an angle after ACE0's robust alignment.

    Of 10,000 similarities from three images each, the 12 with the most inliers are refitted while
    that gives more; the one with the most aligns. Its errors are measured in the ground truth.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same image, the truth in metres, the estimate in a
        world of its own. The truth is rounded to single precision, as the program does. An
        estimate that is not finite fails.
    max_error : float
        Distance in metres. Inliers of the alignment are within the same number of *estimated*
        units.
    max_error_deg : float
        Angle in degrees.
    true_angles : bool
        Whether the angles of the inlier test are those of the rotations. In the published
        environment (SciPy 1.10) they are of the rotations times the scale c of the alignment, not
        orthonormalised: small angles are multiplied by 4c / (1 + 3c). SciPy 1.17 orthonormalises.
    rng : int, SeedSequence, Generator or None
        Seed of the triplets.

    Returns
    -------
    float
        Percent; 0 where fewer than 10 images were estimated, however well.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Notes
    -----
    The value depends on the scale of the estimated world. Where the world is small the inlier test
    is lax, where it is large hardly any triplet passes: either way good poses may fail, and the
    value scatters with the seed. O(n) time for each triplet, O(n) memory.

    References
    ----------
    nianticlabs/acezero, eval_poses.py and eval_poses_util.py at 386ae5a (2024), with a similarity
    alignment.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import ace0_recall
    >>> gt = np.tile(np.eye(4), (20, 1, 1))
    >>> gt[:, :3, 3] = np.random.default_rng(0).random((20, 3))
    >>> est = gt.copy()
    >>> est[:, :3, 3] *= 2
    >>> est[:5] = np.nan
    >>> ace0_recall(gt, est)
    75.0
    """
    check_positive(max_error, "max_error")
    check_positive(max_error_deg, "max_error_deg")
    cameras = Cameras.check(gt_poses, est_poses)
    matched = _single_precision(cameras.matched())
    n_matched = len(matched)
    if n_matched < FEWEST:
        return 0.0
    triplets = random_triplets(n_matched, HYPOTHESES, np.random.default_rng(rng))
    alignment = ace0_alignment(matched, triplets, max_error, max_error_deg, true_angles)
    if alignment is None:
        return 0.0
    distances = alignment.distances(matched.gt, matched.est) / alignment.scale
    turned = alignment.rotation @ matched.gt_rotations
    angles = rotation_angles(matched.est_rotations @ turned.transpose(0, 2, 1))
    right = np.count_nonzero((angles < max_error_deg) & (distances < max_error))
    return 100 * int(right) / len(cameras)


@np.errstate(all="ignore")  # what is not finite is never an inlier
def ace0_alignment(
    cameras: Cameras,
    triplets: Indices,
    max_error: float,
    max_error_deg: float,
    true_angles: bool,
) -> Transform | None:
    """Return ACE0's similarity from ground truth to estimate; None where no triplet fits itself."""
    n = len(cameras)
    between = cameras.gt_rotations @ cameras.est_rotations.transpose(0, 2, 1)

    def inliers(transforms: Transform) -> Booleans:
        """Tell (H, n) which images are within the thresholds, in units of the estimate."""
        near = transforms.distances(cameras.gt, cameras.est) < max_error
        h, i = np.nonzero(near)
        matrices = transforms.rotation[h] @ between[i]
        if true_angles:
            angles = rotation_angles(matrices)
        else:
            angles = _scaled_angles(transforms.scale[h, None, None] * matrices)
        near[h, i] = angles < max_error_deg
        return near

    kept: list[tuple[Transform, Booleans]] = []
    step = block_size(n)
    for start in range(0, len(triplets), step):
        samples = triplets[start : start + step]
        hypotheses = fit(cameras.gt[samples], cameras.est[samples]).inverse_least_squares()
        near = inliers(hypotheses)
        fits_itself = np.take_along_axis(near, samples, axis=1).all(axis=1)
        kept += [(hypotheses[int(k)], near[k]) for k in np.flatnonzero(fits_itself)]
        # Stable, so that of equal ones the first stay.
        kept = sorted(kept, key=lambda candidate: -np.count_nonzero(candidate[1]))[:REFINED]
    refined = []
    for transform, near in kept:
        for _ in range(REFITS):
            again = fit(cameras.gt[near], cameras.est[near]).inverse_least_squares()
            (within,) = inliers(Transform.joined([again]))
            if np.count_nonzero(within) <= np.count_nonzero(near):
                break
            transform, near = again, within
        refined.append((transform, near))
    if not refined:
        return None
    return max(refined, key=lambda candidate: np.count_nonzero(candidate[1]))[0]


def _single_precision(cameras: Cameras) -> Cameras:
    largest = np.finfo(np.float32).max
    rotations, positions = (
        np.clip(part, -largest, largest).astype(np.float32).astype(np.float64)
        for part in (cameras.gt_rotations, cameras.gt)
    )
    return replace(cameras, gt_rotations=rotations, gt=positions)


def _scaled_angles(matrices: Floats) -> Floats:
    """Return the angles of (n, 3, 3) scaled rotations as SciPy 1.10 reads them, in degrees."""
    diagonal = np.einsum("nii->ni", matrices)
    trace = diagonal.sum(axis=1)
    decision = np.column_stack([diagonal, trace]).argmax(axis=1)
    xyz, w = np.empty((len(matrices), 3)), np.empty(len(matrices))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        at = decision == i
        m = matrices[at]
        xyz[at, i] = 1 - trace[at] + 2 * m[:, i, i]
        xyz[at, j] = m[:, j, i] + m[:, i, j]
        xyz[at, k] = m[:, k, i] + m[:, i, k]
        w[at] = m[:, k, j] - m[:, j, k]
        by_trace = decision == 3
        xyz[by_trace, i] = matrices[by_trace, k, j] - matrices[by_trace, j, k]
    w[by_trace] = 1 + trace[by_trace]
    return np.asarray(np.degrees(2 * np.arctan2(np.sqrt((xyz * xyz).sum(axis=1)), np.abs(w))))


def hloc_recall(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    max_error: float = 0.05,
    max_error_deg: float = 5.0,
    *,
    alignment: Literal["none", "sim3"] = "none",
) -> float:
    """Share of images within a distance and an angle, as hloc counts them for Cambridge Landmarks.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same image, in metres. An estimate that is not
        finite fails.
    max_error : float
        Distance in metres.
    max_error_deg : float
        Angle in degrees.
    alignment : {"none", "sim3"}
        hloc aligns nothing: the estimate is in the world of the ground truth. "sim3" moves it by
        the least-squares similarity first, which is no part of hloc.

    Returns
    -------
    float
        Percent, of all images.

    Raises
    ------
    ValueError
        Where the input is malformed.
    NoValueError
        Where there is no least-squares similarity; see `evo_ate`.

    References
    ----------
    cvg/Hierarchical-Localization, hloc/pipelines/Cambridge/utils.py at 0ea601c (2024).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import hloc_recall
    >>> gt = np.tile(np.eye(4), (4, 1, 1))
    >>> est = gt.copy()
    >>> est[:, 0, 3] = [0, 0.04, 0.06, np.nan]
    >>> hloc_recall(gt, est)
    50.0
    """
    check_positive(max_error, "max_error")
    check_positive(max_error_deg, "max_error_deg")
    distances, angles = image_errors(gt_poses, est_poses, alignment)
    right = np.count_nonzero((distances < max_error) & (angles < max_error_deg))
    return 100 * int(right) / len(distances)


def hloc_median(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    error: Literal["translation", "rotation"] = "translation",
    alignment: Literal["none", "sim3"] = "none",
) -> float:
    """Median distance, or median angle, over all images; see `hloc_recall`.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        As in `hloc_recall`. An estimate that is not finite is infinitely far off, and 180 degrees.
    error : {"translation", "rotation"}
        Distances or angles.
    alignment : {"none", "sim3"}
        As there.

    Returns
    -------
    float
        In ground-truth units, or degrees. Infinite where half of the images have no estimate.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import hloc_median
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> est = gt.copy()
    >>> est[:, 0, 3] = [0, 0.04, np.nan]
    >>> hloc_median(gt, est)
    0.04
    """
    check_choice(error, ("translation", "rotation"), "error")
    distances, angles = image_errors(gt_poses, est_poses, alignment)
    return float(np.median(distances if error == "translation" else angles))


def image_errors(
    gt_poses: ArrayLike, est_poses: ArrayLike, alignment: str
) -> tuple[Floats, Floats]:
    """Return distances, infinite for missing images, and angles, 180 degrees for these."""
    check_choice(alignment, ("none", "sim3"), "alignment")
    cameras = Cameras.check(gt_poses, est_poses)
    distances, angles = np.full(len(cameras), np.inf), np.full(len(cameras), 180.0)
    if cameras.estimated.any():
        matched = least_squares_aligned(cameras.matched(), alignment)
        distances[cameras.estimated] = np.linalg.norm(matched.est - matched.gt, axis=1)
        angles[cameras.estimated] = rotation_angles(
            matched.gt_rotations @ matched.est_rotations.transpose(0, 2, 1)
        )
    return distances, angles
