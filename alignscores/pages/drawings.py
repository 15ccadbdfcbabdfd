"""Drawings of a comparison: differences, runs, and errors over time, as SVG without scripts."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..comparison.runs import Outcome
from ..comparison.summary import Pair
from ..comparison.tables import number
from ..comparison.verdicts import difference_text, p_text
from ..texts import shortened

__all__ = ["dots", "errors_over_time", "forest", "style"]

DASHES = "none", "6 3", "2 3", "8 3 2 3", "12 2"  # of curves, for greyscale
N_COLOURS = 8
WIDTH = 360  # of a drawing, in the units of its text, which is 11 high
LEFT, RIGHT = 92, 8  # margins
ROW = 24
HEIGHT = 150  # of curves
N_BINS = 160  # largest number of medians along a curve
N_DECADES = 5  # largest range of the errors
TRACKED, OUTLIER, LOST = range(3)

Axis = Callable[[float], float]  # from a value to a place


def colour_and_dash(index: int) -> tuple[str, str]:
    """Return the colour and the dashes of the curve of a system."""
    return f"var(--c{index % N_COLOURS})", DASHES[index % len(DASHES)]


def style(index: int) -> str:
    """Return the attributes of the curve of a system."""
    colour, dash = colour_and_dash(index)
    return f'class="curve" stroke="{colour}" stroke-dasharray="{dash}"'


def forest(pairs: Sequence[Pair], by: str, names: Mapping[str, str]) -> str:
    """Draw the difference of each pair of systems, with its interval where it is significant."""
    with_difference = [pair for pair in pairs if math.isfinite(pair.difference.value)]
    with_difference.sort(key=lambda pair: not pair.tested)
    shown = [vars(p.difference) if p.better else {"": p.difference.value} for p in with_difference]
    ends = [end for one in shown for end in one.values() if math.isfinite(end)]
    low, high = _widened(min([0.0, *ends]), max([0.0, *ends]))

    def across(value: float) -> float:
        return RIGHT + (WIDTH - 2 * RIGHT) * (value - low) / (high - low)

    row = 2 * ROW
    bottom = row * len(with_difference)
    marks = [f'<path class="rule" d="M{across(0):.1f} 0V{bottom}"/>']
    for index, pair in enumerate(with_difference):
        gain, y = pair.difference, row * index + 32
        said = p_text(pair.p) if pair.tested else "not tested"
        text = f"{names[pair.a]} − {names[pair.b]}: wins {pair.wins:.0%}, {said}"
        kind = "dot" if pair.better else "dot open"
        marks.append(f'<text x="{RIGHT}" y="{y - 12}">{escape(text)}</text>')
        if pair.better and math.isfinite(gain.low):
            marks.append(
                f'<path class="span" d="M{across(gain.low):.1f} {y}H{across(gain.high):.1f}"/>'
            )
        marks.append(f'<circle class="{kind}" cx="{across(gain.value):.1f}" cy="{y}" r="4"/>')
    marks += _ticks(low, high, across, bottom)
    spoken = "; ".join(
        f"{names[p.a]} − {names[p.b]} {difference_text(p.difference, p.better is not None)}"
        for p in with_difference
    )
    return _svg(bottom + 20, marks, f"Differences in {by}. {spoken}")


def dots(values: Mapping[str, Sequence[float]], by: str) -> str:
    """Draw each run of some systems on a sequence as a dot, and their mean as a line."""
    finite = [value for own in values.values() for value in own if math.isfinite(value)]
    low, high = _widened(min(finite, default=0.0), max(finite, default=1.0))

    def across(value: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (value - low) / (high - low)

    bottom = ROW * len(values)
    marks = []
    for index, (name, own) in enumerate(values.items()):
        y = ROW * index + ROW / 2
        marks.append(_name(name, y))
        marks.append(f'<path class="grid" d="M{LEFT} {y:g}H{WIDTH - RIGHT}"/>')
        scored = [value for value in own if math.isfinite(value)]
        marks += [f'<circle class="dot" cx="{across(v):.1f}" cy="{y:g}" r="3.5"/>' for v in scored]
        if scored:
            x = across(float(np.mean(scored)))
            marks.append(f'<path class="mean" d="M{x:.1f} {y - 8:g}V{y + 8:g}"/>')
    marks += _ticks(low, high, across, bottom)
    spoken = "; ".join(f"{name}: {', '.join(map(number, own))}" for name, own in values.items())
    return _svg(bottom + 20, marks, f"{by} of each run. {spoken}")


def errors_over_time(
    runs: Mapping[str, Sequence[Outcome]],
    order: Sequence[str],
    largest: tuple[float, float],
) -> str:
    """Draw the median position error of each system over time, and a band for each run.

    `largest` has the errors, in d and in degrees, beyond which a camera is an outlier. Where most
    runs have no pose the time is shaded.
    """
    scored = [outcome for own in runs.values() for outcome in own]
    unit, timed = scored[0].unit, len(scored[0].stamps) > 0
    start = float(min(outcome.times[0] for outcome in scored))
    end = max(float(max(o.times[-1] for o in scored)), math.nextafter(start, math.inf))
    n_bins = min(N_BINS, max(scored[0].n // 2, 1))
    edges = np.linspace(start, end, n_bins + 1)
    curves = {name: _medians(own, edges) for name, own in runs.items()}
    finite = np.concatenate([curve[np.isfinite(curve) & (curve > 0)] for curve in curves.values()])
    low, high = (np.log10(finite.min()), np.log10(finite.max())) if len(finite) else (0.0, 1.0)
    high = max(math.ceil(high), math.floor(low) + 1)
    low = max(math.floor(low), high - N_DECADES)

    def across(share: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * share

    def up(value: float) -> float:
        return 14 + HEIGHT * (high - math.log10(max(value, 10.0**low))) / (high - low)

    marks = [f'<text x="{LEFT}" y="9">position error; dotted: d = {unit:.3g}</text>']
    marks += _decades(low, high, up)
    for name, curve in curves.items():
        marks += _curve(curve, across, up, order.index(name))
    if 10.0**low < unit < 10.0**high:
        marks.append(f'<path class="rule" d="M{LEFT} {up(unit):.1f}H{WIDTH - RIGHT}"/>')
    y = HEIGHT + 26
    for name, own in runs.items():
        marks.append(_name(name, y + 4))
        for outcome in own:
            marks += _band(_states(outcome, largest, edges), across, y)
            y += 8
        y += 10
    marks.append(f'<text x="{LEFT}" y="{y + 6}">0</text>')
    last = f"{end - start:.0f} s" if timed else f"image {end - start:.0f}"
    marks.append(f'<text x="{WIDTH - RIGHT}" y="{y + 6}" text-anchor="end">{last}</text>')
    spoken = "; ".join(
        f"{name}: {np.median(curve[~np.isnan(curve)]):.2g}" for name, curve in curves.items()
    )
    return _svg(y + 12, marks, f"Median position error over time. Typical: {spoken}")


def _decades(low: int, high: int, up: Axis) -> list[str]:
    """Return a line and a number for each power of ten."""
    marks = []
    for value in 10.0 ** np.arange(low, high + 1):
        y = up(value)
        marks.append(f'<path class="grid" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>')
        marks.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    return marks


def _bins(outcome: Outcome, edges: Floats) -> NDArray[np.intp]:
    """Return in which part of the time each camera is."""
    bins = np.searchsorted(edges, outcome.times, side="right") - 1
    return np.clip(bins, 0, len(edges) - 2)


def _medians(outcomes: Sequence[Outcome], edges: Floats) -> Floats:
    """Return the median error in each part of the time, NaN where no camera is expected."""
    bins = np.concatenate([_bins(outcome, edges) for outcome in outcomes])
    errors = np.concatenate([outcome.position_errors for outcome in outcomes])
    medians = np.full(len(edges) - 1, np.nan)
    for index in np.unique(bins):
        medians[index] = np.median(np.where(np.isnan(errors), np.inf, errors)[bins == index])
    return medians


def _states(outcome: Outcome, largest: tuple[float, float], edges: Floats) -> NDArray[np.intp]:
    """Return the most frequent state in each part of the time; -1 where none is expected."""
    far = outcome.position_errors > largest[0] * outcome.unit
    state = np.where(far | (outcome.rotation_errors > largest[1]), OUTLIER, TRACKED)
    state[~np.isfinite(outcome.position_errors)] = LOST
    bins = _bins(outcome, edges)
    counts = np.zeros((len(edges) - 1, 3))
    np.add.at(counts, (bins, state), 1)
    return np.where(counts.any(axis=1), counts.argmax(axis=1), -1)


def _curve(curve: Floats, across: Axis, up: Axis, index: int) -> list[str]:
    """Return a curve in pieces, and the shades between them."""
    marks, drawn, n = [], np.isfinite(curve), len(curve)
    for first, last, kind in _stretches(np.where(drawn, 1, np.where(np.isnan(curve), -1, 0))):
        if kind == 1:
            points = " ".join(
                f"{across((k + 0.5) / n):.1f},{up(curve[k]):.1f}" for k in range(first, last)
            )
            marks.append(f'<polyline {style(index)} points="{points}"/>')
        elif kind == 0:
            x, width = across(first / n), across(last / n) - across(first / n)
            colour, _ = colour_and_dash(index)
            marks.append(
                f'<rect class="gap" fill="{colour}" x="{x:.1f}" y="14" width="{width:.1f}" '
                f'height="{HEIGHT}"/>'
            )
    return marks


def _band(states: NDArray[np.intp], across: Axis, y: float) -> list[str]:
    """Return a band that shows where a run is tracked, an outlier or lost."""
    names, n = {TRACKED: "tracked", OUTLIER: "outlier", LOST: "lost"}, len(states)
    return [
        f'<rect class="{names[kind]}" x="{across(first / n):.1f}" y="{y:g}" '
        f'width="{across(last / n) - across(first / n):.1f}" height="6"/>'
        for first, last, kind in _stretches(states)
        if kind >= 0
    ]


def _stretches(kinds: NDArray[np.intp]) -> Iterator[tuple[int, int, int]]:
    """Yield start, end and kind of each stretch of the same kind."""
    starts = np.flatnonzero(np.diff(kinds, prepend=kinds[0] - 1))
    ends = [*starts[1:].tolist(), len(kinds)]
    for first, last in zip(starts.tolist(), ends, strict=True):
        yield first, last, int(kinds[first])


def _name(name: str, y: float) -> str:
    return (
        f'<text x="{LEFT - 6}" y="{y + 4:g}" text-anchor="end">{escape(shortened(name, 14))}</text>'
    )


def _widened(low: float, high: float) -> tuple[float, float]:
    """Return ends of an axis with some space around what is shown."""
    space = 0.06 * (high - low) or 0.06 * abs(high) or 0.06
    return low - space, high + space


def _ticks(low: float, high: float, across: Axis, y: float) -> list[str]:
    """Return an axis with a few round numbers."""
    step = 10.0 ** math.floor(math.log10((high - low) / 2))
    step *= next(n for n in (5, 2, 1) if (high - low) / (n * step) >= 2)
    values = step * np.arange(math.ceil(low / step), math.floor(high / step) + 1)
    marks = [f'<path class="axis" d="M{across(low):.1f} {y}H{across(high):.1f}"/>']
    marks += [
        f'<text x="{across(value):.1f}" y="{y + 14}" text-anchor="middle">{value:g}</text>'
        for value in values.round(12).tolist()
    ]
    return marks


def _svg(height: float, marks: Iterable[str], spoken: str) -> str:
    return (
        f'<svg class="drawing" viewBox="0 0 {WIDTH} {height:g}" role="img" '
        f'aria-label="{escape(spoken)}">{"".join(marks)}</svg>'
    )
