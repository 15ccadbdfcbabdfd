"""Frame rate: what each metric makes of the same estimates with fewer of their cameras."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from ..study import Answer, Figure, Question, Study
from .rates import compare, means, plan, summaries, to_markdown
from .trajectories import score_rates

TABLES = ["tables/{}", "tables/{}_means"]


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return how much each metric depends on the frame rate, as a table and in words."""
    table = compare(question.by_name)
    return [table, means(question.by_name), to_markdown(table)]


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    return {"metrics": summaries(answer.table)}


def score(given: Mapping[str, str], part: str) -> pd.DataFrame:
    """Return the scores of one's own trajectories at several frame rates."""
    return score_rates(Path(given["trajectories"]))


STUDY = Study(
    name="frame_rate",
    title="Frame rates",
    plan=plan,
    ask=ask,
    answers=[*(f"{table}.csv" for table in TABLES), "tables/{}.md"],
    figures=[Figure("studies.frame_rate.figure:draw", TABLES)],
    show=show,
    place=50,
    keys=["trajectories"],
    score=score,
)
