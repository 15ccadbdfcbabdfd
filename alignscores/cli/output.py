"""What is printed: a table or JSON, notes and errors."""

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import __version__
from ..similarity import Similarity
from ..trajectories.formats import FORMATS
from ..validation import finite_rows
from .metrics import metric_table, metric_values
from .names import printable
from .notes import MUCH_LOST
from .ranking import TIED_HALF, RankedBy, ranked_by, ranks
from .scoring import Scored, seeds
from .table import table

__all__ = ["print_error", "print_note", "show_json", "show_progress", "show_table"]

TIES: dict[RankedBy | None, str] = {
    "PAS": "PAS less than 2 standard errors apart over the seeds",
    "half_distance": f"half-score distances less than {TIED_HALF:.0%} apart",
}
HALF = "half: largest threshold at which TAS (refined registration) or RAS is one half; -: never"
SCATTER = 0.005  # standard deviation of the TAS over the seeds from which there is a hint


def show_json(
    scored: Sequence[Scored],
    failed: Sequence[dict[str, str]],
    notes: Sequence[str],
    arguments: argparse.Namespace,
) -> None:
    """Print settings, results and failures as JSON on stdout, and the notes on stderr, too."""
    print_notes(scored, notes)
    frames = getattr(arguments, "frames", None)
    printed = {
        "version": __version__,
        "format": arguments.format,
        "est_format": arguments.est_format or arguments.format,
        "reference": printable(arguments.reference),
        "missing_cameras": arguments.missing,
        "t_max_diff": getattr(arguments, "t_max_diff", None),
        "t_offset": getattr(arguments, "t_offset", None),
        "frames": frames and printable(frames),
        "unit": arguments.unit,
        "max_threshold": arguments.max_threshold,
        "max_threshold_deg": arguments.max_threshold_deg,
        "weight": arguments.weight,
        "registration": arguments.registration,
        "seed": arguments.seed,
        "repeat": len(seeds(arguments)),
        "inverted": arguments.invert,
        "body_rotation": arguments.body_rotation,
        "ranked_by": ranked_by(scored),
        "notes": notes,
        "results": as_json(scored, arguments.metrics),
        "failed": failed,
    }
    print(json.dumps(printed, indent=2, allow_nan=False), flush=True)


def show_table(
    scored: Sequence[Scored], notes: Sequence[str], arguments: argparse.Namespace
) -> None:
    """Print the table on stdout and the notes on stderr."""
    print_notes(scored, notes)
    results = as_json(scored, arguments.metrics)
    form = FORMATS[arguments.format]
    if arguments.metrics:
        rows = {one["name"]: one["metrics"] for one in results}
        lines = metric_table(rows, arguments.metrics, form).splitlines()
    else:
        lines = table(results, " m" if form.unit == "m" else "").splitlines()
    by = ranked_by(scored)
    for line in [*lines, *footnotes(results, arguments, lines[0], by)]:
        print(line)
    sys.stdout.flush()


def footnotes(
    results: Sequence[Mapping[str, Any]],
    arguments: argparse.Namespace,
    header: str,
    ranked: RankedBy | None,
) -> list[str]:
    """Return what is said below the table, of what stands in it."""
    chosen = set(arguments.metrics)
    drawn = not chosen or bool(chosen & {"tas", "pas"})
    first, *others = seeds(arguments)
    over = f"means and sd over the seeds {first} to {others[-1]}" if others else f"seed {first}"
    lines = [f"registration {arguments.registration}, {over}" if drawn else f"seed {first}"]
    if arguments.missing:
        lines[0] += f"; missing cameras: {arguments.missing}"
    tied = any(values["rank"] and values["rank"][0] < values["rank"][1] for values in results)
    if tied and not chosen:
        lines.append(f"ranks in common: tied, {TIES[ranked]}")
    if not chosen or chosen & {"half", "half:rotation"}:
        lines.append(HALF)
    if "nan" in header.split():
        lines.append(
            "nan: cameras without a position fail in the TAS, without a rotation in the RAS"
        )
    if any(values["parts"] for values in results) and not chosen:
        lines.append("parts: worlds that are each aligned on their own, which makes scores higher")
    if any(values["lost"] > MUCH_LOST for values in results) and not chosen:
        lines.append("* without what the estimate lost; --missing fail counts it")
    if drawn and max(values["TAS_sd"] or 0.0 for values in results) > SCATTER:
        lines.append("the TAS scatters with the seed; --registration refined makes it steadier")
    return lines


def print_notes(scored: Sequence[Scored], notes: Sequence[str]) -> None:
    """Print the notes on all and on each estimate on stderr, a line each."""
    for note in [*notes, *(note for one in scored for note in one.notes)]:
        print_note(note)


def print_note(message: str) -> None:
    """Print a note on stderr."""
    print(f"alignscores: note: {message}", file=sys.stderr)


def print_error(message: str) -> None:
    """Print an error on stderr."""
    show_progress("")
    print(f"alignscores: error: {message}", file=sys.stderr)


def show_progress(text: str) -> None:
    """Show on a terminal which estimate is being scored; nothing elsewhere."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


def as_json(scored: Sequence[Scored], metrics: Sequence[str]) -> list[dict[str, Any]]:
    """Return each estimate's part of the JSON output; no number in it is NaN or infinite."""
    return [
        {**_values(one), "metrics": metric_values(one, metrics), "rank": rank and list(rank)}
        for one, rank in zip(scored, ranks(scored), strict=True)
    ]


def _values(one: Scored) -> dict[str, Any]:
    tas, ras, matches = one.result.tas, one.result.ras, one.matches
    return {
        "name": one.name,
        "file": printable(one.file),
        "TAS": one.tas,
        "TAS_sd": one.tas_sd,
        "RAS": ras.score,
        "PAS": one.pas,
        "PAS_sd": one.pas_sd,
        "TAS_seeds": one.tas_seeds,
        "PAS_seeds": one.pas_seeds,
        "half_distance": _finite(one.half_distance),
        "half_angle": _finite(one.half_angle),
        "ATE": one.ate,
        "n": len(tas.errors),
        "lost": one.lost,
        "matched": matches.matched,
        "missing": matches.missing,
        "non_finite": matches.non_finite,
        "no_position": int(np.sum(~finite_rows(matches.est_poses[:, :3, 3]))),
        "no_rotation": int(np.sum(~finite_rows(matches.est_poses[:, :3, :3]))),
        "duplicate": matches.duplicate,
        "unmatched": matches.unmatched,
        "unit": tas.unit,
        "within_unit": float(np.mean(tas.errors < tas.unit)),
        "within_10_deg": float(np.mean(ras.errors < 10.0)),
        "n_hypotheses": tas.n_hypotheses,
        "alignment": None if one.parts else _alignment(tas.alignment),
        "parts": [
            {"name": part.name, "n": part.n, "alignment": _alignment(part.alignment)}
            for part in one.parts
        ],
        "body_rotation": None if one.body_rotation is None else one.body_rotation.tolist(),
        "notes": one.notes,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _alignment(alignment: Similarity | None) -> dict[str, Any] | None:
    """Return what takes the estimate to the reference: x -> scale * rotation @ x + translation."""
    if alignment is None:
        return None
    found = alignment.inverse()
    if not np.isfinite([found.scale, *found.translation]).all():
        return None
    return {
        "scale": found.scale,
        "rotation": found.rotation.tolist(),
        "translation": found.translation.tolist(),
    }
