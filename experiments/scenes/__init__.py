"""Synthetic cameras: where they stand, how they are estimated, and which of them are outliers."""

from .errors import ERRORS
from .outliers import OUTLIERS
from .paths import PATHS
from .scene import Scene, make_scene

__all__ = ["ERRORS", "OUTLIERS", "PATHS", "Scene", "make_scene"]
