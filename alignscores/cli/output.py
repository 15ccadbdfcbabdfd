"""What is printed: a table or JSON, notes and errors."""

import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field

from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import scale_note, why
from ..evaluation.settings import Settings
from ..io import FileError
from ..metrics import SCORES, metric
from ..texts import alike, printable
from ..version import __version__
from .table import LEGEND, metric_table, table

__all__ = ["Results", "one_line", "print_error", "print_note", "print_notes"]
__all__ += ["show_progress", "show_table", "table_width"]


@dataclass
class Results:
    """What became of all files: evaluations, failures, and notes on the reference."""

    settings: Settings
    reference: str
    scored: list[Evaluation] = field(default_factory=list)
    failed: list[dict[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def fail(self, file: str, error: Exception) -> None:
        """Add and print that a file cannot be read, scored or written."""
        message = one_line(error, file)
        self.failed.append({"file": printable(file), "error": message})
        print_error(message)

    def json(self) -> str:
        """Return settings, results and failures as JSON."""
        content = {
            "version": __version__,
            "reference": printable(self.reference),
            **self.settings.to_dict(),
            "notes": self.notes,
            "results": [evaluation.to_dict() for evaluation in self.scored],
            "failed": self.failed,
        }
        return json.dumps(content, indent=2, allow_nan=False)


def table_width() -> int:
    """Return the columns of this terminal; a file takes 120."""
    return shutil.get_terminal_size((120, 0)).columns


def show_table(results: Results, *, verbose: bool) -> None:
    """Print the table with its conditions."""
    scored, settings, columns = results.scored, results.settings, table_width()
    if settings.metrics:
        print(metric_table(scored, columns))
    else:
        text, left_out = table(scored, columns)
        print(text)
        if left_out:
            print(f"too narrow for: {', '.join(left_out)}")
    print(conditions(scored))
    scales = {evaluation.name: evaluation.scale for evaluation in scored}
    if not settings.metrics and (scale := scale_note(scales, settings)):
        print(scale)
    if verbose and not settings.metrics:
        print(f"\n{LEGEND.format(**vars(settings))}")


def conditions(scored: Sequence[Evaluation]) -> str:
    """Return the alignment, the frames, and d in one line; other metrics have the frames alone."""
    settings, first = scored[0].settings, scored[0]
    frames = f"{len(first.matches.expected_rows)} {'frames' if settings.form.ordered else 'images'}"
    if settings.frames is not None:
        frames += " that were given"
    elif first.matches.timed:
        frames += " of the reference" if settings.rate == "all" else f" at {settings.rate:g} Hz"
    if first.matches.timed:
        gaps = f"gaps up to {settings.max_gap:g} s and standstill covered"
        frames += f", {gaps if settings.max_gap else 'each needs a pose'}"
    if settings.missing == "ignore":
        frames += ", lost ones left out"
    ours = [metric(name).name in SCORES for name in settings.metrics]
    if ours and not any(ours):
        return frames
    times_d = "d" if settings.max_threshold == 1 else f"{settings.max_threshold:g} d"
    largest = settings.max_threshold * first.result.tas.unit
    unit = f"TAS up to {times_d} = {largest:.3g} {settings.form.unit}"
    half = [] if settings.metrics else ["half: threshold at score 0.5"]
    return "; ".join([settings.how_aligned, frames, unit, *half])


def print_notes(results: Results, *, verbose: bool) -> None:
    """Print the notes; without `verbose` a line for those on estimates that are alike."""
    notes = [
        ("" if note.kind == "file" else evaluation.name, str(note))  # which names the file itself
        for evaluation in results.scored
        for note in evaluation.notes
    ]
    shown = [f"{name}: {note}" if name else note for name, note in notes]
    for line in [*results.notes, *(shown if verbose else alike(notes))]:
        print_note(line)


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


def one_line(error: Exception, file: str = "") -> str:
    """Return the message of an error in one line, with the file unless it names the file itself."""
    message = why(error)
    return printable(f"{file}: {message}" if file and not isinstance(error, FileError) else message)
