"""Which estimated pose belongs to which reference pose: by time, by image name or by row."""

import warnings
from dataclasses import dataclass
from math import inf
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..validation import finite_rows
from .extras import require
from .files import LATEST, Trajectory, TrajectoryWarning

__all__ = ["MISSING", "Matches", "coverage", "in_order", "match"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

MISSING = ("fail", "ignore")
LONG_GAP = 10, 1.0  # in median gaps, and in seconds; a gap that exceeds both is a lost track
NANOSECONDS = 0.5e9, 2e9  # range of the ratio of time stamps where one file is in nanoseconds


@dataclass(frozen=True, eq=False)
class Matches:
    """Reference and estimated poses, row by row the same camera, ready to be scored.

    Parameters
    ----------
    keys : (n,) ndarray
        Time stamps, image names or row numbers of the reference.
    gt_poses, est_poses : (n, 4, 4) ndarray
        Camera-to-world poses; an estimated pose is not finite where the camera was not estimated.
    missing : int
        Number of reference poses without an estimated pose, whether they are among the n or not.
    unmatched : int
        Number of estimated poses without a reference pose; they are left out.
    duplicate : int
        Number of estimated poses left out since another one with the same time stamp or name comes
        first, or is closer to their reference pose in time.
    matched : int
        Number of reference poses with an estimated pose, finite or not.
    non_finite : int
        Number of matched estimated poses that are not finite; each of them is a failure.
    """

    keys: NDArray[Any]
    gt_poses: Floats
    est_poses: Floats
    matched: int
    missing: int
    unmatched: int
    duplicate: int
    non_finite: int


def match(
    reference: Trajectory,
    estimate: Trajectory,
    *,
    missing: str = "ignore",
    t_max_diff: float = 0.01,
    t_offset: float = 0.0,
) -> Matches:
    """Find the estimated pose of each reference pose.

    Time stamps are associated by evo, which gives each pose of the shorter trajectory the nearest
    one in time of the longer. No pose is used twice: the closest pair wins. Image names must be
    equal; rows (KITTI) correspond in order, so their number must be the same.

    Parameters
    ----------
    reference, estimate : Trajectory
        As returned by the readers of `alignscores.trajectories.files`.
    missing : {"ignore", "fail"}
        Whether reference poses without an estimated pose are left out, or kept as failures.
    t_max_diff : float
        Largest difference of associated time stamps in seconds.
    t_offset : float
        Added to the estimate's time stamps, in seconds.

    Returns
    -------
    Matches
        The poses of both, and how many of them were matched, missing, left out.

    Raises
    ------
    ValueError
        Where the trajectories have no pose in common, or another kind of keys or, by row, another
        length; or a setting is impossible.
    ModuleNotFoundError
        Where evo is needed and not installed.

    Warns
    -----
    TrajectoryWarning
        Where the stamps are not in order, or keys of the reference are repeated.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.association import match
    >>> from alignscores.trajectories.files import Trajectory
    >>> reference = Trajectory(np.array(["a", "b", "c"]), np.tile(np.eye(4), (3, 1, 1)))
    >>> estimate = Trajectory(np.array(["c", "x", "a"]), np.tile(np.eye(4), (3, 1, 1)))
    >>> matches = match(reference, estimate, missing="fail")
    >>> matches.matched, matches.missing, matches.unmatched, len(matches.est_poses)
    (2, 1, 1, 3)
    """
    if missing not in MISSING:
        raise ValueError(f"missing must be one of {list(MISSING)}, not {missing!r}")
    for name, seconds, least in (("t_max_diff", t_max_diff, 0), ("t_offset", t_offset, -inf)):
        if not isinstance(seconds, Real) or not least <= seconds < inf:
            raise ValueError(f"{name} must be a finite number of seconds, not {seconds!r}")
    kinds = reference.keys.dtype.kind, estimate.keys.dtype.kind
    if kinds == ("f", "f"):
        pairing = _match_times(reference.keys, estimate.keys, t_max_diff, t_offset)
    elif kinds == ("U", "U"):
        pairing = _match_names(reference.keys, estimate.keys)
    elif kinds == ("i", "i"):
        pairing = _match_rows(reference.keys, estimate.keys)
    else:
        raise ValueError("the two trajectories are not of the same format")

    rows = pairing.ref_kept if missing == "fail" else pairing.ref_rows
    matched = estimate.poses[pairing.est_rows]
    est_poses = np.full((len(reference.keys), 4, 4), np.nan)
    est_poses[pairing.ref_rows] = matched
    return Matches(
        keys=reference.keys[rows],
        gt_poses=reference.poses[rows],
        est_poses=est_poses[rows],
        matched=len(matched),
        missing=len(pairing.ref_kept) - len(matched),
        unmatched=len(estimate.keys) - pairing.duplicate - len(matched),
        duplicate=pairing.duplicate,
        non_finite=int(np.sum(~finite_rows(matched))),
    )


def in_order(reference: Trajectory) -> Trajectory:
    """Return a reference as `match` uses it: without duplicates, in the order of its time stamps.

    Parameters
    ----------
    reference : Trajectory
        As returned by a reader of `alignscores.trajectories.files`.

    Returns
    -------
    Trajectory
        The first pose of each stamp or name; by time where the keys are stamps.

    Warns
    -----
    TrajectoryWarning
        Where the stamps are not in order, or keys are repeated; `match` then has nothing more to
        warn of.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.association import in_order
    >>> from alignscores.trajectories.files import Trajectory
    >>> in_order(Trajectory(np.array([0.0, 0.1, 0.2]), np.tile(np.eye(4), (3, 1, 1)))).keys
    array([0. , 0.1, 0.2])
    """
    rows = _kept(reference.keys, "reference")
    return Trajectory(reference.keys[rows], reference.poses[rows])


def coverage(reference: Trajectory, matches: Matches) -> float:
    """Return the share of a time-stamped reference over which the track was not lost.

    It was lost in gaps between scored poses, and at the ends of the reference, that are longer than
    10 times the median gap and longer than 1 s. The share is one of the reference's poses, so that
    gaps in the reference itself do not count.

    Parameters
    ----------
    reference : Trajectory
        With time stamps as keys, in order.
    matches : Matches
        The result of `match` for it.

    Returns
    -------
    float
        From 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.association import coverage, match
    >>> from alignscores.trajectories.files import Trajectory
    >>> reference = Trajectory(np.arange(100) / 10, np.tile(np.eye(4), (100, 1, 1)))
    >>> rows = np.r_[:30, 70:100]
    >>> estimate = Trajectory(reference.keys[rows], reference.poses[rows])
    >>> coverage(reference, match(reference, estimate))
    0.6
    """
    stamps, scored = reference.keys, matches.keys
    gaps = np.diff(scored, prepend=stamps[0], append=stamps[-1])
    times, seconds = LONG_GAP
    long = gaps > max(times * np.median(gaps), seconds)
    lost = long[np.searchsorted(scored, stamps)] & ~np.isin(stamps, scored)
    return float(np.mean(~lost))


class _Pairing(NamedTuple):
    """Rows of corresponding poses, in the reference's order, and what was left out."""

    ref_rows: Indices
    est_rows: Indices
    ref_kept: Indices  # rows of the reference without duplicates
    duplicate: int  # number of estimated poses left out as duplicates


def _match_times(
    ref_stamps: Floats, est_stamps: Floats, max_diff: float, offset: float
) -> _Pairing:
    sync = require("evo.core.sync", "files")
    ref_kept, est_kept = _kept(ref_stamps, "reference"), _kept(est_stamps, "estimate")
    ref, est = ref_stamps[ref_kept], est_stamps[est_kept]
    # As evo does, from the shorter trajectory: each of its poses gets the nearest of the longer.
    if len(est) > len(ref):
        i, j = sync.matching_time_indices(ref, est, max_diff, offset)
    else:
        j, i = sync.matching_time_indices(est, ref, max_diff, -offset)
    if len(i) == 0:
        raise ValueError(
            f"no time stamps in common: the reference goes from {ref[0]:.6f} to {ref[-1]:.6f} s, "
            f"the estimate from {est[0]:.6f} to {est[-1]:.6f} s (t_offset {offset:g} s, "
            f"t_max_diff {max_diff:g} s){_nanoseconds_hint(ref[-1], est[-1])}"
        )
    pairs = np.array([i, j], dtype=np.intp)
    pairs = pairs[:, np.argsort(np.abs(est[pairs[1]] + offset - ref[pairs[0]]), kind="stable")]
    n_associated = len(np.unique(pairs[1]))
    pairs = pairs[:, _is_first(pairs[0]) & _is_first(pairs[1])]
    pairs = pairs[:, np.argsort(pairs[0])]
    return _Pairing(
        ref_rows=ref_kept[pairs[0]],
        est_rows=est_kept[pairs[1]],
        ref_kept=ref_kept,
        duplicate=len(est_stamps) - len(est_kept) + n_associated - pairs.shape[1],
    )


def _nanoseconds_hint(ref_stamp: float, est_stamp: float) -> str:
    if min(ref_stamp, est_stamp) > LATEST:
        return "; both seem to be in nanoseconds: write them in seconds"
    low, high = NANOSECONDS
    for whose, one, other in (
        ("reference", ref_stamp, est_stamp),
        ("estimate", est_stamp, ref_stamp),
    ):
        if low * other < one < high * other:
            return f"; those of the {whose} seem to be in nanoseconds: write them in seconds"
    return ""


def _match_names(ref_names: NDArray[Any], est_names: NDArray[Any]) -> _Pairing:
    ref_kept, est_kept = _kept(ref_names, "reference"), _kept(est_names, "estimate")
    row_of = dict(zip(est_names[est_kept].tolist(), est_kept.tolist(), strict=True))
    ref_rows = [row for row in ref_kept.tolist() if ref_names[row] in row_of]
    if not ref_rows:
        raise ValueError(
            "no image names in common: the reference has "
            f"{str(ref_names[0])!r}, the estimate {str(est_names[0])!r}, for example"
        )
    est_rows = [row_of[str(ref_names[row])] for row in ref_rows]
    return _Pairing(
        ref_rows=np.array(ref_rows, dtype=np.intp),
        est_rows=np.array(est_rows, dtype=np.intp),
        ref_kept=ref_kept,
        duplicate=len(est_names) - len(est_kept),
    )


def _match_rows(ref_rows: NDArray[Any], est_rows: NDArray[Any]) -> _Pairing:
    if len(ref_rows) != len(est_rows):
        raise ValueError(
            f"the reference has {len(ref_rows)} poses, the estimate {len(est_rows)}: without "
            "stamps or names they correspond row by row, so their number must be the same"
        )
    rows = np.arange(len(ref_rows))
    return _Pairing(ref_rows=rows, est_rows=rows, ref_kept=rows, duplicate=0)


def _kept(keys: NDArray[Any], whose: str) -> Indices:
    """Return the first row of each key; of time stamps, in their order."""
    rows = np.arange(len(keys))
    if keys.dtype.kind == "f":
        backwards = np.diff(keys) < 0
        if backwards.any():
            row = int(np.argmax(backwards)) + 1
            _warn(
                f"the time stamps of the {whose} are not in order (first at pose {row + 1}, "
                f"{keys[row]:.6f} s); sorted"
            )
        rows = np.argsort(keys, kind="stable")
    kept = rows[_is_first(keys[rows])]
    if whose == "reference" and len(kept) < len(rows):
        _warn(f"duplicates in the reference (of stamp or name), left out: {len(rows) - len(kept)}")
    return kept


def _is_first(values: NDArray[Any]) -> NDArray[np.bool_]:
    first = np.zeros(len(values), dtype=bool)
    first[np.unique(values, return_index=True)[1]] = True
    return first


def _warn(message: str) -> None:
    warnings.warn(message, TrajectoryWarning, stacklevel=4)
