"""Drawings of a comparison: differences, runs, and errors over time."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..arrays import Floats
from ..comparison.comparison import Comparison
from ..comparison.runs import Errors
from ..comparison.summary import records
from ..comparison.tables import number
from ..comparison.verdict import difference_text, p_text
from .charts import (
    Axis,
    band,
    chart,
    colour,
    curve,
    drawing,
    error_axis,
    flat,
    plot,
    rect,
    stretches,
    upright,
)

__all__ = ["differences", "errors_over_time", "runs"]

N_BINS = 160  # largest number of medians along a curve


def differences(pairs: pd.DataFrame, by: str) -> str:
    """Draw the difference of each pair of systems, with its interval where it is significant."""
    pairs = pairs[np.isfinite(pairs["difference"])]
    shown = sorted(records(pairs), key=lambda pair: math.isnan(pair["p"]))
    x = _axis([0.0, *(end for pair in shown for end in _ends(pair))])
    rows, spoken = [], []
    for pair in shown:
        which = f"{pair['a']} − {pair['b']}"
        ahead = isinstance(pair["better"], str)
        said = "not tested" if math.isnan(pair["p"]) else p_text(pair["p"])
        value, *interval = x(_ends(pair)).tolist()
        marks = [upright(float(x(0)), "rule")]
        marks += [flat(0.5, "span", *interval)] if interval else []
        dots = ["dot"] if ahead else ["open", "hole"]
        marks += [flat(0.5, kind, value, value) for kind in dots]
        rows.append((f"{which}: wins {pair['wins']:.0%}, {said}", drawing(marks)))
        ends = (pair[name] for name in ("difference", "low", "high"))
        spoken.append(f"{which} {difference_text(*ends, significant=ahead)}")
    drawn = chart(x, rows, f"Differences in {by}. {'; '.join(spoken)}")
    return f'<div class="wide">{drawn}</div>'


def _ends(pair: dict[str, Any]) -> list[float]:
    """Return a difference, and the ends of its interval where it is significant."""
    has_interval = isinstance(pair["better"], str) and math.isfinite(pair["low"])
    names = ["difference", "low", "high"] if has_interval else ["difference"]
    return [pair[name] for name in names]


def runs(found: Comparison, sequence: str) -> str:
    """Draw each scored run on a sequence as a dot, and the mean of a system as a line."""
    table = found.distinct[found.distinct["sequence"] == sequence]
    scored = table[table["status"] == "scored"]
    there = [name for name in found.overall["system"] if name in set(table["system"])]
    values = {name: scored.loc[scored["system"] == name, found.by].tolist() for name in there}
    finite = {system: [v for v in own if math.isfinite(v)] for system, own in values.items()}
    x = _axis([value for own in finite.values() for value in own] or [0.0, 1.0])
    rows, spoken = [], []
    for system, own in finite.items():
        failed = int((table["system"] == system).sum()) - len(values[system])
        marks = [flat(0.5, "dot", place, place) for place in x(own).tolist()]
        marks += [upright(float(x(np.mean(own))), "mean")] if own else []
        name = f"{system} †{failed}" if failed else system
        rows.append((name, drawing([flat(0.5, "grid"), *marks])))
        spoken.append(f"{name}: {', '.join(map(number, values[system]))}")
    return chart(x, rows, f"{found.by} of each run. {'; '.join(spoken)}")


def _axis(values: Sequence[float]) -> Axis:
    """Return an axis with some space around what is shown."""
    low, high = min(values), max(values)
    space = 0.06 * (high - low) or 0.06 * abs(high) or 0.06
    return Axis(low - space, high + space)


def errors_over_time(found: Comparison, sequence: str) -> str:
    """Draw the median position error of each system on a sequence, and a band for each run."""
    settings = found.settings
    outcomes = {
        system: [
            errors
            for run, errors in found.errors.items()
            if (run.system, run.sequence) == (system, sequence)
        ]
        for system in found.overall["system"]
    }
    scored = [outcome for own in outcomes.values() for outcome in own]
    if not scored or settings is None:
        return "<p>No run was scored.</p>"
    start = min(outcome.time[0] for outcome in scored)
    span = max(outcome.time[-1] for outcome in scored) - start
    ordered = settings.form.ordered
    label = "time [s]" if scored[0].timed else "frame" if ordered else "image"
    x = Axis(0.0, span or 1.0, label)
    edges = np.linspace(0, span, min(N_BINS, max(len(scored[0].time) // 2, 1)) + 1)
    unit = found.runs.loc[found.runs["sequence"] == sequence, "d"].dropna().iloc[0]
    limits = settings.max_threshold * float(unit), settings.max_threshold_deg
    medians = {a: _medians(own, start + edges) for a, own in outcomes.items() if own}
    y = error_axis(
        np.concatenate([*medians.values()]),
        limits[0],
        f"median position error [{settings.form.unit}]",
    )
    marks = []
    for index, system in enumerate(sorted(outcomes)):
        if system in medians:
            places = x((edges[1:] + edges[:-1]) / 2), y(medians[system])
            marks.append(curve(*places, index, dots=not ordered))
            marks += _shades(medians[system], index)
    rows = [("", plot(y, [*marks, flat(float(y(limits[0])), "rule")]))]
    for system, own in outcomes.items():
        for number_of_run, one in enumerate(own):
            drawn = band(x, one.time - start, (one.position, one.rotation), limits)
            rows.append(("" if number_of_run else system, drawn))
    spoken = "; ".join(f"{system}: {np.nanmedian(own):.2g}" for system, own in medians.items())
    return chart(x, rows, f"Median position error over time. Typical: {spoken}")


def _medians(outcomes: Sequence[Errors], edges: Floats) -> Floats:
    """Return the median error in each part of the time, NaN where no frame is expected."""
    times = np.concatenate([outcome.time for outcome in outcomes])
    errors = np.concatenate([outcome.position for outcome in outcomes])
    parts = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(edges) - 2)
    medians = np.full(len(edges) - 1, np.nan)
    for part in np.unique(parts):
        medians[part] = np.median(errors[parts == part])
    return medians


def _shades(medians: Floats, index: int) -> list[str]:
    """Return the shades where most runs have no pose."""
    return [
        rect(first / len(medians), last / len(medians), f'class="gap" fill="{colour(index)}"')
        for first, last, lost in stretches(np.isinf(medians).astype(int))
        if lost
    ]
