"""The section of the report: what choices cost and gain."""

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


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    axes = axes_of(THRESHOLDS, {name: one.metrics for name, one in answer.records.items()})
    tables = answer.tables
    table = pd.concat([one for one in tables.values() if "paper" in one])
    times = tables[f"{answer.called}_time"]
    found = choices(axes, table)
    _, read = levels.summaries(tables["threshold_levels"])
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
        "levels_method": levels.METHOD,
    }


def _values(axis: Axis, table: pd.DataFrame, times: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the values of an axis with their effects, marked where certain, and run times."""
    effects, timed = (rows[rows["axis"] == axis.name].set_index("value") for rows in (table, times))
    return [
        {
            "text": value_title(axis.option, value),
            "is_paper": value == axis.paper,
            "effects": [_cell(effects, name, value, axis.paper) for name in COMPARED],
            "times": [f"{time:.2f} ms" for time in timed.loc[[value], "milliseconds"]],
        }
        for value in axis.values
    ]


def _cell(table: pd.DataFrame, name: str, value: str, paper: str) -> dict[str, str]:
    """Return a number, and where it certainly is better or worse than the paper's, that word."""
    effect = EFFECTS[name]
    ours, theirs = (float(table[name][each]) for each in (paper, value))
    if not isfinite(theirs):
        return {"text": NONE, "mark": ""}
    marked = value != paper and matters(ours, theirs, float(table[f"{name}_p"][value]))
    mark = "better" if (theirs > ours) == effect.larger_is_better else "worse"
    return {"text": effect.write(theirs), "mark": mark if marked else ""}
