"""Draw tables of trials: ``python -m figures TABLE.csv``, or the figures of the paper by name."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from importlib import import_module
from inspect import getdoc, signature
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from experiments.command import CommandError, run_command
from experiments.tables import read_record, write_files

from . import style
from .curves import draw_trials
from .paper import FIGURES, histogram

DESCRIPTION = f"""\
Draw tables of trials.

  python -m figures TABLE.csv                                  any table, as TABLE.png next to it
  python -m figures TABLE.csv --output FILE ...                the same, as PDF or PNG
  python -m figures NAME TABLE.csv ... --output FILE ...       a figure of the paper
  python -m figures paper FOLDER [NAME ...] --output FOLDER    all of them, or some, from a folder

The figures of the paper: {", ".join(FIGURES)}.
NAME may also be MODULE:FUNCTION, a function of tables that returns a figure of Matplotlib.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw figures, and return the exit code."""
    parser = ArgumentParser(
        prog="python -m figures",
        usage="python -m figures [NAME] TABLE.csv ... [--output FILE ...]",
        description=DESCRIPTION,
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("tables", nargs="+", metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, default=[], metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    name, *tables = options.tables
    paths = [Path(table) for table in tables]
    if name == "paper":
        return _draw_paper(*tables, output=options.output)
    if name not in FIGURES and ":" not in name:
        return _draw_table(Path(name), paths, options.output)
    if not options.output:
        raise CommandError(f"{name} needs --output FILE")
    draw = FIGURES[name][0] if name in FIGURES else _imported(name)
    return _draw(draw, paths, options.output)


def _draw_table(table: Path, others: Sequence[Path], output: Sequence[Path]) -> list[Path]:
    """Draw any table of trials."""
    if others or not (table.suffix or table.exists()):
        near = get_close_matches(str(table), FIGURES, n=1)
        hint = f"did you mean {near[0]}?" if near else f"the paper's are {', '.join(FIGURES)}"
        raise CommandError(f"unknown figure {table}; {hint}")
    default = table.with_suffix(".png")
    if not output and default.exists():
        raise CommandError(f"{default} exists, and is not replaced; name a file with --output")
    return _draw(draw_trials, [table], output or [default])


def _draw_paper(folder: str = "", *names: str, output: Sequence[Path]) -> list[Path]:
    """Draw figures of the paper, in one process that imports Matplotlib and pandas once."""
    if not folder or len(output) != 1:
        raise CommandError("paper needs one FOLDER with tables of trials, and --output FOLDER")
    if unknown := [name for name in names if name not in FIGURES]:
        raise CommandError(f"unknown figure {unknown[0]}; the paper's are {', '.join(FIGURES)}")
    written = []
    for name in names or FIGURES:
        draw, experiments = FIGURES[name]
        tables = [Path(folder, f"{experiment}.csv") for experiment in experiments]
        written += _draw(draw, tables, [output[0] / f"{name}.{end}" for end in ("pdf", "png")])
    return written


def _imported(name: str) -> Callable[..., Figure]:
    module, _, function = name.partition(":")
    try:
        draw: Callable[..., Figure] = getattr(import_module(module), function)
    except (ImportError, AttributeError, ValueError):
        raise CommandError(f"{name} draws no figure") from None
    return draw


def _draw(draw: Callable[..., Figure], paths: Sequence[Path], output: Sequence[Path]) -> list[Path]:
    """Draw a figure from tables, or Figure 1 from the settings in the record of its table."""
    read: Callable[[Path], Any] = _settings if draw is histogram else read_table
    if len(signature(draw).parameters) != len(paths) and draw is not draw_trials:
        n = len(paths)
        raise CommandError(f"{draw.__name__} is not drawn from {n} table{'s' if n != 1 else ''}")
    _check_records(draw, paths)
    tables = [read(path) for path in paths]
    title = (getdoc(draw) or draw.__name__).partition("\n")[0]
    with style.applied():
        try:
            figure = draw(*tables)
        except ValueError as error:
            raise CommandError(f"{' or '.join(map(str, paths))} {error}") from None
        return write_figure(figure, output, title)


def _check_records(draw: Callable[..., Figure], paths: Sequence[Path]) -> None:
    """Check that a figure of the paper gets its experiments, from tables that were not changed."""
    for name, (function, experiments) in FIGURES.items():
        if function is draw:
            names = [read_record(path).sweeps[0].name for path in paths]
            for path, found, experiment in zip(paths, names, experiments, strict=True):
                if found != experiment:
                    needed = f"{name} is drawn from trials of {', '.join(experiments)}"
                    raise CommandError(f"{needed}; {path} has trials of {found}")


def _settings(path: Path) -> Any:
    return read_record(path).sweeps[0]


def read_table(path: Path) -> pd.DataFrame:
    """Read a table as it is, whoever wrote it, with text where a column is text throughout."""
    try:
        table = pd.read_csv(path, dtype={"settings": str, "value": str})
    except FileNotFoundError:
        raise CommandError(f"{path} does not exist") from None
    except (OSError, ValueError) as error:
        raise CommandError(f"{path} cannot be read ({' '.join(str(error).split())})") from None
    if "settings" in table:
        table["settings"] = table["settings"].fillna("")
    return table.loc[:, ~table.columns.str.startswith("Unnamed:")]  # the index of pandas


def write_figure(figure: Figure, paths: Sequence[Path], title: str) -> list[Path]:
    """Write a figure as PDF or PNG, by the ending of each path, without dates; return the paths."""
    metadata = {
        ".pdf": {"Title": title, "CreationDate": None},
        ".png": {"Title": title, "Software": None},
    }
    for path in paths:
        if path.suffix not in metadata:
            raise CommandError(f"cannot write {path}: a figure is a .pdf or a .png")
    if engine := figure.get_layout_engine():
        engine.execute(figure)
    figure.set_layout_engine("none")  # the layout is done once, and is the same in all files
    files: dict[Path, bytes] = {}
    for path in paths:
        buffer = BytesIO()
        figure.savefig(buffer, format=path.suffix[1:], metadata=metadata[path.suffix])
        files[path] = buffer.getvalue()
    return write_files(files)


if __name__ == "__main__":
    sys.exit(main())
