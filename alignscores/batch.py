"""Scores of many scenes in one call, the same as `tas`, `ras` and `pas`, bit for bit."""

import contextlib
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from operator import index
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .aligner import Aligned, Aligner, Seed
from .arrays import Floats, Indices
from .histogram import cumulative_frequency, equal_steps
from .pose import PASResult, check_weight
from .registration import Registration
from .rotation import RASResult, align_rotations
from .similarity import Similarity, check_alignment
from .translation import TASResult, no_unit
from .validation import (
    AlignmentWarning,
    check_poses,
    check_positions,
    check_positive,
    check_rotations,
    finite_rows,
    real_array,
)

__all__ = [
    "PASBatch",
    "RASBatch",
    "TASBatch",
    "pas_batch",
    "ras_batch",
    "tas_batch",
]


@dataclass(frozen=True, eq=False)
class _Batch:
    """Scores of scenes, with the errors of their cameras in one array."""

    score: Floats
    n_cameras: Indices
    n_lost: Indices
    errors: Floats = field(repr=False)
    thresholds: Floats = field(repr=False)
    starts: Indices = field(repr=False)

    def __len__(self) -> int:
        return len(self.score)

    def _scene(self, scene: int) -> tuple[int, Floats, Floats]:
        """Return the number of a scene, from 0, with its errors and thresholds."""
        scene = range(len(self))[index(scene)]
        rows = slice(*self.starts[scene : scene + 2])
        return scene, self.errors[rows], self.thresholds[scene]


@dataclass(frozen=True, eq=False)
class TASBatch(_Batch):
    """Translation Alignment Scores of scenes; ``[i]`` is the `TASResult` of one.

    Parameters
    ----------
    score : (B,) ndarray
        TAS; NaN where d is undefined.
    n_cameras, n_lost : (B,) ndarray of int
        Numbers of cameras, and of those that were not estimated.
    errors : (N,) ndarray
        Position errors of the cameras of all scenes, in order.
    thresholds : (B, K) ndarray
        Error thresholds in ground-truth units.
    starts : (B + 1,) ndarray of int
        Scene i has the errors from ``starts[i]`` to ``starts[i + 1]``.
    unit : (B,) ndarray
        d of each scene; NaN where it is undefined.
    scale : (B,) ndarray
        Estimated units per ground-truth unit; NaN where there is no alignment.
    registration : str
        Name of the registration.
    aligned : Aligned
        Alignments of all scenes, as rows of scale, rotation and translation.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas_batch
    >>> gt = np.random.default_rng(0).random((3, 20, 3))
    >>> result = tas_batch(gt, 2 * gt)
    >>> result.score, result.scale, result[2].score
    (array([1., 1., 1.]), array([2., 2., 2.]), 1.0)
    """

    unit: Floats
    scale: Floats
    registration: str
    aligned: Aligned = field(repr=False)

    def __getitem__(self, scene: int) -> TASResult:
        scene, errors, thresholds = self._scene(scene)
        if np.isnan(self.score[scene]):
            raise ValueError(no_unit(float(self.unit[scene]), len(errors)))
        return TASResult(
            errors=errors,
            thresholds=thresholds,
            alignment=Similarity.of_row(self.aligned.rows[scene]),
            unit=float(self.unit[scene]),
            n_hypotheses=int(self.aligned.n_hypotheses[scene]),
            registration=self.registration,
        )


@dataclass(frozen=True, eq=False)
class RASBatch(_Batch):
    """Rotation Alignment Scores of scenes; ``[i]`` is the `RASResult` of one.

    Parameters
    ----------
    score : (B,) ndarray
        RAS; NaN where there are no cameras.
    n_cameras, n_lost : (B,) ndarray of int
        Numbers of cameras, and of those that were not estimated.
    errors : (N,) ndarray
        Angular errors in degrees of the cameras of all scenes, in order.
    thresholds : (B, K) ndarray
        Error thresholds in degrees.
    starts : (B + 1,) ndarray of int
        See `TASBatch`.
    alignment : (B, 3, 3) ndarray
        Rotations from the ground-truth to the estimated frames; NaN where no camera was estimated.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import ras_batch
    >>> gt = np.tile(np.eye(3), (2, 5, 1, 1))
    >>> est = gt.copy()
    >>> est[1, 0] = np.nan
    >>> ras_batch(gt, est).score
    array([1. , 0.8])
    """

    alignment: Floats

    def __getitem__(self, scene: int) -> RASResult:
        scene, errors, thresholds = self._scene(scene)
        if len(errors) == 0:
            raise ValueError("gt_rotations has no cameras")
        rotation = self.alignment[scene]
        alignment = None if np.isnan(rotation).all() else rotation
        return RASResult(errors=errors, thresholds=thresholds, alignment=alignment)


@dataclass(frozen=True, eq=False)
class PASBatch:
    """Pose Alignment Scores of scenes; ``[i]`` is the `PASResult` of one.

    Parameters
    ----------
    score : (B,) ndarray
        PAS; NaN where d does not exist.
    tas : TASBatch
        The translation scores.
    ras : RASBatch
        The rotation scores.
    weight : float
        Share of the TAS.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import pas_batch
    >>> poses = np.tile(np.eye(4), (2, 5, 1, 1))
    >>> poses[..., :3, 3] = np.random.default_rng(0).random((2, 5, 3))
    >>> result = pas_batch(poses, poses)
    >>> len(result), result.score, result[0].tas.score
    (2, array([1., 1.]), 1.0)
    """

    score: Floats
    tas: TASBatch
    ras: RASBatch
    weight: float

    def __len__(self) -> int:
        return len(self.score)

    def __getitem__(self, scene: int) -> PASResult:
        tas, ras = self.tas[scene], self.ras[scene]
        score = self.weight * tas.score + (1 - self.weight) * ras.score
        return PASResult(score=score, tas=tas, ras=ras, weight=self.weight)


def pas_batch(
    gt_poses: ArrayLike,
    est_poses: ArrayLike,
    *,
    rng: Seed = 0,
    weight: float = 0.5,
    unit: float | None = None,
    n_hypotheses: int = 1000,
    max_threshold: float = 1.0,
    max_threshold_deg: float = 10.0,
    n_thresholds: int = 100,
    registration: str | Registration = "pcr99",
    alignment: str = "similarity",
    up: str = "z",
    threads: int = 1,
) -> PASBatch:
    """Score many scenes in one call: for each the result of `pas`, bit for bit, in less time.

    Parameters
    ----------
    gt_poses : (B, n, 4, 4) or (B, n, 3, 4) array_like, or sequence of (n, 4, 4) or (n, 3, 4)
        Camera-to-world poses of each scene. All-NaN poses are padding.
    est_poses : as gt_poses
        Estimated poses, row i for the camera of row i. A camera whose centre (rotation) is not
        finite fails in the TAS (RAS).
    rng : int, SeedSequence, Generator or None
        Seed with which each scene is registered. A Generator goes on from scene to scene, on one
        thread.
    weight, unit, n_hypotheses, max_threshold, max_threshold_deg, n_thresholds : float, int
        See `pas`; the same for all scenes.
    registration : {"pcr99", "refined"} or Registration
        See `tas`.
    alignment, up : str
        See `tas`.
    threads : int
        Number of threads; no result depends on it.

    Returns
    -------
    PASBatch
        The scores as arrays, and the result of each scene.

    Raises
    ------
    ValueError
        If the input is malformed; the message names scene and row.

    Warns
    -----
    AlignmentWarning
        If estimates cannot be aligned, so that they score 0, or scenes have no d, so that their
        score is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import pas_batch
    >>> rng = np.random.default_rng(0)
    >>> gt = np.tile(np.eye(4), (100, 20, 1, 1))
    >>> gt[..., :3, 3] = rng.random((100, 20, 3))
    >>> est = gt.copy()
    >>> est[:50, :4] = np.nan
    >>> result = pas_batch(gt, est)
    >>> result.score[[0, 99]], result.tas.n_lost.sum()
    (array([0.8, 1. ]), np.int64(200))
    """
    weight = check_weight(weight)
    truth, estimate, starts = _scenes(gt_poses, est_poses, "poses", check_poses)
    (gt_rotations, gt), (est_rotations, est) = truth, estimate
    positions = _tas_batch(
        gt,
        est,
        starts,
        unit=unit,
        max_threshold=max_threshold,
        n_thresholds=n_thresholds,
        registration=registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
        threads=threads,
    )
    rotations = _ras_batch(
        gt_rotations, est_rotations, starts, max_threshold_deg, n_thresholds, alignment, up
    )
    score = weight * positions.score + (1 - weight) * rotations.score
    return PASBatch(score=score, tas=positions, ras=rotations, weight=weight)


def tas_batch(
    gt_positions: ArrayLike,
    est_positions: ArrayLike,
    *,
    rng: Seed = 0,
    unit: float | None = None,
    n_hypotheses: int = 1000,
    max_threshold: float = 1.0,
    n_thresholds: int = 100,
    registration: str | Registration = "pcr99",
    alignment: str = "similarity",
    up: str = "z",
    threads: int = 1,
) -> TASBatch:
    """Score the positions of many scenes in one call: for each the result of `tas`, bit for bit.

    Parameters
    ----------
    gt_positions, est_positions : (B, n, 3) array_like, or sequence of (n, 3)
        Camera centres of each scene; see `pas_batch`.
    rng, unit, n_hypotheses, max_threshold, n_thresholds, registration, alignment, up : as in `tas`
        The same for all scenes.
    threads : int
        See `pas_batch`.

    Returns
    -------
    TASBatch
        The scores as arrays, and the result of each scene.

    Raises
    ------
    ValueError
        If the input is malformed; the message names scene and row.

    Warns
    -----
    AlignmentWarning
        See `pas_batch`.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import tas_batch
    >>> rng = np.random.default_rng(0)
    >>> scenes = [rng.random((n, 3)) for n in (10, 20, 30)]
    >>> result = tas_batch(scenes, scenes)
    >>> result.score, result.n_cameras
    (array([1., 1., 1.]), array([10, 20, 30]))
    """
    (gt,), (est,), starts = _scenes(gt_positions, est_positions, "positions", check_positions)
    return _tas_batch(
        gt,
        est,
        starts,
        unit=unit,
        max_threshold=max_threshold,
        n_thresholds=n_thresholds,
        registration=registration,
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up=up,
        threads=threads,
    )


def ras_batch(
    gt_rotations: ArrayLike,
    est_rotations: ArrayLike,
    *,
    max_threshold_deg: float = 10.0,
    n_thresholds: int = 100,
    alignment: str = "similarity",
    up: str = "z",
) -> RASBatch:
    """Score the rotations of many scenes in one call: for each the result of `ras`, bit for bit.

    Parameters
    ----------
    gt_rotations, est_rotations : (B, n, 3, 3) array_like, or sequence of (n, 3, 3)
        Camera-to-world rotations of each scene; see `pas_batch`.
    max_threshold_deg, n_thresholds, alignment, up : as in `ras`
        The same for all scenes.

    Returns
    -------
    RASBatch
        The scores as arrays, and the result of each scene.

    Raises
    ------
    ValueError
        If the input is malformed; the message names scene and row.

    Warns
    -----
    AlignmentWarning
        If no camera of a scene was estimated; its score is 0.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> from alignscores import ras_batch
    >>> gt = Rotation.from_euler("z", [[0], [40], [80], [120]], degrees=True)
    >>> est = Rotation.from_euler("x", [[5], [5], [5], [90]], degrees=True) * gt
    >>> ras_batch([gt.as_matrix()], [est.as_matrix()]).score
    array([0.75])
    """
    (gt,), (est,), starts = _scenes(gt_rotations, est_rotations, "rotations", check_rotations)
    return _ras_batch(gt, est, starts, max_threshold_deg, n_thresholds, alignment, up)


def _tas_batch(
    gt: Floats,
    est: Floats,
    starts: Indices,
    *,
    unit: float | None,
    max_threshold: float,
    n_thresholds: int,
    threads: int,
    **settings: Any,
) -> TASBatch:
    check_positive(threads, "threads", integer=True)
    aligner = Aligner(gt, est, starts, threads=int(threads), **settings)
    steps = equal_steps(max_threshold, n_thresholds, "max_threshold")
    aligned = aligner.align(unit, steps[-1])
    units = aligned.units
    thresholds = units[:, None] * steps
    scored = (units > 0) & (units < np.inf) & (np.diff(starts) > 0)
    _warn(~scored, "TAS is undefined", "too few cameras, or too many of them coincide")
    _warn(scored & np.isnan(aligned.rows[:, 0]), "TAS is 0", "the estimate cannot be aligned")
    score = _scores(aligned.errors, thresholds, starts)
    score[~scored] = np.nan
    return TASBatch(
        score=score,
        **_counts(est, starts),
        errors=aligned.errors,
        thresholds=thresholds,
        starts=starts,
        unit=units,
        scale=aligned.rows[:, 0],
        registration=aligner.registration,
        aligned=aligned,
    )


def _ras_batch(
    gt: Floats,
    est: Floats,
    starts: Indices,
    max_threshold_deg: float,
    n_thresholds: int,
    alignment: str,
    up: str,
) -> RASBatch:
    check_alignment(alignment, up)
    steps = equal_steps(max_threshold_deg, n_thresholds, "max_threshold_deg")
    thresholds = np.tile(steps, (len(starts) - 1, 1))
    rotations, errors = align_rotations(gt, est, starts, alignment, up)
    failed = np.isnan(rotations).all(axis=(1, 2)) & (np.diff(starts) > 0)
    _warn(failed, "RAS is 0", "no camera was estimated")
    return RASBatch(
        score=_scores(errors, thresholds, starts),
        **_counts(est, starts),
        errors=errors,
        thresholds=thresholds,
        starts=starts,
        alignment=rotations,
    )


def _scenes(gt: Any, est: Any, kind: str, check: Callable[..., Any]) -> tuple[Any, Any, Indices]:
    """Return the checked cameras of all scenes, and where each scene starts."""
    names = f"gt_{kind}", f"est_{kind}"
    truth, counts = _checked(gt, names[0], check)
    estimate, est_counts = _checked(est, names[1], check)
    if len(counts) != len(est_counts):
        raise ValueError(f"{names[0]} has {len(counts)} scenes but {names[1]} {len(est_counts)}")
    for scene, (n, n_est) in enumerate(zip(counts, est_counts, strict=True)):
        if n != n_est:
            raise ValueError(
                f"{names[0]}[{scene}] has {n} cameras but {names[1]}[{scene}] has {n_est}; "
                "row i of both must be the same camera"
            )
    starts = np.append(0, np.cumsum(counts))
    values = np.hstack([part.reshape(starts[-1], -1) for part in truth])
    padding, finite = np.isnan(values).all(axis=1), np.isfinite(values).all(axis=1)
    if not (padding | finite).all():
        row = int(np.argmin(padding | finite))
        scene = int(np.searchsorted(starts, row, side="right")) - 1
        raise ValueError(f"{names[0]}[{scene}][{row - starts[scene]}] is not finite")
    if padding.any():
        truth, estimate = ([part[finite] for part in parts] for parts in (truth, estimate))
        starts = np.append(0, np.cumsum(finite))[starts]
    return truth, estimate, starts


def _checked(
    scenes: Any, name: str, check: Callable[..., Any]
) -> tuple[Sequence[Floats], list[int]]:
    """Check all scenes at once; if one is wrong, each, so that the error names it."""
    flat: Any = None
    if isinstance(scenes, (list, tuple)):
        for i, scene in enumerate(scenes):
            if not hasattr(scene, "__len__"):
                raise ValueError(f"{name}[{i}] must be an array of cameras, not {scene!r}")
        counts = [len(scene) for scene in scenes]
        kinds = {(type(scene), getattr(scene, "dtype", 0)) for scene in scenes}
        if len(kinds) == 1 and isinstance(scenes[0], np.ndarray):
            with contextlib.suppress(ValueError):  # whose shapes differ
                flat = np.concatenate(scenes)
    else:
        scenes = scenes if hasattr(scenes, "reshape") else real_array(scenes, name)
        n_scenes, n, *rest = (*scenes.shape, 0, 0)[: max(2, len(scenes.shape))]
        counts = n_scenes * [n]
        flat = scenes.reshape(n_scenes * n, *rest)
    if not any(counts):
        raise ValueError(f"{name} has no cameras")
    if flat is not None:
        with contextlib.suppress(ValueError):
            return _as_parts(check(flat, name, complete=False)), counts
    checked = [
        _as_parts(check(scenes[i], f"{name}[{i}]", complete=False))
        for i, n in enumerate(counts)
        if n
    ]
    return [np.concatenate(part) for part in zip(*checked, strict=True)], counts


def _as_parts(checked: Any) -> Sequence[Floats]:
    return checked if isinstance(checked, tuple) else (checked,)


def _counts(est: Floats, starts: Indices) -> dict[str, Indices]:
    missing_before = np.append(0, np.cumsum(~finite_rows(est)))[starts]
    return {"n_cameras": np.diff(starts), "n_lost": np.diff(missing_before)}


def _scores(errors: Floats, thresholds: Floats, starts: Indices) -> Floats:
    """Return the score of each scene, NaN where it has no cameras."""
    n_thresholds = thresholds.shape[1]
    return np.array(
        [
            int(cumulative_frequency(errors[start:end], steps).sum())
            / (n_thresholds * (end - start))
            if end > start
            else np.nan
            for (start, end), steps in zip(pairwise(starts.tolist()), thresholds, strict=True)
        ]
    )


def _warn(scenes: NDArray[np.bool_], what: str, why: str) -> None:
    """Warn of scenes at the line of the user's call, three calls up."""
    if scenes.any():
        first, count = int(np.argmax(scenes)), np.count_nonzero(scenes)
        warnings.warn(
            f"{what} in {count} of {len(scenes)} scenes, first in [{first}]: {why}",
            AlignmentWarning,
            stacklevel=4,
        )
