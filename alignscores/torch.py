"""The scores as a metric of torchmetrics, for evaluation in a training loop; needs the extra torch.

``import alignscores`` does not import this module, nor torch.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .batch import pas_batch
from .extras import require
from .metrics import metric
from .protocols import NoValueError

torch: Any = require("torch", "torch")
torchmetrics: Any = require("torchmetrics", "torch")

__all__ = ["PoseAlignmentScore"]


class PoseAlignmentScore(torchmetrics.Metric):  # type: ignore[misc]  # without types here
    """Pose Alignment Score over all scenes of a data set, updated with batches of them.

    Parameters
    ----------
    registration : {"refined", "pcr99"} or Registration
        See `tas`.
    protocols : sequence of str
        Other projects' metrics, such as "auc@30:vggt", by the names of ``--metrics``.
    options : dict, optional
        Further arguments of `pas_batch`, such as ``{"alignment": "rigid", "threads": 4}``.
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
    >>> score = PoseAlignmentScore(protocols=["auc@30:vggt"])  # doctest: +SKIP
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
        protocols: Sequence[str] = (),
        options: dict[str, Any] | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(**settings)
        self._options = {**(options or {}), "registration": registration}
        self._protocols = {name: metric(name) for name in protocols}
        self.names = ["PAS", "TAS", "RAS", *self._protocols]
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
        if mask is not None:
            gt_poses = torch.where(mask[..., None, None], gt_poses, torch.nan)
        result = pas_batch(gt_poses, est_poses, **self._options)
        columns: list[Any] = [result.score, result.tas.score, result.ras.score]
        if self._protocols:
            columns += np.transpose(self._values(gt_poses, est_poses)).tolist()
        values = torch.tensor(np.array(columns).T, dtype=torch.float64, device=self.device)
        self.values.append(values)

    def compute(self) -> dict[str, Any]:
        """Return the means over all scenes that have a value.

        Returns
        -------
        dict of str to tensor
            By name: PAS, TAS, RAS and the protocols.
        """
        values = torchmetrics.utilities.dim_zero_cat(self.values).unbind(dim=1)
        return {name: one.nanmean() for name, one in zip(self.names, values, strict=True)}

    def _values(self, gt_poses: Any, est_poses: Any) -> list[list[float]]:
        """Return the protocols of each scene; NaN where one has no value."""
        values = []
        for gt, est in zip(gt_poses, est_poses, strict=True):
            gt, est = (frame.detach().cpu().double().numpy() for frame in (gt, est))
            cameras = ~np.isnan(gt[:, :3]).all(axis=(1, 2))
            values.append(
                [_value(family, gt[cameras], est[cameras]) for family in self._protocols.values()]
            )
        return values


def _value(family: Any, gt: Any, est: Any) -> float:
    try:
        return float(family(gt[:, :3, 3], gt[:, :3, :3], est[:, :3, 3], est[:, :3, :3], rng=0))
    except NoValueError:
        return np.nan
