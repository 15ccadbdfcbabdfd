"""What is printed: a table or JSON, notes and errors."""

import json
import shutil
import sys
from dataclasses import dataclass, field
from textwrap import fill

from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import why
from ..evaluation.settings import Settings
from ..io import FileError
from ..show import tables
from ..texts import WIDTH, alike, printable
from ..version import __version__

__all__ = ["Results", "one_line", "print_error", "print_note", "print_notes"]
__all__ += ["show_progress", "show_table", "table_width"]


SHOWN_MODELS = 5  # of an estimate, without --verbose


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

    def all_notes(self) -> list[str]:
        """Return the notes on the reference, and why files failed."""
        return [*self.notes, *(f"error: {one['error']}" for one in self.failed)]

    def written(self, form: str) -> str:
        """Return what was scored as json, csv, markdown or latex."""
        match form:
            case "json":
                return self._json()
            case "csv":
                return tables.csv(self.scored)
            case "latex":
                return tables.latex(self.scored)
        return tables.markdown(self.scored, self.all_notes())

    def _json(self) -> str:
        """Return settings, results and failures as JSON."""
        content = {
            "version": __version__,
            "reference": printable(self.reference),
            **self.settings.to_dict(),
            "notes": self.notes,
            "results": [evaluation.to_dict() for evaluation in self.scored],
            "failed": self.failed,
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"


def table_width() -> int:
    """Return the columns of this terminal; a file takes 120."""
    return shutil.get_terminal_size((120, 0)).columns


def show_table(results: Results, *, verbose: bool) -> None:
    """Print the table with its conditions; `verbose` adds where the scores are lost, and terms."""
    scored = results.scored
    print(tables.text(scored, table_width()))
    print("\n".join(tables.conditions(scored)))
    if models := tables.text_of_models(scored, most=None if verbose else SHOWN_MODELS):
        print(f"\n{models}")
    if verbose and not results.settings.metrics:
        print(f"\n{tables.text_of_deficits(scored)}\n")
        for term, meaning in tables.terms(scored):
            print(fill(f"{term:15}{meaning}", WIDTH, subsequent_indent=" " * 15))


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
