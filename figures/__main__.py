"""Draw one figure: ``python -m figures NAME TABLE.csv ... --output PATH``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.command import CommandError, run_command
from experiments.tables import read_table, read_trials

from . import FIGURES, PAPER_FIGURES

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw one figure; return the exit code."""
    parser = ArgumentParser(
        prog="python -m figures",
        description="Draw a figure from tables of results.",
        epilog=f"figures: {' | '.join(FIGURES)}",
    )
    parser.add_argument("name", choices=FIGURES, metavar="NAME")
    parser.add_argument(
        "tables", nargs="*", type=Path, metavar="TABLE.csv", help="the tables that it is drawn from"
    )
    parser.add_argument(
        "--output",
        type=Path,
        required=True,
        metavar="PATH",
        help="without extension: PATH.pdf and PATH.png are written",
    )
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    module = import_module(f"figures.{options.name}")
    from .output import write_figure

    figure = module.draw(*_read(options.name, module, options.tables))
    title = (module.__doc__ or options.name).partition("\n")[0]
    return write_figure(figure, options.output, title)


def _read(name: str, module: Any, paths: Sequence[Path]) -> list[Any]:
    """Read what a figure is drawn from: trials of experiments, or tables joined to one."""
    wanted = FIGURES[name]
    if len(paths) != len(wanted):
        names = " ".join(f"{table}.csv" for table in wanted) or "no table"
        raise CommandError(f"{name} is drawn from {names}; the command names {len(paths)}")
    if name not in PAPER_FIGURES:
        tables = [read_table(path, module.COLUMNS, dtype={"value": str}) for path in paths]
        return [pd.concat(tables, ignore_index=True)] if tables else []
    trials = [read_trials(path) for path in paths]
    for one, experiment in zip(trials, PAPER_FIGURES[name], strict=True):
        if one.sweep.name != experiment:
            problem = f"{one.path} has trials of {one.sweep.name}, not of {experiment}"
            raise CommandError(f"{name}: {problem}")
    return trials


if __name__ == "__main__":
    sys.exit(main())
