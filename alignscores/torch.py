"""The scores as a metric of torchmetrics, for evaluation in a training loop; needs the extra torch.

``import alignscores`` does not import this module, nor torch.
"""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from .extras import require
from .metrics import NoValueError, metric
from .pose import pas
from .rotation import ras
from .translation import UndefinedUnitError
from .validation import AlignmentWarning

torch: Any = require("torch", "torch")
torchmetrics: Any = require("torchmetrics", "torch")

__all__ = ["PoseAlignmentScore"]


class PoseAlignmentScore(torchmetrics.Metric):  # type: ignore[misc]  # without types here
    """Pose Alignment Score over all scenes of a data set, updated with batches of them.

    Parameters
    ----------
    registration : {"refined", "pcr99"} or Registration
        See `tas`.
    metrics : sequence of str
        Other projects' metrics, such as "auc@30:vggt", by the names of ``--metrics``.
    options : dict, optional
        Further arguments of `pas`, such as ``{"alignment": "rigid"}``.
    **settings : object
        Those of `torchmetrics.Metric`, such as ``dist_sync_on_step``.

    Notes
    -----
    Nothing is differentiated: the scores count cameras. Each process scores its own batches, and
    the values of all scenes are gathered.

    Examples
    --------
    >>> import torch  # doctest: +SKIP
    >>> from alignscores.torch import PoseAlignmentScore  # doctest: +SKIP
    >>> score = PoseAlignmentScore(metrics=["auc@30:vggt"])  # doctest: +SKIP
    >>> for gt_poses, est_poses in loader:  # doctest: +SKIP
    ...     score.update(gt_poses, est_poses)  # (B, n, 4, 4), camera-to-world
    >>> score.compute()["PAS"]  # doctest: +SKIP
    tensor(0.8731, dtype=torch.float64)
    """

    is_differentiable = False
    higher_is_better = True
    full_state_update = False

    def __init__(
        self,
        *,
        registration: Any = "refined",
        metrics: Sequence[str] = (),
        options: dict[str, Any] | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(**settings)
        self._options = {**(options or {}), "registration": registration}
        self._metrics = [metric(name) for name in metrics]
        self.names = ["PAS", "TAS", "RAS", *metrics]
        self.add_state("values", default=[], dist_reduce_fx="cat")

    def update(self, gt_poses: Any, est_poses: Any, mask: Any = None) -> None:
        """Score a batch of scenes.

        Parameters
        ----------
        gt_poses, est_poses : (B, n, 4, 4) or (B, n, 3, 4) tensor, or list of (n, 4, 4)
            Camera-to-world poses, on any device and in any precision; the reference comes first.
        mask : (B, n) tensor of bool, optional
            Which of the poses are cameras; the others fill up scenes that have fewer.
        """
        if len(gt_poses) != len(est_poses):
            raise ValueError(f"gt_poses has {len(gt_poses)} scenes but est_poses {len(est_poses)}")
        masks = [None] * len(gt_poses) if mask is None else mask
        rows = [self._scored(*scene) for scene in zip(gt_poses, est_poses, masks, strict=True)]
        self.values.append(torch.tensor(rows, dtype=torch.float64, device=self.device))

    def compute(self) -> dict[str, Any]:
        """Return the means over all scenes that have a value.

        Returns
        -------
        dict of str to tensor
            By name: PAS, TAS, RAS and the metrics.
        """
        values = torchmetrics.utilities.dim_zero_cat(self.values).unbind(dim=1)
        return {name: value.nanmean() for name, value in zip(self.names, values, strict=True)}

    def _scored(self, gt: Any, est: Any, mask: Any) -> list[float]:
        """Return PAS, TAS, RAS and the metrics of a scene; NaN where one has no value."""
        gt, est = torch.as_tensor(gt), torch.as_tensor(est)
        cameras = ~torch.isnan(gt[:, :3]).flatten(1).all(dim=1) if mask is None else mask
        gt, est = gt[cameras], est[cameras]
        try:
            result = pas(gt, est, **self._options)
            scores = [result.score, result.tas.score, result.ras.score]
        except UndefinedUnitError as error:
            warnings.warn(str(error), AlignmentWarning, stacklevel=3)
            scores = [np.nan, np.nan, ras(gt[:, :3, :3], est[:, :3, :3]).score]
        gt, est = (poses.detach().cpu().double().numpy() for poses in (gt, est))
        return scores + [_value(entry, gt, est) for entry in self._metrics]


def _value(entry: Any, gt: Any, est: Any) -> float:
    try:
        return float(entry(gt, est))
    except NoValueError:
        return np.nan
