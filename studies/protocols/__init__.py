"""Protocols of other projects beside the new scores: which of two estimates is the better one."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pandas as pd
from pydantic import Field

from experiments.config import Sweep, read_yaml
from experiments.metrics import Column

from .. import study
from .orders import at_outliers, compare_sides
from .words import duels, sentences, to_markdown

PROTOCOLS = study.config_file("protocols")
NO_PATH = ("cube", "uneven")  # where the cameras stand in no order: without metrics of motion


class _Question(study.Settings):
    """The settings of a question and its frame rates."""

    every: study.Rates = Field([1])


class _File(study.Section):
    settings: study.Settings
    questions: dict[study.TableName, _Question]


def plan(overrides: Sequence[str] = ()) -> dict[str, study.Table]:
    """Return a table for each question; where it has several frame rates, of the same trials."""
    study.reject(overrides, ["every"], f"the frame rates stand in {PROTOCOLS.name}")
    file = read_yaml(PROTOCOLS, _File)
    sweeps = study.resolve(PROTOCOLS, "questions", overrides, file.questions, file.settings)
    return {name: _table(name, file.questions[name], sweep) for name, sweep in sweeps.items()}


def _table(name: str, question: _Question, sweep: Sweep) -> study.Table:
    metrics = [
        metric
        for metric in sweep.metrics
        if not (sweep.geometry in NO_PATH and Column.parse(metric).metric.family.ordered)
    ]
    # The name, which seeds rest on, is older than that of the study.
    sweep = replace(sweep, name=f"today/{name}", metrics=metrics)
    return study.at_rates(sweep, question.every) if question.every[1:] else study.Table((sweep,))


def ask(question: study.Question) -> list[pd.DataFrame | str]:
    """Return how often each metric is right on each question, as a table and in words."""
    table, by_outliers = compare_sides(question.by_name), at_outliers(question.by_name)
    return [table, to_markdown(table, by_outliers), by_outliers]


def show(answer: study.Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    return {"sentences": sentences(answer.table), "duels": duels(answer.table)}


STUDY = study.Study(
    name="protocols",
    title="Other protocols",
    plan=plan,
    ask=ask,
    answers=("tables/{}.csv", "tables/{}.md", "tables/{}_outliers.csv"),
    figures=[study.Figure("studies.protocols.figure:draw", ["tables/{}"])],
    show=show,
    place=60,
)
