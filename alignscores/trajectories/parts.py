"""An estimate in parts, such as the sub-models of COLMAP, each of which has a world of its own.

Each part is aligned on its own, with all its cameras, as if it were the whole estimate and all
other cameras were lost. A camera that several parts hold is counted by the largest of them, so
without regard to its errors; a camera that none holds is a failure. Where no two parts share a
camera the TAS of the whole is thus the sum of those of the parts, and so is the RAS.

Whoever merges the parts chooses similarities between their worlds, and an alignment of the whole
follows. All of this is one special choice of an alignment for each part: with the best alignments
the score of the parts is an upper bound of that of every model merged from them. So scores of
different numbers of parts do not compare. A part of fewer than 3 cameras has no alignment, and a
single camera fits any rotation: such cameras fail.
"""

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Floats, Indices
from ..pose import PASResult
from ..profile import ScoreProfile, _errors_at, _searched, tas_profile
from ..rotation import RASResult
from ..similarity import Similarity
from ..translation import TASResult
from ..validation import AlignmentWarning, finite_rows
from .files import Trajectory

__all__ = [
    "LEAST",
    "combine",
    "combine_tas",
    "holders",
    "in_one_world",
    "joined",
    "poses_of",
    "profile_of_parts",
]


LEAST = 3  # cameras of a part that can be aligned


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Return the cameras of all parts, each once, in the order of their names.

    Its poses are of different worlds; it tells which cameras were estimated. A single part is
    returned as it is.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.files import Trajectory
    >>> from alignscores.trajectories.parts import joined
    >>> poses = np.tile(np.eye(4), (2, 1, 1))
    >>> parts = [Trajectory(np.array(names), poses) for names in (["a", "c"], ["b", "c"])]
    >>> joined(parts).keys.tolist()
    ['a', 'b', 'c']
    """
    if len(parts) == 1:
        return parts[0]
    keys, rows = np.unique(np.concatenate([part.keys for part in parts]), return_index=True)
    return Trajectory(keys, np.concatenate([part.poses for part in parts])[rows])


def poses_of(part: Trajectory, names: Sequence[str | None]) -> Floats:
    """Return the pose of each name in a part, (n, 4, 4), not finite where it has none.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.files import Trajectory
    >>> from alignscores.trajectories.parts import poses_of
    >>> part = Trajectory(np.array(["a", "c"]), np.tile(np.eye(4), (2, 1, 1)))
    >>> np.isfinite(poses_of(part, ["c", "b", None])).all(axis=(1, 2))
    array([ True, False, False])
    """
    places = {name: row for row, name in enumerate(part.keys.tolist())}
    rows = np.array([places.get(name, -1) for name in names], dtype=np.intp)
    poses = part.poses[rows].copy()
    poses[rows < 0] = np.nan
    return poses


def holders(parts_poses: Sequence[Floats]) -> Indices:
    """Return which part counts each camera: the largest one that holds it; -1 where none does.

    Parameters
    ----------
    parts_poses : sequence of (n, 4, 4) array
        Poses of the same cameras in each part; not finite where the part does not hold the camera.

    Returns
    -------
    (n,) ndarray of int
        Index of the part, the first one of equally large ones. Parts of fewer than 3 cameras hold
        none.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.parts import holders
    >>> parts = np.tile(np.eye(4), (2, 8, 1, 1))
    >>> parts[0, 3:] = parts[1, [0, 1, 7]] = np.nan
    >>> holders(parts)
    array([ 0,  0,  1,  1,  1,  1,  1, -1])
    """
    held = np.array([finite_rows(poses) for poses in parts_poses])
    sizes = held.sum(axis=1)
    largest = np.argmax(np.where(held, sizes[:, None], 0), axis=0)
    return np.where((held & (sizes >= LEAST)[:, None]).any(axis=0), largest, -1)


def combine_tas(results: Sequence[TASResult], holder: Indices) -> TASResult:
    """Return the TAS of the whole: the error of each camera is that in the part that counts it.

    Parameters
    ----------
    results : sequence of TASResult
        Of each part, over all cameras, with the same d and thresholds.
    holder : (n,) ndarray of int
        As of `holders`.

    Returns
    -------
    TASResult
        Its alignment is the identity, as for poses `in_one_world`; of a single part, its result.
    """
    first = results[0]
    if len(results) == 1:
        return first
    return replace(
        first,
        errors=_errors(results, holder),
        alignment=Similarity(1.0, np.eye(3), np.zeros(3)),
        n_hypotheses=sum(one.n_hypotheses for one in results),
    )


def combine(results: Sequence[PASResult], holder: Indices) -> PASResult:
    """Return the PAS of the whole: the weighted mean of its TAS and RAS.

    Parameters are as for `combine_tas`.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import pas
    >>> from alignscores.trajectories.parts import combine, holders
    >>> gt = np.tile(np.eye(4), (20, 1, 1))
    >>> gt[:, :3, 3] = np.random.default_rng(0).random((20, 3))
    >>> gt[:, :3, :3] = Rotation.random(20, rng=1).as_matrix()
    >>> first, second = gt.copy(), gt @ np.diag([2.0, 2.0, 2.0, 1.0])
    >>> second[:, :3, :3] /= 2
    >>> first[8:], second[:10] = np.nan, np.nan
    >>> results = [pas(gt, part) for part in (first, second)]
    >>> whole = combine(results, holders([first, second]))
    >>> results[0].score, results[1].score, whole.score
    (0.4, 0.5, 0.9)
    """
    if len(results) == 1:
        return results[0]
    tas = combine_tas([one.tas for one in results], holder)
    rotations = [one.ras for one in results]
    ras: RASResult = replace(rotations[0], errors=_errors(rotations, holder), alignment=np.eye(3))
    weight = results[0].weight
    score = weight * tas.score + (1 - weight) * ras.score
    return PASResult(score=score, tas=tas, ras=ras, weight=weight)


def profile_of_parts(
    gt_positions: Floats,
    parts_positions: Sequence[Floats],
    holder: Indices,
    units: Floats,
    *,
    rng: int,
) -> ScoreProfile:
    """Return the TAS of the whole over all units, by the refined registration.

    Parameters
    ----------
    gt_positions : (n, 3) ndarray
        Camera centres.
    parts_positions : sequence of (n, 3) ndarray
        Centres of the same cameras in each part; not finite where the part does not hold it.
    holder : (n,) ndarray of int
        As of `holders`.
    units : (U,) ndarray
        See `tas_profile`.
    rng : int
        Seed.

    Returns
    -------
    ScoreProfile
        At each unit each part is aligned so that its own score there is the largest. Of a single
        part it is its `tas_profile`.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.parts import profile_of_parts
    >>> gt = np.random.default_rng(0).random((20, 3))
    >>> parts = np.array([gt, 2 * gt])
    >>> parts[0, 8:] = parts[1, :8] = np.nan
    >>> holder = np.repeat([0, 1], [8, 12])
    >>> profile_of_parts(gt, parts, holder, np.array([0.1, 1.0]), rng=0).scores
    array([1., 1.])
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AlignmentWarning)
        if len(parts_positions) == 1:
            return tas_profile(gt_positions, parts_positions[0], units, rng=rng)
        searches = [_errors_at(gt_positions, part, "refined", rng=rng) for part in parts_positions]
        lost = np.full(len(holder), np.inf)

        def errors_at(unit: float) -> Floats:
            found = [search(unit) for search in searches]
            return _counted([lost if errors is None else errors for errors in found], holder)

        return _searched(units, errors_at(units[0]), errors_at, n_thresholds=100)


def _errors(results: Sequence[TASResult] | Sequence[RASResult], holder: Indices) -> Floats:
    return _counted([one.errors for one in results], holder)


def _counted(parts_errors: Sequence[Floats], holder: Indices) -> Floats:
    """Return the error of each camera in the part that counts it; infinite where none does."""
    errors = np.array(parts_errors)[holder, np.arange(len(holder))]
    return np.where(holder < 0, np.inf, errors)


def in_one_world(
    parts_poses: Sequence[Floats], results: Sequence[PASResult], holder: Indices
) -> Floats:
    """Return the pose of each camera in the world of the ground truth, by its part's alignment.

    Parameters
    ----------
    parts_poses : sequence of (n, 4, 4) array
        Poses of the same cameras in each part.
    results : sequence of PASResult
        Of each part.
    holder : (n,) ndarray of int
        As of `holders`.

    Returns
    -------
    (n, 4, 4) ndarray
        Not finite where no part holds the camera; the position (rotation) not where the part's
        TAS (RAS) has no alignment.
    """
    poses = np.tile(np.eye(4), (len(holder), 1, 1))
    poses[:, :3] = np.nan
    for index, (part, result) in enumerate(zip(parts_poses, results, strict=True)):
        rows = holder == index
        if result.tas.alignment is not None:
            poses[rows, :3, 3] = result.tas.alignment.inverse().apply(part[rows, :3, 3])
        if result.ras.alignment is not None:
            poses[rows, :3, :3] = result.ras.alignment.T @ part[rows, :3, :3]
    return poses
