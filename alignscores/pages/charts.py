"""Charts as SVG without scripts: drawings stretch with the page, texts are HTML.

A chart has rows, each with a name and a drawing, above an axis. Places in a drawing are shares of
its width, and of its height from below.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Floats
from ..evaluation.time import breaks

__all__ = ["LEGEND", "Axis", "band", "chart", "colour", "curve", "drawing", "error_axis"]
__all__ += ["flat", "key", "plot", "rect", "stretches", "upright"]

SIZE = 1000  # units of a drawing
DASHES = "none", "6 3", "2 3", "8 3 2 3", "12 2"  # of curves, for greyscale
N_COLOURS = 8
TRACKED, OUTLIER, LOST, NOT_EXPECTED = range(4)
CLASSES = "tracked", "outlier", "lost"  # in style.css
LEGEND = """\
<p class="small">Dotted: the largest threshold. Bands: <span class="swatch tracked"></span> within
both largest thresholds, <span class="swatch outlier"></span> beyond one of them,
<span class="swatch lost"></span> lost.</p>"""


@dataclass(frozen=True)
class Axis:
    """An axis between two numbers, linear or logarithmic."""

    low: float
    high: float
    label: str = ""
    log: bool = False

    def __call__(self, values: ArrayLike) -> Floats:
        """Return the places of values, at an end if they are beyond; infinite ones have none."""
        scaled = np.log10 if self.log else np.asarray
        low, high = scaled([self.low, self.high])
        places = (scaled(np.clip(values, self.low, self.high)) - low) / (high - low)
        return np.where(np.isinf(values), np.nan, places)

    def ticks(self) -> list[tuple[str, float]]:
        """Return a few round numbers as texts, with their places."""
        if self.log:
            factors = [1, 2, 5] if self.high < 300 * self.low else [1]
            first, last = (math.floor(math.log10(end)) for end in (self.low, self.high))
            numbers = np.outer(10.0 ** np.arange(first, last + 1), factors).ravel()
        else:
            step = 10.0 ** math.floor(math.log10((self.high - self.low) / 2))
            step *= next(n for n in (5, 2, 1) if (self.high - self.low) / (n * step) >= 2)
            numbers = step * np.arange(math.ceil(self.low / step), self.high / step + 1)
        slack = 1e-9 * (self.high - self.low)
        shown = numbers[(numbers >= self.low - slack) & (numbers <= self.high + slack)]
        return [(f"{n:g}", place) for n, place in zip(shown, self(shown).tolist(), strict=True)]


def error_axis(errors: Floats, limit: float, label: str) -> Axis:
    """Return an axis for all errors but the smallest hundredth, and three decades about a limit."""
    shown = errors[np.isfinite(errors)]
    low, high = np.quantile(shown, [0.01, 1]) if len(shown) else (limit, limit)
    low, high = (float(np.clip(end, limit / 1e3, limit * 1e3)) for end in (low, high))
    return Axis(min(low, limit) / 1.5, 1.5 * max(high, limit), label, log=True)


def chart(x: Axis, rows: Iterable[tuple[str, str]], spoken: str) -> str:
    """Return drawings, each with its name, below each other, and their axis."""
    cells = "".join(f'<span title="{escape(row)}">{escape(row)}</span>{svg}' for row, svg in rows)
    ticks = "".join(f'<i style="left:{place:.1%}">{text}</i>' for text, place in x.ticks())
    return (
        f'<div class="chart" role="img" aria-label="{escape(spoken)}">'
        f'<div class="rows">{cells}</div><div class="ticks" aria-hidden="true">{ticks}</div>'
        f"<p>{escape(x.label)}</p></div>"
    )


def plot(y: Axis, marks: Iterable[str]) -> str:
    """Return a drawing with an upright axis."""
    ticks = "".join(f'<i style="bottom:{place:.1%}">{text}</i>' for text, place in y.ticks())
    grid = [flat(place, "grid") for _, place in y.ticks()]
    label = f"<b>{escape(y.label)}</b>"
    return f'<div class="plot" aria-hidden="true">{label}{drawing([*grid, *marks])}{ticks}</div>'


def drawing(marks: Iterable[str]) -> str:
    """Return marks as a picture that is stretched to the width and height of its row."""
    box = f'viewBox="0 0 {SIZE} {SIZE}" preserveAspectRatio="none"'
    return f'<svg {box} aria-hidden="true">{"".join(marks)}</svg>'


def flat(place: float, kind: str, first: float = 0.0, last: float = 1.0) -> str:
    """Return a line from left to right, of a class of style.css; some have round ends."""
    return f'<path class="{kind}" d="M{_right(first)} {_down(place)}H{_right(last)}"/>'


def upright(place: float, kind: str) -> str:
    """Return a line from top to bottom, of a class of style.css."""
    return f'<path class="{kind}" d="M{_right(place)} 0v{SIZE}"/>'


def rect(first: float, last: float, attributes: str) -> str:
    """Return a rectangle between two places, one unit wide or more."""
    width = max(SIZE * (last - first), 1)
    return f'<rect x="{_right(first)}" width="{width:.0f}" height="{SIZE}" {attributes}/>'


def curve(x: Floats, y: Floats, index: int, *, dots: bool = False) -> str:
    """Return a line through places, broken where one is not finite; or a dot at each."""
    path, pen = "", "M"
    for across, up in zip(x.tolist(), y.tolist(), strict=True):
        if not math.isfinite(across + up):
            pen = "M"
            continue
        path += f"{pen}{_right(across)} {_down(up)}{'h0' if pen == 'M' else ''}"
        pen = "M" if dots else "L"
    return f'<path class="curve{" dots" if dots else ""}" {style(index)} d="{path}"/>'


def style(index: int) -> str:
    """Return the attributes of a curve."""
    dashes = DASHES[index % len(DASHES)]
    return f'stroke="{colour(index)}" stroke-dasharray="{dashes}"'


def colour(index: int) -> str:
    """Return the colour of a curve."""
    return f"var(--c{index % N_COLOURS})"


def _right(place: float) -> str:
    return f"{SIZE * place:.0f}"


def _down(place: float) -> str:
    return f"{SIZE * (1 - place):.0f}"


def key(names: Sequence[str]) -> str:
    """Return the names of curves, each behind its style."""
    items = "".join(
        f'<li><svg width="34" height="10" aria-hidden="true"><path class="curve" {style(index)} '
        f'd="M0 5H34"/></svg> {escape(name)}</li>'
        for index, name in enumerate(names)
    )
    return f'<ul class="key">{items}</ul>'


def band(x: Axis, times: Floats, errors: Sequence[Floats], limits: Sequence[float]) -> str:
    """Return a band that shows where an estimate is tracked, an outlier or lost.

    The errors are those of positions, which are not finite where it is lost, and of rotations.
    """
    beyond = [own >= limit for own, limit in zip(errors, limits, strict=True)]
    states = np.where(np.any(beyond, axis=0), OUTLIER, TRACKED)
    states[~np.isfinite(errors[0])] = LOST
    after = breaks(times)
    states = np.insert(states, after, NOT_EXPECTED)
    ends = x([*np.insert(times, after, times[after - 1]), times[-1]]).tolist()
    return drawing(
        rect(ends[first], ends[last], f'class="{CLASSES[state]}"')
        for first, last, state in stretches(states)
        if state != NOT_EXPECTED
    )


def stretches(states: NDArray[np.intp]) -> Iterator[tuple[int, int, int]]:
    """Yield start, end and state of each stretch of the same state."""
    starts = np.flatnonzero(np.diff(states, prepend=states[0] - 1)).tolist()
    for first, last in pairwise([*starts, len(states)]):
        yield first, last, int(states[first])
