"""A study: a name, and the tables of trials that its question is put to."""

from collections.abc import Mapping, Sequence
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
    folder : str
        Where its tables of trials are, in the folder of the results.
    tables : mapping of str to Table
        Their settings.
    """

    name: str
    folder: str
    tables: Mapping[str, Table]


def load_experiments(overrides: Sequence[str] = ()) -> Study:
    """Return the paper's experiments, the same settings for all of them.

    Raises
    ------
    ConfigError
        In one line that names the setting and the experiment that it does not suit.

    Examples
    --------
    >>> from studies.study import load_experiments
    >>> study = load_experiments(["trials=5"])
    >>> study.folder, study.tables["combined"].sweeps[0].trials
    ('trials', 5)
    """
    tables = {}
    for name in experiment_names():
        settings = [f"experiment={name}", *overrides]
        try:
            tables[name] = Table((load_sweep(settings),))
        except ConfigError as error:
            raise ConfigError(f"{error} ({' '.join(settings)})") from None
    return Study("experiments", "trials", tables)


def reject(overrides: Sequence[str], keys: Sequence[str], reason: str) -> None:
    """Refuse settings that a study decides by itself."""
    for override in overrides:
        key, _ = split_override(override)
        if key in keys:
            raise ConfigError(f"setting {key!r} is not open here: {reason}")
