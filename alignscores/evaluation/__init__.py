"""One evaluation for the command, the comparison of systems, and Python: `evaluate`."""

from .evaluate import evaluate
from .evaluation import Evaluation
from .settings import Settings

__all__ = ["Evaluation", "Settings", "evaluate"]
