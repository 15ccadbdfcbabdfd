"""Single rotation averaging: the geodesic L1 and the robust TLUD mean."""

from math import sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .medoid import TLUD_THRESHOLD, medoid
from .similarity import best_yaw
from .validation import finite_rows

__all__ = [
    "angles_and_axes",
    "dots",
    "geodesic_l1_means",
    "nearest_rotations",
    "project_to_rotation",
    "quaternions_from_rotations",
    "rotation_angles",
    "rotation_from_vector",
    "rotations_from_quaternions",
    "tlud_mean",
    "yaw_mean",
]


N_YAWS = 360  # about the vertical axis, among which inliers are looked for
TLUD_TOLERANCE = 1e-3  # radians; the refinement stops after a smaller step
WEISZFELD_STEPS = 10
COINCIDENT = 1e-15  # radians; rotations that differ by less are equal up to rounding
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
        If the shape is another one.

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


def geodesic_l1_means(
    rotations: Floats, starts: Floats, *, tolerance: float = 0.0, axis: Floats | None = None
) -> Floats:
    """Return the rotations with the smallest sums of angles to stacks (G, n, 3, 3): medians.

    Weiszfeld steps from the starts, until one is shorter than the tolerance in radians (Hartley,
    Aftab and Trumpf, "L1 rotation averaging using the Weiszfeld algorithm", CVPR 2011). A rotation
    that the iterate coincides with has no direction to pull in. As in Vardi and Zhang ("The
    multivariate L1-median and associated data depth", PNAS 2000) it cancels the pull of one other,
    so that the iterate stays where an exact majority is. With an axis all steps are about it.
    """
    means, moving = starts.copy(), np.arange(len(starts))
    for _ in range(WEISZFELD_STEPS):
        stacks = rotations if len(moving) == len(rotations) else rotations[moving]
        angles, axes = angles_and_axes(stacks, means[moving])
        away = angles > COINCIDENT
        resting = angles.shape[1] - away.sum(axis=1)  # faster than count_nonzero
        pull, slowness = axes.sum(axis=2), (1 / np.where(away, angles, 1.0)).sum(axis=1)
        for row in np.flatnonzero(resting).tolist():
            moved = away[row]
            pull[row], slowness[row] = (
                axes[row][:, moved].sum(axis=1),
                (1 / angles[row, moved]).sum(),
            )
        if axis is not None:
            pull = dots(pull, np.broadcast_to(axis, pull.shape))[:, None] * axis
        strength = np.sqrt(dots(pull, pull))
        going = strength > resting
        if not going.any():
            break
        moving, pull = moving[going], pull[going]
        steps = ((1 - resting[going] / strength[going]) / slowness[going])[:, None] * pull
        turns = np.array([rotation_from_vector(step) for step in steps])
        means[moving] = turns @ means[moving]
        moving = moving[np.sqrt(dots(steps, steps)) >= tolerance]
        if not moving.size:
            break
    return means


def dots(a: Floats, b: Floats) -> Floats:
    """Return the scalar products of rows (G, 3)."""
    return np.asarray((a[:, None] @ b[:, :, None])[:, 0, 0])


def tlud_mean(rotations: Floats) -> Floats:
    """Return the robust average of rotations (n, 3, 3): truncated least unsquared deviations.

    The rotation with the smallest sum of truncated chordal distances to all others defines the
    inliers; their geodesic L1 mean is the average (section 4, step 1). O(n) memory beyond a
    constant. The time grows little more than n where many rotations agree. Where few do, or all
    errors are about 20 degrees, it grows like n^2.

    Lee and Civera, "Robust Single Rotation Averaging Revisited", arXiv 2309.05388.
    """
    points = rotations.reshape(-1, 9)
    offsets = points - points[medoid(rotations)]
    inliers = rotations[np.sqrt((offsets * offsets).sum(axis=1)) < TLUD_THRESHOLD]
    chordal = project_to_rotation(inliers.sum(axis=0))
    means = geodesic_l1_means(inliers[None], chordal[None], tolerance=TLUD_TOLERANCE)
    return np.asarray(means[0])


def yaw_mean(rotations: Floats, up: str) -> Floats:
    """Return the robust average of rotations (n, 3, 3) among those about the vertical axis.

    As `tlud_mean`, but for the first step: of equally spaced turns that with the smallest sum of
    truncated chordal distances defines the inliers; all are, where none is near any turn.
    """
    k = "xyz".index(up[-1])
    i, j = (k + 1) % 3, (k + 2) % 3
    cosine = rotations[:, i, i] + rotations[:, j, j]
    sine = rotations[:, j, i] - rotations[:, i, j]
    angles = np.arange(N_YAWS) * (2 * np.pi / N_YAWS)

    def distances(angle: float) -> Floats:
        traces = np.cos(angle) * cosine + np.sin(angle) * sine + rotations[:, k, k]
        return np.asarray(np.sqrt(np.maximum(6 - 2 * traces, 0.0)))

    sums = [np.minimum(distances(angle), TLUD_THRESHOLD).sum() for angle in angles.tolist()]
    inlier = distances(float(angles[np.argmin(sums)])) < TLUD_THRESHOLD
    inliers = rotations[inlier] if inlier.any() else rotations
    starts, axis = best_yaw(inliers.sum(axis=0), up)[None], np.eye(3)[k]
    means = geodesic_l1_means(inliers[None], starts, tolerance=TLUD_TOLERANCE, axis=axis)
    return np.asarray(means[0])


def rotation_angles(rotations: Floats) -> Floats:
    """Return the angles of rotations (..., n, 3, 3) in degrees, precise at both ends."""
    return np.degrees(angles_and_axes(rotations)[0])


def angles_and_axes(rotations: Floats, reference: Floats = IDENTITY) -> tuple[Floats, Floats]:
    """Return angles (n,) and unit axes (3, n) of ``rotations @ reference.T``: the logarithms.

    The angles, from 0 to pi, come from sine and cosine together, which is precise at both ends. The
    axis is zero at the angles 0 and pi, where there is none or no single one. Of stacks of
    rotations (G, n, 3, 3), with a reference (G, 3, 3) each, they are (G, n) and (G, 3, n).
    """
    products = ANTISYMMETRIC_PARTS_AND_TRACE @ reference[..., None, :, :]
    flat = rotations.reshape(*rotations.shape[:-2], 9)
    parts = products.reshape(*reference.shape[:-2], 4, 9) @ flat.swapaxes(-1, -2)
    axes = parts[..., :3, :]
    sine = np.sqrt(np.einsum("...in,...in->...n", axes, axes))  # twice the sine
    angles = np.arctan2(sine, parts[..., 3, :] - 1)  # trace - 1 is twice the cosine
    sine = sine[..., None, :]
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


def rotations_from_quaternions(quaternions: Floats) -> Floats:
    """Return the rotations (n, 3, 3) of unit quaternions (n, 4), w last."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def quaternions_from_rotations(rotations: Floats) -> Floats:
    """Return the unit quaternions (n, 4) of rotations (n, 3, 3), w last.

    Sums and differences of the elements of a rotation are 4 q qᵀ; its largest column is divided by
    its length.
    """
    # SciPy's `Rotation` takes longer to import than the command takes to score two files.
    products = np.empty((len(rotations), 4, 4))
    products[:, :3, :3] = rotations + rotations.swapaxes(1, 2)
    traces = np.trace(rotations, axis1=1, axis2=2)
    diagonal = np.arange(3)
    products[:, diagonal, diagonal] += (1 - traces)[:, None]
    differences = rotations - rotations.swapaxes(1, 2)
    products[:, :3, 3] = products[:, 3, :3] = differences[:, [2, 0, 1], [1, 2, 0]]
    products[:, 3, 3] = 1 + traces
    largest = np.einsum("nii->ni", products).argmax(axis=1)
    quaternions = products[np.arange(len(rotations)), largest]
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True))
