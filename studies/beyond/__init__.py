"""What the paper leaves out: the main experiment with other paths, errors and outliers."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import AfterValidator, ConfigDict, Field
from pydantic.dataclasses import dataclass

from experiments.config import EXECUTION, Sweep, flat, load_sweep, read_yaml, require, to_overrides
from experiments.tables import Trials

from ..study import Study, naming
from .findings import findings

SCENARIOS = Path(__file__).with_name("scenarios.yaml")


def _table_name(name: str) -> str:
    fits = re.fullmatch(r"[A-Za-z0-9_]+", name) is not None
    require(fits, "may have letters, digits and underscores alone")
    return name


def _settings(settings: dict[str, Any]) -> dict[str, Any]:
    for key in EXECUTION:
        problem = f"may not set {key}, which holds for all studies; set it with --config"
        require(key not in settings, problem)
    return flat(settings)


Settings = Annotated[dict[str, Any], AfterValidator(_settings)]


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class _File:
    scenarios: Annotated[
        dict[Annotated[str, AfterValidator(_table_name)], Settings], Field(min_length=1)
    ]
    settings: Settings = Field(default_factory=dict)


def plan(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each scenario; what a file does not set is as in this folder's."""
    others = flat(settings)
    path = Path(others.pop("scenarios", SCENARIOS))
    shared, file = read_yaml(SCENARIOS, _File), read_yaml(path, _File)
    tables = {}
    for scenario, own in file.scenarios.items():
        name = f"{study_name(path)}/{scenario}"
        table = {**shared.settings, **file.settings, **own, "name": name, **others}
        with naming(f"{path}: scenarios.{scenario}: "):
            _check(load_sweep(to_overrides(table)))
        tables[scenario] = table
    return tables


def _check(sweep: Sweep) -> None:
    require(sweep.noise == "paired", "needs noise=paired: one order of levels")
    n_levels = max(len(sweep.sigma_t), len(sweep.n_outliers))
    require(n_levels > 1, "needs two levels of noise, or numbers of outliers")


def study_name(path: Path) -> str:
    """Return the name of the results of a file of scenarios."""
    name = "beyond" if path.resolve() == SCENARIOS else f"beyond_{path.stem}"
    with naming(f"{path}: the name {name!r} "):
        return _table_name(name)


def answer(trials: Sequence[Trials], n_jobs: int = 1) -> list[pd.DataFrame | str]:
    """Return what each metric orders in each scenario."""
    return [findings({table.path.stem: table for table in trials})]


STUDY = Study(
    name="beyond",
    title="Beyond the paper",
    text="A metric orders noise (outliers) where, at every number of outliers (at every noise "
    "level), it puts two of three pairs of trials at neighbouring levels in the right order. The "
    "mean is over the trials without outliers: it shows what the number of laps and the frame "
    "rate do to a score. Another seed may take values near two of three to the other side.",
    alt="Two matrices, noise and outliers: a row for each scenario, a column for each metric. Each "
    "cell has the smallest share of pairs in the right order, on a blue that is the darker the "
    "larger it is; what does not order has no colour.",
    plan=plan,
    answer=answer,
    position=40,
    keys=["scenarios"],
)
