"""The section of the report: what choices cost and gain."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import pandas as pd

from ..axes import Axis, axes_of, value_title
from ..study import Answer
from ..words import NONE
from . import levels, maps
from .effects import COMPARED, EFFECTS
from .maps import THRESHOLDS
from .words import NOTHING, TERMS, choices, lead, matters, method


@dataclass(frozen=True)
class Cell:
    """A number, and where it certainly is better or worse than the paper's value's, that word."""

    text: str
    mark: str = ""


@dataclass(frozen=True)
class Value:
    """A value of an option with its effects and run times."""

    text: str
    is_paper: bool
    effects: Sequence[Cell]
    times: Sequence[str]


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    axes = axes_of(THRESHOLDS, {name: one.metrics for name, one in answer.records.items()})
    tables = answer.tables
    table = pd.concat([one for one in tables.values() if "paper" in one])
    times = tables[f"{answer.called}_time"]
    found = choices(axes, table)
    read = levels.summaries(tables["threshold_levels"])
    return {
        "choices": found,
        "lead": lead(found),
        "method": method(answer.records["outliers"].sweep.trials),
        "nothing": NOTHING,
        "terms": TERMS,
        "effects": [EFFECTS[name] for name in COMPARED],
        "cameras": sorted(times["n_cameras"].unique()),
        "values": {axis.name: _values(axis, table, times) for axis in axes},
        "maps": maps.sentences(tables["threshold_maps"]),
        "maps_method": maps.METHOD,
        "levels": read,
        "levels_heads": levels.heads(read),
        "levels_method": levels.METHOD,
    }


def _values(axis: Axis, table: pd.DataFrame, times: pd.DataFrame) -> list[Value]:
    """Return the values of an axis with their effects and run times."""
    effects, timed = (rows[rows["axis"] == axis.name].set_index("value") for rows in (table, times))
    return [
        Value(
            value_title(axis.option, value),
            value == axis.paper,
            [_cell(effects, name, value, axis.paper) for name in COMPARED],
            [f"{milliseconds:.2f} ms" for milliseconds in timed.loc[[value], "milliseconds"]],
        )
        for value in axis.values
    ]


def _cell(table: pd.DataFrame, name: str, value: str, paper: str) -> Cell:
    effect = EFFECTS[name]
    ours, theirs = (float(table[name][each]) for each in (paper, value))
    if not isfinite(theirs):
        return Cell(NONE)
    marked = value != paper and matters(ours, theirs, float(table[f"{name}_p"][value]))
    mark = "better" if (theirs > ours) == effect.larger_is_better else "worse"
    return Cell(effect.write(theirs), mark if marked else "")
