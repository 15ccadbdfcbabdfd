"""The paper's experiments, its figures, and Table 1 derived from the trials."""

from collections.abc import Iterator, Mapping, Sequence

from experiments.config import Sweep, experiment_names, load_sweep

from ..study import Figure, Study, Table, naming
from .table1 import ask

FIGURES: Mapping[str, tuple[str, ...]] = {
    "histogram": ("combined",),  # one trial under its settings
    "outliers": ("outliers",),
    "collinear": ("collinear",),
    "trajectory_length": ("trajectory_length",),
    "rotations": ("rotations",),
    "combined": ("combined",),
    "maa_vs_pas": ("maa_vs_pas_outliers", "maa_vs_pas_length", "maa_vs_pas_collinear"),
}
"""The figures of the paper, each with the experiments whose trials it shows."""
ALONE = ("histogram", "maa_vs_pas")  # in a module of their own


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


STUDY = Study(
    name="paper",
    title="Figures and Table 1",
    plan=Experiments,
    ask=ask,
    answers=("tables/method_comparison.csv", "tables/method_comparison.md"),
    figures=[
        Figure(
            f"figures.{name}:draw" if name in ALONE else f"figures.noise:{name}",
            [f"trials/{experiment}" for experiment in experiments],
            name,
        )
        for name, experiments in FIGURES.items()
    ],
    place=0,
    trials="trials",
)
