"""The paper's scores in NumPy and SciPy, step by step: to read with the paper in hand.

Lee and Civera, "Alignment Scores: Robust Metrics for Multiview Pose Accuracy Evaluation". The names
are the paper's: c are camera centres, R camera-to-world rotations of the ground truth, c_est and
R_est those of the estimate, row i the same camera; a row of NaN was not estimated. The functions of
the same names in `alignscores` are the fast ones, with checks and options. Here memory grows with
the square of the number of cameras n, and input is not checked. Scores come first, then what they
call: PCR-99, the average of rotations, and at the end what the paper leaves open.
"""

from itertools import combinations
from math import ceil, comb
from typing import Any

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from .arrays import Booleans, Floats, Indices
from .registration import Seed
from .similarity import Similarity

__all__ = ["literal_frames", "pas", "pcr99", "ras", "tas"]


def tas(c: Floats, c_est: Floats, rng: Seed = 0) -> float:
    """Return the Translation Alignment Score, TAS.

    Parameters
    ----------
    c : (n, 3) ndarray
        Camera centres of the ground truth, in any unit; n >= 4.
    c_est : (n, 3) ndarray
        Estimated centres in their own frame and scale.
    rng : int, SeedSequence, Generator or None
        Seed of the random triplets.

    Returns
    -------
    float
        TAS, from 0 to 1.

    References
    ----------
    Section 3, eq. 1 to 3.

    Examples
    --------
    >>> import numpy as np
    >>> import alignscores
    >>> from alignscores import paper
    >>> c = np.random.default_rng(0).random((100, 3))
    >>> c_est = c + np.random.default_rng(1).normal(scale=0.03, size=c.shape)
    >>> paper.tas(c, c_est, rng=7) == alignscores.tas(c, c_est, rng=7).score
    True
    """
    n, estimated = len(c), np.isfinite(c_est).all(axis=1)
    # Step 1, eq. 1: d is the upper quartile Q3 of the distances to the closest other camera.
    closest = KDTree(c).query(c, k=2)[0][:, 1]
    d = np.sort(closest)[ceil(3 * n / 4) - 1]
    # Step 2: PCR-99 without an inlier threshold: the cost is the m-th smallest error (eq. 2).
    m = max(4, (n + 5) // 10)  # round(n / 10), halves up; the option `order` of the study is m / n
    a, b = c[estimated], c_est[estimated]
    rng = np.random.default_rng(rng)
    alignment, _ = pcr99(a, b, rank=min(m, len(a)), rng=rng)
    # Step 3: the distance errors, and f_k, how many are below 0.01 d, 0.02 d, ..., d (not equal).
    e = np.full(n, np.inf)
    if alignment is not None:
        s, R, t = alignment.scale, alignment.rotation, alignment.translation
        e[estimated] = np.linalg.norm((b - t) / s - a @ R.T, axis=1)
    f = [np.count_nonzero(e < k / 100 * d) for k in range(1, 101)]
    # Step 4, eq. 3.
    return float(sum(f) / (100 * n))


def ras(R: Floats, R_est: Floats) -> float:
    """Return the Rotation Alignment Score, RAS.

    Parameters
    ----------
    R : (n, 3, 3) ndarray
        Camera-to-world rotations of the ground truth.
    R_est : (n, 3, 3) ndarray
        Estimated ones, to their own world frame.

    Returns
    -------
    float
        RAS, from 0 to 1.

    References
    ----------
    Section 4, eq. 4.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import paper
    >>> R = Rotation.from_euler("z", [[0], [40], [80], [120]], degrees=True)
    >>> R_est = Rotation.from_euler("x", [[5], [5], [5], [90]], degrees=True) * R
    >>> paper.ras(R.as_matrix(), R_est.as_matrix())
    0.75
    """
    n, estimated = len(R), np.isfinite(R_est).all(axis=(1, 2))
    e = np.full(n, np.inf)
    if estimated.any():
        R, R_est = R[estimated], R_est[estimated]
        # Step 1: the rotation between the frames is the robust average of R_est_i R_i^T.
        Q = average(R_est @ R.swapaxes(1, 2))
        # Step 2: the angular errors, and f_k, how many are below 0.1, 0.2, ..., 10 degrees.
        e[estimated] = np.degrees(Rotation.from_matrix((Q @ R).swapaxes(1, 2) @ R_est).magnitude())
    f = [np.count_nonzero(e < k / 10) for k in range(1, 101)]
    # Step 3, eq. 4.
    return float(sum(f) / (100 * n))


def pas(
    R: Floats, c: Floats, R_est: Floats, c_est: Floats, rng: Seed = 0, *, alpha: float = 0.5
) -> float:
    """Return the Pose Alignment Score, PAS: the weighted mean of TAS and RAS.

    Parameters
    ----------
    R, c, R_est, c_est : ndarray
        See `ras` and `tas`.
    rng : int, SeedSequence, Generator or None
        See `tas`.
    alpha : float
        Weight of the TAS; `weight` in `alignscores.pas` and in the study.

    Returns
    -------
    float
        PAS, from 0 to 1.

    References
    ----------
    Section 5, eq. 5; the weight is from section 8.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import paper
    >>> c, R = np.random.default_rng(0).random((10, 3)), np.tile(np.eye(3), (10, 1, 1))
    >>> R_est = R.copy()
    >>> R_est[:5] = np.nan
    >>> paper.pas(R, c, R_est, 2 * c), paper.pas(R, c, R_est, 2 * c, alpha=0.9)
    (0.75, 0.95)
    """
    return alpha * tas(c, c_est, rng) + (1 - alpha) * ras(R, R_est)


# --- Section 3, step 2: PCR-99 --------------------------------------------------------------------


def pcr99(
    c: Floats,
    c_est: Floats,
    /,
    *,
    rank: int,
    rng: np.random.Generator,
    n_hypotheses: int = 1000,
    prescreen: float = 0.1,
    literal: bool = False,
    **_: Any,
) -> tuple[Similarity | None, int]:
    """Return s, R, t with c_est = s R c + t by PCR-99, and the number of hypotheses.

    Lee, Civera and Vandewalle, "PCR-99: A Practical Method for Point Cloud Registration with 99
    Percent Outliers", arXiv 2402.16598, with random triplets and eq. 2 as the cost.

    Parameters
    ----------
    c, c_est : (n, 3) ndarray
        Finite camera centres of ground truth and estimate.
    rank : int
        m of the paper: the m-th smallest error is the cost of a hypothesis.
    rng : Generator
        Source of the random triplets.
    n_hypotheses : int
        Number of triplets that are tried.
    prescreen : float
        Largest difference between the log edge ratios of a triplet.
    literal : bool
        How three cameras on a line are registered; see `literal_frames`.
    **_ : object
        What else a `Registration` is given.

    Returns
    -------
    alignment : Similarity or None
        s, R and t; None if no triplet passes the prescreening.
    n_used : int
        Number of hypotheses.

    References
    ----------
    Section 3, step 2, eq. 2.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import paper
    >>> c = np.random.default_rng(0).random((30, 3))
    >>> alignment, n_used = paper.pcr99(c, 2 * c, rank=4, rng=np.random.default_rng(1))
    >>> round(alignment.scale, 6), n_used
    (2.0, 1000)
    """
    with np.errstate(all="ignore"):  # NaN and infinity never win
        # Steps 2a, 2b: random triplets; the first 1000 that pass the prescreening count.
        triplets = prescreened_triplets(c, c_est, n_hypotheses, prescreen, rng)
        if triplets.size == 0:
            return None, 0
        a, b = c.T.take(triplets, axis=1), c_est.T.take(triplets, axis=1)
        flat = np.zeros(a.shape[2], dtype=bool) if literal else is_flat(a) | is_flat(b)
        s, R, t = similarities(a, b, flat)
        # Step 2c: the errors (c_est - t) / s - R c of all hypotheses h and cameras, in one product
        # of [I / s, -R, -t / s] and [c_est, c, 1]; the hypothesis with the smallest m-th error.
        factors = np.dstack([np.eye(3) / s[:, None, None], -R, -t[:, :, None] / s[:, None, None]])
        points = np.vstack([c_est.T, c.T, np.ones(len(c))])
        residuals = (factors.reshape(-1, 7) @ points).reshape(len(s), 3, -1)
        squares = np.einsum("hin,hin->hn", residuals, residuals)
        cost = np.partition(squares, rank - 1, axis=1)[:, rank - 1]
        best = cheapest(cost, flat, c)
    return Similarity(float(s[best]), R[best], t[best]), len(s)


def prescreened_triplets(
    c: Floats, c_est: Floats, n_wanted: int, prescreen: float, rng: np.random.Generator
) -> Indices:
    """Return triplets (3, H) whose log ratios of edges differ pairwise by at most a threshold.

    Where no more triplets exist than are wanted, all that pass, each with its three first edges;
    otherwise random ones, as many as are wanted or found in 1000 draws for each.
    """
    n = len(c)
    with np.errstate(all="ignore"):
        rho = np.log(cdist(c_est, c_est) / cdist(c, c))
    rho[~np.isfinite(rho)] = np.nan  # coincident cameras never pass, nor does a camera drawn twice

    def passes(triplets: Indices) -> Booleans:
        i, j, k = triplets
        ratios = rho[i, j], rho[i, k], rho[j, k]
        spread = np.maximum.reduce(ratios) - np.minimum.reduce(ratios)
        return np.asarray(spread <= prescreen)

    if comb(n, 3) <= n_wanted:
        i, j, k = np.array(list(combinations(range(n), 3)), dtype=np.intp).reshape(-1, 3).T
        triplets = np.hstack([(i, j, k), (j, k, i), (k, i, j)])
        return triplets[:, passes(triplets)]
    passing: Indices = np.empty((3, 0), dtype=np.intp)
    n_drawn, batch = 0, 2 * n_wanted
    while passing.shape[1] < n_wanted and n_drawn < 1000 * n_wanted:
        triplets = rng.integers(n, size=(3, batch))
        passing = np.hstack([passing, triplets[:, passes(triplets)]])
        n_drawn += batch
        missing = n_wanted - passing.shape[1]
        batch = min(1 << 16, 64 + int(1.1 * missing * n_drawn / max(1, passing.shape[1])))
    return passing[:, :n_wanted]


def similarities(a: Floats, b: Floats, flat: Booleans) -> tuple[Floats, Floats, Floats]:
    """Return s, R, t from triangles a to b (3 coordinates, 3 corners, H).

    R takes the axes of a to those of b; s and t fit best in the sense of least squares.
    """
    A, B = axes(a), axes(b)
    R = (B[:, :, None] * A[:, None]).sum(axis=0)  # (3, 3, H)
    R[:, :, flat] = smallest_rotation(A[0, :, flat], B[0, :, flat])
    a_mean, b_mean = a.mean(axis=1), b.mean(axis=1)
    turned = np.einsum("ijh,jkh->ikh", R, a - a_mean[:, None])
    s = ((b - b_mean[:, None]) * turned).sum(axis=(0, 1)) / np.square(turned).sum(axis=(0, 1))
    t = b_mean - s * np.einsum("ijh,jh->ih", R, a_mean)
    return s, np.moveaxis(R, 2, 0), t.T


def axes(corners: Floats) -> Floats:
    """Return the axes (3, 3 coordinates, H) of triangles (3 coordinates, 3 corners, H).

    They are along the first edge, along the normal, and normal to both.
    """
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    first = edge_1 / np.linalg.norm(edge_1, axis=0)
    normal = np.cross(first, edge_2, axis=0)
    second = normal / np.linalg.norm(normal, axis=0)
    return np.stack([first, second, np.cross(first, second, axis=0)])


# --- Section 4, step 1: the average of rotations --------------------------------------------------


def average(S: Floats) -> Floats:
    """Return the robust average of rotations (n, 3, 3): truncated least unsquared deviations.

    Lee and Civera, "Robust Single Rotation Averaging Revisited", arXiv 2309.05388.
    """
    rows = S.reshape(-1, 9)
    cost = np.minimum(cdist(rows, rows), 0.5).sum(axis=1)  # of truncated chordal distances
    inliers = S[np.linalg.norm(rows - rows[np.argmin(cost)], axis=1) < 0.5]
    Q = Rotation.from_matrix(inliers.sum(axis=0))  # the chordal mean: projected on SO(3)
    for _ in range(10):  # Weiszfeld steps to the geodesic L1 mean
        v = (Rotation.from_matrix(inliers) * Q.inv()).as_rotvec()
        angle = np.linalg.norm(v, axis=1)
        away = angle > 1e-15
        pull = (v[away] / angle[away, None]).sum(axis=0)
        resting, strength = np.count_nonzero(~away), np.linalg.norm(pull)
        if strength <= resting:  # the mean is one of the rotations
            break
        step = (1 - resting / strength) * pull / (1 / angle[away]).sum()
        Q = Rotation.from_rotvec(step) * Q
        if np.linalg.norm(step) < 0.001:  # radians
            break
    return np.asarray(Q.as_matrix())


# --- What the paper leaves open: three cameras on a line ------------------------------------------
#
# They have no normal. R is then the smallest rotation from line to line, and such a hypothesis must
# be cheaper than all others by more than rounding.

FLAT = 1e-6  # largest sine of the first angle of a triangle without a normal
MARGIN = 64 * np.finfo(np.float64).eps  # rounding of squared errors, as a share of the largest c^2


def is_flat(corners: Floats) -> Booleans:
    """Return which triangles (3 coordinates, 3 corners, H) have no normal."""
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(edge_1 / np.linalg.norm(edge_1, axis=0), edge_2, axis=0)
    sine = np.linalg.norm(normal, axis=0) / np.linalg.norm(edge_2, axis=0)
    return np.asarray(sine <= FLAT)


def smallest_rotation(a: Floats, b: Floats) -> Floats:
    """Return the smallest rotations (3, 3, H) from unit vectors a to unit vectors b (H, 3).

    These are two reflections: I - 2 a a^T, then I - 2 h h^T with h halfway between a and b.
    """
    other = np.cross(a, np.eye(3)[np.argmin(np.abs(a), axis=1)])  # of opposite ones any normal
    h = np.where(np.linalg.norm(a + b, axis=1)[:, None] > FLAT, a + b, other)
    h = h / np.linalg.norm(h, axis=1)[:, None]
    first, second = (np.eye(3) - 2 * v[:, :, None] * v[:, None] for v in (a, h))
    return np.moveaxis(second @ first, 0, 2)


def cheapest(cost: Floats, flat: Booleans, c: Floats) -> int:
    """Return the cheapest hypothesis; a flat triangle must win by more than rounding."""
    rounding = MARGIN * np.square(c - np.median(c, axis=0)).sum(axis=1).max()
    return int(np.lexsort([flat, cost + flat * rounding])[0])


def literal_frames(*positions: Floats, **settings: Any) -> tuple[Similarity | None, int]:
    """Register by PCR-99 with literal frames; for ``alignscores.tas(..., registration=)``.

    Three cameras on a line have no normal. This takes the one that is computed all the same, a
    rounding error scaled to unit length, as the authors' programs do: R is in general no rotation.

    Parameters
    ----------
    *positions : (n, 3) ndarray
        Finite camera centres of ground truth and estimate.
    **settings : object
        See `pcr99`.

    Returns
    -------
    tuple of Similarity or None, and int
        See `pcr99`.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import paper, tas
    >>> line = np.arange(30)[:, None] * [1.0, 2.0, 3.0]
    >>> tas(line, 2 * line, registration=paper.literal_frames).registration
    'literal_frames'
    """
    return pcr99(*positions, literal=True, **settings)
