"""The paper's experiments, and Table 1 derived from the trials."""

from collections.abc import Sequence

from experiments.config import Sweep, experiment_names, load_sweep

from ..study import Study, naming
from .table1 import answer


def plan(overrides: Sequence[str] = ()) -> dict[str, list[str]]:
    """Return the settings of each experiment of the paper."""
    return {name: [f"experiment={name}", *overrides] for name in experiment_names()}


def load_experiment(settings: Sequence[str]) -> Sweep:
    """Compose an experiment of the paper; a `ConfigError` names it with all settings."""
    with naming(after=f" ({' '.join(settings)})"):
        return load_sweep(settings)


STUDY = Study(name="paper", title="Table 1", plan=plan, answer=answer, position=0)
