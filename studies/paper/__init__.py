"""The paper's experiments, and Table 1 derived from the trials."""

from collections.abc import Iterator, Mapping, Sequence

from experiments.config import Sweep, experiment_names, load_sweep

from ..study import Study, Table, naming
from .table1 import ask


class Experiments(Mapping[str, Table]):
    """The paper's experiments, each resolved where it is asked for: settings need not suit all."""

    def __init__(self, overrides: Sequence[str] = ()) -> None:
        self._overrides = overrides

    def __getitem__(self, name: str) -> Table:
        return Table((load_experiment(name, self._overrides),))

    def __iter__(self) -> Iterator[str]:
        return iter(experiment_names())

    def __len__(self) -> int:
        return len(experiment_names())


def load_experiment(name: str, overrides: Sequence[str]) -> Sweep:
    """Resolve an experiment of the paper; a `ConfigError` names it with all settings."""
    settings = [f"experiment={name}", *overrides]
    with naming(after=f" ({' '.join(settings)})"):
        sweep = load_sweep(settings)
    return sweep


STUDY = Study(name="paper", title="Table 1", plan=Experiments, ask=ask, position=0, trials="trials")
