"""Robust registration of camera positions (section 3, step 2): the paper's and a refined one.

`REGISTRATIONS` are those that `tas` has by name, written in C in the folder ``kernel`` and defined
in ``docs/explanation/registration.md``. Any function of the signature of `Registration` is another.
"""

from typing import Protocol

import numpy as np

from ..arrays import Floats
from ..similarity import Similarity
from ..validation import check_positions, check_positive, check_same_length
from . import kernel

__all__ = ["REGISTRATIONS", "Registration", "pcr99"]

REGISTRATIONS = "pcr99", "refined"


class Registration(Protocol):
    """What `tas` calls to align the estimate: any function of this signature.

    It is given the cameras that were estimated, each frame centred on its median and scaled by its
    spread, and settings of which it uses those that it needs. It returns the alignment, from ground
    truth to estimate (None where there is none), and the number of hypotheses it was chosen from.
    """

    def __call__(
        self,
        gt_positions: Floats,
        est_positions: Floats,
        /,
        *,
        rank: int,
        threshold: float,
        n_hypotheses: int,
        rng: np.random.Generator,
        alignment: str,
    ) -> tuple[Similarity | None, int]:
        """Register ``(n, 3)`` estimated positions to the ground truth.

        ``rank`` is m of the paper, at most n; ``threshold`` is the largest error threshold in the
        given ground-truth units. ``alignment`` is "similarity", "rigid" or "yaw", whose vertical
        axis is the third one.
        """
        ...


def pcr99(
    gt_positions: Floats,
    est_positions: Floats,
    /,
    *,
    rank: int,
    threshold: float = 1.0,
    n_hypotheses: int,
    rng: np.random.Generator,
    alignment: str = "similarity",
    prescreen: float = kernel.PRESCREEN,
) -> tuple[Similarity | None, int]:
    """Register by PCR-99 with unknown scale, as the paper does; see `Registration`.

    ``threshold`` is not used; ``prescreen`` is the largest difference between the log edge ratios
    of a triplet. Where no more than ``n_hypotheses`` triplets exist all are tried, each with its
    three first edges, and nothing is random. O(n_hypotheses * n) time, O(n) memory.
    """
    check_positive(rank, "rank", integer=True)
    gt = check_positions(gt_positions, "gt_positions", complete=True)
    est = check_positions(est_positions, "est_positions", complete=False)
    check_same_length(gt, est, "gt_positions", "est_positions")
    aligned = kernel.align_scenes(
        kernel.Options("pcr99", alignment, n_hypotheses, rank=rank, prescreen=prescreen),
        np.array([0, len(gt)]),
        np.ascontiguousarray(gt),
        np.ascontiguousarray(est),
        rng,
        np.ones(1),
    )
    return Similarity.of_row(aligned.rows[0]), int(aligned.n_hypotheses[0])
