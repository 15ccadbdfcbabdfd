"""Drawings of a comparison: differences, runs, and errors over time."""

import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Floats
from ..comparison.comparison import Comparison
from ..comparison.runs import Outcome
from ..comparison.summary import Pair, Summary
from ..comparison.tables import number
from ..comparison.verdicts import difference_text, p_text
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


def differences(pairs: Sequence[Pair], by: str) -> str:
    """Draw the difference of each pair of systems, with its interval where it is significant."""
    shown = [pair for pair in pairs if math.isfinite(pair.difference.value)]
    shown.sort(key=lambda pair: not pair.tested)
    x = _axis([0.0, *(end for pair in shown for end in _ends(pair))])
    rows, spoken = [], []
    for pair in shown:
        which = f"{pair.a} − {pair.b}"
        said = p_text(pair.p) if pair.tested else "not tested"
        value, *interval = x(_ends(pair)).tolist()
        marks = [upright(float(x(0)), "rule")]
        marks += [flat(0.5, "span", *interval)] if interval else []
        dots = ["dot"] if pair.better else ["open", "hole"]
        marks += [flat(0.5, kind, value, value) for kind in dots]
        rows.append((f"{which}: wins {pair.wins:.0%}, {said}", drawing(marks)))
        spoken.append(f"{which} {difference_text(pair.difference, pair.better is not None)}")
    drawn = chart(x, rows, f"Differences in {by}. {'; '.join(spoken)}")
    return f'<div class="wide">{drawn}</div>'


def _ends(pair: Pair) -> list[float]:
    """Return a difference, and the ends of its interval where it is significant."""
    gain = pair.difference
    has_interval = pair.better and math.isfinite(gain.low)
    return [gain.value, gain.low, gain.high] if has_interval else [gain.value]


def runs(summary: Summary, by: str, sequence: str) -> str:
    """Draw each scored run on a sequence as a dot, and the mean of a system as a line."""
    values = {
        system: [run.outcome.scores[by] for run in summary.of(system, sequence) if not run.failed]
        for system in summary.ranked(by)
        if (system, sequence) in summary.entries
    }
    finite = {system: [v for v in own if math.isfinite(v)] for system, own in values.items()}
    x = _axis([value for own in finite.values() for value in own] or [0.0, 1.0])
    rows, spoken = [], []
    for system, own in finite.items():
        failed = summary.entries[system, sequence].failed
        marks = [flat(0.5, "dot", place, place) for place in x(own).tolist()]
        marks += [upright(float(x(np.mean(own))), "mean")] if own else []
        name = f"{system} †{failed}" if failed else system
        rows.append((name, drawing([flat(0.5, "grid"), *marks])))
        spoken.append(f"{name}: {', '.join(map(number, values[system]))}")
    return chart(x, rows, f"{by} of each run. {'; '.join(spoken)}")


def _axis(values: Sequence[float]) -> Axis:
    """Return an axis with some space around what is shown."""
    low, high = min(values), max(values)
    space = 0.06 * (high - low) or 0.06 * abs(high) or 0.06
    return Axis(low - space, high + space)


def errors_over_time(comparison: Comparison, sequence: str) -> str:
    """Draw the median position error of each system on a sequence, and a band for each run."""
    summary, settings = comparison.summary, comparison.settings
    outcomes = {
        system: [run.outcome for run in summary.of(system, sequence) if not run.failed]
        for system in summary.systems
    }
    scored = [outcome for own in outcomes.values() for outcome in own]
    if not scored:
        return "<p>No run was scored.</p>"
    start = min(outcome.times[0] for outcome in scored)
    span = max(outcome.times[-1] for outcome in scored) - start
    ordered = settings.form.ordered
    label = "time [s]" if len(scored[0].stamps) else "frame" if ordered else "image"
    x = Axis(0.0, span or 1.0, label)
    edges = np.linspace(0, span, min(N_BINS, max(scored[0].n // 2, 1)) + 1)
    limits = settings.max_threshold * summary.unit(sequence), settings.max_threshold_deg
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
            drawn = band(x, one.times - start, (one.position_errors, one.rotation_errors), limits)
            rows.append(("" if number_of_run else system, drawn))
    spoken = "; ".join(f"{system}: {np.nanmedian(own):.2g}" for system, own in medians.items())
    return chart(x, rows, f"Median position error over time. Typical: {spoken}")


def _medians(outcomes: Sequence[Outcome], edges: Floats) -> Floats:
    """Return the median error in each part of the time, NaN where no frame is expected."""
    times = np.concatenate([outcome.times for outcome in outcomes])
    errors = np.concatenate([outcome.position_errors for outcome in outcomes])
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
