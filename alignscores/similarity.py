"""Similarity transformations from the ground-truth frame to the estimated frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .validation import check_positions, check_same_length

__all__ = [
    "ALIGNMENTS",
    "FARTHEST_SQUARABLE",
    "FARTHEST_SUMMABLE",
    "SYNONYMS",
    "UP",
    "Similarity",
    "best_yaw",
    "check_alignment",
    "least_squares_rmse",
]


ALIGNMENTS = "similarity", "rigid", "yaw", "none"
SYNONYMS = "sim3 is similarity, se3 is rigid"  # as metrics of other projects name them
UP = "z", "y", "x", "-z", "-y", "-x"
FARTHEST_SUMMABLE = 1e300  # sums and differences of coordinates beyond may overflow
FARTHEST_SQUARABLE = 1e100  # squares of coordinates beyond, and their sums, may overflow
LINE = 1e-9  # ratio of second to first singular value below which the cameras lie on a line
PARALLEL = 1e-6  # sine of an angle below which two directions have no usable normal


@dataclass(frozen=True, eq=False)
class Similarity:
    """Similarity that takes ground-truth positions to estimated positions.

    A camera at ``c`` in the ground-truth frame is expected at
    ``scale * rotation @ c + translation`` in the estimated frame.

    Parameters
    ----------
    scale : float
        Estimated units per ground-truth unit, positive.
    rotation : (3, 3) ndarray
        Rotation from the ground-truth frame to the estimated frame.
    translation : (3,) ndarray
        Position of the ground-truth origin in the estimated frame, in estimated units.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import Similarity
    >>> twice = Similarity(2.0, np.eye(3), np.array([1.0, 0.0, 0.0]))
    >>> twice.apply(np.ones((1, 3)))
    array([[3., 2., 2.]])
    >>> twice.inverse().apply(np.array([[3.0, 2.0, 2.0]]))
    array([[1., 1., 1.]])
    >>> twice.position_errors(np.ones((1, 3)), np.array([[3.0, 2.0, 6.0]]))
    array([2.])
    """

    scale: float
    rotation: Floats
    translation: Floats

    @classmethod
    def fit(
        cls,
        gt_positions: ArrayLike,
        est_positions: ArrayLike,
        *,
        alignment: str = "similarity",
        up: str = "z",
    ) -> "Similarity":
        """Return the least-squares alignment: the sum of squared errors is smallest.

        The errors are `position_errors`, in ground-truth units. Not robust: one outlier
        moves it anywhere.

        Parameters
        ----------
        gt_positions, est_positions : (n, 3) array_like
            Finite camera centres in the ground-truth and in the estimated frame.
        alignment : {"similarity", "rigid", "yaw", "none"}
            What may differ between the two frames; see `tas`.
        up : {"z", "y", "x", "-z", "-y", "-x"}
            Vertical axis of both frames, for "yaw".

        Returns
        -------
        Similarity
            The alignment. Where many are equally good, as the spin about collinear cameras is free,
            it is one of them.

        Raises
        ------
        ValueError
            If the input is malformed, or no similarity of positive, finite scale is the best:
            the cameras coincide in either frame, or their two shapes are uncorrelated.

        References
        ----------
        Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
        PAMI 1991. For "yaw" Zhang and Scaramuzza, "A tutorial on quantitative trajectory
        evaluation for visual(-inertial) odometry", IROS 2018.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import Similarity
        >>> gt = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        >>> alignment = Similarity.fit(gt, 2 * gt + [1, 2, 3])
        >>> round(alignment.scale, 9), alignment.translation.round(9)
        (2.0, array([1., 2., 3.]))
        """
        gt = check_positions(gt_positions, "gt_positions", complete=True)
        est = check_positions(est_positions, "est_positions", complete=True)
        check_same_length(gt, est, "gt_positions", "est_positions")
        check_alignment(alignment, up)
        if alignment == "none":
            return cls(1.0, np.eye(3), np.zeros(3))
        gt, gt_centre, gt_extent = _centred(gt)
        est, est_centre, est_extent = _centred(est)
        covariance = (est[:, None] * gt).sum(axis=2)
        scale = 1.0
        if alignment == "yaw":
            rotation = best_yaw(covariance, up)
        else:
            rotation, correlation = _best_rotation(covariance)
        if alignment == "similarity":  # Umeyama's of the estimate to the ground truth, inverted
            with np.errstate(all="ignore"):  # where nothing fits, the scale is NaN or infinite
                scale = float((est * est).sum() / correlation * (est_extent / gt_extent))
        if not 0 < scale < np.inf:
            raise ValueError(
                "no similarity fits gt_positions to est_positions: the cameras coincide in one of "
                "the frames, or their shapes have nothing in common"
            )
        return cls(scale, rotation, est_centre - scale * rotation @ gt_centre)

    def apply(self, positions: Floats) -> Floats:
        """Return ground-truth positions (n, 3) in the estimated frame."""
        return self.scale * positions @ self.rotation.T + self.translation

    def inverse(self) -> "Similarity":
        """Return the alignment from the estimated to the ground-truth frame."""
        rotation = self.rotation.T
        return Similarity(1 / self.scale, rotation, -rotation @ self.translation / self.scale)

    def position_errors(self, gt_positions: Floats, est_positions: Floats) -> Floats:
        """Return the distances (n,) of aligned estimated positions from the true ones, both (n, 3).

        ``|| (est - translation) / scale - rotation @ gt ||``, in ground-truth units.
        """
        with np.errstate(over="ignore"):  # beyond the largest number: infinitely far
            aligned = (est_positions - self.translation) / self.scale
            errors: Floats = np.linalg.norm(aligned - gt_positions @ self.rotation.T, axis=1)
        return errors


def least_squares_rmse(
    gt_positions: Floats, est_positions: Floats, *, alignment: str = "similarity", up: str = "z"
) -> float:
    """Return the root mean square of the position errors after `Similarity.fit`: the ATE."""
    fit = Similarity.fit(gt_positions, est_positions, alignment=alignment, up=up)
    errors = fit.position_errors(gt_positions, est_positions)
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(errors**2)))


def check_alignment(alignment: str, up: str) -> None:
    """Check the names of an alignment and of an axis."""
    if alignment not in ALIGNMENTS:
        choices = ", ".join(ALIGNMENTS)
        raise ValueError(f"alignment must be one of {choices}, not {alignment!r}; {SYNONYMS}")
    if up not in UP:
        raise ValueError(f"up must be one of {', '.join(UP)}, not {up!r}")


def best_yaw(matrix: Floats, up: str) -> Floats:
    """Return the rotation about the vertical axis that correlates best with a matrix (3, 3)."""
    k = "xyz".index(up[-1])
    i, j = (k + 1) % 3, (k + 2) % 3
    cosine, sine = matrix[i, i] + matrix[j, j], matrix[j, i] - matrix[i, j]
    length = np.hypot(cosine, sine)
    rotation = np.eye(3)
    if length > 0:
        rotation[i, i] = rotation[j, j] = cosine / length
        rotation[j, i] = sine / length
        rotation[i, j] = -rotation[j, i]
    return rotation


def _best_rotation(matrix: Floats) -> tuple[Floats, np.float64]:
    """Return the rotation that correlates best with a matrix (3, 3), and their correlation."""
    u, correlations, vt = np.linalg.svd(matrix)
    if correlations[1] <= LINE * correlations[0]:
        # The spin about the line is free: the smallest rotation, not a rounding error.
        u, vt = _line_frames(u[:, 0], vt[0])
    handedness = np.sign(np.linalg.det(u @ vt))
    u[:, 2] *= handedness
    correlations[2] *= handedness
    return u @ vt, correlations.sum()


def _line_frames(gt: Floats, est: Floats) -> tuple[Floats, Floats]:
    """Return frames, as columns and as rows, about two unit vectors with a common normal."""
    normal = np.cross(gt, est)
    if normal @ normal <= PARALLEL * PARALLEL:  # any normal
        normal = np.cross(gt, np.eye(3)[np.argmin(np.abs(gt))])
    normal /= np.sqrt(normal @ normal)
    columns, rows = (np.array([first, normal, np.cross(first, normal)]) for first in (gt, est))
    return columns.T, rows


def _centred(positions: Floats) -> tuple[Floats, Floats, np.float64]:
    """Return centred positions (3, n) in units of their extent, with centre and extent.

    Relative to the first position, coinciding ones are exactly 0.
    """
    positions = np.clip(positions, -FARTHEST_SUMMABLE, FARTHEST_SUMMABLE)
    local = np.ascontiguousarray((positions - positions[0]).T)  # rows are summed more precisely
    extent = np.abs(local).max() or np.float64(1)
    local /= extent
    mean = local.mean(axis=1)
    return local - mean[:, None], positions[0] + extent * mean, extent
