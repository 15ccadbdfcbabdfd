"""The questions: settings of trials, and the metrics that are evaluated on them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from experiments.config import CONFIG_DIR, load_sweep, read_yaml
from experiments.metrics import Column

from ..study import Study, Table, reject

__all__ = ["DIFFERS", "TODAY", "load_today"]

TODAY = CONFIG_DIR / "study" / "today.yaml"
DIFFERS = "every="
NO_PATH = ("cube", "uneven")  # where the cameras stand in no order


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
    content = read_yaml(TODAY)
    return Study(
        "today",
        {
            name: _table(name, content["settings"], own, overrides)
            for name, own in content["questions"].items()
        },
    )


def _table(
    name: str, shared: Mapping[str, Any], own: Mapping[str, Any], overrides: Sequence[str]
) -> Table:
    settings = {**shared, **own}
    rates, without = settings.pop("every", [1]), settings.pop("without", [])
    sweep = load_sweep(overrides, settings)
    metrics = [
        metric
        for metric in sweep.metrics
        if metric not in without
        and not (sweep.geometry in NO_PATH and Column.parse(metric).metric.ordered)
    ]
    sweep = replace(sweep, name=f"today/{name}", metrics=metrics)
    if len(rates) == 1:
        return Table((sweep,))
    return Table(tuple(replace(sweep, every=k, differs=f"{DIFFERS}{k}") for k in rates))
