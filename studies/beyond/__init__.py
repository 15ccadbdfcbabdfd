"""What the paper leaves out: the main experiment with other paths, errors and outliers."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from experiments.config import split_override

from ..study import Figure, Question, Study, Table
from .findings import findings
from .scenarios import BEYOND, load_scenarios, study_name
from .show import show


def plan(overrides: Sequence[str]) -> Mapping[str, Table]:
    """Return a table for each scenario."""
    others = [one for one in overrides if split_override(one)[0] != "scenarios"]
    return load_scenarios(_file(overrides), others)


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return what each metric orders in each scenario."""
    return [findings(question.by_name)]


def _file(overrides: Sequence[str]) -> Path:
    return Path(dict(split_override(one) for one in overrides).get("scenarios", BEYOND))


STUDY = Study(
    name="beyond",
    title="Beyond the paper",
    plan=plan,
    ask=ask,
    answers=["tables/{}.csv"],
    figures=[
        Figure("studies.beyond.figure:draw", ["tables/{}"]),
        Figure("studies.beyond.paths:draw", name="paths"),
    ],
    show=show,
    place=40,
    keys=["scenarios"],
    called=lambda overrides: study_name(_file(overrides)),
)
