"""The page of one's own files: all errors in one HTML file, whose scripts compute the scores."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices
from ..evaluation.evaluation import LOST, STATUSES, Evaluation
from ..evaluation.settings import Settings
from ..explorer import source
from ..explorer.document import document
from ..texts import printable
from ..trajectories.files import Trajectory
from ..translation import closest_pair_distances
from ..version import __version__

__all__ = ["Estimate", "packed", "page", "page_data", "page_without_data"]

QUANTILES = 20  # of the closest-pair distances, equally spaced, that d can be on the page
STEPS = 100  # thresholds of a score
SCRIPTS = "scores.js", "charts.js", "controls.js", "own.js"


@dataclass(frozen=True, eq=False)
class Estimate:
    """What the page shows of an estimate; arrays have an entry a camera."""

    name: str
    file: str
    rows: Indices  # in the reference
    statuses: NDArray[np.uint8]  # of `Evaluation`
    position_errors: Floats  # infinite for failures
    rotation_errors: Floats
    positions: Floats  # aligned, (n, 3); not finite for failures
    tas: tuple[float, float | None]  # mean and standard deviation over the seeds
    pas: tuple[float, float | None]
    half: tuple[float, float]  # half-score distance and angle
    notes: list[str]


def page(scored: Sequence[Evaluation], file: str) -> str:
    """Return the page of estimates against a reference, whose file is shown as `file`."""
    estimates = [_estimate(evaluation) for evaluation in scored]
    reference, settings = scored[0].reference, scored[0].settings
    return _document(
        page_data(f"Scores against {Path(file).name}", reference, file, estimates, settings)
    )


def page_without_data() -> list[str]:
    """Return what stands before and after the data in a page, the text of `page_data` as JSON."""
    return _document({"title": "Scores"}).split('{"title":"Scores"}')


def _document(data: dict[str, Any]) -> str:
    return document(
        data["title"],
        source("own.html"),
        styles=map(source, ("style.css", "own.css")),
        scripts=map(source, SCRIPTS),
        data=data,
    )


def page_data(
    title: str,
    reference: Trajectory,
    file: str,
    estimates: Sequence[Estimate],
    settings: Settings,
) -> dict[str, Any]:
    """Return what the scripts read; without a unit in the settings the page derives d."""
    positions = reference.poses[:, :3, 3]
    centre = (np.nanmin(positions, axis=0) + np.nanmax(positions, axis=0)) / 2
    form = settings.form
    return {
        "title": title,
        "version": __version__,
        "format": settings.format,
        "unit": form.unit,
        "ordered": form.ordered,
        "reference": file,
        "cameras": _cameras(reference.keys),
        "positions": packed(positions - centre, "<f4"),
        "quantiles": QUANTILES,
        "statuses": STATUSES,
        "settings": {
            "threshold": settings.max_threshold,
            "degrees": settings.max_threshold_deg,
            "steps": STEPS,
            "weight": settings.weight,
            "missing": settings.missing_cameras or "fail",
            "unit": settings.unit,
            "registration": settings.registration,
            "aligned": settings.how_aligned,
            "seeds": [settings.seeds[0], settings.seeds[-1]],
        },
        "estimates": [
            {
                "name": estimate.name,
                "file": estimate.file,
                "rows": packed(estimate.rows, "<u4"),
                "codes": packed(estimate.statuses, "u1"),
                "position": packed(estimate.position_errors, "<f8"),
                "rotation": packed(estimate.rotation_errors, "<f8"),
                "positions": packed(estimate.positions - centre, "<f4"),
                "units": None if settings.unit else _quantiles(positions[estimate.rows]),
                "TAS": estimate.tas,
                "PAS": estimate.pas,
                "half": [value if np.isfinite(value) else None for value in estimate.half],
                "notes": estimate.notes,
            }
            for estimate in estimates
        ],
    }


def _cameras(keys: NDArray[Any]) -> dict[str, Any]:
    """Return the stamps or names of the reference, by their kind."""
    if keys.dtype.kind == "f":
        return {"stamps": packed(keys, "<f8")}
    return {"names": [printable(str(key)) for key in keys.tolist()]}


def _estimate(evaluation: Evaluation) -> Estimate:
    """Return an estimate with all cameras that are scored, or would be if missing ones failed."""
    matches, result = evaluation.matches, evaluation.result
    rows = matches.expected_rows
    scored = np.isin(rows, matches.gt_rows)

    def of_all(values: NDArray[Any], of_lost: float) -> NDArray[Any]:
        found = np.full((len(rows), *values.shape[1:]), of_lost, values.dtype)
        found[scored] = values
        return found

    return Estimate(
        name=evaluation.name,
        file=printable(evaluation.file),
        rows=rows,
        statuses=of_all(evaluation.statuses, LOST),
        position_errors=of_all(result.tas.errors, np.inf),
        rotation_errors=of_all(result.ras.errors, np.inf),
        positions=of_all(evaluation.positions, np.nan),
        tas=(evaluation.tas, evaluation.tas_sd),
        pas=(evaluation.pas, evaluation.pas_sd),
        half=(evaluation.half_distance, evaluation.half_angle),
        notes=evaluation.notes,
    )


def _quantiles(positions: Floats) -> list[float]:
    """Return quantiles of the closest-pair distances; none of fewer than 2 cameras."""
    n = len(positions)
    if n < 2:
        return []
    distances = np.sort(closest_pair_distances(positions))
    ranks = -(-n * np.arange(1, QUANTILES + 1) // QUANTILES)
    return list(np.minimum(distances[ranks - 1], np.finfo(float).max).tolist())


def packed(values: NDArray[Any], kind: str) -> str:
    """Return numbers as base64 of their bytes, of a type such as ``<f4``."""
    with np.errstate(over="ignore"):  # beyond single precision: infinite
        return b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
