"""Alignment scores: robust metrics for the accuracy of multiview camera poses.

TAS, RAS and PAS score estimated camera positions, rotations and poses against the ground truth,
from 0 to 1. Conventions throughout: the reference comes first, poses are camera-to-world, angles
are degrees.

Source: S. H. Lee and J. Civera, "Alignment Scores: Robust Metrics for Multiview Pose Accuracy
Evaluation".
"""

__version__ = "1.0.0"

from .averaging import nearest_rotations
from .comparison import Comparison, compare
from .evaluation import Evaluation, Settings, evaluate
from .histogram import AlignmentScore
from .pose import PASResult, pas
from .profile import ScoreProfile, ras_profile, tas_profile
from .registration import Registration
from .rotation import RASResult, ras
from .similarity import Similarity
from .translation import TASResult, closest_pair_quartile, tas
from .validation import AlignmentWarning

__all__ = [
    "AlignmentScore",
    "AlignmentWarning",
    "Comparison",
    "Evaluation",
    "PASResult",
    "RASResult",
    "Registration",
    "ScoreProfile",
    "Settings",
    "Similarity",
    "TASResult",
    "closest_pair_quartile",
    "compare",
    "evaluate",
    "nearest_rotations",
    "pas",
    "ras",
    "ras_profile",
    "tas",
    "tas_profile",
]
