"""The paper's registration and the refined one: spread over seeds, and what they order."""

from functools import partial

import pandas as pd

from .. import axes
from ..study import Figure, Question, Study
from .registrations import REGISTRATIONS, compare, show, to_markdown


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
    plan=partial(axes.plan, REGISTRATIONS),
    ask=ask,
    figures=[Figure("studies.registration_study.figure:draw", ["tables/{}"])],
    show=show,
    place=30,
    keys=axes.axis_names(REGISTRATIONS),
    files=[REGISTRATIONS],
    axes=REGISTRATIONS,
)
