"""The paper's experiments, and Table 1 derived from the trials."""

from collections.abc import Sequence

from experiments.config import Sweep, experiment_names, load_sweep

from ..study import Study, Tables, naming
from .table1 import ask


def plan(overrides: Sequence[str] = ()) -> Tables:
    """Return a table for each experiment of the paper."""
    return Tables(experiment_names(), lambda name: load_experiment(name, overrides))


def load_experiment(name: str, overrides: Sequence[str]) -> Sweep:
    """Resolve an experiment of the paper; a `ConfigError` names it with all settings."""
    settings = [f"experiment={name}", *overrides]
    with naming(after=f" ({' '.join(settings)})"):
        sweep = load_sweep(settings)
    return sweep


STUDY = Study(name="paper", title="Table 1", plan=plan, ask=ask, position=0, trials="trials")
