"""One look at both files: units, clocks and conventions that are mixed up in one of them.

`look` tries the same candidates on the reference and on the estimate: units of time, the offset of
the clocks, the convention of the poses, mirrored axes, frame-to-frame motions, units of length. A
cheap test on the trajectories selects candidates; each is then scored like any other estimate. A
hint is given only if that raises the score clearly, and names the file, the option and both scores.

Conventions, with R_i, R̂_i the camera-to-world rotations and Q the rotation between the frames:

- *another camera frame*: R̂_i ≈ Q R_i B with one constant B, a swap of axes or any rotation.
- *world-to-camera*: the same for inverted poses of either file, whose positions fit better, too.
- *inverted rotations* with true positions: the same for the transposed rotations of either file.
- *quaternions with w at the wrong end*: the same for the rotations in true order.

Which file is mixed up shows in B, which is the identity only if the right one is corrected, and in
Q, which is then the rotation that aligns the positions. The RAS measures how well rotations fit.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats, Indices
from ..averaging import (
    angles_and_axes,
    project_to_rotation,
    rotation_angles,
    rotations_from_quaternions,
    tlud_mean,
)
from ..io import FAILURES, Trajectory, inverse_poses
from ..registration import pcr99
from ..validation import finite_rows
from .clock import find_clock
from .evaluation import Hint, Note
from .settings import Settings
from .time import nearest_stamps

__all__ = ["Convention", "Files", "describe_rotation", "find_convention", "look", "rescue"]
__all__ += ["rotate_cameras"]

NEAR_DEG = 10.0  # the largest threshold of the RAS; a smaller B is inaccuracy
MIN_CAMERAS = 10  # fewer fit some rotation by chance
SAMPLE = 300  # cameras looked at
MOTION_DEG = 30.0  # largest rotation from one frame to the next
STEPS = 5  # in which B and Q are refined in turn
CLEARLY = 0.02  # by which the score of a less likely mistake must be better
CONSISTENT_DEG = 20.0  # between the alignments of positions and rotations
BODY, CAMERA = "x forward, y left, z up", "x right, y down, z forward"
OF_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
COMMON = {  # common conventions of camera axes: B, and its name
    "none": np.eye(3),
    "180 deg about x, as OpenGL's camera axes to OpenCV's": np.diag([1.0, -1.0, -1.0]),
    f"as a frame with {BODY} to a camera with {CAMERA}": OF_BODY,
    f"as a camera with {CAMERA} to a frame with {BODY}": OF_BODY.T,
}
W_FIRST, W_LAST = "qw qx qy qz", "qx qy qz qw"
REF, EST, BOTH = "reference", "estimate", "both"

CLEAR = 0.1  # by which a remedy must raise the score
CLEAR_OF_TIME = 0.01  # likewise; of stamps, whose steps or motions show it on their own
STEPS_OF_CAMERAS = 1e-3, 5.0  # seconds between the poses of a trajectory
TIME_FACTORS = {1e-3: "ms", 1e-6: "us", 1e-9: "ns", 1e3: "us", 1e6: "ms"}  # the latter: read as ns
LENGTHS = {1e3: "mm", 1e2: "cm", 3.28084: "feet"}  # units in a metre
MIRRORS = [np.diag(axes) for axes in ((1.0, 1.0, -1.0), (1.0, -1.0, 1.0), (-1.0, 1.0, 1.0))]


# ---------------------------------------------------------------------------- conventions


@dataclass(frozen=True, eq=False)
class Convention:
    """The convention under which an estimate fits its reference; all is empty if there is none."""

    kind: str = ""  # inverted, inverted rotations, or the true order of quaternions
    side: str = ""  # the file that has it: REF, EST, BOTH
    body_rotation: Floats | None = None  # its camera axes (columns) in the reference's camera frame
    is_ambiguous: bool = False  # whether the other file may as well be the one


def find_convention(gt_poses: Floats, est_poses: Floats) -> Convention:
    """Find the convention under which the finite ones of estimated poses fit their reference.

    It is reported if it raises the RAS by 0.3, or by half of what is missing to 1: noise, lost
    cameras or drift fit under none so much better. Where both are inverted, their rotations may
    agree; then their positions show it.
    """
    estimated = np.flatnonzero(finite_rows(est_poses))
    n = len(estimated)
    if n < MIN_CAMERAS:
        return Convention()
    rows = estimated[np.linspace(0, n - 1, min(SAMPLE, n)).astype(int)]
    gt, est = gt_poses[rows], est_poses[rows]
    ras_now = _ras(gt, est, np.eye(3))[0]
    positions, inverted = _inverted(gt, est)
    least = ras_now + min(0.3, (1 - ras_now) / 2)
    if any(case[1] == BOTH for case in inverted) and _step(inverse_poses(gt)) < _step(gt):
        least = ras_now - CLEARLY
    elif ras_now > 0.9:
        return Convention()
    fits = []
    for kind, side, true, poses, axes, rotation in _candidates(gt, est, positions, inverted):
        body = _fitted_frame(true, poses, rotation) if axes is None else axes
        ras, frame = _ras(true, poses, body)
        apart = np.inf if rotation is None else rotation_angles((rotation.T @ frame)[None])[0]
        fits.append((ras, apart <= CONSISTENT_DEG, kind, side, body))
    better = [fit for fit in fits if fit[0] >= least]
    better = [fit for fit in better if fit[1]] or better
    if not better:
        return Convention()
    good = [fit for fit in better if fit[0] > max(fit[0] for fit in better) - CLEARLY]
    _, _, kind, side, body = good[0]
    is_none = rotation_angles(body[None])[0] <= NEAR_DEG
    others = {EST: REF, REF: EST}
    rivals = [
        fit for fit in good if fit[3] == others.get(side) and np.allclose(fit[4], body, atol=1e-6)
    ]
    return Convention(kind, side, None if is_none else body, bool(kind and rivals))


# Kind, side, both trajectories as they would be, and the rotation of their positions.
_Case = tuple[str, str, Floats, Floats, Floats | None]


def _inverted(gt: Floats, est: Floats) -> tuple[Floats | None, list[_Case]]:
    """Return the rotation of the positions as they are, and inverted poses that fit much better."""
    now = _position_fit(gt, est)
    inverted: list[_Case] = []
    for side, true, poses in _of_sides(gt, est, inverse_poses):
        fit = _position_fit(true, poses)
        if fit.misfit < min(0.15, now.misfit / 3):
            inverted.append(("inverted", side, true, poses, fit.rotation))
    return now.rotation, inverted


def _step(poses: Floats) -> float:
    """Return the median distance between successive positions.

    In the coordinates of the camera all that is far away moves as the camera turns, so that the
    true path, as a rule, has the smaller steps.
    """
    return float(np.median(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)))


def _candidates(
    gt: Floats, est: Floats, positions: Floats | None, inverted: list[_Case]
) -> Iterator[tuple[str, str, Floats, Floats, Floats | None, Floats | None]]:
    """Yield kind, side, both trajectories, B (None: any), and the rotation of their positions.

    The likeliest come first. Where inverted poses fit better, only they are candidates.
    """
    swapped = [
        (kind, side, true, poses, positions)
        for kind in ("inverted rotations", W_FIRST, W_LAST)
        for side, true, poses in _of_sides(gt, est, CHANGES[kind])
    ]
    common = list(COMMON.values())
    inputs: list[_Case] = inverted or [("", "", gt, est, positions)]
    yield from ((*case[:4], axes, case[4]) for axes in common for case in inputs)
    if not inverted:
        yield from ((*case[:4], common[0], case[4]) for case in swapped)
        bodies = [case for case in swapped if case[0] == "inverted rotations" and case[1] != BOTH]
        yield from ((*case[:4], axes, case[4]) for axes in common[1:] for case in bodies)
    yield from ((*case[:4], None, case[4]) for case in inputs)


def _of_sides(
    gt: Floats, est: Floats, change: Callable[[Floats], Floats]
) -> list[tuple[str, Floats, Floats]]:
    """Return a change of either trajectory, and of both."""
    return [(EST, gt, change(est)), (REF, change(gt), est), (BOTH, change(gt), change(est))]


def _transposed(poses: Floats) -> Floats:
    changed = poses.copy()
    changed[:, :3, :3] = poses[:, :3, :3].swapaxes(1, 2)
    return changed


def _reordered(poses: Floats, shift: int) -> Floats:
    """Return poses whose quaternions, w last, are shifted by so many parts."""
    angles, axes = angles_and_axes(poses[:, :3, :3])
    quaternions = np.vstack([np.sin(angles / 2) * axes, np.cos(angles / 2)]).T
    changed = poses.copy()
    changed[:, :3, :3] = rotations_from_quaternions(np.roll(quaternions, shift, axis=1))
    return changed


CHANGES: dict[str, Callable[[Floats], Floats]] = {  # what corrects a kind of mistake
    "inverted": inverse_poses,
    "inverted rotations": _transposed,
    W_FIRST: partial(_reordered, shift=-1),
    W_LAST: partial(_reordered, shift=1),
}


def rotate_cameras(est_poses: Floats, body_rotation: Floats | None) -> Floats:
    """Return estimated poses (n, 4, 4) with the reference's camera axes: R̂_i Bᵀ."""
    if body_rotation is None:
        return est_poses
    rotated = est_poses.copy()
    rotated[:, :3, :3] = est_poses[:, :3, :3] @ body_rotation.T
    return rotated


def describe_rotation(rotation: Floats) -> str:
    """Return a rotation of the camera frame in words."""
    for name, axes in COMMON.items():
        if np.allclose(rotation, axes):
            return name
    angles, axes = angles_and_axes(rotation[None])
    axis = ", ".join(f"{part:z.2f}" for part in axes[:, 0])
    return f"{np.degrees(angles[0]):.1f} deg about ({axis})"


def _fitted_frame(gt_poses: Floats, est_poses: Floats, positions: Floats | None) -> Floats:
    """Return the constant B with R̂_i ≈ Q R_i B.

    Between two cameras both turn by the same angle, about axes that B takes to each other. Where
    all turns are about one axis, that leaves B open; the rotation of the positions is Q, too. A B
    near a common one is that: what is between them is inaccuracy.
    """
    gt, est = gt_poses[:, :3, :3], est_poses[:, :3, :3]
    true, estimated = _turns(gt), _turns(est)
    lengths = np.linalg.norm([true, estimated], axis=2)
    alike = np.abs(lengths[0] - lengths[1]) < 0.1  # not so where one of the cameras is an outlier
    moments = true[alike].T @ estimated[alike]
    near_identity = 1e-3 * np.linalg.norm(moments) * np.eye(3)  # where turns are about one axis
    bodies = [project_to_rotation(moments + near_identity)]
    if positions is not None:
        bodies.append(tlud_mean((positions @ gt).swapaxes(1, 2) @ est))
    for _ in range(STEPS):
        frames = [tlud_mean(est @ body.T @ gt.swapaxes(1, 2)) for body in bodies]
        bodies = [tlud_mean((frame @ gt).swapaxes(1, 2) @ est) for frame in frames]
    body = max(bodies, key=lambda body: _ras(gt_poses, est_poses, body)[0])
    common = np.array(list(COMMON.values()))
    apart = rotation_angles(common.swapaxes(1, 2) @ body)
    return common[np.argmin(apart)] if apart.min() <= NEAR_DEG else body


def _turns(rotations: Floats) -> Floats:
    """Return the axes of the rotations between some pairs of cameras, as long as their sines."""
    n = len(rotations)
    partners = np.concatenate([np.roll(rotations, k, axis=0) for k in (n // 10, n // 4, n // 2)])
    angles, axes = angles_and_axes(np.tile(rotations, (3, 1, 1)).swapaxes(1, 2) @ partners)
    return np.asarray((np.sin(angles) * axes).T)


def _ras(gt_poses: Floats, est_poses: Floats, body: Floats) -> tuple[float, Floats]:
    """Return the RAS with infinitely many thresholds, and the rotation between the frames."""
    gt, est = gt_poses[:, :3, :3], est_poses[:, :3, :3] @ body.T
    frame = tlud_mean(est @ gt.swapaxes(1, 2))
    errors = rotation_angles((frame @ gt).swapaxes(1, 2) @ est)
    return float(np.maximum(1 - errors / NEAR_DEG, 0).mean()), frame


class _Fit(NamedTuple):
    """Aligned positions: their median error relative to their extent, and the alignment.

    The rotation is None where positions on a line, or that do not fit, leave it open.
    """

    misfit: float = np.inf
    rotation: Floats | None = None
    scale: float = np.nan


def _position_fit(gt_poses: Floats, est_poses: Floats) -> _Fit:
    """Return how well positions fit."""
    gt, est = gt_poses[:, :3, 3], est_poses[:, :3, 3]
    centred = gt - np.median(gt, axis=0)
    extent = float(np.median(np.linalg.norm(centred, axis=1)))
    rank, rng = len(gt) // 2 + 1, np.random.default_rng(0)
    alignment, _ = pcr99(gt, est, rank=rank, n_hypotheses=300, rng=rng)
    if alignment is None or extent == 0:
        return _Fit()
    misfit = float(np.median(alignment.position_errors(gt, est))) / extent
    widths = np.linalg.svd(centred, compute_uv=False)
    has_rotation = misfit < min(0.15, widths[1] / widths[0])
    return _Fit(misfit, alignment.rotation if has_rotation else None, alignment.scale)


# ---------------------------------------------------------------------------- one look at both


class Scored(NamedTuple):
    """What scoring returns for a candidate: the score, and the poses that were compared."""

    score: float
    gt_poses: Floats
    est_poses: Floats


@dataclass(frozen=True)
class Files:
    """Names of both files in messages, and their paths; empty for trajectories in memory."""

    reference: str = "the reference"
    estimate: str = "the estimate"
    ref_path: str = ""
    est_path: str = ""

    def name(self, side: str) -> str:
        """Return the name of a file, or of both."""
        both = f"both {self.reference} and {self.estimate}"
        return {REF: self.reference, EST: self.estimate, BOTH: both}[side]


Attempt = Callable[[Trajectory, Trajectory, Settings], Scored]


@dataclass(frozen=True, eq=False)
class _State:
    """Both trajectories and the settings after the remedies so far, with their score."""

    reference: Trajectory
    estimate: Trajectory
    settings: Settings
    scored: Scored | None
    has_rotations: bool
    notes: tuple[Note, ...] = ()

    @property
    def score(self) -> float:
        return self.scored.score if self.scored else 0.0


@dataclass(frozen=True, eq=False)
class _Remedy:
    """A change that may raise the score: what to say, what to do, and both trajectories then."""

    kind: str
    text: str
    option: str
    reference: Trajectory
    estimate: Trajectory
    changes: dict[str, Any] = field(default_factory=dict)


def look(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    scored: Scored,
    attempt: Attempt,
    files: Files,
    *,
    has_rotations: bool,
) -> list[Note]:
    """Return the hints on mistakes in either file; those found first are corrected for the others.

    The score is the PAS, without rotations the TAS.
    """
    state = _State(reference, estimate, settings, scored, has_rotations)
    for find, min_gain in (
        (_units_of_time, CLEAR_OF_TIME),
        (_clocks, CLEAR_OF_TIME),
        (_conventions, CLEAR),
        (_increments, CLEAR),
        (_units_of_length, CLEAR),
    ):
        if state.score > 1 - min_gain:
            break
        state = _tried(state, list(find(state, files)), min_gain, attempt)
    return list(state.notes)


def rescue(
    reference: Trajectory,
    estimate: Trajectory,
    settings: Settings,
    attempt: Attempt,
    files: Files,
    *,
    has_rotations: bool,
) -> str:
    """Return what lets an estimate be scored that is refused, an empty string if nothing does."""
    state = _State(reference, estimate, settings, None, has_rotations)
    for find in (_units_of_time, _clocks, _increments):
        tried = _tried(state, list(find(state, files)), CLEAR, attempt)
        if tried.notes:
            return str(tried.notes[0])
    return ""


def _tried(state: _State, remedies: Sequence[_Remedy], min_gain: float, attempt: Attempt) -> _State:
    """Return the state with the best remedy, if that raises the score clearly.

    The likeliest come first.
    """
    best, chosen = state, None
    for remedy in remedies:
        settings = replace(state.settings, **remedy.changes)
        with suppress(*FAILURES), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scored = attempt(remedy.reference, remedy.estimate, settings)
            if scored.score > best.score + (CLEARLY if chosen else 0):
                best = replace(
                    state,
                    reference=remedy.reference,
                    estimate=remedy.estimate,
                    settings=settings,
                    scored=scored,
                )
                chosen = remedy
    if chosen is None or best.score < state.score + min_gain:
        return state
    name = "PAS" if state.has_rotations else "TAS"
    before = f"{name} {state.score:.3f} as it is, " if state.scored else f"{name} "
    gain = f"({before}{best.score:.3f} corrected)"
    note = Hint(chosen.kind, f"{chosen.text} {gain}", chosen.option)
    return replace(best, notes=(*state.notes, note))


def _units_of_time(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield units of the stamps of either file, where their steps are no camera's."""
    reference, estimate = state.reference, state.estimate
    if not reference.keys.dtype.kind == estimate.keys.dtype.kind == "f":
        return
    factors = [_time_factors(trajectory.keys) for trajectory in (reference, estimate)]
    for of_ref, of_est in product(*factors):
        if of_ref == of_est == 1:
            continue
        ref, est = (
            trajectory._replace(keys=trajectory.keys * factor)
            for trajectory, factor in ((reference, of_ref), (estimate, of_est))
        )
        units = {
            side: TIME_FACTORS[factor]
            for side, factor in ((REF, of_ref), (EST, of_est))
            if factor != 1
        }
        text = " and ".join(f"{unit} in {files.name(side)}" for side, unit in units.items())
        columns = {side: f"t_{unit}" for side, unit in units.items()}
        option = _columns(state, files, {REF: ref, EST: est}, columns)
        steps = [np.median(np.diff(np.sort(poses.keys))) for poses in (reference, estimate)]
        yield _Remedy(
            "units",
            f"time stamps seem to be {text}: as seconds their steps are {steps[0]:.3g} s in "
            f"{files.reference} and {steps[1]:.3g} s in {files.estimate}",
            f"{option} names the unit" if option else "write seconds",
            ref,
            est,
        )


def _time_factors(stamps: Floats) -> list[float]:
    """Return 1, and factors that make the steps of stamps those of a camera if they are not."""
    steps = np.diff(np.sort(stamps))
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    low, high = STEPS_OF_CAMERAS
    if step == 0 or low <= step <= high:
        return [1.0]
    return [1.0, *(factor for factor in TIME_FACTORS if low <= step * factor <= high)]


def _columns(
    state: _State, files: Files, wanted: dict[str, Trajectory], names: dict[str, str]
) -> str:
    """Return the options that name columns, if reading the files with them has the poses wanted.

    `names` has what stands for t, or for the quaternion, in the columns of each side.
    """
    settings, options = state.settings, {}
    for side, name in names.items():
        path, named, form = (
            (files.ref_path, settings.ref_columns, settings.form)
            if side == REF
            else (files.est_path, settings.est_columns, settings.est_form)
        )
        trajectory = wanted[side]
        usual = f"t x y z {W_LAST}" if finite_rows(trajectory.poses[:, :3, :3]).any() else "t x y z"
        columns = named or settings.columns or usual
        if name.startswith("t_"):
            columns = " ".join(name if word[0] == "t" else word for word in columns.split())
        elif name.startswith("q"):
            parts = iter(name.split())
            columns = " ".join(next(parts) if word[0] == "q" else word for word in columns.split())
        else:
            columns = columns.replace("x y", "y x")
        if not path or not form.tables or not _reads(path, form, columns, trajectory):
            return ""
        options[side] = columns
    if len(options) == 2 and len({*options.values()}) == 1:
        return f"--columns '{options[REF]}'"
    return " ".join(f"--{side[:3]}_columns '{columns}'" for side, columns in options.items())


def _reads(path: str, form: Any, columns: str, wanted: Trajectory) -> bool:
    """Return whether a file, read with these columns, has the stamps and poses of a trajectory."""
    with suppress(*FAILURES), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read = form.read(path, columns=columns)
        order = np.argsort(read.keys, kind="stable")
        nearest, distance = nearest_stamps(read.keys[order], wanted.keys)
        rows, same = order[nearest], distance <= 1e-6
        rotations = read.poses[rows, :3, :3] - wanted.poses[:, :3, :3]
        return bool(same.mean() > 0.9 and not np.nanmax(np.abs(rotations), initial=0) > 1e-3)
    return False


def _clocks(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the offset of the clocks, if it is certain."""
    settings = state.settings
    timed = state.reference.keys.dtype.kind == state.estimate.keys.dtype.kind == "f"
    if not timed or settings.t_offset == "auto" or settings.frames is not None:
        return
    offset = float(settings.t_offset)
    estimate = state.estimate._replace(keys=state.estimate.keys + offset)
    clock = find_clock(state.reference, estimate)
    if clock is None or not clock.certain or (state.scored and clock.agrees):
        return
    seconds = offset + clock.seconds
    yield _Remedy(
        "clock",
        f"its clock is off: its {clock.what} fit those of {files.reference} best with an offset of "
        f"{seconds:.3f} s, standard error {clock.error:.4f} s",
        "--t_offset auto adds it",
        state.reference,
        state.estimate,
        {"t_offset": seconds},
    )


def _conventions(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield the convention of either file, with what corrects it, and mirrored axes."""
    if not state.scored:
        return
    convention = Convention()
    if state.has_rotations:
        convention = find_convention(state.scored.gt_poses, state.scored.est_poses)
    frame = ""
    if convention.body_rotation is not None:
        frame = (
            f"the camera frame of {files.estimate} is rotated against that of {files.reference}, "
            f"{describe_rotation(convention.body_rotation)}"
        )
    changes = {"body_rotation": "auto"} if frame else {}
    if convention.kind:
        yield _of_convention(state, files, convention, frame, changes)
    elif frame:
        option = "--body_rotation auto removes it"
        if _may_both_be_inverted(state.scored, convention.body_rotation):
            option += "; if both files are world-to-camera, --ref_invert --est_invert instead"
        yield _Remedy("frame", frame, option, state.reference, state.estimate, changes)
    if convention.kind or frame or _fits_mirrored(state.scored, state.settings):
        yield from _mirrors(state, files)  # on a plane, both have much the same effect


def _may_both_be_inverted(scored: Scored, body_rotation: Floats | None) -> bool:
    """Return whether a rotation of the camera frame may be one of inverted coordinate frames.

    Inverse poses of two frames that differ by a rotation differ by that rotation of their cameras,
    and not in their positions.
    """
    if body_rotation is None or any((body_rotation == axes).all() for axes in COMMON.values()):
        return False
    some = _sample(scored)
    rotation = _position_fit(scored.gt_poses[some], scored.est_poses[some]).rotation
    return rotation is not None and rotation_angles(rotation[None])[0] <= NEAR_DEG


def _of_convention(
    state: _State, files: Files, found: Convention, frame: str, changes: dict[str, Any]
) -> _Remedy:
    """Return what corrects the convention of poses or rotations."""
    reference, estimate, settings = state.reference, state.estimate, state.settings
    change = CHANGES[found.kind]
    sides = {EST: [EST], REF: [REF], BOTH: [REF, EST]}[found.side]
    ref = reference._replace(poses=change(reference.poses)) if REF in sides else reference
    est = estimate._replace(poses=change(estimate.poses)) if EST in sides else estimate
    names = files.name(found.side)
    if found.is_ambiguous:
        names = f"{files.reference} or {files.estimate}"
    also = f", and {frame}" if frame else ""
    if found.kind == "inverted":
        given = {REF: settings.ref_invert, EST: settings.invert}
        text = f"the poses of {names} seem to be "
        text += "camera-to-world" if given[sides[0]] else "world-to-camera"
        kinds = [REF, EST] if found.is_ambiguous else sides
        options = [f"{'leave out ' * given[side]}--{side[:3]}_invert" for side in kinds]
        option = (" or " if found.is_ambiguous else " ").join(options)
        option = f"{option}{' --body_rotation auto' if frame else ''}"
        option += "" if given[sides[0]] else " corrects it"
    elif found.kind == "inverted rotations":
        text = f"the rotations of {names} seem to be world-to-camera, its positions not"
        option = "transpose them in the file"
    else:
        text = f"the quaternions of {names} seem to have w at the wrong end"
        option = _columns(state, files, {REF: ref, EST: est}, dict.fromkeys(sides, found.kind))
        option = f"name their order with {option}" if option else "reorder them"
    kind = "quaternions" if found.kind in (W_FIRST, W_LAST) else found.kind
    return _Remedy(kind, text + also, option, ref, est, changes)


def _sample(scored: Scored) -> Indices:
    """Return the rows of some estimated positions, evenly spread."""
    rows = np.flatnonzero(finite_rows(scored.est_poses[:, :3, 3]))
    return np.asarray(rows[np.linspace(0, len(rows) - 1, min(SAMPLE, len(rows))).astype(int)])


def _fits_mirrored(scored: Scored, settings: Settings) -> bool:
    """Return whether mirrored positions fit better, or that depends on the mirror."""
    some = _sample(scored)
    if len(some) < MIN_CAMERAS:
        return False
    gt, est = scored.gt_poses[some], scored.est_poses[some]
    flip = np.diag([1.0, 1.0, -1.0, 1.0])
    fixed = settings.alignment in ("yaw", "none")
    return fixed or _position_fit(gt, flip @ est).misfit < _position_fit(gt, est).misfit


def _mirrors(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield swapped columns of a file without rotations, and a mirrored reference."""
    reference, estimate = state.reference, state.estimate
    text = (
        f"{files.reference} and {files.estimate} are mirror images: the reference is left-handed, "
        "as Unity's and Unreal's frames are, or has two axes swapped, such as north and east; or "
        "the estimate"
    )
    positions = reference.poses.copy()
    positions[:, :3, 3] @= MIRRORS[0]
    changed = [positions]
    if state.has_rotations:
        for mirror in MIRRORS:
            poses = reference.poses.copy()
            poses[:, :3, 3] @= mirror
            poses[:, :3, :3] = mirror @ poses[:, :3, :3] @ mirror
            changed.append(poses)
    for side, trajectory in ((REF, reference), (EST, estimate)):
        if not _has_constant(trajectory):
            continue
        poses = trajectory.poses.copy()
        poses[:, :2, 3] = poses[:, 1::-1, 3]
        both = {REF: reference, EST: estimate, side: trajectory._replace(poses=poses)}
        option = _columns(state, files, both, {side: "y x"})
        if option:
            yield _Remedy("mirrored", text, f"{option} swaps two axes", both[REF], both[EST])
    for poses in changed:
        option = "correct the export: no rotation corrects it"
        yield _Remedy("mirrored", text, option, reference._replace(poses=poses), estimate)


def _has_constant(trajectory: Trajectory) -> bool:
    """Return whether a trajectory has positions only, whose rotations are nan or all alike."""
    rotations = trajectory.poses[:, :3, :3]
    rotations = rotations[finite_rows(rotations)]
    return bool((rotations == rotations[:1]).all())


def _increments(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield rows that are motions from frame to frame, multiplied to poses."""
    reference, estimate = state.reference, state.estimate
    if not state.settings.form.ordered or not state.has_rotations or state.score > 0.6:
        return
    if not (finite_rows(reference.poses).all() and finite_rows(estimate.poses).all()):
        return
    n = len(estimate.keys)
    rows = reference.keys.dtype.kind == "i"
    if not state.scored and not (rows and n == len(reference.keys) - 1):
        return
    sample = np.linspace(0, n - 1, min(SAMPLE, n)).astype(int)
    now = np.inf
    if n == len(reference.keys):
        now = _position_fit(reference.poses[sample], estimate.poses[sample]).misfit
    # The product of poses of a common frame can hide noise: both files must look like motions.
    both = [BOTH] if _hardly_rotates(reference) and _hardly_rotates(estimate) else []
    for side, inverse in product((EST, REF, *both), (False, True)):
        ref, est = (
            trajectory._replace(poses=_product(trajectory.poses, inverse))
            if side in (changed, BOTH)
            else trajectory
            for changed, trajectory in ((REF, reference), (EST, estimate))
        )
        if n < len(ref.keys) and rows and side == EST:  # the first pose is the identity
            est = Trajectory(ref.keys, np.concatenate([np.eye(4)[None], est.poses]))
        if len(ref.keys) == len(est.keys):
            fit = _position_fit(ref.poses[sample], est.poses[sample]).misfit
            if fit > (0.15 if side == BOTH else min(0.15, now / 3)):
                continue
        text = f"the rows of {files.name(side)} seem to be motions from frame to frame"
        yield _Remedy("increments", text, "write their product, pose by pose", ref, est)


def _hardly_rotates(trajectory: Trajectory) -> bool:
    """Return whether all rotations are small, as from frame to frame, and not all the same."""
    rotations = trajectory.poses[:, :3, :3]
    small = np.trace(rotations, axis1=1, axis2=2).min() > 1 + 2 * np.cos(np.radians(MOTION_DEG))
    return bool(small) and not _has_constant(trajectory)


def _product(poses: Floats, inverse: bool) -> Floats:
    """Return the poses to which motions from frame to frame multiply."""
    steps = inverse_poses(poses) if inverse else poses
    products = np.empty_like(steps)
    pose = np.eye(4)
    for row, step in enumerate(steps):
        pose = pose @ step
        pose[:3, :3] = project_to_rotation(pose[:3, :3]) if row % 100 == 99 else pose[:3, :3]
        products[row] = pose
    return products


def _units_of_length(state: _State, files: Files) -> Iterator[_Remedy]:
    """Yield other units of length, where the alignment keeps the scale."""
    if not state.scored or state.settings.alignment == "similarity":
        return
    some = _sample(state.scored)
    if len(some) < MIN_CAMERAS:
        return
    scale = _position_fit(state.scored.gt_poses[some], state.scored.est_poses[some]).scale
    for factor, unit in LENGTHS.items():
        for side, ratio in ((EST, factor), (REF, 1 / factor)):
            if abs(np.log(scale / ratio)) < 0.1:
                poses = state.estimate.poses.copy()
                poses[:, :3, 3] /= ratio
                yield _Remedy(
                    "units",
                    f"the positions of {files.name(side)} seem to be in {unit}, with an estimate "
                    f"of {scale:.4g}x the reference",
                    "write both in one unit, or --alignment similarity removes the scale",
                    state.reference,
                    state.estimate._replace(poses=poses),
                )
