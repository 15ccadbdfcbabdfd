"""TAS, RAS and PAS as evo metrics, for code written for `evo.core.metrics.APE`.

They align the trajectories themselves, which must be associated, but not aligned. Needs the extra
``evo``.
"""

from abc import abstractmethod
from typing import Any

import numpy as np

from ..arrays import Floats
from ..histogram import AlignmentScore
from ..pose import PASResult, pas
from ..rotation import ras
from ..translation import tas
from .extras import require
from .files.poses import orthonormalise

metrics: Any = require("evo.core.metrics", "evo")
Unit: Any = require("evo.core.units", "evo").Unit

__all__ = ["PAS", "RAS", "TAS"]


class _Score(metrics.PE):  # type: ignore[misc]  # evo has no types
    """What the three metrics have in common: `result` after `process_data`, and its `error`."""

    unit = Unit.none

    def __init__(self, **options: Any) -> None:
        self.options = options
        self.error: Floats = np.array([])

    def __str__(self) -> str:
        return f"{type(self).__name__} ({self.unit.value})"

    def process_data(self, data: tuple[Any, Any]) -> None:
        """Score a pair of associated evo trajectories, (reference, estimate)."""
        if len(data) != 2:
            raise metrics.MetricsException("data must be a pair: (reference, estimate)")
        reference, estimate = data
        if reference.num_poses != estimate.num_poses:
            raise metrics.MetricsException(
                f"the reference has {reference.num_poses} poses, the estimate "
                f"{estimate.num_poses}; associate them first"
            )
        try:
            self._score(_poses(reference), _poses(estimate))
        except ValueError as error:
            raise metrics.MetricsException(str(error)) from error

    def get_statistic(self, statistics_type: Any) -> float:
        """Return a statistic of the errors; infinite or NaN where a camera was not estimated."""
        with np.errstate(invalid="ignore"):
            return float(super().get_statistic(statistics_type))

    def get_all_statistics(self) -> dict[str, float]:
        """Return evo's statistics of the errors, and the score under its name."""
        return {type(self).__name__: self.result.score, **super().get_all_statistics()}

    @abstractmethod
    def _score(self, gt_poses: Floats, est_poses: Floats) -> None:
        """Score poses (n, 4, 4) into ``result`` and ``error``."""


class TAS(_Score):
    """Translation Alignment Score; the errors are position errors in the reference's unit.

    Parameters
    ----------
    **options : object
        Keyword arguments of `alignscores.tas`.

    Examples
    --------
    >>> import numpy as np
    >>> from evo.core.trajectory import PosePath3D
    >>> from alignscores.trajectories.evo import TAS
    >>> poses = np.tile(np.eye(4), (5, 1, 1))
    >>> poses[:, :3, 3] = np.random.default_rng(0).random((5, 3))
    >>> metric = TAS(registration="refined")
    >>> metric.process_data((PosePath3D(poses_se3=poses), PosePath3D(poses_se3=poses)))
    >>> metric.result.score
    1.0
    """

    unit = Unit.meters
    result: AlignmentScore

    def _score(self, gt_poses: Floats, est_poses: Floats) -> None:
        self.result = tas(gt_poses[:, :3, 3], est_poses[:, :3, 3], **self.options)
        self.error = self.result.errors


class RAS(_Score):
    """Rotation Alignment Score; the errors are angles in degrees.

    Parameters
    ----------
    **options : object
        Keyword arguments of `alignscores.ras`.

    Examples
    --------
    >>> import numpy as np
    >>> from evo.core.trajectory import PosePath3D
    >>> from alignscores.trajectories.evo import RAS
    >>> path = PosePath3D(poses_se3=np.tile(np.eye(4), (5, 1, 1)))
    >>> metric = RAS(max_threshold_deg=5)
    >>> metric.process_data((path, path))
    >>> metric.result.score
    1.0
    """

    unit = Unit.degrees
    result: AlignmentScore

    def _score(self, gt_poses: Floats, est_poses: Floats) -> None:
        self.result = ras(gt_poses[:, :3, :3], est_poses[:, :3, :3], **self.options)
        self.error = self.result.errors


class PAS(_Score):
    """Pose Alignment Score.

    A pose has no single error: ``error`` is the weighted share of the thresholds that the pose
    misses, from 0 to 1. Its mean is 1 - PAS.

    Parameters
    ----------
    **options : object
        Keyword arguments of `alignscores.pas`.

    Examples
    --------
    >>> import numpy as np
    >>> from evo.core.trajectory import PosePath3D
    >>> from alignscores.trajectories.evo import PAS
    >>> poses = np.tile(np.eye(4), (5, 1, 1))
    >>> poses[:, :3, 3] = np.random.default_rng(0).random((5, 3))
    >>> metric = PAS()
    >>> metric.process_data((PosePath3D(poses_se3=poses), PosePath3D(poses_se3=poses)))
    >>> metric.get_all_statistics()["PAS"]
    1.0
    """

    result: PASResult

    def get_all_statistics(self) -> dict[str, float]:
        """Return the three scores, d, and evo's statistics of the errors."""
        tas_result = self.result.tas
        scores = {"TAS": tas_result.score, "RAS": self.result.ras.score, "d": tas_result.unit}
        return {**scores, **super().get_all_statistics()}

    def get_result(self, ref_name: str = "reference", est_name: str = "estimate") -> Any:
        """Return an evo result that also holds the position and the rotation errors."""
        result = super().get_result(ref_name, est_name)
        result.add_np_array("position_error_array", self.result.tas.errors)
        result.add_np_array("rotation_error_deg_array", self.result.ras.errors)
        return result

    @classmethod
    def of(cls, result: PASResult) -> "PAS":
        """Return the metric of a result that was computed before."""
        metric = cls()
        metric._take(result)
        return metric

    def _score(self, gt_poses: Floats, est_poses: Floats) -> None:
        self._take(pas(gt_poses, est_poses, **self.options))

    def _take(self, result: PASResult) -> None:
        self.result = result
        self.error = result.weight * _missed(result.tas) + (1 - result.weight) * _missed(result.ras)


def _missed(result: AlignmentScore) -> Floats:
    """Return the share of the thresholds that each error misses: those it is not below."""
    missed = np.searchsorted(result.thresholds, result.errors, side="right")
    return np.asarray(missed / len(result.thresholds))


def _poses(trajectory: Any) -> Floats:
    """Return the poses (n, 4, 4) of an evo trajectory; matrices with few digits are corrected."""
    poses = np.array(trajectory.poses_se3, dtype=float)
    rotations, deviation = orthonormalise(poses[:, :3, :3])
    rounded = deviation < 1e-2
    poses[rounded, :3, :3] = rotations[rounded]
    return poses
