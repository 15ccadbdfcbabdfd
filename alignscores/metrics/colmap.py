"""The errors of relative poses of COLMAP's reconstruction benchmark, and their AUC."""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Booleans, Floats
from ..validation import check_positive
from .base import Metric, angle
from .cameras import Cameras
from .vggt import direction_blocks

__all__ = ["METRICS", "colmap_relative_auc", "interpolated_auc"]


SHORTEST = 1e-10  # a shorter step is divided by this
FAILED = 180.0  # degrees


def colmap_relative_auc(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    max_error_deg: float,
    *,
    accuracy: float = 1e-3,
    outliers: ArrayLike = 0,
) -> float:
    """Area under the recall of relative poses, as COLMAP's benchmark computes it.

    The error of an ordered pair of cameras is the larger of the angle between the relative
    rotations and the angle between the directions of the relative translations, 0 to 180 degrees;
    a direction is 0 where the true centres are closer than `accuracy`. The recall is interpolated
    linearly between the errors, from `accuracy` (as degrees) on, and flat after the last one.

    Parameters
    ----------
    gt_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses.
    est_poses : (n, 4, 4) or (n, 3, 4) array_like, or (m, n, 4, 4) or (m, n, 3, 4)
        Row i is camera i of the ground truth; the estimate in any frame. Or m models of a scene,
        each in its own frame. A pair that is in several models has an error in each; a pair
        that is in none has one of 180 degrees, such as all pairs of a row that is not finite.
    max_error_deg : float
        Upper end t of the area; the benchmark has 0.5, 1, 5, 10.
    accuracy : float
        Accuracy of the reference in metres: 0.001 for ETH3D and BlendedMVS, 0.02 for the Image
        Matching Challenge. The same number is used in degrees: smaller errors count as equal.
    outliers : int or (m,) array_like
        Number of images in each model that the ground truth lacks. Each of their pairs has an error
        of 180 degrees.

    Returns
    -------
    float
        Percent.

    Notes
    -----
    The benchmark with a ground truth of one component.

    No sorting: of N pairs, K have errors up to t, the last of them e, and those above `accuracy`
    sum to S; the trapezoids are ``K t - S + (e - accuracy) / 2``, over ``N t``. O(m n^2) time,
    O(m n) memory.

    References
    ----------
    colmap/colmap, benchmark/reconstruction/evaluation/utils.py at 5d968cf (2026), error_type
    relative_auc.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.metrics import colmap_relative_auc
    >>> gt = np.tile(np.eye(4), (3, 1, 1))
    >>> gt[:, :3, 3] = np.eye(3)
    >>> est = gt.copy()
    >>> est[2, :3, :3] = Rotation.from_euler("x", 1.5, degrees=True).as_matrix()
    >>> round(colmap_relative_auc(gt, est, 3), 1)
    70.8
    >>> models = np.stack([gt, gt])
    >>> models[0, 2] = models[1, 0] = np.nan  # camera 1 is in both, no model has cameras 0 and 2
    >>> round(colmap_relative_auc(gt, models, 3), 1)
    66.7
    """
    check_positive(max_error_deg, "max_error_deg")
    check_positive(accuracy, "accuracy")
    models = est_poses if np.ndim(est_poses) == 4 else np.asarray(est_poses)[None]
    cameras = [Cameras.check(gt_poses, model) for model in np.asarray(models)]
    estimated = np.array([model.estimated for model in cameras])
    n_failed, sizes = _n_failed(estimated, outliers), estimated.sum(axis=1)
    measured = (part for model in cameras for part in _errors(model, accuracy))
    errors = chain(measured, [np.broadcast_to(FAILED, n_failed)])
    n_pairs = n_failed + int((sizes * (sizes - 1)).sum())
    return interpolated_auc(errors, n_pairs, max_error_deg, accuracy)


def _n_failed(estimated: Booleans, outliers: ArrayLike) -> int:
    """Return the number of ordered pairs without a relative pose, or with an image that is none.

    ``estimated[j, i]`` tells whether model j has camera i. It is at least 1 where there is no pair.
    """
    n, sizes = estimated.shape[1], estimated.sum(axis=1)
    together = sum(int(estimated[of].any(axis=0).sum()) - 1 for of in estimated.T if of.any())
    registered = sizes + np.asarray(outliers)
    of_outliers = registered * (registered - 1) - sizes * (sizes - 1)
    n_failed = int(n * (n - 1) - together + of_outliers.sum())
    return n_failed if n > 1 else max(n_failed, 1)


def _errors(cameras: Cameras, accuracy: float) -> Iterator[Floats]:
    """Yield the errors of all ordered pairs of estimated cameras."""
    for convention in ("vggt", "mapanything"):  # each pair is seen from either camera
        for block in direction_blocks(cameras, convention):
            pairs = block.pairs
            lengths = np.maximum(block.gt_lengths, SHORTEST) * np.maximum(
                block.est_lengths, SHORTEST
            )
            directions = np.degrees(np.arccos(np.clip(block.dots / lengths, -1, 1)[pairs]))
            directions[block.gt_lengths[pairs] < accuracy] = 0
            yield np.maximum(directions, block.rotation_angles()[pairs])


def interpolated_auc(errors: Iterable[Floats], n: int, end: float, min_error: float) -> float:
    """Return the area under linearly interpolated recall up to an end, in percent of the box."""
    if end < min_error:
        return 100 * sum(int(np.count_nonzero(part <= min_error)) for part in errors) / n
    count, total, last = 0, 0.0, min_error
    for part in errors:
        within = part[part <= end]
        count += len(within)
        total += float(within[within > min_error].sum())
        last = max(last, float(within.max(initial=min_error)))
    return 100 * (count * end - total + (last - min_error) / 2) / (n * end)


def _degrees(text: str) -> Mapping[str, float] | None:
    end = angle(text)
    return None if end is None else {"max_error_deg": end}


METRICS = [
    Metric(
        f"auc@ANGLE:{project}",
        partial(colmap_relative_auc, accuracy=accuracy),
        unit="%",
        larger_is_better=True,
        needs=("rotations", "metres"),
        description=f"area under the interpolated recall of relative poses, of COLMAP's {of}",
        argument=_degrees,
        example=f"auc@5:{project}",
        sets=True,
    )
    for project, accuracy, of in (
        ("colmap", 0.001, "benchmark"),
        ("colmap-imc", 0.02, "benchmark on the Image Matching Challenge"),
    )
]
"""The AUC, with the accuracy of either reference."""
