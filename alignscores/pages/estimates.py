"""The page of estimates of one reference: scores, trajectories, and errors over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats
from ..comparison.tables import Cell, Table, as_html
from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import collected_warnings
from ..evaluation.time import breaks
from ..histogram import AlignmentScore
from ..texts import printable
from ..thresholds import N_THRESHOLDS, ScoreProfile, tas_profile
from ..version import __version__
from .charts import LEGEND, Axis, band, chart, curve, error_axis, flat, key, plot, upright
from .document import data_element, document, packed, source

__all__ = ["page"]

# Dark to light, so that the order survives greyscale and colour blindness.
RAMP = ["#000004", "#180c3c", "#440a68", "#6d186e", "#972766", "#c03a51", "#e15635", "#f67e14"]
BEYOND = "#1289c9"  # not a colour of the ramp


@dataclass(frozen=True)
class Kind:
    """Errors of positions, or of rotations, and the estimates that have any."""

    name: str
    score: str
    unit: str
    estimates: dict[int, Evaluation]  # by their numbers on the page

    def result(self, evaluation: Evaluation) -> AlignmentScore:
        """Return the score of an estimate."""
        result: AlignmentScore = getattr(evaluation.result, self.score.lower())
        return result

    def errors(self, evaluation: Evaluation) -> Floats:
        """Return the errors of all expected frames, infinite where there is no pose."""
        return evaluation.over_expected(self.result(evaluation).errors, np.inf)

    @property
    def limit(self) -> float:
        """The largest threshold, the same for all."""
        return float(self.result(next(iter(self.estimates.values()))).thresholds[-1])


def page(scored: Sequence[Evaluation], file: str = "reference") -> str:
    """Return the page of estimates; `file` is the reference's."""
    names = [evaluation.name for evaluation in scored]
    more = f" and {len(names) - 3} more" if names[3:] else ""
    title = f"{', '.join(names[:3])}{more} against {printable(Path(file).name)}"
    kinds = _kinds(scored)
    notes = [note.named(evaluation.name) for evaluation in scored for note in evaluation.notes]
    body = source("estimates.html").format(
        title=escape(title),
        conditions=escape(_conditions(scored[0], kinds)),
        table=_table(scored),
        notes="".join(f"<li>{escape(printable(note))}</li>" for note in notes),
        colours=_colours(kinds, by_estimate=len(scored) > 1),
        scene=data_element(_scene(scored, kinds)),
        key=key(names),
        ramp=f"background:linear-gradient(90deg,{','.join(RAMP)})",
        beyond=BEYOND,
        errors=_errors_over_time(scored, kinds),
        legend=LEGEND,
        cumulative="".join(map(_cumulative, kinds)),
        profiles="".join(map(_profile, kinds)),
        version=__version__,
    )
    return document(title, body, ["style.css", "estimates.css"], ["estimates.js"])


def _kinds(scored: Sequence[Evaluation]) -> list[Kind]:
    """Return positions and, where an estimate has them, rotations."""
    numbered = dict(enumerate(scored))
    with_rotations = {index: one for index, one in numbered.items() if one.has_rotations}
    positions = Kind("position", "TAS", scored[0].settings.form.unit, numbered)
    rotations = Kind("rotation", "RAS", "deg", with_rotations)
    return [positions, rotations] if with_rotations else [positions]


def _conditions(first: Evaluation, kinds: Sequence[Kind]) -> str:
    """Return how the estimates were scored."""
    limits = " and ".join(f"{kind.limit:.3g} {kind.unit}" for kind in kinds)
    unit = f"d = {first.result.tas.unit:.3g} {first.settings.form.unit}"
    lost = "score 0" if first.settings.missing == "fail" else "are left out"
    seeds = "; drawings of the first seed" if first.tas_seeds[1:] else ""
    how = first.settings.how_aligned
    return f"{how}; {unit}; largest thresholds {limits}; lost frames {lost}{seeds}"


def _table(scored: Sequence[Evaluation]) -> str:
    """Return the table of the command."""
    rows = [[Cell(one.name), *map(Cell, one.row.values())] for one in scored]
    return as_html(Table(["estimate", *scored[0].row], rows))


def _colours(kinds: Sequence[Kind], *, by_estimate: bool) -> str:
    """Return the choice of what the colours of the trajectories show."""
    choices = {"estimate": ("estimate", "")}
    choices |= {k.name: (f"{k.name} error", f"{k.limit:.3g} {k.unit}") for k in kinds}
    chosen = "estimate" if by_estimate else "position"
    return "".join(
        f'<label><input type="radio" name="colour" value="{name}" data-limit="{limit}"'
        f"{' checked' if name == chosen else ''}> {text}</label>"
        for name, (text, limit) in choices.items()
    )


def _errors_over_time(scored: Sequence[Evaluation], kinds: Sequence[Kind]) -> str:
    """Draw the errors of all estimates, and a band for each."""
    first, ordered, times = scored[0], scored[0].settings.form.ordered, scored[0].times
    x = Axis(times[0], max(times[-1], times[0] + 1e-3), first.time_label)
    after = breaks(times)
    places = x(np.insert(times, after, np.nan))
    drawings = []
    for kind in kinds:
        errors = {index: kind.errors(one) for index, one in kind.estimates.items()}
        all_errors = np.concatenate([*errors.values()])
        y = error_axis(all_errors, kind.limit, f"{kind.name} error [{kind.unit}]")
        shown = {index: y(np.insert(own, after, np.nan)) for index, own in errors.items()}
        curves = [curve(places, own, index, dots=not ordered) for index, own in shown.items()]
        drawings.append(("", plot(y, [*curves, flat(float(y(kind.limit)), "rule")])))
    limits = [kind.limit for kind in kinds]
    for one in scored:
        drawings.append((one.name, band(x, times, [kind.errors(one) for kind in kinds], limits)))
    names = first.reference.keys[first.matches.expected_rows].tolist()
    timed = first.matches.timed
    frames = [f"{t:.2f} s" for t in times] if timed else [printable(str(name)) for name in names]
    said = [_errors_in_words(index, one, kinds) for index, one in enumerate(scored)]
    return chart(x, drawings, "Errors over time", (times, _texts(frames, said)))


def _errors_in_words(index: int, evaluation: Evaluation, kinds: Sequence[Kind]) -> list[str]:
    """Return the errors of each expected frame, after the name of the estimate."""
    words = []
    for kind in kinds:
        if index in kind.estimates:
            errors = kind.errors(evaluation).tolist()
            words.append([f"{e:.3g} {kind.unit}" if e < np.inf else "lost" for e in errors])
    frames = zip(*words, strict=True)
    return [f"{evaluation.name} {', '.join(dict.fromkeys(frame))}" for frame in frames]


def _texts(places: Sequence[str], said: Sequence[Sequence[str]]) -> list[str]:
    """Return what a cursor says at each place: what is said of all estimates."""
    return [f"{place}: {'; '.join(own)}" for place, *own in zip(places, *said, strict=True)]


def _cumulative(kind: Kind) -> str:
    """Draw the share of the frames below each threshold."""
    x = Axis(0, kind.limit, f"threshold of {kind.name}s [{kind.unit}]")
    y = Axis(0, 100, "frames below [%]")
    curves = []
    for index, one in kind.estimates.items():
        result = kind.result(one)
        below = 100 * result.cumulative_frequency / len(result.errors)
        ends = x(np.repeat([0, *result.thresholds], 2)[1:-1])
        curves.append(curve(ends, y(np.repeat(below, 2)), index))
    return chart(x, [("", plot(y, curves))], f"Frames below each threshold of {kind.name}s")


def _profile(kind: Kind) -> str:
    """Draw a score over its largest threshold."""
    largest = kind.limit * np.geomspace(0.01, 10, 16)
    x = Axis(largest[0], largest[-1], f"largest threshold [{kind.unit}]", log=True)
    y = Axis(0, 1, kind.score)
    scores = {index: _scores(kind, one, largest) for index, one in kind.estimates.items()}
    curves = [curve(x(largest), y(own), index) for index, own in scores.items()]
    said = [[f"{kind.estimates[k].name} {score:.3f}" for score in scores[k]] for k in scores]
    texts = _texts([f"up to {limit:.3g} {kind.unit}" for limit in largest], said)
    drawn = plot(y, [*curves, upright(float(x(kind.limit)), "rule")])
    return chart(x, [("", drawn)], f"{kind.score} over its largest threshold", (largest, texts))


def _scores(kind: Kind, evaluation: Evaluation, largest: Floats) -> Floats:
    """Return a score at largest thresholds, at each of which refined aligns anew."""
    matches, settings = evaluation.matches, evaluation.settings
    if kind.score == "RAS" or settings.registration != "refined":
        errors = np.sort(kind.result(evaluation).errors)
        return ScoreProfile(largest, [errors], N_THRESHOLDS).scores
    with collected_warnings():  # the TAS has said them
        return tas_profile(
            matches.gt_poses[:, :3, 3],
            matches.est_poses[:, :3, 3],
            largest,
            rng=settings.seed,
            alignment=settings.alignment,
            up=settings.up,
        ).scores


def _scene(scored: Sequence[Evaluation], kinds: Sequence[Kind]) -> dict[str, Any]:
    """Return the trajectories from above, the axis along which the reference is thinnest."""
    first = scored[0]
    reference = first.reference.poses[first.matches.expected_rows, :3, 3]
    low, high = reference.min(axis=0), reference.max(axis=0)
    thin = int(np.argmin(high - low))
    axes = [axis for axis in range(3) if axis != thin] + [thin]
    signs = [1, 1, -1 if thin == 1 else 1]  # a right-handed frame
    paths = [reference, *(one.over_expected(one.positions, np.nan) for one in scored)]
    return {
        "ordered": first.settings.form.ordered,
        "size": (high - low)[axes[:2]].tolist(),
        "paths": [packed((path - (low + high) / 2)[:, axes] * signs, "<f4") for path in paths],
        "ramp": [*RAMP, BEYOND],
        "colours": {
            kind.name: {
                index: packed(np.minimum(kind.errors(one) / kind.limit, 1) * len(RAMP), "u1")
                for index, one in kind.estimates.items()
            }
            for kind in kinds
        },
    }
