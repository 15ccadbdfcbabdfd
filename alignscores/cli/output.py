"""Output of both commands: notes, errors, progress, and the file of each option."""

import argparse
import shutil
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from os.path import realpath
from pathlib import Path

from ..evaluation.notes import why
from ..evaluation.reading import files_below
from ..extras import require
from ..io import FileError
from ..texts import printable

__all__ = ["OF_BOTH", "OUTPUTS", "PRINTED", "STDOUT", "files_of", "needed_by"]
__all__ += ["one_line", "print_error", "print_note", "refuse_to_replace"]
__all__ += ["show_progress", "table_width"]


@dataclass(frozen=True)
class Output:
    """The file that an option writes: its suffixes, and the packages of an extra that it needs."""

    help: str
    suffixes: tuple[str, ...] = ()
    packages: tuple[str, ...] = ()
    extra: str = ""
    each: bool = False  # a file an estimate


OUTPUTS = {
    "save_page": Output(
        "save a page with the table and drawings", (".html",), ("plotly", "jinja2"), "page"
    ),
    "save_plot": Output("save the plot", (".png", ".pdf", ".svg"), ("matplotlib",), "plots"),
    "save_errors": Output(
        "save the errors of each expected frame", (".csv",), ("pandas",), "tables"
    ),
    "save_csv": Output("save what --csv prints", (".csv",), ("pandas",), "tables"),
    "markdown": Output(
        "save the tables in Markdown, with all notes; - prints them",
        packages=("pandas", "tabulate"),
        extra="tables",
    ),
    "latex": Output("print a table in LaTeX", packages=("pandas", "jinja2"), extra="tables"),
    "save_aligned": Output("save the aligned estimate, as TUM or KITTI", (".txt",), each=True),
    "save_results": Output("save results for evo_res", (".zip",), ("evo",), "evo", each=True),
    "save_rrd": Output("save a recording for the Rerun viewer", (".rrd",), ("rerun",), "rerun"),
    # The last, since it has what could not be written.
    "save_json": Output("save what --json prints", (".json",)),
}
OF_BOTH = "save_page", "save_plot", "save_json", "save_csv", "markdown"  # options of both commands
PRINTED = {"json": "JSON", "csv": "CSV", "latex": "LaTeX"}  # instead of the table
STDOUT = Path("-")


def files_of(arguments: argparse.Namespace, in_folder: Mapping[str, str]) -> dict[str, Path]:
    """Return the files that will be written, by option; the packages that they take are there.

    `in_folder` are the names of those in the folder of --output; a note says which one is
    not written for want of a package.
    """
    files = {}
    for option, output in OUTPUTS.items():
        path = getattr(arguments, option, None)
        if path not in (None, STDOUT):
            needed_by(option)
            files[option] = path
        elif arguments.output and option in in_folder:
            missing = [package for package in output.packages if find_spec(package) is None]
            if missing:
                install = (
                    f'{missing[0]} is not installed: pip install "alignscores[{output.extra}]"'
                )
                print_note(f"{in_folder[option]} is not written: {install}")
            else:
                files[option] = arguments.output / in_folder[option]
    return files


def needed_by(option: str) -> None:
    """Raise ModuleNotFoundError where a package is missing that an option takes."""
    output = OUTPUTS[option if option in OUTPUTS else f"save_{option}"]
    for package in output.packages:
        require(package, output.extra)


def refuse_to_replace(inputs: Iterable[str], outputs: Iterable[tuple[str, Path]]) -> None:
    """Check that no output, by option, replaces an input or another output."""
    used = {realpath(file): f"the input {file}" for path in inputs for file in files_below(path)}
    for option, path in outputs:
        target = realpath(path)  # unlike `Path.resolve`, also of a link to itself
        if target in used:
            raise ValueError(f"--{option} {path} would replace {used[target]}; name another")
        used[target] = f"what --{option} writes"


def table_width() -> int:
    """Return the columns of this terminal; a file takes 120."""
    return shutil.get_terminal_size((120, 0)).columns


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
