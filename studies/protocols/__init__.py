"""Protocols of other projects beside the new scores: which of two estimates is the better one."""

from typing import Any

import pandas as pd

from ..study import Answer, Figure, Question, Study
from .orders import at_outliers, compare_sides
from .questions import plan
from .words import duels, sentences, to_markdown


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return how often each metric is right on each question, as a table and in words."""
    table, by_outliers = compare_sides(question.by_name), at_outliers(question.by_name)
    return [table, to_markdown(table, by_outliers), by_outliers]


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    return {"sentences": sentences(answer.table), "duels": duels(answer.table)}


STUDY = Study(
    name="protocols",
    title="Other protocols",
    plan=plan,
    ask=ask,
    answers=("tables/{}.csv", "tables/{}.md", "tables/{}_outliers.csv"),
    figures=[Figure("studies.protocols.figure:draw", ["tables/{}"])],
    show=show,
    place=60,
)
