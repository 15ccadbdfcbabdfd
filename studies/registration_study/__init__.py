"""The paper's registration and the refined one: spread over seeds, and what they order."""

from collections.abc import Mapping, Sequence

import pandas as pd

from .. import axes
from ..study import Figure, Question, Study, Table, config_file
from .registrations import compare, to_markdown
from .show import show

REGISTRATIONS = config_file("registration_study")


def plan(overrides: Sequence[str]) -> Mapping[str, Table]:
    """Return a table for each experiment, and for each set of inputs with several seeds."""
    return axes.plan(REGISTRATIONS, overrides)


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return what the other registration changes, as a table and in words."""
    parts, times = question.by_name, question.times
    metrics = {name: part.record.metrics for name, part in parts.items()}
    (axis,) = axes.axes_of(REGISTRATIONS, metrics)
    table = compare(axis, parts)
    return [table, to_markdown(axis, table, times)]


STUDY = Study(
    name="registration_study",
    title="Registrations",
    plan=plan,
    ask=ask,
    figures=[Figure("studies.registration_study.figure:draw", ["tables/{}"])],
    show=lambda answer: show(REGISTRATIONS, answer),
    place=30,
    keys=axes.axis_names(REGISTRATIONS),
    files=[REGISTRATIONS],
    axes=REGISTRATIONS,
)
