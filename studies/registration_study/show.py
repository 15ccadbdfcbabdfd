"""The section of the report: both registrations on the same cameras."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from experiments.metrics import Column

from ..axes import Axis, axes_of, is_seeded
from ..study import Answer
from . import registrations

DIGITS = {  # of the statistics; one of an order, three of all others
    "median standard deviation": 5,
    "largest standard deviation": 4,
    "scattered inputs": 0,
    registrations.DEPENDENCE: 1,
}


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    metrics = {name: record.metrics for name, record in answer.records.items()}
    (axis,) = axes_of(registrations.REGISTRATIONS, metrics)
    table, times = answer.table, answer.tables[f"{answer.called}_time"]
    groups = [
        _group(axis, part, numbers, _inputs_title(axis, answer))
        for part, numbers in registrations.summarise(axis, table).items()
    ]
    timed = [
        (f"{n} cameras", [f"{milliseconds:.2f} ms" for milliseconds in rows["milliseconds"]])
        for n, rows in times.groupby("n_cameras")
    ]
    groups.append({"title": "Processor time of one evaluation", "part": "", "rows": timed})
    once = (one.sweep for one in answer.records.values() if not is_seeded(one.metrics))
    return {
        "values": axis.values,
        "paper": axis.paper,
        "trials": next(once).trials,
        "spread": registrations.spread(axis, table),
        "meaning": registrations.meaning(axis, table),
        "repeatable": registrations.REPEATABLE,
        "groups": groups,
        "inputs": _inputs(axis, table),
    }


def _inputs_title(axis: Axis, answer: Answer) -> str:
    metrics = (metric for record in answer.records.values() for metric in record.metrics)
    seeds = {Column.parse(metric).options.get("seed") for metric in metrics} - {None}
    return f"{len(registrations.gain(axis, answer.table))} inputs, {len(seeds)} seeds each"


def _group(
    axis: Axis, part: str, statistics: Mapping[str, "pd.Series[float]"], inputs: str
) -> dict[str, Any]:
    """Return statistics of the same trials: words, and a number for each registration."""
    rows = []
    for name, numbers in statistics.items():
        digits = DIGITS.get(name, 1 if registrations.ORDER in name else 3)
        texts = [f"{numbers[value]:.{digits}f}" for value in axis.values]
        rows.append((f"{name[0].upper()}{name[1:]}", texts))
    title = f"Experiment {part.replace('_', ' ')}" if part else inputs
    return {"title": title, "part": part, "rows": rows}


def _inputs(axis: Axis, table: pd.DataFrame) -> list[tuple[str, Sequence[str]]]:
    """Return each input with the mean and the standard deviation of its scores over the seeds."""
    scene = ["part", "geometry", *registrations.SCENE]
    several = table["trial"].nunique() > 1
    rows: list[tuple[str, Sequence[str]]] = []
    for _, group in table.groupby(scene, sort=False):
        first, of = group.iloc[0], group.set_index("statistic")
        where = registrations.GEOMETRIES.get(first["geometry"], first["geometry"])
        words = f"{first['n_cameras']:.0f} {where}, {first['n_outliers']:.0f} outliers, "
        words += f"sigma_t {first['sigma_t']:g}"
        words += f", trial {1 + first['trial']:.0f}" if several else ""
        texts = [
            f"{of[value]['mean']:.4f} ± {of[value]['standard deviation']:.4f}"
            for value in axis.values
        ]
        rows.append((words, texts))
    return rows
