"""What the numbers that the paper chose by experience cost and gain."""

from collections.abc import Mapping, Sequence

import pandas as pd

from experiments.command import ConfigError

from .. import axes
from ..study import Figure, Question, Study, Table
from .effects import effects
from .section import THRESHOLDS, show

KINDS = ("tas", "ras", "pas", "registration")  # a table each; what the names of axes start with
TABLES = [f"tables/{{}}_{kind}" for kind in KINDS]


def plan(overrides: Sequence[str]) -> Mapping[str, Table]:
    """Return the tables in which one option varies at a time."""
    for name in axes.axis_names(THRESHOLDS):
        if name.partition("_")[0] not in KINDS:
            kinds = ", ".join(f"{kind}_" for kind in KINDS)
            raise ConfigError(f"axis {name!r} must have a name that starts with {kinds}")
    return axes.plan(THRESHOLDS, overrides)


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return the effects of all values, a table for each kind."""
    parts = question.by_name
    found = axes.axes_of(THRESHOLDS, {name: part.record.metrics for name, part in parts.items()})
    table = effects(found, {name: part.table for name, part in parts.items()})
    kind_of = table["axis"].str.partition("_")[0]
    return [table[kind_of == kind] for kind in KINDS]


STUDY = Study(
    name="threshold_study",
    title="Thresholds",
    plan=plan,
    ask=ask,
    answers=[f"{table}.csv" for table in TABLES],
    figures=[Figure("studies.threshold_study.figure:draw", TABLES)],
    show=show,
    place=20,
    keys=axes.axis_names(THRESHOLDS),
    files=[THRESHOLDS],
)
