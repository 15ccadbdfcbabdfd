"""The section of the report on thresholds: every value with its effects."""

from math import isfinite
from typing import Any

import pandas as pd

from ..axes import Axis, axes_of, value_title
from ..order import SIGNIFICANCE
from ..study import Answer, config_file
from ..words import NONE
from .effects import COMPARED, EFFECTS

THRESHOLDS = config_file("threshold_study")
RELEVANT = 0.02  # of the paper's value


def show(answer: Answer) -> dict[str, Any]:
    """Return what the section is filled with."""
    axes = axes_of(THRESHOLDS, {name: one.metrics for name, one in answer.records.items()})
    table = pd.concat(answer.tables.values())
    return {
        "axes": axes,
        "trials": answer.records["outliers"].sweep.trials,
        "effects": [EFFECTS[name] for name in COMPARED],
        "values": {axis.name: _values(axis, table) for axis in axes},
    }


def _values(axis: Axis, table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the values of an axis with their effects, marked where certain."""
    effects = table[table["axis"] == axis.name].set_index("value")
    return [
        {
            "text": value_title(axis.option, value),
            "is_paper": value == axis.paper,
            "effects": [_cell(effects, name, value, axis.paper) for name in COMPARED],
        }
        for value in axis.values
    ]


def _cell(table: pd.DataFrame, name: str, value: str, paper: str) -> dict[str, str]:
    """Return a number, and where it certainly is better or worse than the paper's, that word."""
    ours, theirs = table[name][paper], table[name][value]
    mark = ""
    if table[f"{name}_p"][value] < SIGNIFICANCE and abs(theirs - ours) >= RELEVANT * abs(ours):
        mark = "better" if (theirs > ours) == EFFECTS[name].larger_is_better else "worse"
    return {"text": EFFECTS[name].write(theirs) if isfinite(theirs) else NONE, "mark": mark}
