"""Mix-ups of convention between a reference and an estimate, distinguished from inaccuracy.

An estimate whose camera axes are not the reference's (OpenGL against OpenCV, the IMU's against the
camera's), or whose poses are world-to-camera, has a RAS near 0 for reasons that have nothing to do
with accuracy. With R_i, R̂_i the camera-to-world rotations and Q the rotation between the worlds:

- *another camera frame*: R̂_i ≈ Q R_i B with one constant B. Then R̂_iᵀ R̂_j = Bᵀ (R_iᵀ R_j) B: the
  relative rotations have equal angles, and Bᵀ takes the axes of one to those of the other, which
  gives B without Q; with B known, Q is the robust average of R̂_i Bᵀ R_iᵀ as in the RAS.
- *world-to-camera*: the same for the inverted poses.
- *quaternions with w at the wrong end* look like both of these, in the rotations alone.
- Where a camera turns little, as on a short stretch of road, *a common swap of axes* and w at the
  wrong end also look like mere inaccuracy. But they have no parameter to fit: half of what is
  missing to a RAS of 1 is evidence enough. Where both explain it, axes were swapped.
- *world-to-camera translations* beside camera-to-world rotations: the positions fit once they are
  -R̂_i t̂_i.
- *mirrored*: the positions fit the reference's mirror image, as after a flip of one axis or a swap
  of two. The rotations of a mirrored world are the true ones up to another camera frame.
- *swapped*: the scores hardly change when reference and estimate are exchanged, so this can only be
  guessed from how the two files look.

The RAS measures how well the rotations fit. A convention is reported only if it raises the RAS far
more than the freedom to choose one does: an estimate that is merely bad, with noise, lost cameras
or drift, fits under none.
"""

from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import ArrayLike

from ..aligner import normalise
from ..arrays import Floats
from ..averaging import (
    angles_and_axes,
    chordal_mean,
    project_to_rotation,
    rotation_angles,
    rotation_from_vector,
    tlud_mean,
)
from ..registration import pcr99
from ..similarity import Similarity
from ..validation import check_poses, check_same_length, finite_rows
from .files import Trajectory, inverse_poses

__all__ = [
    "Convention",
    "check_conventions",
    "describe_rotation",
    "find_convention",
    "rotate_cameras",
    "seem_swapped",
]


SAMPLE = 500  # cameras looked at, evenly spread
HYPOTHESES = 300  # camera triplets that propose a rotation B
NEAR_DEG = 10.0  # the largest threshold of the RAS: a smaller B is inaccuracy
FRAME_STEPS = 10  # in which B and Q are fitted
MIN_CAMERAS = 10  # fewer fit some rotation by chance
MIN_RAS = 0.35  # smallest RAS under a convention that is reported
MIN_GAIN = 3.0  # smallest ratio of it to the RAS without the convention
KNOWN_GAIN = 0.1, 0.5  # least gain in RAS, and share of 1 - RAS, of what has no parameter
CLEARLY_BETTER = 0.02  # in RAS, than a likelier convention
DEFINED_AXIS_DEG = (5.0, 170.0)  # angles of relative rotations whose axis is well defined
SHIFTED_QUATERNIONS = (  # B where w first is read as w last, and the other way round
    np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]),
)
POSITIONS_GAIN = 3.0  # factor by which mirrored or inverted positions must fit better
POSITIONS_MISFIT = 0.15  # largest median error when they do, relative to the reference's extent


@dataclass(frozen=True, eq=False)
class Convention:
    """The convention under which an estimate fits its reference, as far as it can be found.

    Parameters
    ----------
    inverted : bool
        Whether the estimated poses are world-to-camera.
    rotations_inverted, positions_inverted : bool
        Whether only their rotations, or only their positions, are.
    quaternions_shifted : bool
        Whether the rotations are those of quaternions whose w is at the wrong end. A cyclic shift
        of the components is a reflection of the unit quaternions, and so takes q to a q* b with
        constants a and b: the rotations look inverted, in another camera frame.
    body_rotation : (3, 3) ndarray or None
        The estimate's camera axes (columns) in the reference's camera frame; None where it is the
        same frame, or no other one explains the estimate.
    mirrored : bool
        Whether the positions fit the mirror image of the reference.
    ras, corrected_ras : float
        RAS of the poses as they are, and under the convention found, approximately.
    scale : float
        Estimated units per unit of the reference, by the positions; NaN if not looked for.

    Examples
    --------
    >>> from alignscores import Convention
    >>> str(Convention(inverted=True, mirrored=True))
    'the estimated poses are world-to-camera; the estimated positions are mirrored'
    """

    inverted: bool = False
    rotations_inverted: bool = False
    positions_inverted: bool = False
    quaternions_shifted: bool = False
    body_rotation: Floats | None = None
    mirrored: bool = False
    ras: float = 0.0
    corrected_ras: float = 0.0
    scale: float = np.nan

    def __str__(self) -> str:
        found = {
            "the estimated poses are world-to-camera": self.inverted,
            "the quaternions have w at the wrong end": self.quaternions_shifted,
            "the estimated rotations are world-to-camera": (
                self.rotations_inverted and not self.quaternions_shifted
            ),
            "the estimated positions are world-to-camera translations": self.positions_inverted,
            "the estimated positions are mirrored": self.mirrored,
        }
        words = [sentence for sentence, holds in found.items() if holds]
        if self.body_rotation is not None and not self.quaternions_shifted:
            turn = describe_rotation(self.body_rotation)
            words.insert(1 if self.inverted else 0, f"the camera's frame is turned: {turn}")
        return "; ".join(words) or "no mix-up is found"


def find_convention(gt_poses: Floats, est_poses: Floats, *, quaternions: bool = True) -> Convention:
    """Find the convention under which the finite ones of estimated poses fit their reference.

    All of it is False and None where they fit as they are, or fit under none. With rotations about
    a single axis B is not unique: to rotate all cameras about that axis is to rotate the world. An
    inversion can then look like another camera frame, and the positions decide. `quaternions` tells
    whether the rotations may have been quaternions.
    """
    estimated = np.flatnonzero(finite_rows(est_poses))
    if len(estimated) < MIN_CAMERAS:
        return Convention()
    rows = estimated[np.linspace(0, len(estimated) - 1, min(SAMPLE, len(estimated))).astype(int)]
    gt, est = gt_poses[rows], est_poses[rows]
    found = _find_rotation(gt, est, quaternions)
    positions = (inverse_poses(est) if found.inverted else est)[:, :3, 3]
    mirrored = _is_mirrored(gt[:, :3, 3], positions)
    rotated_as_is = not found.inverted and not found.rotations_inverted
    inverted = rotated_as_is and not mirrored and _positions_inverted(gt, est)
    return replace(found, mirrored=mirrored, positions_inverted=inverted)


def check_conventions(gt_poses: ArrayLike, est_poses: ArrayLike) -> Convention:
    """Look for a mix-up of conventions that makes estimated poses fit badly.

    Parameters
    ----------
    gt_poses, est_poses : (n, 4, 4) or (n, 3, 4) array_like
        Poses as they would be scored, camera-to-world; see `pas`. At least 10 cameras.

    Returns
    -------
    Convention
        What explains the estimate better: inverted poses, other camera axes, quaternions with w at
        the wrong end, a mirrored world; all False or None where nothing does. Its ``str`` says it
        in words, and `scale` has the estimate's scale.

    Raises
    ------
    ValueError
        Where the input is malformed.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import check_conventions
    >>> rng = np.random.default_rng(0)
    >>> gt = np.tile(np.eye(4), (30, 1, 1))
    >>> gt[:, :3, :3] = Rotation.random(30, rng=rng).as_matrix()
    >>> gt[:, :3, 3] = rng.random((30, 3))
    >>> found = check_conventions(gt, np.linalg.inv(gt))
    >>> found.inverted, str(found)
    (True, 'the estimated poses are world-to-camera')
    >>> opengl = gt @ np.diag([1.0, -1.0, -1.0, 1.0])
    >>> str(check_conventions(gt, opengl))
    "the camera's frame is turned: 180 deg about x, as OpenGL's camera axes to OpenCV's"
    """
    gt = np.dstack(check_poses(gt_poses, "gt_poses", complete=True))  # (n, 3, 4)
    est = np.dstack(check_poses(est_poses, "est_poses", complete=False))
    check_same_length(gt, est, "gt_poses", "est_poses")
    found = find_convention(gt, est)
    estimated = finite_rows(est)
    est = est[estimated]
    if found.inverted:
        est = inverse_poses(est)
    elif found.positions_inverted:
        est[:, :, 3] = -np.einsum("nij,nj->ni", est[:, :, :3], est[:, :, 3])
    if found.mirrored:
        est[:, 2, 3] = -est[:, 2, 3]
    return replace(found, scale=_scale(gt[estimated, :, 3], est[:, :, 3]))


def rotate_cameras(est_poses: Floats, body_rotation: Floats | None) -> Floats:
    """Return estimated poses (n, 4, 4) with the reference's camera axes: R̂_i Bᵀ."""
    if body_rotation is None:
        return est_poses
    rotated = est_poses.copy()
    rotated[:, :3, :3] = est_poses[:, :3, :3] @ body_rotation.T
    return rotated


def describe_rotation(rotation: Floats) -> str:
    """Describe a rotation of the camera's frame in words."""
    for axes, name in zip(_AXES[1:], _NAMES[1:], strict=True):
        if np.allclose(rotation, axes):
            return name
    vector = _log(rotation[None])[0]
    angle = float(np.linalg.norm(vector))
    axis = ", ".join(f"{part:.2f}" for part in vector / angle)
    return f"{np.degrees(angle):.1f} deg about ({axis})"


def seem_swapped(reference: Trajectory, estimate: Trajectory) -> bool:
    """Tell whether two time-stamped files look as if the estimate were given as the reference.

    The scores hardly depend on it. A SLAM estimate usually starts at the identity pose, and a
    reference is usually sampled more densely: where both are the other way round, the two seem
    swapped.
    """
    if reference.keys.dtype.kind != "f":
        return False
    start = max(reference.keys.min(), estimate.keys.min())
    end = min(reference.keys.max(), estimate.keys.max())
    n_ref, n_est = (
        int(np.sum((keys >= start) & (keys <= end))) for keys in (reference.keys, estimate.keys)
    )
    return n_est >= 2 * n_ref and _starts_at_origin(reference) and not _starts_at_origin(estimate)


def _starts_at_origin(trajectory: Trajectory) -> bool:
    first = trajectory.poses[int(np.argmin(trajectory.keys))]
    extent = np.nanmax(np.abs(trajectory.poses[:, :3, 3]), initial=0.0)
    unrotated = np.abs(first[:3, :3] - np.eye(3)).max() < 1e-3
    return bool(unrotated and np.abs(first[:3, 3]).max() <= 1e-3 * extent)


def _find_rotation(gt: Floats, est: Floats, quaternions: bool) -> Convention:
    """Find the convention of the rotations: whether they are inverted, and the camera frame."""
    rotations = gt[:, :3, :3]
    ras = _approximate_ras(_residuals(rotations, est[:, :3, :3]))
    needed = max(MIN_RAS, MIN_GAIN * ras)
    fits: dict[bool, tuple[Floats | None, float]] = {}
    for inverted in (False, True) if needed <= 1 else ():
        candidate = inverse_poses(est) if inverted else est
        frame, fit = _best_frame(rotations, candidate[:, :3, :3])
        near = float(rotation_angles(frame[None])[0]) <= NEAR_DEG
        if fit >= needed:
            fits[inverted] = None if near else frame, fit
    if not fits:
        return _known_mix_up(rotations, est[:, :3, :3], ras, quaternions)

    # The positions of inverted poses fit only once the poses are inverted. So the positions also
    # decide where rotations about a single axis fit both ways.
    as_is, inverted_misfit = _misfit(gt, est), _misfit(gt, inverse_poses(est))
    if len(fits) == 2 and abs(fits[True][1] - fits[False][1]) < 0.03:
        inverted = inverted_misfit < as_is
    else:
        inverted = max(fits, key=lambda key: fits[key][1])
    body, fit = fits[inverted]
    if not inverted and body is None:  # a small misalignment
        return Convention(ras=ras, corrected_ras=ras)
    rotations_inverted = inverted and inverted_misfit > as_is
    shifted = body is not None and any(np.allclose(body, frame) for frame in SHIFTED_QUATERNIONS)
    return Convention(
        inverted=inverted and inverted_misfit <= as_is,
        rotations_inverted=rotations_inverted,
        quaternions_shifted=quaternions and rotations_inverted and shifted,
        body_rotation=body,
        ras=ras,
        corrected_ras=fit,
    )


def _known_mix_up(gt: Floats, est: Floats, ras: float, quaternions: bool) -> Convention:
    """Find a common swap of axes, or quaternions with w at the wrong end.

    They are looked for where the rotations do not fit badly as they are.
    """
    gain, share = KNOWN_GAIN
    needed = max(ras + gain, 1 - share * (1 - ras))
    if needed > 1:
        return Convention(ras=ras, corrected_ras=ras)
    found = [
        Convention(body_rotation=axes, corrected_ras=_approximate_ras(_residuals(gt, est @ axes.T)))
        for axes in _AXES[1:N_COMMON]
    ]
    for frame in SHIFTED_QUATERNIONS if quaternions else ():
        fit = _approximate_ras(_residuals(gt, est.transpose(0, 2, 1) @ frame.T))
        found.append(
            Convention(
                rotations_inverted=True,
                quaternions_shifted=True,
                body_rotation=frame,
                corrected_ras=fit,
            )
        )
    best = max(found, key=lambda one: one.corrected_ras - CLEARLY_BETTER * one.quaternions_shifted)
    if best.corrected_ras < needed:
        return Convention(ras=ras, corrected_ras=ras)
    return replace(best, ras=ras)


def _best_frame(gt: Floats, est: Floats) -> tuple[Floats, float]:
    """Return the constant B with R̂_i ≈ Q R_i B for most cameras, and the RAS under it.

    A B that takes axes to axes is preferred to others that fit about as well: conventions do so.
    """
    best, best_ras = _AXES[0], 0.0
    for axes in _AXES:  # the likeliest first; a later one must be clearly better
        ras = _approximate_ras(_residuals(gt, est @ axes.T))
        if ras > best_ras + CLEARLY_BETTER:
            best, best_ras = axes, ras
    free = _refined_frame(gt, est, _frame_hypothesis(gt, est))
    ras = _approximate_ras(_residuals(gt, est @ free.T))
    smallest = _smallest_equivalent(gt, free)
    if _approximate_ras(_residuals(gt, est @ smallest.T)) > ras - 0.05:
        free = smallest
    return (free, ras) if ras > best_ras + 0.05 else (best, best_ras)


def _smallest_equivalent(gt: Floats, body: Floats) -> Floats:
    """Return the smallest rotation that explains motion about a single axis as well as B does.

    With R_i = W exp(θ_i a) any exp(φ a) B does; its trace, which is largest for the smallest
    angle, is a constant plus cos φ (tr B − aᵀ B a) + sin φ tr([a]ₓ B).
    """
    vectors = _log(gt[0].T @ gt)
    axis = np.linalg.eigh(vectors.T @ vectors)[1][:, -1]
    along = axis @ body @ axis
    across = axis @ [body[1, 2] - body[2, 1], body[2, 0] - body[0, 2], body[0, 1] - body[1, 0]]
    spin = np.arctan2(across, np.trace(body) - along)
    return rotation_from_vector(spin * axis) @ body


def _frame_hypothesis(gt: Floats, est: Floats) -> Floats:
    """Return the B of a camera triplet with which most cameras agree."""
    rng = np.random.default_rng(0)
    i, j, k = rng.integers(len(gt), size=(3, 10 * HYPOTHESES))
    gt_axes, est_axes = (
        np.array([_log(world[i].transpose(0, 2, 1) @ world[other]) for other in (j, k)])
        for world in (gt, est)
    )
    usable = np.ones(len(i), dtype=bool)
    for a, b in zip(gt_axes, est_axes, strict=True):
        angle, est_angle = (np.degrees(np.linalg.norm(vector, axis=1)) for vector in (a, b))
        usable &= (angle > DEFINED_AXIS_DEG[0]) & (angle < DEFINED_AXIS_DEG[1])
        usable &= abs(angle - est_angle) < NEAR_DEG
    first = np.flatnonzero(usable)[:HYPOTHESES]
    if not first.size:
        return np.eye(3)
    bodies = project_to_rotation(np.einsum("pha,phb->hab", gt_axes[:, first], est_axes[:, first]))
    rows = i[first]
    worlds = est[rows] @ bodies.transpose(0, 2, 1) @ gt[rows].transpose(0, 2, 1)
    # <Q R_i, R̂_i Bᵀ> = 1 + 2 cos(angle): linear in the products of entries of Q and of B
    products = np.einsum("hac,hbd->hacbd", worlds, bodies).reshape(-1, 81)
    coefficients = np.einsum("ncb,nad->acbdn", gt, est).reshape(81, -1)
    cosines = (products @ coefficients - 1) / 2
    agreeing = np.sum(cosines > np.cos(np.radians(NEAR_DEG)), axis=1)
    best: Floats = bodies[np.argmax(agreeing)]
    return best


def _refined_frame(gt: Floats, est: Floats, body: Floats) -> Floats:
    """Fit B and Q in turn to the cameras that agree with them."""
    for _ in range(FRAME_STEPS):
        world = tlud_mean(est @ body.T @ gt.transpose(0, 2, 1))
        frames = (world @ gt).transpose(0, 2, 1) @ est
        agree = rotation_angles(frames @ body.T) < NEAR_DEG
        if not agree.any():
            return body
        body = chordal_mean(frames[agree])
    return body


def _residuals(gt: Floats, est: Floats) -> Floats:
    """Angular errors in degrees after the alignment of the RAS."""
    world = tlud_mean(est @ gt.transpose(0, 2, 1))
    return rotation_angles((world @ gt).transpose(0, 2, 1) @ est)


def _approximate_ras(residuals: Floats) -> float:
    """Return the RAS with infinitely many thresholds; 0 where only few cameras fit, by chance."""
    if np.sum(residuals < NEAR_DEG) < MIN_CAMERAS:
        return 0.0
    return float(np.maximum(1 - residuals / NEAR_DEG, 0).mean())


def _is_mirrored(gt: Floats, est: Floats) -> bool:
    mirrored = _position_misfit(gt, est * [1.0, 1.0, -1.0])
    return mirrored < min(POSITIONS_MISFIT, _position_misfit(gt, est) / POSITIONS_GAIN)


def _positions_inverted(gt: Floats, est: Floats) -> bool:
    """Tell whether the estimate's positions are the translations from world to camera."""
    centres = -np.einsum("nij,nj->ni", est[:, :3, :3], est[:, :3, 3])
    inverted = _position_misfit(gt[:, :3, 3], centres)
    return inverted < min(POSITIONS_MISFIT, _misfit(gt, est) / POSITIONS_GAIN)


def _misfit(gt: Floats, est: Floats) -> float:
    return _position_misfit(gt[:, :3, 3], est[:, :3, 3])


def _position_misfit(gt: Floats, est: Floats) -> float:
    """Median position error after robust registration, relative to the extent of the reference."""
    gt, est = normalise(gt)[0], normalise(est)[0]
    extent = float(np.median(np.linalg.norm(gt, axis=1)))
    return median_error(gt, est, n_hypotheses=300) / extent if extent > 0 else np.inf


def _scale(gt: Floats, est: Floats) -> float:
    """Return the scale of a robust registration; NaN without one."""
    if len(gt) < MIN_CAMERAS:
        return np.nan
    (gt, _, gt_unit), (est, _, est_unit) = normalise(gt), normalise(est)
    alignment = _registered(gt, est, HYPOTHESES)
    return np.nan if alignment is None else float(alignment.scale * (est_unit / gt_unit))


def median_error(gt: Floats, est: Floats, *, n_hypotheses: int) -> float:
    """Return the median position error after a robust registration; infinite without one."""
    alignment = _registered(gt, est, n_hypotheses)
    return np.inf if alignment is None else float(np.median(alignment.position_errors(gt, est)))


def _registered(gt: Floats, est: Floats, n_hypotheses: int) -> Similarity | None:
    """Return the similarity with the least median position error, if there is one."""
    rank, rng = len(gt) // 2 + 1, np.random.default_rng(0)
    return pcr99(gt, est, rank=rank, n_hypotheses=n_hypotheses, rng=rng)[0]


def _log(rotations: Floats) -> Floats:
    """Rotation vectors (n, 3) in radians."""
    angles, axes = angles_and_axes(rotations)
    return (angles * axes).T


def _axis_rotations() -> tuple[list[Floats], list[str]]:
    """Return the 24 rotations that take axes to axes, the likeliest mix-ups first, with names."""
    body, camera = "x forward, y left, z up", "x right, y down, z forward"
    named = {
        (1, 0, 0, 0, 1, 0, 0, 0, 1): "none",
        (1, 0, 0, 0, -1, 0, 0, 0, -1): "180 deg about x, as OpenGL's camera axes to OpenCV's",
        (0, -1, 0, 0, 0, -1, 1, 0, 0): f"as a frame with {body} to a camera with {camera}",
        (0, 0, 1, -1, 0, 0, 0, -1, 0): f"as a camera with {camera} to a frame with {body}",
    }
    rotations = [np.reshape(entries, (3, 3)).astype(float) for entries in named]
    names = list(named.values())
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        rotation = np.eye(3)[list(order)] * np.array(signs)[:, None]
        known = any(np.array_equal(rotation, other) for other in rotations)
        if np.linalg.det(rotation) > 0 and not known:
            rotations.append(rotation)
            columns = [
                f"{'-' if column.sum() < 0 else '+'}{'xyz'[abs(column).argmax()]}"
                for column in rotation.T
            ]
            names.append(f"its x, y, z are the reference's {', '.join(columns)}")
    return rotations, names


_AXES, _NAMES = _axis_rotations()
N_COMMON = 4  # of them have a use, none among them
