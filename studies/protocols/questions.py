"""The questions: settings of trials, and the metrics that are evaluated on them."""

from collections.abc import Sequence
from dataclasses import replace

from pydantic import Field

from experiments.config import Sweep, read_yaml
from experiments.metrics import Column

from ..study import (
    Rates,
    Section,
    Settings,
    Table,
    TableName,
    at_rates,
    config_file,
    reject,
    resolve,
)

PROTOCOLS = config_file("protocols")
NO_PATH = ("cube", "uneven")  # where the cameras stand in no order


class Question(Settings):
    """The settings of a question, its frame rates, and the metrics that would take too long."""

    every: Rates = Field([1])
    without: list[str] = Field([])


class _File(Section):
    settings: Settings
    questions: dict[TableName, Question]


def plan(overrides: Sequence[str] = ()) -> dict[str, Table]:
    """Return a table for each question; where it has several frame rates, of the same trials.

    Metrics of motion are left out where cameras do not follow a path.
    """
    reject(overrides, ["every"], f"the frame rates stand in {PROTOCOLS.name}")
    file = read_yaml(PROTOCOLS, _File)
    sweeps = resolve(PROTOCOLS, "questions", overrides, file.questions, file.settings)
    return {name: _table(name, file.questions[name], sweep) for name, sweep in sweeps.items()}


def _table(name: str, question: Question, sweep: Sweep) -> Table:
    metrics = [
        metric
        for metric in sweep.metrics
        if metric not in question.without
        and not (sweep.geometry in NO_PATH and Column.parse(metric).metric.family.ordered)
    ]
    # The name, which seeds rest on, is older than that of the study.
    sweep = replace(sweep, name=f"today/{name}", metrics=metrics)
    return at_rates(sweep, question.every) if question.every[1:] else Table((sweep,))
