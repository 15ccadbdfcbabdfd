"""The page of estimates of one reference; its scripts compute scores from all errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices
from ..evaluation.evaluation import LOST, Evaluation, finite_or_none, median
from ..evaluation.settings import Settings
from ..texts import printable
from ..trajectories.files import Trajectory
from ..version import __version__
from .document import document, packed, source

__all__ = ["Estimate", "breaks", "over_expected", "page", "page_data"]

SCRIPTS = "scores.js", "charts.js", "controls.js", "estimates.js"


@dataclass(frozen=True, eq=False)
class Estimate:
    """An estimate on the page; arrays have an entry for each expected frame."""

    name: str
    rows: Indices  # in the reference
    lost: Booleans  # whether `--missing ignore` leaves the frame out
    position_errors: Floats  # infinite for failures
    rotation_errors: Floats
    positions: Floats  # aligned, (n, 3); not finite for failures
    half: tuple[float, float]  # half-score distance and angle
    ate: float | None
    tracked: float
    notes: list[str]


def page(scored: Sequence[Evaluation], file: str = "reference") -> str:
    """Return the page of estimates; `file` is the reference's."""
    estimates = [_estimate(evaluation) for evaluation in scored]
    names = ", ".join(estimate.name for estimate in estimates[:3])
    more = f" and {len(estimates) - 3} more" if estimates[3:] else ""
    first = scored[0]
    title = f"{names}{more} against {printable(Path(file).name)}"
    unit = first.result.tas.unit
    return _document(page_data(title, first.reference, estimates, first.settings, unit))


def _document(data: dict[str, Any]) -> str:
    return document(
        data["title"],
        source("estimates.html"),
        styles=("style.css", "estimates.css"),
        scripts=SCRIPTS,
        data=data,
    )


def page_data(
    title: str,
    reference: Trajectory,
    estimates: Sequence[Estimate],
    settings: Settings,
    unit: float,
) -> dict[str, Any]:
    """Return the data for the scripts; `unit` is d."""
    positions, rows = reference.poses[:, :3, 3], estimates[0].rows
    times = reference.keys[rows] if reference.keys.dtype.kind == "f" else rows.astype(int)
    centre = (np.nanmin(positions, axis=0) + np.nanmax(positions, axis=0)) / 2
    return {
        "title": title,
        "version": __version__,
        "unit": settings.form.unit,
        "ordered": settings.form.ordered,
        "cameras": _cameras(reference.keys),
        "positions": packed(positions - centre, "<f4"),
        "breaks": rows[breaks(times)].tolist(),
        "settings": {
            "threshold": settings.max_threshold,
            "degrees": settings.max_threshold_deg,
            "weight": settings.weight,
            "missing": settings.missing,
            "unit": unit,
            "aligned": settings.how_aligned,
        },
        "estimates": [_estimate_data(estimate, centre) for estimate in estimates],
    }


def _estimate_data(estimate: Estimate, centre: Floats) -> dict[str, Any]:
    errors = estimate.position_errors, estimate.rotation_errors
    return {
        "name": estimate.name,
        "rows": packed(estimate.rows, "<u4"),
        "lost": packed(estimate.lost, "u1"),
        "position": packed(errors[0], "<f8"),
        "rotation": packed(errors[1], "<f8"),
        "positions": packed(estimate.positions - centre, "<f4"),
        "half": [finite_or_none(value) for value in estimate.half],
        "median": [finite_or_none(median(values)) for values in errors],
        "ate": estimate.ate,
        "tracked": estimate.tracked,
        "notes": estimate.notes,
    }


def _cameras(keys: NDArray[Any]) -> dict[str, Any]:
    """Return the stamps or names of the reference, by their kind."""
    if keys.dtype.kind == "f":
        return {"stamps": packed(keys, "<f8")}
    return {"names": [printable(str(key)) for key in keys.tolist()]}


def _estimate(evaluation: Evaluation) -> Estimate:
    """Return an estimate with all expected frames, also those that are left out."""
    result = evaluation.result
    return Estimate(
        name=evaluation.name,
        rows=evaluation.matches.expected_rows,
        lost=over_expected(evaluation, evaluation.statuses, LOST) == LOST,
        position_errors=over_expected(evaluation, result.tas.errors, np.inf),
        rotation_errors=over_expected(evaluation, result.ras.errors, np.inf),
        positions=over_expected(evaluation, evaluation.positions, np.nan),
        half=(evaluation.half_distance, evaluation.half_angle),
        ate=evaluation.ate,
        tracked=1 - evaluation.lost,
        notes=[printable(note.named(evaluation.name)) for note in evaluation.notes],
    )


def breaks(times: NDArray[Any]) -> NDArray[np.intp]:
    """Return where frames follow a gap of the reference, in which nothing is expected."""
    steps = np.diff(times)
    return np.flatnonzero(steps > 3 * np.median(steps)) + 1 if len(steps) else steps.astype(np.intp)


def over_expected(evaluation: Evaluation, values: NDArray[Any], of_lost: float) -> NDArray[Any]:
    """Return values of scored frames for all expected ones; those left out have `of_lost`."""
    rows = evaluation.matches.expected_rows
    all_rows = np.full((len(rows), *values.shape[1:]), of_lost, values.dtype)
    all_rows[np.isin(rows, evaluation.matches.gt_rows)] = values
    return all_rows
