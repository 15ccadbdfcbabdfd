"""What the paper leaves out: the main experiment with other paths, errors and outliers."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import pandas as pd
from pydantic import Field

from experiments.command import ConfigError
from experiments.config import Sweep, read_yaml, split_override

from .. import study
from .findings import findings

BEYOND = study.config_file("beyond")


class _File(study.Section):
    scenarios: Annotated[dict[study.TableName, study.Settings], Field(min_length=1)]
    settings: study.Settings = study.Settings()


def plan(overrides: Sequence[str] = ()) -> study.Tables:
    """Return a table for each scenario; what a file does not set is as in ``beyond.yaml``."""
    path = _file(overrides)
    called = study_name(path)
    with study.naming(f"{path}: the name {called!r} "):
        study.table_name(called)
    shared, file = read_yaml(BEYOND, _File), read_yaml(path, _File)
    others = [one for one in overrides if split_override(one)[0] != "scenarios"]

    def sweep(name: str) -> Sweep:
        place = f"{path}: scenarios.{name}"
        settings = shared.settings, file.settings, file.scenarios[name]
        found = study.resolve(place, others, *settings)
        if found.noise != "paired":
            raise ConfigError(f"{place} needs noise=paired: one order of levels")
        if len(found.sigma_t) == len(found.n_outliers) == 1:
            raise ConfigError(f"{place} needs two levels of noise, or numbers of outliers")
        return replace(found, name=f"{called}/{name}")

    return study.Tables(file.scenarios, sweep)


def study_name(path: Path) -> str:
    """Return what the results of a file of scenarios are called."""
    return "beyond" if path.resolve() == BEYOND else f"beyond_{path.stem}"


def ask(question: study.Question) -> list[pd.DataFrame | str]:
    """Return what each metric orders in each scenario."""
    return [findings(question.by_name)]


def _file(overrides: Sequence[str]) -> Path:
    return Path(dict(map(split_override, overrides)).get("scenarios", BEYOND))


STUDY = study.Study(
    name="beyond",
    title="Beyond the paper",
    text="A metric orders noise (outliers) where, at every number of outliers (at every noise "
    "level), it puts two of three pairs of trials at neighbouring levels in the right order. The "
    "mean is that of the trials without outliers: it shows what the number of laps and the frame "
    "rate do to a score. Another seed may take values near two of three to the other side.",
    alt="Two matrices, noise and outliers: a row for each scenario, a column for each metric. Each "
    "cell has the smallest share of pairs in the right order, on a blue that is the darker the "
    "larger it is; what does not order has no colour.",
    plan=plan,
    ask=ask,
    position=40,
    keys=["scenarios"],
    called=lambda overrides: study_name(_file(overrides)),
)
