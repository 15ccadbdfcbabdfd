"""Single rotation averaging: the chordal, the geodesic L1 and the robust TLUD mean."""

from math import ceil, sin, sqrt

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .arrays import Floats
from .similarity import best_turn
from .validation import finite_rows

__all__ = [
    "angles_and_axes",
    "chordal_mean",
    "geodesic_l1_mean",
    "nearest_rotations",
    "project_to_rotation",
    "rotation_angles",
    "rotation_from_vector",
    "tlud_mean",
]


TLUD_THRESHOLD = 0.5  # chordal distance at which a deviation is truncated, about 20 degrees
TLUD_TOLERANCE = 1e-3  # radians; the refinement stops after a smaller step
WEISZFELD_STEPS = 10
COINCIDENT = 1e-15  # radians; rotations that differ by less are equal up to rounding
NEGLIGIBLE = 1e-12  # of a mean distance; rotations whose means differ by less are equally good
DISTANCES_AT_ONCE = 1 << 17  # 1 MiB, which fits in the cache
BATCH = 8  # smallest number of rotations that are compared with all others at once
SAMPLE = 128  # rotations from which the share of near pairs is estimated
SPARSE = 1 / 32  # share of near pairs below which a tree is faster than bounds
NEAR_PAIRS_AT_ONCE = 1 << 20  # 24 MiB
IDENTITY = np.eye(3)
# Their inner products with a rotation are twice the sine times the axis, and the trace.
ANTISYMMETRIC_PARTS_AND_TRACE = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ]
)


def project_to_rotation(matrices: Floats) -> Floats:
    """Return the rotations nearest to matrices (..., 3, 3) in the Frobenius norm."""
    u, _, vt = np.linalg.svd(matrices)
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    rotations: Floats = u @ vt
    return rotations


def nearest_rotations(matrices: ArrayLike) -> Floats:
    """Return the rotation nearest to each matrix, as of rotations rounded or multiplied in float32.

    Parameters
    ----------
    matrices : (n, 3, 3) array_like
        Matrices that are roughly rotations; a row that is not finite stays as it is.

    Returns
    -------
    (n, 3, 3) ndarray
        Their projections on SO(3), in float64.

    Raises
    ------
    ValueError
        Where the shape is another one.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import nearest_rotations
    >>> rotations = nearest_rotations(np.array([[[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]]))
    >>> np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-14)
    True
    """
    rotations = np.array(matrices, dtype=np.float64)
    if rotations.ndim != 3 or rotations.shape[1:] != (3, 3):
        raise ValueError(f"matrices must have shape (n, 3, 3), not {rotations.shape}")
    finite = finite_rows(rotations)
    rotations[finite] = project_to_rotation(rotations[finite])
    return rotations


def chordal_mean(rotations: Floats) -> Floats:
    """Return the rotation with the smallest sum of squared chordal distances to (n, 3, 3) others.

    It is the projection of their sum on SO(3) (Hartley et al., "Rotation Averaging", IJCV 2013,
    section 5).
    """
    return project_to_rotation(rotations.sum(axis=0))


def geodesic_l1_mean(
    rotations: Floats,
    start: Floats,
    *,
    max_steps: int = WEISZFELD_STEPS,
    tolerance: float = 0.0,
    axis: Floats | None = None,
) -> Floats:
    """Return the rotation that minimises the sum of angles to rotations (n, 3, 3): a median.

    Weiszfeld steps from the start, until one is shorter than the tolerance in radians (Hartley,
    Aftab and Trumpf, "L1 rotation averaging using the Weiszfeld algorithm", CVPR 2011). A rotation
    that the iterate coincides with has no direction to pull in. As in Vardi and Zhang ("The
    multivariate L1-median and associated data depth", PNAS 2000) it cancels the pull of one other,
    so that the iterate stays where an exact majority is. With an axis all steps are about it.
    """
    mean = start
    for _ in range(max_steps):
        angles, axes = angles_and_axes(rotations, mean)
        away = angles > COINCIDENT
        resting = len(angles) - np.count_nonzero(away)
        if resting:
            angles, axes = angles[away], axes[:, away]
        pull = axes.sum(axis=1)
        if axis is not None:
            pull = (axis @ pull) * axis
        strength = sqrt(pull @ pull)
        if strength <= resting:
            break
        step = (1 - resting / strength) / (1 / angles).sum() * pull
        mean = rotation_from_vector(step) @ mean
        if sqrt(step @ step) < tolerance:
            break
    return mean


def tlud_mean(rotations: Floats, up: str | None = None) -> Floats:
    """Return the robust average of rotations (n, 3, 3): truncated least unsquared deviations.

    The rotation with the smallest sum of truncated chordal distances to all others defines the
    inliers; their geodesic L1 mean is the average (section 4, step 1). Where a vertical axis is
    given, it is the best rotation about this axis for the same inliers. O(n) memory beyond a
    constant. The time grows like n^1.5 where many rotations agree. Where few do, a tree finds all
    pairs within the threshold, which takes most of the time. In between, where all errors are about
    20 degrees, the time grows like n^2.
    """
    flat = rotations.reshape(-1, 9)
    inlier = np.linalg.norm(flat - flat[_medoid(rotations)], axis=1) < TLUD_THRESHOLD
    inliers = rotations[inlier]
    if up is None:
        return geodesic_l1_mean(inliers, chordal_mean(inliers), tolerance=TLUD_TOLERANCE)
    start, axis = best_turn(inliers.sum(axis=0), up), np.eye(3)["xyz".index(up[-1])]
    return geodesic_l1_mean(inliers, start, tolerance=TLUD_TOLERANCE, axis=axis)


def _medoid(rotations: Floats) -> int:
    """Return the index of the rotation whose truncated distances to all have the smallest sum."""
    points = rotations.reshape(-1, 9)
    if len(points) ** 2 > DISTANCES_AT_ONCE:
        order = np.random.default_rng(0).permutation(len(points))  # failures may be periodic
        sample = points[order[:SAMPLE]]
        squared = scipy.spatial.distance.cdist(sample, sample, "sqeuclidean")
        share = float(np.mean(squared < TLUD_THRESHOLD**2))
        if share < SPARSE:
            return int(order[_medoid_by_tree(rotations[order], share)])
    return _medoid_by_bounds(points)


def _medoid_by_bounds(points: Floats) -> int:
    """Find the medoid where many agree: the sums of few points (n, 9) bound those of the others.

    Truncated distances obey the triangle inequality. With f_i the sum and d the truncated distance
    to i, f_j >= n d - f_i. Where d is not truncated, only the terms of points within two thresholds
    of i differ: if these are m, f_j >= f_i - m d. The points with the lowest bounds come first
    (Newling and Fleuret, "A sub-quadratic exact medoid algorithm", AISTATS 2017).
    """
    n = len(points)
    # Relative to the median, so that squared distances are differences of small numbers.
    points = points - np.partition(points, n // 2, axis=0)[n // 2]
    squares = np.einsum("ni,ni->n", points, points)
    size = max(BATCH, DISTANCES_AT_ONCE // n)
    best, best_sum = 0, np.inf
    bounds, left = np.zeros(n), np.arange(n)
    while left.size:
        if left.size > size:
            left = left[np.argpartition(bounds[left], size)]
        batch, left = left[:size], left[size:]
        squared = points[batch] @ (-2 * points.T)
        squared += squares
        squared += squares[batch, None]
        distances = np.sqrt(np.clip(squared, 0, TLUD_THRESHOLD**2))
        sums = distances.sum(axis=1)
        smallest = int(np.argmin(sums))
        if sums[smallest] < best_sum:
            best, best_sum = int(batch[smallest]), sums[smallest]
        if left.size:
            near = [np.count_nonzero(row < (2 * TLUD_THRESHOLD) ** 2) for row in squared]
            d, f, m = distances[:, left], sums[:, None], np.array(near)[:, None]
            bound = np.maximum(n * d - f, np.where(d < TLUD_THRESHOLD, f - m * d, 0)).max(axis=0)
            bounds[left] = np.maximum(bounds[left], bound)
            left = left[bounds[left] < best_sum - NEGLIGIBLE * n]
    return best


def _medoid_by_tree(rotations: Floats, share: float) -> int:
    """Find the medoid where few agree, from the near pairs alone: about that share of all pairs."""
    n = len(rotations)
    quaternions = scipy.spatial.transform.Rotation.from_matrix(rotations).as_quat()
    # The chordal distance is sqrt(8) sin(angle / 2); that of quaternions v = 2 sin(angle / 4).
    both_signs = scipy.spatial.KDTree(np.vstack([quaternions, -quaternions]))
    reach = sqrt(2 - 2 * sqrt(1 - TLUD_THRESHOLD**2 / 8))
    agreement = np.zeros(n)  # by how much each sum of distances is below n thresholds
    n_parts = ceil(share * n * n / NEAR_PAIRS_AT_ONCE)
    for i in range(n_parts):
        part = scipy.spatial.KDTree(quaternions[i::n_parts])
        pairs = part.sparse_distance_matrix(both_signs, reach, output_type="ndarray")
        v = pairs["v"]
        agreement[i::n_parts] = np.bincount(
            pairs["i"], TLUD_THRESHOLD - sqrt(8) * v * np.sqrt(1 - v * v / 4)
        )
    return int(np.argmax(agreement))


def rotation_angles(rotations: Floats) -> Floats:
    """Return the angles of rotations (n, 3, 3) in degrees, precise down to 0 and up to 180."""
    return np.degrees(angles_and_axes(rotations)[0])


def angles_and_axes(rotations: Floats, reference: Floats = IDENTITY) -> tuple[Floats, Floats]:
    """Return angles (n,) and unit axes (3, n) of ``rotations @ reference.T``: the logarithms.

    The angles, from 0 to pi, come from sine and cosine together, which is precise at both ends. The
    axis is zero at the angles 0 and pi, where there is none or no single one.
    """
    parts = (ANTISYMMETRIC_PARTS_AND_TRACE @ reference).reshape(4, 9) @ rotations.reshape(-1, 9).T
    axes = parts[:3]
    sine = np.sqrt(np.einsum("in,in->n", axes, axes))  # twice the sine
    angles = np.arctan2(sine, parts[3] - 1)  # trace - 1 is twice the cosine
    return angles, np.divide(axes, sine, out=axes, where=sine > 0)


def rotation_from_vector(vector: Floats) -> Floats:
    """Return the rotation about a vector (3,) by its length in radians: Rodrigues' formula."""
    angle = sqrt(vector @ vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = (vector / angle).tolist()
    s, c = sin(angle), 2 * sin(angle / 2) ** 2
    return np.array(
        [
            [1 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y],
            [c * x * y + s * z, 1 - c * (x * x + z * z), c * y * z - s * x],
            [c * x * z - s * y, c * y * z + s * x, 1 - c * (x * x + y * y)],
        ]
    )
