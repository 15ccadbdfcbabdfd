"""Single rotation averaging: the chordal, the geodesic L1 and the robust TLUD mean."""

from math import sin, sqrt

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "angles_and_axes",
    "chordal_mean",
    "geodesic_l1_mean",
    "project_to_rotation",
    "rotation_angles",
    "rotation_from_vector",
    "tlud_mean",
]

Floats = NDArray[np.float64]

TLUD_THRESHOLD = 0.5  # chordal distance at which a deviation is truncated, about 20 degrees
TLUD_TOLERANCE = 1e-3  # radians; the refinement stops below such a step
WEISZFELD_STEPS = 10
COINCIDENT = 1e-15  # radians; rotations that differ by less are equal up to rounding
CHUNK = 1 << 21  # pairwise distances held at once: 16 MiB
# Their inner products with a rotation are sine times axis (times 2) and trace.
ANTISYMMETRIC_PARTS_AND_TRACE = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ]
)


def project_to_rotation(matrix: Floats) -> Floats:
    """Return the rotation nearest to a matrix in the Frobenius norm.

    Parameters
    ----------
    matrix : (3, 3) array
        Any matrix.

    Returns
    -------
    (3, 3) ndarray
        The projection on SO(3).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.averaging import project_to_rotation
    >>> np.allclose(project_to_rotation(3 * np.eye(3)), np.eye(3))
    True
    """
    u, _, vt = np.linalg.svd(matrix)
    sign = np.array([1.0, 1.0, np.linalg.det(u @ vt)])
    rotation: Floats = (u * sign) @ vt
    return rotation


def chordal_mean(rotations: Floats) -> Floats:
    """Return the rotation that minimises the sum of squared chordal distances.

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations.

    Returns
    -------
    (3, 3) ndarray
        The projection of their sum on SO(3).

    References
    ----------
    Hartley et al., "Rotation Averaging", IJCV 2013, section 5.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.averaging import chordal_mean
    >>> turns = Rotation.from_euler("z", [[10], [20], [30]], degrees=True).as_matrix()
    >>> Rotation.from_matrix(chordal_mean(turns)).as_euler("xyz", degrees=True).round(6)
    array([ 0.,  0., 20.])
    """
    return project_to_rotation(rotations.sum(axis=0))


def geodesic_l1_mean(
    rotations: Floats, start: Floats, *, max_steps: int = WEISZFELD_STEPS, tolerance: float = 0.0
) -> Floats:
    """Return the rotation that minimises the sum of angles to the given ones (a median).

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations.
    start : (3, 3) array
        Rotation to start from.
    max_steps : int
        Largest number of Weiszfeld steps.
    tolerance : float
        Stop after a step of less than so many radians.

    Returns
    -------
    (3, 3) ndarray
        The last iterate.

    Notes
    -----
    Rotations that the iterate coincides with have no direction: each holds it against the pull of
    one other, as in the reference. So an exact majority is the result, not a source of jumps.

    References
    ----------
    Hartley, Aftab and Trumpf, "L1 rotation averaging using the Weiszfeld algorithm", CVPR 2011.
    Vardi and Zhang, "The multivariate L1-median and associated data depth", PNAS 2000, for the
    coincidence.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.averaging import chordal_mean, geodesic_l1_mean
    >>> turns = Rotation.from_euler("z", [[10], [10.5], [11], [150]], degrees=True).as_matrix()
    >>> mean = geodesic_l1_mean(turns, chordal_mean(turns), max_steps=100)
    >>> bool(10.4 < Rotation.from_matrix(mean).as_euler("xyz", degrees=True)[2] < 11.1)
    True
    """
    mean = start
    for _ in range(max_steps):
        angles, axes = angles_and_axes(rotations, mean)
        away = angles > COINCIDENT
        resting = len(angles) - np.count_nonzero(away)
        if resting:
            angles, axes = angles[away], axes[:, away]
        pull = axes.sum(axis=1)
        strength = sqrt(pull @ pull)
        if strength <= resting:
            break
        step = (1 - resting / strength) / (1 / angles).sum() * pull
        mean = rotation_from_vector(step) @ mean
        if sqrt(step @ step) < tolerance:
            break
    return mean


def tlud_mean(rotations: Floats) -> Floats:
    """Return the robust average of rotations: truncated least unsquared deviations.

    The rotation with the smallest sum of truncated chordal distances to all others tells the
    inliers; their geodesic L1 mean is the result.

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations, most of which may be outliers.

    Returns
    -------
    (3, 3) ndarray
        The average.

    Notes
    -----
    O(n^2) time, O(n) memory beyond a constant.

    References
    ----------
    Lee and Civera, "Alignment Scores", section 4, step 1.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.averaging import tlud_mean
    >>> turns = Rotation.from_euler(
    ...     "z", [[9], [10], [11], [80], [160], [240]], degrees=True
    ... ).as_matrix()
    >>> Rotation.from_matrix(tlud_mean(turns)).as_euler("xyz", degrees=True).round(2)
    array([ 0.,  0., 10.])
    """
    flat = rotations.reshape(-1, 9)
    rows = max(1, CHUNK // len(flat))
    cost = np.concatenate(
        [
            np.minimum(_chordal_distances(flat[i : i + rows], flat), TLUD_THRESHOLD).sum(axis=1)
            for i in range(0, len(flat), rows)
        ]
    )
    best = int(np.argmin(cost))
    inliers = rotations[_chordal_distances(flat[best : best + 1], flat)[0] < TLUD_THRESHOLD]
    return geodesic_l1_mean(inliers, chordal_mean(inliers), tolerance=TLUD_TOLERANCE)


def rotation_angles(rotations: Floats) -> Floats:
    """Return the angles of rotations in degrees, precise down to 0 and up to 180.

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations.

    Returns
    -------
    (n,) ndarray
        Angles in degrees, from 0 to 180.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores.averaging import rotation_angles
    >>> turns = Rotation.from_euler("y", [[0], [1e-9], [180]], degrees=True).as_matrix()
    >>> rotation_angles(turns)
    array([0.e+00, 1.e-09, 1.8e+02])
    """
    return np.degrees(angles_and_axes(rotations)[0])


def angles_and_axes(rotations: Floats, reference: Floats = np.eye(3)) -> tuple[Floats, Floats]:
    """Return the angles and axes of ``rotations @ reference.T``: the log maps ``angles * axes``.

    Parameters
    ----------
    rotations : (n, 3, 3) array
        Rotations.
    reference : (3, 3) array
        Rotation that they are seen from, by default the identity.

    Returns
    -------
    angles : (n,) ndarray
        Angles in radians, from 0 to pi. They come from sine and cosine together, which is precise
        at both ends and needs no clipping.
    axes : (3, n) ndarray
        Unit axes, component first; zero at the angles 0 and pi, where there is none or no single
        one.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.averaging import angles_and_axes
    >>> quarter_turn = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    >>> angles, axes = angles_and_axes(quarter_turn)
    >>> angles / np.pi, axes.T
    (array([0.5]), array([[0., 0., 1.]]))
    """
    parts = (ANTISYMMETRIC_PARTS_AND_TRACE @ reference).reshape(4, 9) @ rotations.reshape(-1, 9).T
    axes = parts[:3]
    sine = np.sqrt(np.einsum("in,in->n", axes, axes))  # twice the sine, as of the cosine
    angles = np.arctan2(sine, parts[3] - 1)
    return angles, np.divide(axes, sine, out=axes, where=sine > 0)


def rotation_from_vector(vector: Floats) -> Floats:
    """Return the rotation about a vector by its length in radians: the exponential map.

    Parameters
    ----------
    vector : (3,) array
        Axis times angle.

    Returns
    -------
    (3, 3) ndarray
        The rotation (Rodrigues' formula).

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.averaging import rotation_from_vector
    >>> rotation_from_vector(np.array([0.0, 0.0, np.pi / 2])).round(12)
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
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


def _chordal_distances(a: Floats, b: Floats) -> Floats:
    """Frobenius distances (h, n) between rotations stored as rows of 9 numbers."""
    squared: Floats = 6.0 - 2.0 * (a @ b.T)
    return np.sqrt(np.maximum(squared, 0.0, out=squared), out=squared)
