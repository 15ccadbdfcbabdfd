"""The questions: settings of trials, and the metrics that are evaluated on them."""

from collections.abc import Sequence
from dataclasses import replace

from pydantic import Field

from experiments.config import CONFIG_DIR, Sweep, read_yaml
from experiments.metrics import Column

from ..study import Rates, Section, Settings, Study, Table, TableName, at_rates, reject, resolve

__all__ = ["TODAY", "load_today"]

TODAY = CONFIG_DIR / "study" / "today.yaml"
NO_PATH = ("cube", "uneven")  # where the cameras stand in no order


class Question(Settings):
    """The settings of a question, its frame rates, and the metrics that would take too long."""

    every: Rates = Field([1])
    without: list[str] = Field([])


class _File(Section):
    settings: Settings
    questions: dict[TableName, Question]


def load_today(overrides: Sequence[str] = ()) -> Study:
    """Read ``configs/study/today.yaml``.

    Parameters
    ----------
    overrides : sequence of str
        Settings for all questions such as ``"trials=5"``.

    Returns
    -------
    Study
        A table for each question; where it has several frame rates, with a sweep for each, of the
        same trials. Metrics of motion are left out where cameras do not follow a path.

    Raises
    ------
    ConfigError
        In one line, where something is unknown or impossible.

    Examples
    --------
    >>> from studies.today.questions import load_today
    >>> study = load_today(["trials=5"])
    >>> list(study.tables)[:3], len(study.tables["frame_rate"].sweeps)
    (['outliers', 'collinear', 'cameras'], 4)
    """
    reject(overrides, ["every"], f"the frame rates stand in {TODAY.name}")
    file = read_yaml(TODAY, _File)
    tables = {
        name: _table(
            name, question, resolve(TODAY, f"questions.{name}", overrides, file.settings, question)
        )
        for name, question in file.questions.items()
    }
    return Study("today", tables)


def _table(name: str, question: Question, sweep: Sweep) -> Table:
    metrics = [
        metric
        for metric in sweep.metrics
        if metric not in question.without
        and not (sweep.geometry in NO_PATH and Column.parse(metric).metric.family.ordered)
    ]
    sweep = replace(sweep, name=f"today/{name}", metrics=metrics)
    return at_rates(sweep, question.every) if question.every[1:] else Table((sweep,))
