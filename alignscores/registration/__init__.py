"""Robust registration of camera positions (section 3, step 2): the paper's and a refined one.

A registration is any function of the signature of `Registration`; `REGISTRATIONS` holds those that
`tas` knows by name.
"""

from typing import Protocol

import numpy as np

from ..arrays import Floats
from ..similarity import Similarity
from .kernel import pcr99, refined

__all__ = ["REGISTRATIONS", "Registration", "pcr99", "refined"]


class Registration(Protocol):
    """What `tas` calls to align the estimate: any function of this signature.

    It is given the cameras that were estimated, each world centred on its median and scaled by its
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


REGISTRATIONS: dict[str, Registration] = {"pcr99": pcr99, "refined": refined}
