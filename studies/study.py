"""What a study is: one description, found in its folder, and a plan once settings are known."""

import pkgutil
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, reduce
from hashlib import sha256
from importlib import import_module
from operator import or_
from pathlib import Path
from typing import Annotated, Self

import pandas as pd
from pydantic import AfterValidator, BaseModel, ConfigDict, model_validator

import studies
from experiments.command import ConfigError
from experiments.config import CONFIG_DIR, EXECUTION, Sweep, load_sweep, require, split_override
from experiments.tables import SWEEPS, Trials


@dataclass(frozen=True)
class Table:
    """The settings of a table of trials: one sweep, or several whose trials are joined."""

    sweeps: tuple[Sweep, ...]

    @property
    def digest(self) -> str:
        """A short text that changes with any of the settings."""
        return sha256(SWEEPS.dump_json(self.sweeps)).hexdigest()[:16]


class Tables(Mapping[str, Table]):
    """Tables of one sweep each, composed where they are asked for: Hydra takes its time."""

    def __init__(self, names: Iterable[str], sweep: Callable[[str], Sweep]) -> None:
        self._names, self._sweep = list(names), sweep

    def __getitem__(self, name: str) -> Table:
        if name not in self._names:
            raise KeyError(name)
        return Table((self._sweep(name),))

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


@dataclass(frozen=True, eq=False)
class Question:
    """The trials of a study, and how many processes may answer."""

    trials: Sequence[Trials]
    n_jobs: int = 1
    own: pd.DataFrame = field(default_factory=pd.DataFrame)  # from user-supplied files

    @property
    def by_name(self) -> Mapping[str, Trials]:
        """The trials by the names of their tables."""
        return {trials.path.stem: trials for trials in self.trials}


@dataclass(frozen=True)
class Study:
    """A study: the trials that it needs, and the program that answers from them."""

    name: str
    title: str  # in the report
    plan: Callable[[Sequence[str]], Mapping[str, Table]]  # tables of trials, from Hydra overrides
    ask: Callable[[Question], Sequence[pd.DataFrame | str]]  # returns the tables that it writes
    text: str = ""  # of its section in the report: without, there is none
    alt: str = ""  # describes its figure for who does not see it
    position: int = 100  # in the report
    trials: str = "trials/{}"  # their folder; braces stand for the name of the results
    keys: Sequence[str] = ()  # settings of its own
    called: Callable[[Sequence[str]], str] | None = None  # names the results, from the overrides
    own: "Own | None" = None  # user-supplied files, in place of trials
    score: Callable[[Mapping[str, str], str], pd.DataFrame] | None = None  # of a part of these


@dataclass(frozen=True)
class Own:
    """User-supplied input file; the study exists only if it is given."""

    key: str  # that names the file
    sources: Callable[[Path], Mapping[str, Sequence[str]]]  # the input files of each part


@dataclass(frozen=True)
class Plan:
    """A study under the settings that are its own and those that are nobody's."""

    study: Study
    overrides: Sequence[str] = field(default_factory=list)

    @cached_property
    def called(self) -> str:
        """The name of its results."""
        return self.study.called(self.overrides) if self.study.called else self.study.name

    @property
    def folder(self) -> str:
        """Where its trials are."""
        return self.study.trials.format(self.called)

    @cached_property
    def sources(self) -> Mapping[str, Sequence[str]]:
        """The parts of user-supplied files, and the input files of each."""
        own = self.study.own
        return own.sources(Path(dict(map(split_override, self.given))[own.key])) if own else {}

    @property
    def given(self) -> list[str]:
        """The settings that are its own."""
        return [one for one in self.overrides if split_override(one)[0] in self.study.keys]

    @cached_property
    def tables(self) -> Mapping[str, Table]:
        """Its tables of trials by their names; a `ConfigError` says which setting is wrong."""
        return self.study.plan(self.overrides)


def found() -> list[Study]:
    """Return the studies whose descriptions there are, in the order of the report."""
    folders = [module.name for module in pkgutil.iter_modules(studies.__path__) if module.ispkg]
    described = [import_module(f"studies.{name}").STUDY for name in folders]
    return sorted(described, key=lambda study: (study.position, study.name))


def plans(overrides: Iterable[str] = ()) -> dict[str, Plan]:
    """Return all studies whose files are given, by their names, under the settings of each."""
    described, given = found(), [(split_override(one)[0], one) for one in overrides]
    owned = {key for study in described for key in study.keys} | set(EXECUTION)
    keys = {key for key, _ in given}
    return {
        study.name: Plan(study, [o for key, o in given if key in study.keys or key not in owned])
        for study in described
        if study.own is None or study.own.key in keys
    }


def table_name(name: str) -> str:
    """Return a name that results may be called by; a `ValueError` says why this one is none."""
    fits = re.fullmatch(r"[A-Za-z0-9_]+", name) is not None
    require(fits, "may have letters, digits and underscores alone")
    return name


TableName = Annotated[str, AfterValidator(table_name)]


class Section(BaseModel):
    """A section of the file of a study: all its keys, and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Settings(Section):
    """Settings of a sweep as the file of a study has them, checked where it is resolved."""

    model_config = ConfigDict(extra="allow")

    @model_validator(mode="after")
    def _results_depend_on_them(self) -> Self:
        for key in EXECUTION:
            problem = f"may not set {key}, which holds for all studies; set it with --config"
            require(key not in (self.model_extra or {}), problem)
        return self


@contextmanager
def naming(before: str = "", after: str = "") -> Iterator[None]:
    """Say in one line what is wrong with a setting or a file, and where it stands."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise ConfigError(f"{before}{error}{after}") from None


def config_file(name: str) -> Path:
    """Return the file of a study's settings."""
    return CONFIG_DIR / "study" / f"{name}.yaml"


def resolve(place: str, overrides: Sequence[str], *settings: Settings) -> Sweep:
    """Compose the settings at a place of a study's file; the last ones win."""
    with naming(f"{place}: "):
        return load_sweep(overrides, reduce(or_, (one.model_extra or {} for one in settings)))


def reject(overrides: Sequence[str], keys: Sequence[str], reason: str) -> None:
    """Refuse settings that a study decides by itself."""
    for key, _ in map(split_override, overrides):
        if key in keys:
            raise ConfigError(f"setting {key!r} cannot be set: {reason}")
