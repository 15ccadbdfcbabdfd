"""The paper's experiments, and Table 1 derived from the trials."""

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.config import EXPERIMENTS, Sweep, load_sweep

from ..study import Study, naming
from .table1 import answer


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each experiment of the paper."""
    return {name: {"experiment": name, **settings} for name in EXPERIMENTS}


def load_experiment(overrides: Sequence[str]) -> Sweep:
    """Compose an experiment of the paper; a `ConfigError` names it with all settings."""
    with naming(after=f" ({' '.join(overrides)})"):
        return load_sweep(overrides)


STUDY = Study(name="paper", title="Table 1", plan=plan, answer=answer, position=0)
