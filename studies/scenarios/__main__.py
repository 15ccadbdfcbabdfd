"""Judge scenarios: ``python -m studies.scenarios SCENARIO.csv ... --output FILE.csv``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import read_trials, to_csv, write_files

from .findings import findings

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write what the scenarios show; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.scenarios",
        description="Tell what each metric still orders in each scenario.",
    )
    parser.add_argument("scenarios", nargs="+", type=Path, metavar="SCENARIO.csv")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.csv")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    table = findings({path.stem: read_trials(path) for path in options.scenarios})
    write_files({options.output: to_csv(table)})
    return [options.output]


if __name__ == "__main__":
    sys.exit(main())
