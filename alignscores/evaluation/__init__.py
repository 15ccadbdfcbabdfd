"""One evaluation for the command, the comparison of systems, and Python: `evaluate`."""

from .evaluation import Evaluation
from .scoring import evaluate
from .settings import Settings

__all__ = ["Evaluation", "Settings", "evaluate"]
