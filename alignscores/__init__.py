"""Alignment scores: robust metrics for the accuracy of multiview camera poses.

TAS, RAS and PAS score estimated camera positions, rotations and poses against the ground truth,
from 0 to 1. Conventions throughout: the reference comes first, poses are camera-to-world, angles
are degrees.

Source: S. H. Lee and J. Civera, "Alignment Scores: Robust Metrics for Multiview Pose Accuracy
Evaluation".
"""

from importlib import import_module

from .version import __version__ as __version__

TYPE_CHECKING = False  # for type checkers it is true; to import `typing` takes longer than the rest
if TYPE_CHECKING:
    from .averaging import nearest_rotations
    from .comparison import Comparison, compare
    from .evaluation import Evaluation, Settings, evaluate
    from .histogram import AlignmentScore
    from .io import Trajectory
    from .pose import PASResult, pas
    from .registration import Registration
    from .rotation import RASResult, ras
    from .show import plot, save_page
    from .similarity import Similarity
    from .thresholds import ScoreProfile, ras_angle, ras_profile, tas_distance, tas_profile
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
    "Trajectory",
    "closest_pair_quartile",
    "compare",
    "evaluate",
    "nearest_rotations",
    "pas",
    "plot",
    "ras",
    "ras_angle",
    "ras_profile",
    "save_page",
    "tas",
    "tas_distance",
    "tas_profile",
]

# Imported when they are asked for, so that the command starts, and ends, at once.
MODULES = {
    "averaging": "nearest_rotations",
    "comparison": "Comparison compare",
    "evaluation": "Evaluation Settings evaluate",
    "histogram": "AlignmentScore",
    "io": "Trajectory",
    "pose": "PASResult pas",
    "registration": "Registration",
    "rotation": "RASResult ras",
    "show": "plot save_page",
    "similarity": "Similarity",
    "thresholds": "ScoreProfile ras_angle ras_profile tas_distance tas_profile",
    "translation": "TASResult closest_pair_quartile tas",
    "validation": "AlignmentWarning",
}


def __getattr__(name: str) -> object:
    for module, names in MODULES.items():
        if name in names.split():
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
