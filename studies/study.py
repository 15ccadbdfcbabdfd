"""A study: a name, and the tables of trials that its question is put to."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256

from experiments.command import ConfigError
from experiments.config import Sweep, experiment_names, load_sweep, split_override
from experiments.tables import SWEEPS

__all__ = ["Study", "Table", "load_experiments", "reject"]


@dataclass(frozen=True)
class Table:
    """The settings of a table of trials: one sweep, or several whose trials are joined."""

    sweeps: tuple[Sweep, ...]

    @property
    def json(self) -> str:
        """The settings as ``python -m experiments.run --sweeps`` takes them."""
        return SWEEPS.dump_json(self.sweeps, exclude_defaults=True).decode()

    @property
    def digest(self) -> str:
        """A short text that changes with any of the settings."""
        return sha256(self.json.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Study:
    """A name, and tables of trials by theirs.

    Parameters
    ----------
    name : str
        What its results are called.
    tables : mapping of str to Table
        Their settings.
    """

    name: str
    tables: Mapping[str, Table]


class _Experiments(Mapping[str, Table]):
    """The paper's experiments, each resolved where it is asked for: settings need not suit all."""

    def __init__(self, overrides: Sequence[str]) -> None:
        self._overrides = overrides

    def __getitem__(self, name: str) -> Table:
        settings = [f"experiment={name}", *self._overrides]
        try:
            return Table((load_sweep(settings),))
        except ConfigError as error:
            raise ConfigError(f"{error} ({' '.join(settings)})") from None

    def __iter__(self) -> Iterator[str]:
        return iter(experiment_names())

    def __len__(self) -> int:
        return len(experiment_names())


def load_experiments(overrides: Sequence[str] = ()) -> Study:
    """Return the paper's experiments, with the same overrides for all of them.

    A table is resolved where it is asked for. A `ConfigError` then names the setting, and the
    experiment that it does not suit.

    Examples
    --------
    >>> from studies.study import load_experiments
    >>> study = load_experiments(["trials=5"])
    >>> study.name, study.tables["combined"].sweeps[0].trials
    ('experiments', 5)
    """
    return Study("experiments", _Experiments(overrides))


def reject(overrides: Sequence[str], keys: Sequence[str], reason: str) -> None:
    """Refuse settings that a study decides by itself."""
    for override in overrides:
        key, _ = split_override(override)
        if key in keys:
            raise ConfigError(f"setting {key!r} cannot be set: {reason}")
