"""What is printed: a table or JSON, notes and errors."""

import json
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import MUCH_LOST, scale_note
from ..evaluation.ranking import are_ranked, ranks
from ..evaluation.settings import Settings
from ..texts import WIDTH, printable
from ..version import __version__
from .metrics import metric_table
from .table import table

__all__ = ["print_error", "print_note", "show_json", "show_progress", "show_table", "table_width"]

HALF = "half: smallest threshold where TAS (refined registration) or RAS reaches one half; -: never"
SCATTER = 0.005  # standard deviation of the TAS over the seeds from which there is a hint


def show_json(
    settings: Settings,
    reference: str,
    scored: Sequence[Evaluation],
    failed: Sequence[dict[str, str]],
    notes: Sequence[str],
) -> None:
    """Print settings, results and failures as JSON on stdout, and the notes on stderr, too."""
    print_notes(scored, notes)
    printed = {
        "version": __version__,
        "reference": printable(reference),
        **settings.to_dict(),
        "ranked_by": "PAS" if are_ranked(scored) else None,
        "notes": notes,
        "results": results(scored),
        "failed": failed,
    }
    print(json.dumps(printed, indent=2, allow_nan=False))


def results(scored: Sequence[Evaluation]) -> list[dict[str, Any]]:
    """Return each estimate's part of the JSON output, with its rank among the others."""
    return [
        {**evaluation.to_dict(), "rank": rank}
        for evaluation, rank in zip(scored, ranks(scored), strict=True)
    ]


def table_width() -> int:
    """Return the columns that a table may have on this terminal."""
    return min(shutil.get_terminal_size((WIDTH, 0)).columns, WIDTH)


def show_table(scored: Sequence[Evaluation], notes: Sequence[str]) -> None:
    """Print the table on stdout and the notes on stderr."""
    print_notes(scored, notes)
    rows, settings = results(scored), scored[0].settings
    columns = table_width()
    dropped: list[str] = []
    if settings.metrics:
        metrics = {row["name"]: row["metrics"] for row in rows}
        lines = metric_table(metrics, settings, columns).splitlines()
    else:
        shown, dropped = table(rows, settings, columns)
        lines = shown.splitlines()
    notes = footnotes(rows, settings, lines[0])
    if dropped and columns < WIDTH:
        notes.append(f"no room for: {', '.join(dropped)}; --json has all")
    for line in [*lines, *notes]:
        print(line)


def footnotes(rows: Sequence[Mapping[str, Any]], settings: Settings, header: str) -> list[str]:
    """Return what is said below the table, of what stands in it."""
    chosen = set(settings.metrics)
    drawn = not chosen or bool(chosen & {"TAS", "PAS"})
    first, *others = settings.seeds
    over = f"means and sd over the seeds {first} to {others[-1]}" if others else f"seed {first}"
    aligned = drawn or settings.alignment != "similarity"
    lines = [f"{settings.how_aligned}, {over}" if aligned else f"seed {first}"]
    if settings.missing_cameras:
        lines[0] += f"; missing cameras: {settings.missing_cameras}"
    tied = any(row["rank"] and row["rank"][0] < row["rank"][1] for row in rows)
    if tied and not chosen:
        why = "PAS less than 2 standard errors apart over the seeds" if others else "of equal PAS"
        lines.append(f"ranks in common: tied, {why}")
    if "half" in header.split() or chosen & {"half_distance", "half_angle"}:
        lines.append(HALF)
    if "nan" in header.split():
        lines.append(
            "nan: cameras without a position fail in the TAS, without a rotation in the RAS"
        )
    if any(row["parts"] for row in rows) and not chosen:
        lines.append("parts: worlds that are each aligned on their own, which makes scores higher")
    if settings.form.timed and "n" in header.split():
        ignored = settings.missing_cameras == "ignore"
        of = "covered frames" if ignored else "expected frames, the same for every estimate"
        lines.append(f"n: {of}; lost: share of time without a pose")
    scales = {row["name"]: row["scale"] for row in rows}
    if not chosen and (note := scale_note(scales, settings)):
        lines.append(note)
    if any(row["lost"] > MUCH_LOST for row in rows) and settings.missing_cameras == "ignore":
        lines.append("* without what the estimate lost; --missing fail counts it")
    if drawn and max(row["TAS_sd"] or 0.0 for row in rows) > SCATTER:
        lines.append("the TAS scatters with the seed; --registration refined makes it steadier")
    return lines


def print_notes(scored: Sequence[Evaluation], notes: Sequence[str]) -> None:
    """Print the notes on all and on each estimate on stderr, a line for those that are alike."""
    alike: dict[str, list[str]] = {note: [note] for note in notes}
    for evaluation in scored:
        for note in evaluation.notes:
            said = re.sub(r"[\d.]+", "", note.replace(evaluation.name, ""))
            alike.setdefault(said, []).append(note)
    for first, *others in alike.values():
        print_note(f"{first} (and alike for {len(others)} more)" if others else first)


def print_note(message: str) -> None:
    """Print a note on stderr."""
    print(f"alignscores: note: {printable(message)}", file=sys.stderr)


def print_error(message: str) -> None:
    """Print an error on stderr."""
    show_progress("")
    print(f"alignscores: error: {printable(message)}", file=sys.stderr)


def show_progress(text: str) -> None:
    """Show on a terminal which estimate is being scored; nothing elsewhere."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr)  # flushed by its \r
