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
    from .batch import PASBatch, RASBatch, TASBatch, pas_batch, ras_batch, tas_batch
    from .comparison import Comparison, compare
    from .distance import ras_angle, tas_distance
    from .evaluation import Evaluation, Settings, evaluate
    from .histogram import AlignmentScore
    from .pose import PASResult, pas
    from .profile import ScoreProfile, ras_profile, tas_profile
    from .registration import Registration
    from .rotation import RASResult, ras
    from .similarity import Similarity
    from .trajectories.conventions import Convention, check_conventions
    from .trajectories.files import Trajectory
    from .translation import TASResult, closest_pair_quartile, tas
    from .validation import AlignmentWarning

__all__ = [
    "AlignmentScore",
    "AlignmentWarning",
    "Comparison",
    "Convention",
    "Evaluation",
    "PASBatch",
    "PASResult",
    "RASBatch",
    "RASResult",
    "Registration",
    "ScoreProfile",
    "Settings",
    "Similarity",
    "TASBatch",
    "TASResult",
    "Trajectory",
    "check_conventions",
    "closest_pair_quartile",
    "compare",
    "evaluate",
    "nearest_rotations",
    "pas",
    "pas_batch",
    "ras",
    "ras_angle",
    "ras_batch",
    "ras_profile",
    "tas",
    "tas_batch",
    "tas_distance",
    "tas_profile",
]

# Imported when they are asked for, so that the command starts, and ends, at once.
MODULES = {
    "AlignmentScore": "histogram",
    "AlignmentWarning": "validation",
    "Comparison": "comparison",
    "Convention": "trajectories.conventions",
    "Evaluation": "evaluation",
    "PASBatch": "batch",
    "PASResult": "pose",
    "RASBatch": "batch",
    "RASResult": "rotation",
    "Registration": "registration",
    "ScoreProfile": "profile",
    "Settings": "evaluation",
    "Similarity": "similarity",
    "TASBatch": "batch",
    "TASResult": "translation",
    "Trajectory": "trajectories.files",
    "check_conventions": "trajectories.conventions",
    "closest_pair_quartile": "translation",
    "compare": "comparison",
    "evaluate": "evaluation",
    "nearest_rotations": "averaging",
    "pas": "pose",
    "pas_batch": "batch",
    "ras": "rotation",
    "ras_angle": "distance",
    "ras_batch": "batch",
    "ras_profile": "profile",
    "tas": "translation",
    "tas_batch": "batch",
    "tas_distance": "distance",
    "tas_profile": "profile",
}


def __getattr__(name: str) -> object:
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
