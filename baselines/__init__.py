"""Baselines that the alignment scores are compared with: ATE, DTE, DRE, mAA, rotation statistics.

Conventions as in `alignscores`: the reference comes first, poses are camera-to-world, angles are
degrees. The errors (all but the mAA) have no value for a camera that was not estimated: they raise
ValueError.
"""

from .absolute import ate
from .discernible import dre, dte
from .pairwise import maa
from .rotation import rotation_statistics

__all__ = ["ate", "dre", "dte", "maa", "rotation_statistics"]
