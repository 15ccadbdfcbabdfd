"""AUC of lists of image pairs, as papers on image matching report it: AUC@5, 10 and 20 degrees."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..averaging import rotation_angles
from ..validation import check_poses, check_positive, check_same_length, real_array
from .cameras import NoValueError, check_choice
from .colmap import interpolated_auc

__all__ = ["pair_auc", "pair_pose_errors"]

Convention = Literal["superglue", "vggt"]


def pair_auc(
    errors: ArrayLike,
    thresholds: Sequence[float] = (5.0, 10.0, 20.0),
    *,
    convention: Convention = "superglue",
) -> Floats:
    """Area under the recall of a list of image pairs, up to each threshold.

    Parameters
    ----------
    errors : (n,) array_like
        Error of each pair in degrees, as of `pair_pose_errors`; one that is not finite is a pair
        without a pose, which fails.
    thresholds : sequence of float
        Upper ends t of the areas in degrees.
    convention : {"superglue", "vggt"}
        "superglue": the recall goes up in straight lines from error to error, and is flat from the
        last one below t on. "vggt": the mean of the shares of pairs below 1, 2, ..., t degrees, for
        whole t.

    Returns
    -------
    (len(thresholds),) ndarray
        Percent.

    Raises
    ------
    NoValueError
        If there is no pair.

    Notes
    -----
    LoFTR and RoMa compute SuperGlue's value; glue-factory rounds it to two decimals of a percent.
    All fold directions at 90 degrees. Where the true centres coincide there is no direction, and
    the error is NaN: the pair fails, but LoFTR sorts with Python's comparisons, which NaN breaks.

    References
    ----------
    magicleap/SuperGluePretrainedNetwork, models/utils.py, pose_auc, at 45a750e; zju3dv/LoFTR,
    src/utils/metrics.py, error_auc, at 5d6c834; cvg/glue-factory, gluefactory/utils/tools.py,
    cal_error_auc, at 002d090; Parskatt/RoMa, romatch/utils/utils.py, pose_auc, at 021a916; VGGT as
    in `vggt_auc`.

    Examples
    --------
    >>> from alignscores.metrics import pair_auc
    >>> pair_auc([0.5, 3.0, 12.0, float("nan")])
    array([40.   , 45.   , 63.125])
    >>> pair_auc([0.5, 3.0, 12.0, float("nan")], convention="vggt")
    array([35.  , 42.5 , 56.25])
    """
    check_choice(convention, get_args(Convention), "convention")
    values = real_array(errors, "errors")
    if values.ndim != 1 or (values < 0).any():
        raise ValueError("errors must be a list of angles in degrees, at least 0")
    if len(values) == 0:
        raise NoValueError("there is no pair")
    values = values[np.isfinite(values)]
    n = np.size(errors)
    areas = []
    for end in thresholds:
        check_positive(end, "thresholds")
        if convention == "superglue":
            areas.append(interpolated_auc([values[values < end]], n, end, 0.0))
            continue
        if end != round(end):
            raise ValueError(f"thresholds of vggt are whole degrees, not {end!r}")
        counts = np.histogram(values[values <= end], np.arange(end + 1))[0]
        areas.append(100 * float(np.cumsum(counts).sum()) / (end * n))
    return np.array(areas)


def pair_pose_errors(gt_poses: ArrayLike, est_poses: ArrayLike) -> Floats:
    """Return the pose error of image pairs: the larger of the rotation's and the direction's.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Relative pose of each pair, from the first camera to the second one. The estimate's
        translation may have any length and sign; a pose that is not finite was not found.

    Returns
    -------
    (n,) ndarray
        Degrees; infinite where there is no pose, or no direction.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import pair_pose_errors
    >>> gt = np.tile(np.eye(4), (2, 1, 1))
    >>> gt[:, :3, 3] = [1, 0, 0]
    >>> est = gt.copy()
    >>> est[:, :3, 3] = [[-7, 0, 0], [1, 1, 0]]
    >>> pair_pose_errors(gt, est)
    array([ 0., 45.])
    """
    gt_rotations, gt = check_poses(gt_poses, "gt_poses", complete=True)
    est_rotations, est = check_poses(est_poses, "est_poses", complete=False)
    check_same_length(gt, est, "gt_poses", "est_poses")
    with np.errstate(all="ignore"):
        lengths = np.linalg.norm(gt, axis=1) * np.linalg.norm(est, axis=1)
        cosines = np.abs(np.sum(gt * est, axis=1)) / lengths
        directions = np.degrees(np.arccos(np.minimum(cosines, 1)))
        errors = np.maximum(
            rotation_angles(gt_rotations.swapaxes(1, 2) @ est_rotations), directions
        )
    return np.where(np.isfinite(errors), errors, np.inf)
