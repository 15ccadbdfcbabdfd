"""The page of one's own files: all errors in one HTML file, whose scripts compute the scores."""

import argparse
from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..explorer import source
from ..explorer.document import document
from ..trajectories.association import match
from ..trajectories.files import Trajectory
from ..translation import closest_pair_distances
from .formats import FORMATS
from .names import printable
from .notes import collected_warnings
from .saving import LOST, statuses
from .scoring import Scored, seeds

__all__ = ["page"]

Floats = NDArray[np.float64]

QUANTILES = 20  # of the closest-pair distances, equally spaced, that d can be on the page
SCRIPTS = "scores.js", "charts.js", "controls.js", "own.js"


def page(scored: Sequence[Scored], reference: Trajectory, arguments: argparse.Namespace) -> str:
    """Return the page: reference and estimates, their errors, and the settings of the run.

    The errors are those of the first seed, exactly; positions are rounded to single precision.
    """
    positions = reference.poses[:, :3, 3]
    centre = (positions.min(axis=0) + positions.max(axis=0)) / 2
    form = FORMATS[arguments.format]
    name = printable(arguments.reference)
    data = {
        "version": __version__,
        "format": arguments.format,
        "unit": form.unit,
        "ordered": form.ordered,
        "reference": name,
        "cameras": _cameras(reference.keys),
        "positions": _packed(positions - centre, "<f4"),
        "quantiles": QUANTILES,
        "settings": {
            "threshold": arguments.max_threshold,
            "degrees": arguments.max_threshold_deg,
            "steps": len(scored[0].result.tas.thresholds),
            "weight": arguments.weight,
            "missing": arguments.missing or "fail",
            "unit": arguments.unit,
            "registration": arguments.registration,
            "seeds": [seeds(arguments)[0], seeds(arguments)[-1]],
        },
        "estimates": [_estimate(one, reference, centre, arguments) for one in scored],
    }
    return document(
        f"Scores against {name}",
        source("own.html"),
        styles=map(source, ("style.css", "own.css")),
        scripts=map(source, SCRIPTS),
        data=data,
    )


def _cameras(keys: NDArray[Any]) -> dict[str, Any]:
    """Return the stamps or names of the reference, by their kind."""
    if keys.dtype.kind == "f":
        return {"stamps": _packed(keys, "<f8")}
    return {"names": [printable(str(key)) for key in keys.tolist()]}


def _estimate(
    one: Scored, reference: Trajectory, centre: Floats, arguments: argparse.Namespace
) -> dict[str, Any]:
    """Return an estimate with all cameras that are scored, or would be if missing ones failed."""
    row_of = {key: row for row, key in enumerate(reference.keys.tolist())}
    scored_rows = [row_of[key] for key in one.matches.keys.tolist()]
    lost_rows = sorted(
        {row_of[key] for key in _lost(one, reference, arguments)}.difference(scored_rows)
    )
    rows = np.array([*scored_rows, *lost_rows])
    order = np.argsort(rows)
    status = np.array([*statuses(one), *[LOST] * len(lost_rows)])[order]
    errors, filler = one.result, np.full(len(lost_rows), np.inf)
    alignment = errors.tas.alignment
    aligned = np.full((len(rows), 3), np.nan)
    if alignment is not None:
        est = one.matches.est_poses[:, :3, 3]
        aligned[: len(est)] = alignment.inverse().apply(est) - centre
    words, codes = np.unique(status, return_inverse=True)
    there = status != LOST
    gt = reference.poses[rows[order], :3, 3]
    return {
        "name": one.name,
        "file": printable(one.file),
        "rows": _packed(rows[order], "<u4"),
        "status": words.tolist(),
        "codes": _packed(codes, "u1"),
        "position": _packed(np.r_[errors.tas.errors, filler][order], "<f8"),
        "rotation": _packed(np.r_[errors.ras.errors, filler][order], "<f8"),
        "positions": _packed(aligned[order], "<f4"),
        "units": {"fail": _units(gt), "ignore": _units(gt[there])},
        "TAS": [one.tas, one.tas_sd],
        "RAS": [errors.ras.score, None],
        "PAS": [one.pas, one.pas_sd],
        "half": [
            value if np.isfinite(value) else None for value in (one.half_distance, one.half_angle)
        ],
        "parts": len(one.parts),
        "notes": one.notes,
    }


def _lost(one: Scored, reference: Trajectory, arguments: argparse.Namespace) -> list[Any]:
    """Return the cameras that would fail, where those without an estimate are left out."""
    if arguments.missing != "ignore":
        return []
    settings = {"t_max_diff": arguments.t_max_diff} if FORMATS[arguments.format].timed else {}
    with collected_warnings():  # the run has told them
        due = match(reference, one.estimate, missing="fail", **settings)
    return list(due.keys[due.est_rows < 0].tolist())


def _units(gt_positions: Floats) -> list[float]:
    """Return d at each quantile of the closest-pair distances; none of fewer than 2 cameras."""
    n = len(gt_positions)
    if n < 2:
        return []
    distances = np.sort(closest_pair_distances(gt_positions))
    ranks = -(-n * np.arange(1, QUANTILES + 1) // QUANTILES)
    return list(np.minimum(distances[ranks - 1], np.finfo(float).max).tolist())


def _packed(values: NDArray[Any], kind: str) -> str:
    """Return numbers as base64 of their bytes, the last ones first."""
    with np.errstate(over="ignore"):  # beyond single precision: infinite
        return b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
