"""What a study is: one description, found in its folder."""

import pkgutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import pandas as pd

import studies
from experiments.command import ConfigError
from experiments.tables import Trials

Plan = Callable[[Mapping[str, Any]], Mapping[str, Mapping[str, Any]]]
"""From ``snakemake --config``: the settings of each table of trials by its name."""
Answer = Callable[[Sequence[Trials], int], Sequence[pd.DataFrame | str]]
"""From tables of trials and the number of processes: the tables that the study writes."""


@dataclass(frozen=True)
class Study:
    """A study: the trials that it needs, and the function that answers from them.

    A study that scores user-supplied files, or needs other trials, has a program of its own.
    """

    name: str
    title: str  # in the report
    plan: Plan | None = None
    answer: Answer | None = None
    text: str = ""  # of its section in the report: without, there is none
    alt: str = ""  # describes its figure for who does not see it
    position: int = 100  # in the report
    keys: Sequence[str] = ()  # settings of its own


def find_studies() -> dict[str, Study]:
    """Return the studies by their names, in the order of the report."""
    folders = [module.name for module in pkgutil.iter_modules(studies.__path__) if module.ispkg]
    described = [import_module(f"studies.{name}").STUDY for name in folders]
    described.sort(key=lambda study: (study.position, study.name))
    return {study.name: study for study in described}


@contextmanager
def naming(before: str = "", after: str = "") -> Iterator[None]:
    """Raise what is wrong with a setting or a file as a `ConfigError` that names it."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise ConfigError(f"{before}{error}{after}") from None


def reject(settings: Collection[str], fixed: Sequence[str], reason: str) -> None:
    """Raise a `ConfigError` for settings that a study decides on its own."""
    for key in fixed:
        if key in settings:
            raise ConfigError(f"setting {key!r} cannot be set: {reason}")
