"""What is printed and saved: a table, JSON, evo results and pictures."""

import argparse
import json
import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..trajectories.extras import require
from ..validation import finite_rows
from .formats import FORMATS
from .names import numbered, printable, unique_names
from .notes import MUCH_LOST
from .ranking import comparable, ranks
from .scoring import Scored, seeds
from .table import table

__all__ = ["print_error", "save", "show_json", "show_progress", "show_table"]

SCATTER = 0.005  # standard deviation of the TAS over the seeds from which there is a hint


def show_json(
    scored: Sequence[Scored],
    failed: Sequence[dict[str, str]],
    notes: Sequence[str],
    arguments: argparse.Namespace,
) -> None:
    """Print settings, results and failures as JSON on stdout, and the notes on stderr, too."""
    print_notes(scored, notes)
    printed = {
        "version": __version__,
        "format": arguments.format,
        "reference": printable(arguments.reference),
        "missing_cameras": arguments.missing,
        "t_max_diff": getattr(arguments, "t_max_diff", None),
        "t_offset": getattr(arguments, "t_offset", None),
        "unit": arguments.unit,
        "max_threshold": arguments.max_threshold,
        "max_threshold_deg": arguments.max_threshold_deg,
        "weight": arguments.weight,
        "registration": arguments.registration,
        "seed": arguments.seed,
        "repeat": len(seeds(arguments)),
        "inverted": arguments.invert,
        "body_rotation": arguments.body_rotation,
        "notes": notes,
        "results": as_json(scored),
        "failed": failed,
    }
    print(json.dumps(printed, indent=2, allow_nan=False), flush=True)


def show_table(
    scored: Sequence[Scored], notes: Sequence[str], arguments: argparse.Namespace
) -> None:
    """Print the table on stdout and the notes on stderr."""
    print_notes(scored, notes)
    results = as_json(scored)
    print(table(results, " [m]" if FORMATS[arguments.format].unit == "m" else ""))
    for line in footnotes(results, arguments):
        print(line)
    sys.stdout.flush()


def footnotes(results: Sequence[Mapping[str, Any]], arguments: argparse.Namespace) -> list[str]:
    """Return what is said below the table."""
    first, *others = seeds(arguments)
    over = f"means and sd over the seeds {first} to {others[-1]}" if others else f"seed {first}"
    lines = [f"registration {arguments.registration}, {over}"]
    if arguments.missing:
        lines[0] += f"; missing cameras: {arguments.missing}"
    if any(values["rank"] and values["rank"][0] < values["rank"][1] for values in results):
        lines.append("ranks in common: tied, PAS less than 2 standard errors apart over the seeds")
    if any(values["no_position"] or values["no_rotation"] for values in results):
        lines.append(
            "a camera without position (no pos.) fails in the TAS, "
            "without rotation (no rot.) in the RAS"
        )
    if any(values["lost"] > MUCH_LOST for values in results):
        lines.append("* without what the estimate lost; --missing fail counts it")
    if max(values["TAS_sd"] or 0.0 for values in results) > SCATTER:
        lines.append("the TAS scatters with the seed; --registration refined makes it steadier")
    return lines


def print_notes(scored: Sequence[Scored], notes: Sequence[str]) -> None:
    """Print the notes on all and on each estimate on stderr, a line each."""
    for note in [*notes, *(note for one in scored for note in one.notes)]:
        print(f"alignscores: note: {note}", file=sys.stderr)


def print_error(message: str) -> None:
    """Print an error on stderr."""
    show_progress("")
    print(f"alignscores: error: {message}", file=sys.stderr)


def show_progress(text: str) -> None:
    """Show on a terminal which estimate is being scored; nothing elsewhere."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


def as_json(scored: Sequence[Scored]) -> list[dict[str, Any]]:
    """Return each estimate's part of the JSON output; no number in it is NaN or infinite."""
    found = ranks(scored) if comparable(scored) else [None] * len(scored)
    return [
        {**_values(one), "rank": rank and list(rank)}
        for one, rank in zip(scored, found, strict=True)
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
        "body_rotation": None if one.body_rotation is None else one.body_rotation.tolist(),
        "notes": one.notes,
    }


def save(scored: Sequence[Scored], arguments: argparse.Namespace) -> None:
    """Write the files that were asked for, and show the figure."""
    if arguments.save_results:
        save_evo_results(
            scored,
            arguments.save_results,
            names=unique_names(arguments.estimates),
            reference=printable(arguments.reference),
            registration=arguments.registration,
            seed=arguments.seed,
        )
    if not arguments.plot and not arguments.save_plot:
        return
    from .plots import score_figure  # needs Matplotlib

    panels = {one.name: (one.matches, one.result) for one in scored}
    title = f"registration {arguments.registration}, seed {arguments.seed}"
    if arguments.save_plot:
        save_figure(score_figure(panels, title=title), arguments.save_plot)
    if arguments.plot:
        pyplot = require("matplotlib.pyplot", "plots")
        score_figure(panels, title=title, figure=pyplot.figure())
        pyplot.show()


def save_evo_results(
    scored: Sequence[Scored],
    path: Path,
    *,
    names: Sequence[str],
    reference: str,
    registration: str,
    seed: int,
) -> list[Path]:
    """Save results that ``evo_res`` reads, one file an estimate.

    A single estimate goes to `path`. Of several, each goes to the path with its name appended;
    `names` are those of all estimates, also of those that could not be scored. evo's statistics are
    of the share of the thresholds that a pose misses, from 0 to 1, whose mean is 1 - PAS.

    Returns
    -------
    list of Path
        The files.
    """
    file_interface = require("evo.tools.file_interface", "files")
    from ..trajectories.evo import PAS  # needs evo

    files: dict[Path, bytes] = {}
    flat_names = dict(zip(names, numbered([n.replace("/", "_") for n in names]), strict=True))
    for one in scored:
        flat_name = flat_names[one.name]
        result = PAS.of(one.result).get_result(reference, flat_name)
        result.add_info(
            {
                "title": f"PAS: share of the thresholds missed ({registration}, seed {seed})",
                "label": "share of the thresholds missed",
                "registration": registration,
                "seed": seed,
            }
        )
        extra = {"ATE": one.ate, "TAS_sd": one.tas_sd}
        result.add_stats({key: value for key, value in extra.items() if value is not None})
        if one.matches.keys.dtype.kind == "f":
            result.add_np_array("timestamps", one.matches.keys)
        buffer = BytesIO()
        file_interface.save_res_file(buffer, result)
        target = path.with_name(f"{path.stem}_{flat_name}{path.suffix}") if names[1:] else path
        files[target] = buffer.getvalue()
    for file, content in files.items():
        write_whole(file, content)
    return list(files)


def save_figure(figure: Any, path: Path) -> None:
    """Save a figure, whole or not at all."""
    buffer = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # a name in a script that the font has not
        figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    write_whole(path, buffer.getvalue())


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it: nobody ever sees half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:  # named after the file, not after the temporary one
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        temporary.unlink(missing_ok=True)
