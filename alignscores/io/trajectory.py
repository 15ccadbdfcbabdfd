"""Trajectories: poses with their stamps, names or numbers, and the checks that each reader makes.

A quaternion is a rotation if its length is within 0.1 of one, a matrix if its R^T R is within 0.1
of the identity. Both are normalised. Others are refused with their line, in every format.
"""

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats
from ..averaging import nearest_rotations, rotations_from_quaternions
from ..files import FileError, FilePath, Source
from ..validation import finite_rows

__all__ = ["Trajectory", "TrajectoryWarning", "inverse_poses"]

MAX_ROUNDING = 1e-2  # deviation from a unit quaternion or a rotation that counts as rounding
MAX_DEVIATION = 0.1  # deviation beyond which a quaternion or a matrix is refused
MAX_DUPLICATES = 0.1  # share of the poses; more duplicates are an error
MIN_IN_ORDER = 0.9  # share of the steps upwards in numbers that may be time stamps
MAX_NAME = 255  # characters of an image's name; an array has room for the longest in each row
MIN_RUN = 10  # poses of a run; where stamps jump back more often, the rows are not in order
TRANSPOSE = ", unlike the last column: transpose it"
BLOCK = 1 << 14  # rows that are converted at once, which the cache of a processor holds

TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ticks": 1e7, "ns": 1e9}  # in a second
MAX_SECONDS = 1e11  # larger time stamps, as a rule, are in a smaller unit
# Stamps that differ by 5e6 or more are nanoseconds since a start, up to three years: such steps
# would be 5 s and more in microseconds since 1970. So are those of a day that differ by 5e5, for
# 10 s: in microseconds these would be slow, and shorter ones in nanoseconds no recording.
MAX_NANOSECONDS, MIN_NANOSECOND_STEP = 1e17, 5e6
MAX_FAST, MIN_FAST_STEP, MIN_FAST_DURATION = 1e14, 5e5, 1e10
# Seconds from the start of ticks of 100 ns to 1970: none, 1601 (Windows), the year 1 (.NET).
EPOCHS = 0.0, 11_644_473_600.0, 62_135_596_800.0
TODAY = 6e8, 3.5e9  # seconds since 1970, from 1989 to 2080


class TrajectoryWarning(UserWarning):
    """Something in a trajectory that was corrected, and that the user should know about."""


class Trajectory(NamedTuple):
    """Poses with what identifies each of them.

    Parameters
    ----------
    keys : (n,) ndarray
        Time stamps in seconds (float), image names (str) or row numbers (int).
    poses : (n, 4, 4) ndarray
        Camera-to-world poses.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import Trajectory
    >>> trajectory = Trajectory(np.array([0.5, 1.0]), np.tile(np.eye(4), (2, 1, 1)))
    >>> trajectory
    Trajectory(2 poses, 0.5 to 1.0)
    >>> trajectory.positions.shape, trajectory.rotations.shape
    ((2, 3), (2, 3, 3))
    >>> keys, poses = trajectory
    >>> keys
    array([0.5, 1. ])
    """

    keys: NDArray[Any]
    poses: Floats

    def __repr__(self) -> str:
        n = len(self.keys)
        return f"Trajectory({n} poses, {self.keys[0]} to {self.keys[-1]})" if n else "Trajectory()"

    @property
    def positions(self) -> Floats:
        """Camera centres, (n, 3); NaN where there is none."""
        return self.poses[:, :3, 3]

    @property
    def rotations(self) -> Floats | None:
        """Rotations, (n, 3, 3), NaN where there is none; None without rotations."""
        return self.poses[:, :3, :3] if self.has_rotations else None

    @property
    def has_rotations(self) -> bool:
        """Whether a rotation is finite; False without rotations."""
        rotations, positions = self.poses[:, :3, :3], self.poses[:, :3, 3]
        return bool(finite_rows(rotations).any() or not finite_rows(positions).any())

    def with_rotations(self) -> "Trajectory":
        """Return a trajectory without rotations with identity ones, others unchanged.

        Returns
        -------
        Trajectory
            The trajectory, each finite pose with a rotation.

        Examples
        --------
        >>> import numpy as np
        >>> from alignscores import Trajectory
        >>> Trajectory(np.arange(2.0), np.tile(np.eye(4), (2, 1, 1))).with_rotations()
        Trajectory(2 poses, 0.0 to 1.0)
        """
        if self.has_rotations:
            return self
        poses = self.poses.copy()
        poses[finite_rows(poses[:, :3, 3]), :3, :3] = np.eye(3)
        return self._replace(poses=poses)


def checked(keys: NDArray[Any], poses: Floats, source: Source) -> Trajectory:
    """Return a trajectory; refuse it if a tenth of its poses have the key of another one.

    A position or rotation with a number that is not finite was not estimated; it becomes all NaN.
    """
    for part in (poses[:, :3, 3], poses[:, :3, :3]):
        finite = finite_rows(part)
        if not finite.all():
            part[~finite] = np.nan
    if keys.dtype.kind == "f":
        if (keys[1:] > keys[:-1]).all():
            return Trajectory(keys, poses)
        _refuse_several_runs(keys, source)
    present = np.flatnonzero(finite_rows(poses[:, :3, 3]))
    _, first = np.unique(keys[present], return_index=True)
    n, n_duplicates = len(present), len(present) - len(first)
    if n_duplicates == 0:
        return Trajectory(keys, poses)
    row = int(np.setdiff1d(present, present[first])[0])
    what = {"f": "time stamp", "U": "name"}.get(keys.dtype.kind, "number")
    example = f"{keys[row]:.6f}" if keys.dtype.kind == "f" else str(keys[row])[:60]
    have = "pose has" if n_duplicates == 1 else "poses have"
    reason = f"{n_duplicates} of {n} {have} the {what} of another one, such as {example}"
    if n_duplicates >= MAX_DUPLICATES * n:
        remedy = "write each pose once"
        if what == "time stamp":
            remedy = "write stamps with all their digits, and each pose once"
            if row and keys[row] < keys[row - 1]:
                jump = keys[row - 1] - keys[row]
                remedy = f"stamps jump back by {jump:.6g} s here; write a file for each run"
        raise source.error(row, f"{reason}; {remedy}")
    if what != "time stamp":  # where poses are matched by time, there is a note on them
        warn(f"{source.path}, {source.place_of_row(row)}", f"{reason}; the first one is used")
    return Trajectory(keys, poses)


def image_names(names: Sequence[str], source: Source) -> NDArray[np.str_]:
    """Return an array of names; refuse one so long that it is no name."""
    long = next((row for row, name in enumerate(names) if len(name) > MAX_NAME), None)
    if long is not None:
        reason = f"the name of an image has {len(names[long])} characters, more than {MAX_NAME}"
        raise FileError(source.path, f"{reason}: {names[long][:40]!r} ...")
    return np.array(names)


def _refuse_several_runs(stamps: Floats, source: Source) -> None:
    """Raise an error where stamps jump back and cover the same time again.

    Both runs have several poses in this time; a pose that is out of order is no run.
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(stamps) < 0) + 1])
    ends = np.append(starts[1:], len(stamps)) - 1
    spans = stamps[ends] - stamps[starts]
    if len(starts) == 1 or np.median(ends - starts) < MIN_RUN:
        return
    for run in range(1, len(starts)):
        first, last = stamps[starts[run - 1 : run + 1]], stamps[ends[run - 1 : run + 1]]
        is_again = last.min() - first.max() > spans[run - 1 : run + 1].min() / 2
        before = stamps[starts[run - 1] : starts[run]] >= first.max()
        after = stamps[starts[run] : ends[run] + 1] <= last.min()
        if is_again and min(before.sum(), after.sum()) >= MIN_RUN:
            jump = stamps[ends[run - 1]] - stamps[starts[run]]
            reason = (
                f"the time stamps jump back by {jump:.6g} s: the file seems to hold several runs"
            )
            raise source.error(int(starts[run]), f"{reason}; write a file for each")


def inverse_poses(poses: Floats) -> Floats:
    """Invert poses (n, 4, 4): camera-to-world from world-to-camera, or the other way round."""
    inverse = poses.copy()
    inverse[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    inverse[:, :3, 3] = -np.einsum("nji,nj->ni", poses[:, :3, :3], poses[:, :3, 3])
    return inverse


def poses_from_positions(positions: Floats) -> Floats:
    """Return poses (n, 4, 4) without rotations, which are nan."""
    poses = np.full((len(positions), 4, 4), np.nan)
    poses[:, :3, 3], poses[:, 3] = positions, [0, 0, 0, 1]
    return poses


def poses_from_quaternions(
    positions: Floats, quaternions: Floats, source: Source, remedy: str = ""
) -> Floats:
    """Return poses (n, 4, 4); quaternions are x, y, z, w.

    Quaternions of zeros are no rotations. If others are, the pose was not estimated. The remedy is
    said where they are no quaternions.
    """
    n = len(positions)
    poses, lengths = np.empty((n, 4, 4)), np.empty(n)
    poses[:, 3] = [0, 0, 0, 1]
    for rows in _blocks(n):
        block = quaternions[rows]
        with np.errstate(over="ignore"):
            length = np.linalg.norm(block, axis=1)
        if not np.isfinite(length).all():
            length[~finite_rows(block)] = np.nan  # a camera that was not estimated
        lengths[rows] = length
        unit = block / np.where(length == 0, np.nan, length)[:, None]
        poses[rows, :3, :3] = rotations_from_quaternions(unit)
        poses[rows, :3, 3] = positions[rows]
    zero = lengths == 0
    _check_quaternions(lengths, zero, source, remedy)
    if zero.all():
        warn(source.path, "all quaternions are zero, which are no rotations")
    elif zero.any():
        poses[zero, :3, 3] = np.nan
        poses_have = "pose has" if zero.sum() == 1 else "poses have"
        warn(source.path, f"{zero.sum()} {poses_have} a quaternion of zeros: not estimated")
    return poses


def _check_quaternions(lengths: Floats, zero: Booleans, source: Source, remedy: str) -> None:
    """Raise an error for a quaternion that is none, and warn of those that are rounded."""
    deviation = np.abs(lengths - ~zero)
    wrong = deviation > MAX_DEVIATION
    if wrong.any():
        row = int(np.argmax(wrong))
        also = f", nor {_n_others(int(wrong.sum()) - 1)}" if wrong.sum() > 1 else ""
        reason = f"a quaternion of length {lengths[row]:.3g} is not a rotation{also}{remedy}"
        raise source.error(row, reason)
    _warn_of(deviation, source, "has a quaternion that is not of unit length")


def _n_others(n: int) -> str:
    return "is 1 other" if n == 1 else f"are {n} others"


@np.errstate(invalid="ignore", over="ignore")
def poses_from_vectors(positions: Floats, vectors: Floats, source: Source) -> Floats:
    """Return poses (n, 4, 4) of rotation vectors (n, 3) in radians."""
    angles = np.linalg.norm(vectors, axis=1)
    far = np.isfinite(angles) & (angles > 2 * np.pi + MAX_DEVIATION)
    if far.any():
        row = int(np.argmax(far))
        reason = (
            f"a rotation vector of length {angles[row]:.3g} is not in radians, or has Euler angles"
        )
        raise source.error(row, reason)
    half = angles / 2
    factors = 0.5 * np.sinc(half / np.pi)
    quaternions = np.column_stack([factors[:, None] * vectors, np.cos(half)])
    poses = poses_from_positions(positions)
    poses[:, :3, :3] = rotations_from_quaternions(quaternions)
    return poses


def poses_from_matrices(matrices: Floats, source: Source) -> Floats:
    """Return poses (n, 4, 4) of matrices (n, 3 or 4, 4), with the rotations nearest to theirs."""
    wrong = (matrices[:, 3:] != [0, 0, 0, 1]).any(axis=(1, 2)) & finite_rows(matrices)
    by_columns = bool(matrices[:, 3:, :3].any() and not matrices[:, :3, 3].any())
    source.refuse(wrong, f"the last row of the matrix must be 0 0 0 1{by_columns * TRANSPOSE}")
    poses = poses_from_positions(matrices[:, :3, 3])
    deviation = np.empty(len(poses))
    for rows in _blocks(len(poses)):
        linear = matrices[rows, :3, :3]
        with np.errstate(all="ignore"):
            gram = linear.transpose(0, 2, 1) @ linear
            off = deviation[rows] = np.abs(gram - np.eye(3)).max(axis=(1, 2))
            reflected = (np.linalg.det(linear) < 0) & (off <= MAX_DEVIATION)
        far = ~(off <= MAX_DEVIATION) & finite_rows(linear)
        if far.any():
            row = int(np.argmax(far))
            reason = f"R^T R differs from the identity by {off[row]:.2g}"
            raise source.error(rows.start + row, f"the matrix is not a rotation: {reason}")
        if reflected.any():
            reason = "the matrix is not a rotation: its determinant is negative"
            raise source.error(rows.start + int(np.argmax(reflected)), reason)
        poses[rows, :3, :3] = nearest_rotations(linear)
    _warn_of(deviation, source, "has a matrix that is only roughly a rotation")
    return poses


def time_unit(stamps: Floats) -> str:
    """Return the unit of time stamps, a key of `TIME_UNITS`, as their size or their steps show it.

    Stamps since the start of a recording pass for seconds, also milliseconds and microseconds.
    """
    in_order = bool((stamps[1:] > stamps[:-1]).all())
    size = abs(float(stamps[len(stamps) // 2])) if in_order else float(np.median(np.abs(stamps)))
    steps = np.diff(stamps if in_order else np.unique(stamps))
    step = float(np.median(steps)) if len(steps) else 0.0
    is_fast = size < MAX_FAST and step >= MIN_FAST_STEP and np.ptp(stamps) >= MIN_FAST_DURATION
    if is_fast or (size < MAX_NANOSECONDS and step >= MIN_NANOSECOND_STEP):
        return "ns"
    since_1970 = (size / TIME_UNITS["ticks"] - epoch for epoch in EPOCHS)
    if any(TODAY[0] < seconds < TODAY[1] for seconds in since_1970):
        return "ticks"
    units = (unit for unit in ("s", "ms", "us") if size < MAX_SECONDS * TIME_UNITS[unit])
    return next(units, "ns")


def in_seconds(stamps: Floats, path: FilePath, usual: str = "s") -> Floats:
    """Return time stamps in seconds; warn where their size shows a unit that is not usual."""
    unit = time_unit(stamps)
    if unit not in ("s", usual):
        of_100_ns = " of 100 ns" * (unit == "ticks")
        warn(path, f"time stamps in {unit}{of_100_ns}, as their size shows")
    return stamps / TIME_UNITS[unit]


def refuse_counters(stamps: Floats, source: Source) -> None:
    """Raise an error for keys of poses in place of times, by their size or their steps.

    They are larger than nanoseconds since 1970, such as those of GTSAM, or count by one although
    they are as large as if in us or ns.
    """
    if len(stamps) < 3:
        return
    is_clock = np.ptp(stamps) > 2 * len(stamps) or time_unit(stamps) in ("s", "ms")
    is_large = float(np.median(np.abs(stamps))) > TODAY[1] * TIME_UNITS["ns"]
    if is_large or not is_clock:
        what = "are larger than those of any clock" if is_large else "count by one"
        reason = f"the time stamps {what}, from {stamps.min():.0f} on"
        remedy = "write the time of each pose in seconds; no --t_offset can help"
        raise source.error(0, f"{reason}: they are keys of poses, not times of a clock; {remedy}")


def check_stamps(seconds: Floats, source: Source, per_second: float = 1.0) -> None:
    """Raise an error for a time stamp that is not finite, or too large for seconds.

    The file has `per_second` units of time in a second.
    """
    source.refuse(~np.isfinite(seconds), "the time stamp is not finite")
    far = np.abs(seconds) > MAX_SECONDS
    if far.any():
        row, typical = int(np.argmax(far)), float(np.median(seconds))
        others = f"are near {typical:.6g} s"
        if abs(typical) > MAX_SECONDS:
            unit = time_unit(seconds * per_second)
            others = f"seem to be in {unit}; --columns names the unit, as t_{unit}"
        reason = f"the time stamp of {seconds[row]:.6g} s is not a time; most {others}"
        raise source.error(row, reason)


def _blocks(n: int) -> list[slice]:
    return [slice(start, start + BLOCK) for start in range(0, n, BLOCK)]


def _warn_of(deviation: Floats, source: Source, what: str) -> None:
    """Warn of rotations that deviate from a rotation by more than rounding explains."""
    rows = np.flatnonzero(np.isfinite(deviation) & (deviation > MAX_ROUNDING))
    if len(rows) > 0:
        first, others = int(rows[0]), len(rows) - 1
        more = f" and so have {others} more" if others else ""
        off = f"{what} (off by {deviation[first]:.2g}){more}; normalised"
        warn(f"{source.path}, {source.place_of_row(first)}", off)


def warn(path: FilePath, what: str) -> None:
    """Warn of what is unusual in a file, or at a place in it."""
    warnings.warn(f"{path}: {what}", TrajectoryWarning, stacklevel=4)
