"""The convention under which estimated poses fit their reference: a mistake in either file.

With R_i, R̂_i the camera-to-world rotations and Q the rotation between the frames:

- *another camera frame*: R̂_i ≈ Q R_i B with one constant B, a swap of axes or any rotation.
- *world-to-camera*: the same for inverted poses of either file, whose positions fit better, too.
- *inverted rotations* with true positions: the same for transposed rotations of either file.
- *inverted positions* with true rotations: positions fit better if they are taken for translations
  of world-to-camera poses.
- *quaternions with w at the wrong end*: the same for the rotations in true order, which may be
  those of world-to-camera poses, as COLMAP writes both.

Which file is mixed up shows in B, which is the identity only if the right one is corrected, and in
Q, which is then the rotation that aligns the positions. The RAS measures how well rotations fit. A
B of a few degrees is inaccuracy, which no mistake has to explain.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats, Indices
from ..averaging import (
    angles_and_axes,
    project_to_rotation,
    quaternions_from_rotations,
    rotation_angles,
    rotation_from_vector,
    rotations_from_quaternions,
    tlud_mean,
)
from ..io import inverse_poses
from ..registration import pcr99
from ..rotation import average_rotation
from ..validation import finite_rows

__all__ = [
    "BOTH",
    "EST",
    "INVERTED",
    "INVERTED_POSITIONS",
    "INVERTED_ROTATIONS",
    "INVERTED_W",
    "MAX_MISFIT",
    "MAX_MISFIT_OF_RELATED",
    "MIN_CAMERAS",
    "NEAR_DEG",
    "REF",
    "W_FIRST",
    "W_LAST",
    "Convention",
    "PositionFit",
    "corrected",
    "describe_rotation",
    "find_conventions",
    "fit_positions",
    "is_common",
    "moving_cameras",
    "rotate_cameras",
    "rotations_fit_mirrored",
]

NEAR_DEG = 10.0  # the largest threshold of the RAS; a smaller B is inaccuracy
MIN_CAMERAS = 10  # fewer fit some rotation by chance
SAMPLE = 300  # cameras looked at
STEPS = 5  # in which B and Q are refined in turn
ABOUT = 2.0  # ratio of errors of positions that are about the same
ROUNDING = 1e-6  # of errors of positions, relative to those with a mistake
EQUAL = 0.02  # difference of the RAS of conventions that fit equally well
MIN_GAIN, CLEAR_GAIN = 0.1, 0.3  # of the RAS; the latter where positions do not confirm it
MAX_MISFIT = 0.15  # of positions that fit, relative to their extent
MAX_MISFIT_OF_RELATED = 1 / 3  # of positions that are related at all
CONSISTENT_DEG = 20.0  # between the alignments of positions and rotations
BODY, CAMERA = "x forward, y left, z up", "x right, y down, z forward"
OF_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
COMMON = {  # common conventions of camera axes: B, and its name
    "none": np.eye(3),
    "180 deg about x, as OpenGL's camera axes to OpenCV's": np.diag([1.0, -1.0, -1.0]),
    f"as a frame with {BODY} to a camera with {CAMERA}": OF_BODY,
    f"as a camera with {CAMERA} to a frame with {BODY}": OF_BODY.T,
}
INVERTED, INVERTED_ROTATIONS = "inverted", "inverted rotations"
INVERTED_POSITIONS = "inverted positions"  # translations of inverse poses
W_FIRST, W_LAST = "qw qx qy qz", "qx qy qz qw"
OF_ROTATIONS = {INVERTED_ROTATIONS, W_FIRST, W_LAST}
INVERTED_W = {f"{INVERTED}, {order}": order for order in (W_FIRST, W_LAST)}  # two mistakes
REF, EST, BOTH = "reference", "estimate", "both"


@dataclass(frozen=True, eq=False)
class Convention:
    """The convention under which an estimate fits its reference; all is empty if there is none."""

    # by file: INVERTED, INVERTED_ROTATIONS, INVERTED_POSITIONS, the true order of quaternions, or
    # one of INVERTED_W
    mistakes: Mapping[str, str] = field(default_factory=dict)
    body_rotation: Floats | None = None  # its camera axes (columns) in the reference's camera frame
    is_unlikely: bool = False  # whether others that fit as well take one mistake fewer


def find_conventions(
    gt_poses: Floats,
    est_poses: Floats,
    *,
    inverted: Collection[str] = (),
    orders: Mapping[str, str] | None = None,
    alignment: str = "similarity",
    up: str = "z",
) -> list[Convention]:
    """Find the conventions under which the finite ones of estimated poses fit their reference.

    They are reported if they raise the RAS by 0.1, or where rotations and positions do not have the
    same alignment by 0.3 or half of what is missing to 1: noise, lost cameras or drift fit under
    none so much better. The optimism of a fitted camera frame does not count. Two mistakes, or one
    and another camera frame, must explain 0.1 more than one; a frame with no common name counts as
    two. Where both are inverted, their rotations may agree; then their positions show it. Those
    that fit equally well are all reported, the likeliest first. `inverted` are the files whose
    poses were inverted when they were read. `orders` is the order in which the quaternions of each
    file were read, which is not tried as a mistake. The RAS is computed under `alignment` and `up`;
    where these count a rotation between the coordinate frames, it is no camera frame.
    """
    rows = moving_cameras(gt_poses, est_poses)
    if len(rows) < MIN_CAMERAS:
        return []
    gt, est = gt_poses[rows], est_poses[rows]
    original = _Pair({}, gt, est, fit_positions(gt, est), alignment, up)
    as_read = orders or {}
    pairs = [
        _corrected(original, mistakes, inverted)
        for mistakes in MISTAKES
        if all(as_read.get(side) != INVERTED_W.get(m, m) for side, m in mistakes.items())
    ]
    moved = _moved(original, pairs)
    are_truer = any(_are_truer(pair, original) for pair in moved)
    as_it_is = original.ras(np.eye(3))[0]
    if as_it_is + MIN_GAIN > 1 and not are_truer:
        return []
    fits = [_fit(*candidate) for candidate in _candidates(original, moved, pairs)]
    fits = [fit for fit in fits if fit.n_causes]  # a B near the identity is no convention
    if alignment in ("yaw", "none"):  # a turned coordinate frame may explain as much
        turned = _fit(original._replace(alignment="similarity"), np.eye(3))
        min_ras_of_truer = turned.ras - EQUAL
        min_ras = turned.ras + EQUAL if turned.is_consistent else min_ras_of_truer
        fits = [
            fit
            for fit in fits
            if fit.ras >= (min_ras_of_truer if _are_truer(fit.pair, original) else min_ras)
            and (fit.has_same_axes or not fit.apart_deg > CONSISTENT_DEG)
        ]
    near = _ras_within_inaccuracy(original)
    better = _clearly_better(fits, as_it_is, near, are_truer=are_truer)
    n_causes = max((fit.n_causes for fit in better), default=0)
    conventions: dict[tuple[Any, ...], Convention] = {}
    for fit in _as_good(fits, better):
        mistakes = fit.pair.mistakes
        body = None if fit.has_same_axes else fit.body
        convention = Convention(mistakes, body, is_unlikely=fit.n_causes > n_causes)
        conventions.setdefault(tuple(mistakes.items()), convention)
    for convention in _may_be_inverted([*conventions.values()], original):
        conventions.setdefault(tuple(convention.mistakes.items()), convention)
    return [*conventions.values()]


def _clearly_better(
    fits: "list[_Candidate]", as_it_is: float, near: float, *, are_truer: bool
) -> "list[_Candidate]":
    """Return the fits that raise the RAS clearly, also above those that take fewer mistakes.

    `near` is the RAS within inaccuracy, which no mistake has to explain. If positions `are_truer`,
    rotations need only fit as well.
    """
    better = []
    for fit in fits:
        is_frame = not fit.pair.mistakes and not fit.has_same_axes
        now = as_it_is if is_frame else near
        gain = MIN_GAIN if fit.is_consistent else min(CLEAR_GAIN, (1 - now) / 2)
        if fit.ras >= (as_it_is - EQUAL if are_truer else now + gain):
            better.append(fit)
    better = [fit for fit in better if not fit.apart_deg > CONSISTENT_DEG] or better
    return [
        fit
        for fit in better
        if all(fit.ras >= other.ras + MIN_GAIN for other in better if other.n_causes < fit.n_causes)
    ]


def _as_good(fits: "list[_Candidate]", better: "list[_Candidate]") -> "list[_Candidate]":
    """Return the fits that are as good as the best, and take at most one mistake more."""
    if not better:
        return []
    min_ras, n_causes = max(fit.ras for fit in better) - EQUAL, max(fit.n_causes for fit in better)
    max_apart = max(CONSISTENT_DEG, *(fit.apart_deg for fit in better))
    return [
        fit
        for fit in fits
        if fit.ras + fit.optimism > min_ras
        and fit.n_causes <= n_causes + 1
        and not fit.apart_deg > max_apart
    ]


def _may_be_inverted(found: list[Convention], original: "_Pair") -> Iterator[Convention]:
    """Yield inversions that poor positions, or a common coordinate frame, may hide."""
    of_both = dict.fromkeys((REF, EST), INVERTED)
    for convention in found:
        if INVERTED_ROTATIONS in convention.mistakes.values():
            yield replace(convention, mistakes=dict.fromkeys(convention.mistakes, INVERTED))
    # If both files are inverted, coordinate frames that differ look like camera frames.
    has_frame = any(not each.mistakes and each.body_rotation is not None for each in found)
    rotation = original.positions.rotation
    is_in_same_frame = rotation is not None and rotation_angles(rotation[None])[0] <= NEAR_DEG
    both = _corrected(original, of_both, ())
    if has_frame and is_in_same_frame and not _hides_errors(original, both):
        yield Convention(of_both)


def moving_cameras(gt_poses: Floats, est_poses: Floats) -> Indices:
    """Return at most SAMPLE rows with an estimate, evenly spread over the motion of the reference.

    While a camera rests, its poses are alike and fit under any alignment.
    """
    rows = np.flatnonzero(finite_rows(est_poses))
    poses = gt_poses[rows]
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    turns = rotation_angles(poses[:-1, :3, :3].swapaxes(1, 2) @ poses[1:, :3, :3])
    moves = np.zeros(len(rows), dtype=bool)
    moves[:1] = True
    for sizes in (steps, np.nan_to_num(turns)):
        parts = SAMPLE * np.append(0, np.cumsum(sizes)) / max(sizes.sum(), np.finfo(float).tiny)
        moves[1:] |= np.diff(parts.astype(int)) > 0
    rows = rows[moves]
    return np.asarray(rows[np.linspace(0, len(rows) - 1, min(SAMPLE, len(rows))).astype(int)])


class _Pair(NamedTuple):
    """Both trajectories without a mistake, and how their positions fit."""

    mistakes: Mapping[str, str]
    gt: Floats
    est: Floats
    positions: "PositionFit"
    alignment: str  # of the RAS
    up: str
    has_moved: bool = False  # whether positions depend on the mistake, as inverse poses do

    def ras(self, body: Floats) -> tuple[float, Floats]:
        """Return the RAS under B with infinitely many thresholds, and the rotation Q."""
        gt, est = self.gt[:, :3, :3], self.est[:, :3, :3] @ body.T
        frame = average_rotation(est @ gt.swapaxes(1, 2), self.alignment, self.up)
        errors = rotation_angles((frame @ gt).swapaxes(1, 2) @ est)
        return float(np.maximum(1 - errors / NEAR_DEG, 0).mean()), frame


class _Candidate(NamedTuple):
    """How well rotations fit without a mistake, and with B."""

    ras: float  # without the optimism
    apart_deg: float  # between the alignments of rotations and positions; nan if these have none
    pair: _Pair
    body: Floats
    optimism: float  # part of the RAS that is owed to a B fitted to the same cameras

    @property
    def has_same_axes(self) -> bool:
        """Whether B is the identity, or no more than inaccuracy."""
        return bool(rotation_angles(self.body[None])[0] <= NEAR_DEG)

    @property
    def n_causes(self) -> int:
        """How many mistakes or common camera frames it takes; any other frame counts as two."""
        of_frame = 0 if self.has_same_axes else 1 if is_common(self.body) else 2
        return of_frame + sum(2 if m in INVERTED_W else 1 for m in self.pair.mistakes.values())

    @property
    def is_consistent(self) -> bool:
        """Whether rotations and positions have the same alignment."""
        return self.apart_deg <= CONSISTENT_DEG


def _fit(pair: _Pair, axes: Floats | None) -> _Candidate:
    """Return how well rotations fit with these axes of the cameras, None for any."""
    body = _fitted_frame(pair) if axes is None else axes
    ras, frame = pair.ras(body)
    optimism = _optimism(pair) if axes is None else 0.0
    apart = np.nan
    if pair.positions.rotation is not None:
        apart = float(rotation_angles((pair.positions.rotation.T @ frame)[None])[0])
    return _Candidate(ras - optimism, apart, pair, body, optimism)


def _optimism(pair: _Pair) -> float:
    """Return by how much the RAS of half of the cameras drops under the B of the other half.

    Some B makes the turns of two short walks alike that have nothing to do with each other.
    """
    half = len(pair.gt) // 2
    halves = [
        pair._replace(gt=pair.gt[rows], est=pair.est[rows]) for rows in (np.s_[:half], np.s_[half:])
    ]
    bodies = [_fitted_frame(part) for part in halves]
    fitted, exchanged = (
        sum(part.ras(body)[0] for part, body in zip(halves, frames, strict=True))
        for frames in (bodies, bodies[::-1])
    )
    return max(fitted - exchanged, 0.0) / 2


def _candidates(
    original: _Pair, moved: list[_Pair], pairs: list[_Pair]
) -> Iterator[tuple[_Pair, Floats | None]]:
    """Yield both trajectories, and B (None: any), the likeliest first.

    Where other positions fit better, only they are candidates. In one coordinate frame, another
    camera frame and the same mistake in the rotations of both files may be alike, and errors of the
    same size are a smaller part of a longer path.
    """
    now = original.positions
    is_longer = all(len(pair.mistakes) == 2 and pair.positions.error > now.error for pair in moved)
    inputs = [original, *moved] if is_longer else moved
    may_have_frame = [pair for pair in inputs if {*pair.mistakes.values()} <= {INVERTED}]
    none, *swaps = COMMON.values()
    yield from ((pair, none) for pair in inputs)
    yield from ((pair, axes) for axes in swaps for pair in may_have_frame)
    nearer = [pair for pair in pairs if pair.positions.error <= ABOUT * now.error]
    one, both = ([pair for pair in nearer if len(pair.mistakes) == n] for n in (1, 2))
    if is_longer:
        yield from _of_rotations(one)
        inverses = {INVERTED, *INVERTED_W}
        yield from ((pair, none) for pair in one if inverses.intersection(pair.mistakes.values()))
    yield from ((pair, None) for pair in may_have_frame)
    if is_longer:
        yield from _of_rotations(both)


def _of_rotations(pairs: list[_Pair]) -> Iterator[tuple[_Pair, Floats | None]]:
    """Yield trajectories without mistakes in the rotations only, and B."""
    none, *swaps = COMMON.values()
    yield from ((pair, none) for pair in pairs if {*pair.mistakes.values()} <= OF_ROTATIONS)
    transposed = [pair for pair in pairs if INVERTED_ROTATIONS in pair.mistakes.values()]
    yield from ((pair, axes) for axes in swaps for pair in transposed)


def _ras_within_inaccuracy(pair: _Pair) -> float:
    """Return the RAS of cameras whose axes are the same, or off by no more than inaccuracy."""
    body = _rotation_between_cameras(pair)
    angles, axes = angles_and_axes(body[None])
    near = _fit(pair, rotation_from_vector(min(angles[0], np.radians(NEAR_DEG)) * axes[:, 0]))
    as_it_is = _fit(pair, np.eye(3)).ras
    may_be_near = near.is_consistent or pair.positions.rotation is None
    return max(as_it_is, near.ras) if may_be_near else as_it_is


def _moved(original: _Pair, pairs: list[_Pair]) -> list[_Pair]:
    """Return the pairs without a mistake of the smallest errors, if positions fit much better.

    The same errors are a small part of a long path: in metres they tell which file it is, or that
    it may be either.
    """
    now = original.positions
    pairs = [
        pair
        for pair in pairs
        if pair.has_moved
        and pair.positions.misfit < MAX_MISFIT_OF_RELATED
        and not (len(pair.mistakes) == 2 and _hides_errors(original, pair))
    ]
    better = [
        pair
        for pair in pairs
        if pair.positions.is_much_better_than(now)
        or (pair.positions.error < now.error / 3 and pair.positions.misfit < now.misfit)
    ]
    return [
        pair
        for pair in pairs
        if better and not any(_is_likelier(other, pair, ROUNDING * now.error) for other in better)
    ]


def _is_likelier(other: _Pair, pair: _Pair, rounding: float) -> bool:
    """Return whether another pair is likelier, since its errors are much smaller.

    A small ring of cameras fits a large one, and has smaller errors even if it fits worse.
    """
    now, then = pair.positions, other.positions
    is_in_same_unit = 1 / ABOUT < now.scale / then.scale < ABOUT
    is_nearer = now.error > max(2 * then.error, rounding)
    return is_nearer and (is_in_same_unit or then.misfit <= now.misfit)


def _hides_errors(original: _Pair, inverted: _Pair) -> bool:
    """Return whether positions fit as they are, and inverted poses of both files move more.

    In the coordinates of the camera all that is far away moves as the camera turns. On that long
    path errors are small, but hardly smaller in metres.
    """
    now, then = original.positions, inverted.positions
    is_long = now.misfit < MAX_MISFIT and _step(inverted.gt) > _step(original.gt)
    return is_long and then.error > now.error / ABOUT


def _are_truer(pair: _Pair, original: _Pair) -> bool:
    """Return whether inverted poses have much smaller errors of positions, or both smaller steps.

    Drift about the origin moves no inverse pose, and passes for errors of two inverted files.
    Positions near one point, as of cameras that look at it, have small errors, but fit no others.
    """
    now, then = original.positions, pair.positions
    if not pair.has_moved:
        return False
    if len(pair.mistakes) == 2:
        return _step(pair.gt) < _step(original.gt)
    is_related = now.misfit > MAX_MISFIT_OF_RELATED and then.misfit <= MAX_MISFIT
    return is_related or then.error < now.error / 3


def _step(poses: Floats) -> float:
    """Return the median distance between successive positions."""
    return float(np.median(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)))


def _corrected(original: _Pair, mistakes: Mapping[str, str], inverted: Collection[str]) -> _Pair:
    """Return both trajectories without mistakes in one file or both, which may be `inverted`."""
    gt, est = (
        corrected(poses, mistakes[side], inverted=side in inverted) if side in mistakes else poses
        for poses, side in ((original.gt, REF), (original.est, EST))
    )
    positions = original.positions
    if not {*mistakes.values()} <= OF_ROTATIONS or not mistakes.keys().isdisjoint(inverted):
        positions = fit_positions(gt, est)
    has_moved = positions is not original.positions
    return original._replace(
        mistakes=mistakes, gt=gt, est=est, positions=positions, has_moved=has_moved
    )


def _transposed(poses: Floats) -> Floats:
    changed = poses.copy()
    changed[:, :3, :3] = poses[:, :3, :3].swapaxes(1, 2)
    return changed


def _reordered(poses: Floats, shift: int) -> Floats:
    """Return poses whose quaternions, w last, are shifted by so many parts."""
    quaternions = quaternions_from_rotations(poses[:, :3, :3])
    changed = poses.copy()
    changed[:, :3, :3] = rotations_from_quaternions(np.roll(quaternions, shift, axis=1))
    return changed


def _inverted_after(correct: Callable[[Floats], Floats], poses: Floats) -> Floats:
    """Return the inverse of poses after another mistake in them is corrected."""
    return inverse_poses(correct(poses))


CORRECTIONS: dict[str, Callable[[Floats], Floats]] = {  # what corrects a mistake
    INVERTED: inverse_poses,
    INVERTED_ROTATIONS: _transposed,
    W_FIRST: partial(_reordered, shift=-1),
    W_LAST: partial(_reordered, shift=1),
}
CORRECTIONS[INVERTED_POSITIONS] = partial(_inverted_after, _transposed)
CORRECTIONS |= {
    mistake: partial(_inverted_after, CORRECTIONS[order]) for mistake, order in INVERTED_W.items()
}
MISTAKES: list[dict[str, str]] = [  # of one file or both, where orders of quaternions may differ
    dict.fromkeys(sides, mistake)
    for mistake in CORRECTIONS
    for sides in ((EST,), (REF,), (REF, EST))
]
MISTAKES += [
    dict(zip((REF, EST), orders, strict=True))
    for pair in ((W_FIRST, W_LAST), INVERTED_W)
    for orders in permutations(pair)
]


def corrected(poses: Floats, mistake: str, *, inverted: bool) -> Floats:
    """Return poses without a mistake in their file; `inverted`: when they were read."""
    correct = CORRECTIONS[mistake]
    if inverted and mistake != INVERTED:
        return inverse_poses(correct(inverse_poses(poses)))
    return correct(poses)


def rotate_cameras(est_poses: Floats, body_rotation: Floats | None) -> Floats:
    """Return estimated poses (n, 4, 4) with the reference's camera axes: R̂_i Bᵀ."""
    if body_rotation is None:
        return est_poses
    rotated = est_poses.copy()
    rotated[:, :3, :3] = est_poses[:, :3, :3] @ body_rotation.T
    return rotated


def is_common(rotation: Floats) -> bool:
    """Return whether a rotation of the camera frame is between common conventions."""
    return any(bool((rotation == axes).all()) for axes in COMMON.values())


def describe_rotation(rotation: Floats) -> str:
    """Return a rotation of the camera frame in words."""
    for name, axes in COMMON.items():
        if np.allclose(rotation, axes):
            return name
    angles, axes = angles_and_axes(rotation[None])
    axis = ", ".join(f"{part:z.2f}" for part in axes[:, 0])
    return f"{np.degrees(angles[0]):.1f} deg about ({axis})"


def _fitted_frame(pair: _Pair) -> Floats:
    """Return the constant B with R̂_i ≈ Q R_i B; near a common one the latter.

    The rotation between them is inaccuracy, unless it raises the RAS by 0.1, as for an IMU some
    degrees off the camera's axes.
    """
    body = _rotation_between_cameras(pair)
    common = np.array(list(COMMON.values()))
    apart = rotation_angles(common.swapaxes(1, 2) @ body)
    nearest = common[np.argmin(apart)]
    if apart.min() > NEAR_DEG:
        return body
    is_identity = bool((nearest == np.eye(3)).all())
    is_inaccuracy = pair.ras(body)[0] < pair.ras(nearest)[0] + MIN_GAIN
    return nearest if is_identity or is_inaccuracy else body


def _rotation_between_cameras(pair: _Pair) -> Floats:
    """Return the constant B with R̂_i ≈ Q R_i B.

    Between two cameras both turn by the same angle, about axes that B takes to each other. Where
    all turns are about one axis, that leaves B open; the rotation of the positions is Q, too.
    """
    gt, est = pair.gt[:, :3, :3], pair.est[:, :3, :3]
    true, estimated = _turns(gt), _turns(est)
    lengths = np.linalg.norm([true, estimated], axis=2)
    alike = np.abs(lengths[0] - lengths[1]) < 0.1  # not so where one of the cameras is an outlier
    moments = true[alike].T @ estimated[alike]
    near_identity = 1e-3 * np.linalg.norm(moments) * np.eye(3)  # where turns are about one axis
    bodies = [project_to_rotation(moments + near_identity)]
    if pair.positions.rotation is not None:
        bodies.append(tlud_mean((pair.positions.rotation @ gt).swapaxes(1, 2) @ est))
    for _ in range(STEPS):
        frames = [pair.ras(body)[1] for body in bodies]
        bodies = [tlud_mean((frame @ gt).swapaxes(1, 2) @ est) for frame in frames]
    return max(bodies, key=lambda body: pair.ras(body)[0])


def _turns(rotations: Floats) -> Floats:
    """Return the axes of the rotations between some pairs of cameras, as long as their sines."""
    n = len(rotations)
    partners = np.concatenate([np.roll(rotations, k, axis=0) for k in (n // 10, n // 4, n // 2)])
    angles, axes = angles_and_axes(np.tile(rotations, (3, 1, 1)).swapaxes(1, 2) @ partners)
    return np.asarray((np.sin(angles) * axes).T)


def rotations_fit_mirrored(
    gt_poses: Floats, est_poses: Floats, mirrors: Iterable[Floats], alignment: str, up: str
) -> bool:
    """Return whether one of some mirrors raises the RAS by 0.1, and positions fit."""
    rows = moving_cameras(gt_poses, est_poses)
    if len(rows) < MIN_CAMERAS:
        return False
    gt, est = gt_poses[rows], est_poses[rows]
    pair = _Pair({}, gt, est, fit_positions(gt, est), alignment, up)
    if pair.positions.misfit > MAX_MISFIT:
        return False
    min_ras = pair.ras(np.eye(3))[0] + MIN_GAIN
    for mirror in mirrors:
        mirrored = gt.copy()
        mirrored[:, :3, :3] = mirror @ gt[:, :3, :3] @ mirror
        if pair._replace(gt=mirrored).ras(np.eye(3))[0] >= min_ras:
            return True
    return False


class PositionFit(NamedTuple):
    """Aligned positions: their median error relative to their extent, and the alignment.

    The rotation is None where positions on a line, or that do not fit, leave it open.
    """

    errors: Floats  # (n, 3), in the reference's frame
    misfit: float = np.inf
    rotation: Floats | None = None
    scale: float = np.nan
    certain: float = 0.0  # a larger misfit leaves the rotation about the longest axis open

    @property
    def error(self) -> float:
        """The median error, in the unit of the reference."""
        return float(np.median(np.linalg.norm(self.errors, axis=1)))

    def is_much_better_than(self, other: "PositionFit") -> bool:
        """Return whether the misfit is less than a third, and positions fit at all."""
        return self.misfit < min(other.misfit / 3, MAX_MISFIT_OF_RELATED)


def fit_positions(gt_poses: Floats, est_poses: Floats) -> PositionFit:
    """Return how well positions fit."""
    gt, est = gt_poses[:, :3, 3], est_poses[:, :3, 3]
    centred = gt - np.median(gt, axis=0)
    extent = float(np.median(np.linalg.norm(centred, axis=1)))
    rank, rng = len(gt) // 2 + 1, np.random.default_rng(0)
    alignment, _ = pcr99(gt, est, rank=rank, n_hypotheses=300, rng=rng)
    if alignment is None or extent == 0:
        return PositionFit(centred)
    errors = alignment.inverse().apply(est) - gt
    misfit = float(np.median(np.linalg.norm(errors, axis=1))) / extent
    widths = np.linalg.svd(centred, compute_uv=False)
    certain = np.radians(CONSISTENT_DEG) * widths[1] / widths[0]  # about the longest axis
    has_rotation = misfit < min(MAX_MISFIT, certain)
    rotation = alignment.rotation if has_rotation else None
    return PositionFit(errors, misfit, rotation, alignment.scale, float(certain))
