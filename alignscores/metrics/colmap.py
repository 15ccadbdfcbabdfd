"""The errors of relative poses of COLMAP's reconstruction benchmark, and their AUC."""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..validation import check_positive
from .base import Metric, angle
from .cameras import Cameras
from .vggt import direction_blocks

__all__ = ["METRICS", "colmap_relative_auc", "interpolated_auc"]


SHORTEST = 1e-10  # a shorter step is divided by this
FAILED = 180.0  # degrees


def colmap_relative_auc(
    gt_poses: ArrayLike, est_poses: ArrayLike, max_error_deg: float, *, accuracy: float = 1e-3
) -> float:
    """Area under the recall of relative poses, as COLMAP's benchmark computes it.

    The error of an ordered pair of cameras is the larger of the angle between the relative
    rotations and the angle between the directions of the relative translations, 0 to 180 degrees;
    a direction is 0 where the true centres are closer than `accuracy`. The recall is interpolated
    linearly between the errors, from `accuracy` (as degrees) on, and flat after the last one.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Camera-to-world poses, row i of both the same camera; the estimate in any frame. All pairs
        of an estimate that is not finite have an error of 180 degrees.
    max_error_deg : float
        Upper end t of the area; the benchmark has 0.5, 1, 5, 10.
    accuracy : float
        Accuracy of the reference in metres: 0.001 for ETH3D and BlendedMVS, 0.02 for the Image
        Matching Challenge. The same number is used in degrees: smaller errors count as equal.

    Returns
    -------
    float
        Percent.

    Notes
    -----
    The benchmark of one reference model and one estimated model.

    No sorting: of N pairs, K have errors up to t, the last of them e, and those above `accuracy`
    sum to S; the trapezoids are ``K t - S + (e - accuracy) / 2``, over ``N t``. O(n^2) time, O(n)
    memory.

    References
    ----------
    colmap/colmap, benchmark/reconstruction/evaluation/utils.py at ee667dd (2026).

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
    """
    check_positive(max_error_deg, "max_error_deg")
    check_positive(accuracy, "accuracy")
    cameras = Cameras.check(gt_poses, est_poses)
    n_pairs = max(len(cameras) * (len(cameras) - 1), 1)
    return interpolated_auc(_errors(cameras, accuracy), n_pairs, max_error_deg, accuracy)


def _errors(cameras: Cameras, accuracy: float) -> Iterator[Floats]:
    """Yield the errors of all ordered pairs; there is at least one."""
    for convention in ("vggt", "mapanything"):  # each pair is seen from either camera
        for block in direction_blocks(cameras, convention):
            pairs = block.pairs
            lengths = np.maximum(block.gt_lengths, SHORTEST) * np.maximum(
                block.est_lengths, SHORTEST
            )
            directions = np.degrees(np.arccos(np.clip(block.dots / lengths, -1, 1)[pairs]))
            directions[block.gt_lengths[pairs] < accuracy] = 0
            yield np.maximum(directions, block.rotation_angles()[pairs])
    n, v = len(cameras), int(np.count_nonzero(cameras.estimated))
    failed = n * (n - 1) - v * (v - 1) if n > 1 else 1
    yield np.broadcast_to(FAILED, failed)


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
    )
    for project, accuracy, of in (
        ("colmap", 0.001, "benchmark"),
        ("colmap-imc", 0.02, "benchmark on the Image Matching Challenge"),
    )
]
"""The AUC, with the accuracy of either reference."""
