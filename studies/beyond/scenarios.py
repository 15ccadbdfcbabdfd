"""Scenarios: the main experiment under other paths, errors and outliers, from a file of YAML."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import Field

from experiments.command import ConfigError
from experiments.config import Sweep, read_yaml

from ..study import Section, Settings, Table, TableName, config_file, resolve, table_name

BEYOND = config_file("beyond")


class _File(Section):
    scenarios: Annotated[dict[TableName, Settings], Field(min_length=1)]
    settings: Settings = Settings()


def load_scenarios(path: Path = BEYOND, overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each scenario; what a file does not set is as in ``beyond.yaml``."""
    study = study_name(path)
    try:
        table_name(study)
    except ValueError as error:
        raise ConfigError(f"{path}: the name {study!r} {error}") from None
    shared, file = read_yaml(BEYOND, _File), read_yaml(path, _File)
    settings = shared.settings, file.settings
    sweeps = resolve(path, "scenarios", overrides, file.scenarios, *settings)
    for name, sweep in sweeps.items():
        _check_order(path, name, sweep)
    return {name: Table((replace(one, name=f"{study}/{name}"),)) for name, one in sweeps.items()}


def study_name(path: Path) -> str:
    """Return what the results of a file of scenarios are called."""
    return "beyond" if path.resolve() == BEYOND else f"beyond_{path.stem}"


def _check_order(path: Path, name: str, sweep: Sweep) -> None:
    """Make sure that there is something to be put in one order."""
    if sweep.noise != "paired":
        problem = "needs noise=paired: one order of levels"
    elif len(sweep.sigma_t) == len(sweep.n_outliers) == 1:
        problem = "needs two levels of noise, or numbers of outliers"
    else:
        return
    raise ConfigError(f"{path}: scenarios.{name} {problem}")
