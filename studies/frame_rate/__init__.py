"""Frame rate: what each metric makes of the same estimates with fewer of their cameras."""

from typing import Any

import pandas as pd

from ..study import Answer, Figure, Question, Study
from .rates import compare, plan, summaries, to_markdown

__all__ = ["STUDY"]


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return how much each metric depends on the frame rate, as a table and in words."""
    table = compare(question.by_name)
    return [table, to_markdown(table)]


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    return {"metrics": summaries(answer.table)}


STUDY = Study(
    name="frame_rate",
    title="Frame rates",
    plan=plan,
    ask=ask,
    figures=[Figure("studies.frame_rate.figure:draw", ["tables/{}"])],
    show=show,
    place=50,
    keys=["trajectories"],
)
