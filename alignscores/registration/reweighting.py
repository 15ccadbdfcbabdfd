"""The steps of the refined registration: truncated costs and reweighted least-squares fits.

The definition in NumPy; ``kernel.c`` computes the same, to the last bit, where it was compiled. So
every sum has a fixed order, and singular values come from a fixed number of Jacobi rotations
instead of a library's.

Points are stored component first, ``(3, n)``; similarities, from ground truth to estimate, as rows
``(H, 13)``: scale, rotation, translation.
"""

import numpy as np

from ..arrays import Floats
from ..similarity import LINE, SMALLEST, common_normal, dot
from .hypotheses import chunks, complete_frames, squared_errors, turns

__all__ = ["lane_sums", "refine", "truncated_costs", "weighted_fits"]


LANES = 8  # partial sums, so that a processor can add as many numbers at once
SWEEPS = 4  # of Jacobi rotations; after them the columns of a 3 x 3 matrix are orthogonal


def truncated_costs(
    gt: Floats, est: Floats, similarities: Floats, threshold: float, resolution: float
) -> Floats:
    """Return ``sum(min(sqrt(e^2 + r^2), T))`` over the cameras for each similarity.

    T is the threshold, r the resolution: smaller differences between errors do not count. An error
    that is not a number counts T. ``docs/explanation/registration.md`` derives cost and steps.
    """
    errors = (
        _smoothed_errors(gt, est, chunk, resolution) for chunk in chunks(similarities, gt.shape[1])
    )
    return np.concatenate([lane_sums(np.where(e < threshold, e, threshold)) for e in errors])


def refine(
    gt: Floats,
    est: Floats,
    similarities: Floats,
    threshold: float,
    resolution: float,
    n_left: int,
    least_gain: float,
    alignment: str = "similarity",
) -> Floats:
    """Refine by iteratively reweighted least squares; after each step drop the more expensive half.

    ``n_left`` are never dropped, and are returned, the cheapest first, once no step gains more than
    ``least_gain``. In exact arithmetic no step raises a cost where the cameras within the threshold
    determine the fit; a step that does is not taken.
    """
    costs = truncated_costs(gt, est, similarities, threshold, resolution)
    gains = np.full(len(costs), np.inf)
    while len(costs) > n_left or np.any(gains > least_gain):
        steps, step_costs = _reweighted_fits(
            gt, est, similarities, threshold, resolution, alignment
        )
        gains = costs - step_costs
        better = gains > 0
        similarities = np.where(better[:, None], steps, similarities)
        costs = np.where(better, step_costs, costs)
        kept = np.argsort(costs, kind="stable")[: max(n_left, len(costs) // 2)]
        similarities, costs, gains = similarities[kept], costs[kept], gains[kept]
    return similarities


def weighted_fits(
    gt: Floats, est: Floats, weights: Floats, alignment: str = "similarity"
) -> Floats:
    """Return least-squares alignments, one for each row of weights (H, n).

    The rotation correlates best with the weighted cross-covariance of the two clouds; scale and
    translation follow, so that the errors in the ground truth are smallest (Umeyama,
    "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991).
    Where the weighted cameras lie on a line, its spin is that of the smallest rotation. A
    similarity is not a number, or of no positive scale, where none is the best. "rigid" has the
    same rotation and the scale 1, "yaw" the best rotation about the third axis; where all rotations
    are equally good, theirs is the identity.
    """
    total = np.maximum(lane_sums(weights), SMALLEST)
    gt_means, est_means = (
        np.array([lane_sums(weights * component) for component in points]) / total
        for points in (gt, est)
    )
    gt_local, est_local = (
        points[:, None] - means[:, :, None] for points, means in ((gt, gt_means), (est, est_means))
    )
    covariance = np.array([[lane_sums(weights * b * a) for a in gt_local] for b in est_local])
    spread = lane_sums(weights * dot(est_local, est_local))

    largest = np.fmax.reduce(np.abs(covariance), axis=(0, 1), initial=0.0)
    with np.errstate(all="ignore"):  # where no fit is the best, it is not a number
        covariance = covariance / largest
        if alignment == "yaw":
            cosine, sine = covariance[0, 0] + covariance[1, 1], covariance[1, 0] - covariance[0, 1]
            rotation = turns(cosine, sine, 0)
        else:
            rotation = _best_rotations(covariance)
        if alignment == "similarity":
            correlation = dot(*(m.swapaxes(0, 1) for m in (rotation, covariance))).sum(axis=0)
            scale = spread / (correlation * largest)
        else:
            scale = np.ones_like(spread)
            rotation[:, :, largest == 0] = np.eye(3)[:, :, None]
        translation = est_means - scale * dot(rotation.swapaxes(0, 1), gt_means[:, None])
    return np.vstack([scale, rotation.reshape(9, -1), translation]).T


def _reweighted_fits(
    gt: Floats,
    est: Floats,
    similarities: Floats,
    threshold: float,
    resolution: float,
    alignment: str,
) -> tuple[Floats, Floats]:
    """Take a step from each similarity; return the fits and their costs.

    The step is the fit with the weights ``1 / sqrt(e^2 + r^2)`` of the errors below the threshold,
    and 0 beyond.
    """

    def step(chunk: Floats) -> Floats:
        errors = _smoothed_errors(gt, est, chunk, resolution)
        weights = np.where(errors < threshold, 1 / errors, 0.0)
        return weighted_fits(gt, est, weights, alignment)

    fits = np.concatenate([step(chunk) for chunk in chunks(similarities, gt.shape[1])])
    return fits, truncated_costs(gt, est, fits, threshold, resolution)


def _smoothed_errors(gt: Floats, est: Floats, similarities: Floats, resolution: float) -> Floats:
    """Return ``sqrt(e^2 + r^2)`` of all cameras under all similarities, (H, n)."""
    rotation = similarities[:, 1:10].reshape(-1, 3, 3)
    squares = squared_errors(gt, est, similarities[:, 0], rotation, similarities[:, 10:])
    smoothed: Floats = np.sqrt(squares + resolution * resolution)
    return smoothed


def _best_rotations(covariance: Floats) -> Floats:
    """Return the rotations (3, 3, H) that correlate best with matrices."""
    columns, axes = _orthogonal_columns(covariance)
    norms = np.sqrt(dot(columns, columns))
    order = np.argsort(-norms, axis=0, kind="stable")[None]
    largest, middle, _ = np.take_along_axis(norms, order[0], axis=0)
    columns, axes = (np.take_along_axis(m, order, axis=1) for m in (columns, axes))
    frames = np.empty((3, 3, 2, len(largest)))  # axes, components, worlds
    frames[0] = np.stack([axes[:, 0], columns[:, 0] / largest], axis=1)
    frames[1] = np.stack([axes[:, 1], columns[:, 1]], axis=1)
    line = middle <= LINE * largest
    if line.any():
        normal = common_normal(frames[0, :, 0], frames[0, :, 1])
        np.copyto(frames[1], normal[:, None], where=line)
    complete_frames(frames)
    return dot(frames[:, :, None, 1], frames[:, None, :, 0])


def _orthogonal_columns(matrices: Floats) -> tuple[Floats, Floats]:
    """Return ``matrices @ axes`` with orthogonal columns, and the axes, which are orthonormal.

    One-sided Jacobi rotations: each turns a pair of columns so that they become orthogonal.
    """
    columns = matrices.copy()
    axes = np.zeros_like(columns)
    for i in range(3):
        axes[i, i] = 1.0
    for i, j in SWEEPS * ((0, 1), (0, 2), (1, 2)):
        product = dot(columns[:, i], columns[:, j])
        difference = dot(columns[:, j], columns[:, j]) - dot(columns[:, i], columns[:, i])
        ratio = difference / (2 * product)
        tangent = np.copysign(1.0, ratio) / (np.abs(ratio) + np.sqrt(1 + ratio * ratio))
        tangent[product == 0] = 0.0
        cosine = 1 / np.sqrt(1 + tangent * tangent)
        sine = cosine * tangent
        for m in (columns, axes):
            m[:, i], m[:, j] = (
                cosine * m[:, i] - sine * m[:, j],
                sine * m[:, i] + cosine * m[:, j],
            )
    return columns, axes


def lane_sums(values: Floats) -> Floats:
    """Return sums over the cameras, the last axis: in lanes, which are then folded in halves."""
    padding = [(0, 0)] * (values.ndim - 1) + [(0, -values.shape[-1] % LANES)]
    padded = np.pad(values, padding)
    rows = padded.reshape(*values.shape[:-1], padded.shape[-1] // LANES, LANES)
    lanes = rows.sum(axis=-2, initial=0.0)
    while lanes.shape[-1] > 1:
        half = lanes.shape[-1] // 2
        lanes = lanes[..., :half] + lanes[..., half:]
    total: Floats = lanes[..., 0]
    return total
