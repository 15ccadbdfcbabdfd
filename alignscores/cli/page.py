"""The page of one's own files: all errors in one HTML file, whose scripts compute the scores."""

import argparse
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..arrays import Floats, Indices
from ..explorer import source
from ..explorer.document import document
from ..trajectories.association import match
from ..trajectories.files import Trajectory
from ..trajectories.formats import FORMATS
from ..translation import closest_pair_distances
from .names import printable
from .notes import collected_warnings
from .saving import LOST, STATUSES, statuses
from .scoring import Scored, aligned_positions, seeds

__all__ = ["Estimate", "around", "packed", "page", "page_data"]


QUANTILES = 20  # of the closest-pair distances, equally spaced, that d can be on the page
STEPS = 100  # thresholds of a score
SCRIPTS = "scores.js", "charts.js", "controls.js", "own.js"


@dataclass(frozen=True, eq=False)
class Estimate:
    """What the page shows of an estimate; `rows` and arrays are of its cameras.

    Parameters
    ----------
    name, file : str
        As they are shown.
    rows : (n,) ndarray of int
        Row of each camera in the reference, ascending.
    statuses : (n,) ndarray of uint8
        As of `alignscores.cli.saving.statuses`.
    position_errors, rotation_errors : (n,) ndarray
        Infinite for failures.
    positions : (n, 3) ndarray
        Aligned; not finite where there are none.
    tas, pas : (float, float or None)
        Means over the seeds of the run, and standard deviations.
    half : (float, float)
        Half-score distance and angle.
    notes : list of str
        What the user should know about it.
    """

    name: str
    file: str
    rows: Indices
    statuses: NDArray[np.uint8]
    position_errors: Floats
    rotation_errors: Floats
    positions: Floats
    tas: tuple[float, float | None]
    pas: tuple[float, float | None]
    half: tuple[float, float]
    notes: list[str]


def page(scored: Sequence[Scored], reference: Trajectory, arguments: argparse.Namespace) -> str:
    """Return the page: reference and estimates, their errors, and the settings of the run.

    The errors are those of the first seed, exactly; positions are rounded to single precision.
    """
    file = printable(arguments.reference)
    estimates = [_estimate(one, reference, arguments) for one in scored]
    return _document(page_data(f"Scores against {file}", reference, file, estimates, arguments))


def around() -> list[str]:
    """Return what stands before and after the data in a page: the text of `page_data` as JSON."""
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
    options: argparse.Namespace,
) -> dict[str, Any]:
    """Return what the scripts read.

    Parameters
    ----------
    title : str
        Title of the page.
    reference : Trajectory
        As of `alignscores.trajectories.association.in_order`.
    file : str
        Its file, as it is shown.
    estimates : sequence of Estimate
        In the order in which they are shown.
    options : Namespace
        Those of the run; where its unit is None the page derives d.
    """
    positions = reference.poses[:, :3, 3]
    centre = (positions.min(axis=0) + positions.max(axis=0)) / 2
    form = FORMATS[options.format]
    return {
        "title": title,
        "version": __version__,
        "format": options.format,
        "unit": form.unit,
        "ordered": form.ordered,
        "reference": file,
        "cameras": _cameras(reference.keys),
        "positions": packed(positions - centre, "<f4"),
        "quantiles": QUANTILES,
        "statuses": STATUSES,
        "settings": {
            "threshold": options.max_threshold,
            "degrees": options.max_threshold_deg,
            "steps": STEPS,
            "weight": options.weight,
            "missing": options.missing or "fail",
            "unit": options.unit,
            "registration": options.registration,
            "seeds": [seeds(options)[0], seeds(options)[-1]],
        },
        "estimates": [
            {
                "name": one.name,
                "file": one.file,
                "rows": packed(one.rows, "<u4"),
                "codes": packed(one.statuses, "u1"),
                "position": packed(one.position_errors, "<f8"),
                "rotation": packed(one.rotation_errors, "<f8"),
                "positions": packed(one.positions - centre, "<f4"),
                "units": None if options.unit else _units(positions, one),
                "TAS": one.tas,
                "PAS": one.pas,
                "half": [value if np.isfinite(value) else None for value in one.half],
                "notes": one.notes,
            }
            for one in estimates
        ],
    }


def _cameras(keys: NDArray[Any]) -> dict[str, Any]:
    """Return the stamps or names of the reference, by their kind."""
    if keys.dtype.kind == "f":
        return {"stamps": packed(keys, "<f8")}
    return {"names": [printable(str(key)) for key in keys.tolist()]}


def _estimate(one: Scored, reference: Trajectory, arguments: argparse.Namespace) -> Estimate:
    """Return an estimate with all cameras that are scored, or would be if missing ones failed."""
    rows = np.union1d(one.matches.gt_rows, _lost(one, reference, arguments))
    scored = np.isin(rows, one.matches.gt_rows)

    def of_all(values: NDArray[Any], of_lost: float) -> NDArray[Any]:
        found = np.full((len(rows), *values.shape[1:]), of_lost, values.dtype)
        found[scored] = values
        return found

    return Estimate(
        name=one.name,
        file=printable(one.file),
        rows=rows,
        statuses=of_all(statuses(one.matches), LOST),
        position_errors=of_all(one.result.tas.errors, np.inf),
        rotation_errors=of_all(one.result.ras.errors, np.inf),
        positions=of_all(aligned_positions(one.matches, one.result), np.nan),
        tas=(one.tas, one.tas_sd),
        pas=(one.pas, one.pas_sd),
        half=(one.half_distance, one.half_angle),
        notes=one.notes,
    )


def _lost(one: Scored, reference: Trajectory, arguments: argparse.Namespace) -> Indices:
    """Return the cameras that would fail, where those without an estimate are left out."""
    if arguments.missing != "ignore":
        return np.empty(0, np.intp)
    settings = {"t_max_diff": arguments.t_max_diff} if FORMATS[arguments.format].timed else {}
    with collected_warnings():  # the run has told them
        due = match(reference, one.estimate, missing="fail", **settings)
    return due.gt_rows[due.est_rows < 0]


def _units(positions: Floats, one: Estimate) -> dict[str, list[float]]:
    """Return d at each quantile, where cameras without an estimate fail, and where they do not."""
    there = one.rows[one.statuses != LOST]
    return {"fail": _quantiles(positions[one.rows]), "ignore": _quantiles(positions[there])}


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
