"""A study: a name, and the tables of trials that its question is put to."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from hashlib import sha256
from operator import or_
from pathlib import Path
from typing import Annotated, Any, Self

import pandas as pd
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from experiments.command import ConfigError
from experiments.config import (
    EXECUTION,
    Sweep,
    experiment_names,
    load_sweep,
    require,
    split_override,
)
from experiments.tables import SWEEPS

__all__ = ["Rates", "Section", "Settings", "Study", "Table", "TableName", "at_rates"]
__all__ += ["load_experiment", "load_experiments", "rates_of", "reject", "resolve", "table_name"]

EVERY = "every="  # in the column `settings` of tables with several frame rates


def table_name(name: str) -> str:
    """Return a name that results may be called by; a `ValueError` says why this one is none."""
    fits = re.fullmatch(r"[A-Za-z0-9_]+", name) is not None
    require(fits, "may have letters, digits and underscores alone")
    return name


TableName = Annotated[str, AfterValidator(table_name)]
Rates = Annotated[list[int], Field(min_length=1)]


class Section(BaseModel):
    """A section of the file of a study: all its keys, and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Settings(Section):
    """Settings of a sweep as the file of a study has them; keys of subclasses are the study's own.

    They are checked where a sweep is resolved, with all that is set elsewhere.
    """

    model_config = ConfigDict(extra="allow")

    @model_validator(mode="after")
    def _results_depend_on_them(self) -> Self:
        for key in EXECUTION:
            problem = f"may not set {key}, which holds for all studies; set it with --config"
            require(key not in self.settings, problem)
        return self

    @property
    def settings(self) -> dict[str, Any]:
        """Those that `experiments.config.load_sweep` takes."""
        return self.model_extra or {}


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
        return Table((load_experiment(name, self._overrides),))

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


def load_experiment(name: str, overrides: Sequence[str]) -> Sweep:
    """Resolve an experiment of the paper; a `ConfigError` names it with all settings."""
    settings = [f"experiment={name}", *overrides]
    try:
        return load_sweep(settings)
    except ConfigError as error:
        raise ConfigError(f"{error} ({' '.join(settings)})") from None


def resolve(path: Path, key: str, overrides: Sequence[str], *parts: Settings) -> Sweep:
    """Resolve the settings that stand in the parts of a study's file; later ones win.

    A `ConfigError` names the file and the key of the last part.
    """
    try:
        return load_sweep(overrides, reduce(or_, (part.settings for part in parts)))
    except ConfigError as error:
        raise ConfigError(f"{path}: {key}: {error}") from None


def at_rates(sweep: Sweep, rates: Sequence[int]) -> Table:
    """Return the table of the same trials at several frame rates."""
    return Table(tuple(replace(sweep, every=k, changes=f"{EVERY}{k}") for k in rates))


def rates_of(table: pd.DataFrame) -> pd.Series:
    """Return the frame rate of each trial in such a table."""
    return table["settings"].str.removeprefix(EVERY).astype(int)


def reject(overrides: Sequence[str], keys: Sequence[str], reason: str) -> None:
    """Refuse settings that a study decides by itself."""
    for override in overrides:
        key, _ = split_override(override)
        if key in keys:
            raise ConfigError(f"setting {key!r} cannot be set: {reason}")
