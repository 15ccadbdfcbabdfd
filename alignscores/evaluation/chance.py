"""The chance level: the TAS of a camera that never moves."""

import numpy as np
from scipy.spatial.distance import cdist

from ..arrays import Floats
from ..distance import N_THRESHOLDS

__all__ = ["chance_level"]

SAMPLE = 1000  # frames looked at, evenly spread


def chance_level(positions: Floats, largest: float) -> float:
    """Return the highest TAS of an estimate that stays at one of the reference's positions.

    `largest` is the largest threshold, in the reference's unit.
    """
    n = len(positions)
    some = positions[np.linspace(0, n - 1, min(SAMPLE, n)).astype(int)]
    below = N_THRESHOLDS - np.floor(cdist(some, some) * (N_THRESHOLDS / largest))
    return float(np.maximum(below, 0).mean(axis=1).max() / N_THRESHOLDS)
