"""The questions: settings of trials, and the metrics that are evaluated on them."""

from collections.abc import Sequence
from dataclasses import replace

from pydantic import Field

from experiments.config import Sweep, read_yaml
from experiments.metrics import Column

from .. import study

PROTOCOLS = study.config_file("protocols")
NO_PATH = ("cube", "uneven")  # where the cameras stand in no order


class Question(study.Settings):
    """The settings of a question, its frame rates, and the metrics that would take too long."""

    every: study.Rates = Field([1])
    without: list[str] = Field([])


class _File(study.Section):
    settings: study.Settings
    questions: dict[study.TableName, Question]


def plan(overrides: Sequence[str] = ()) -> dict[str, study.Table]:
    """Return a table for each question; where it has several frame rates, of the same trials.

    Metrics of motion are left out where cameras do not follow a path.
    """
    study.reject(overrides, ["every"], f"the frame rates stand in {PROTOCOLS.name}")
    file = read_yaml(PROTOCOLS, _File)
    sweeps = study.resolve(PROTOCOLS, "questions", overrides, file.questions, file.settings)
    return {name: _table(name, file.questions[name], sweep) for name, sweep in sweeps.items()}


def _table(name: str, question: Question, sweep: Sweep) -> study.Table:
    metrics = [
        metric
        for metric in sweep.metrics
        if metric not in question.without
        and not (sweep.geometry in NO_PATH and Column.parse(metric).metric.family.ordered)
    ]
    # The name, which seeds rest on, is older than that of the study.
    sweep = replace(sweep, name=f"today/{name}", metrics=metrics)
    return study.at_rates(sweep, question.every) if question.every[1:] else study.Table((sweep,))
