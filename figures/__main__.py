"""Draw one figure: ``python -m figures MODULE:FUNCTION TABLE.csv ... --output FILE.pdf``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from importlib import import_module
from inspect import getdoc, signature
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from experiments.command import CommandError, run_command
from experiments.tables import read_table, read_trials, write_files

from . import style


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw one figure; return the exit code."""
    parser = ArgumentParser(
        prog="python -m figures",
        description="Draw a figure from tables of results.",
        epilog="snakemake results/figures/NAME.pdf makes the tables, and the figure",
    )
    example = "figures.noise:outliers, for example"
    parser.add_argument("draw", metavar="MODULE:FUNCTION", help=example)
    parser.add_argument("tables", nargs="*", type=Path, metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    module, _, name = options.draw.partition(":")
    try:
        draw = getattr(import_module(module), name)
        signature(draw).bind(*options.tables)
    except (ImportError, AttributeError, ValueError):
        raise CommandError(f"{options.draw} draws no figure") from None
    except TypeError:
        problem = f"is not drawn from {len(options.tables)} tables"
        raise CommandError(f"{options.draw} {problem}") from None
    title = (getdoc(draw) or name).partition("\n")[0]
    with style.applied():
        return write_figure(draw(*map(_read, options.tables)), options.output, title)


def _read(path: Path) -> Any:
    """Read trials with their record, or a table that has none."""
    if path.parent.name == "tables":
        return read_table(path, dtype={"value": str})
    return read_trials(path)


def write_figure(figure: Figure, paths: Sequence[Path], title: str) -> list[Path]:
    """Write a figure as PDF or PNG, by the ending of each path, without dates; return the paths."""
    metadata = {
        ".pdf": {"Title": title, "CreationDate": None},
        ".png": {"Title": title, "Software": None},
    }
    files: dict[Path, bytes] = {}
    for path in paths:
        if path.suffix not in metadata:
            raise CommandError(f"cannot write {path}: a figure is a .pdf or a .png")
        buffer = BytesIO()
        figure.savefig(buffer, format=path.suffix[1:], metadata=metadata[path.suffix])
        files[path] = buffer.getvalue()
    return write_files(files)


if __name__ == "__main__":
    sys.exit(main())
