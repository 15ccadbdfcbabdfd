"""Write the report: ``python -m report RESULTS --output HTML``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import write_files

from .page import render


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; return the exit code."""
    parser = ArgumentParser(
        prog="python -m report",
        description="Write verdicts, figures and tables on one self-contained page.",
        epilog="snakemake report computes all that the page needs, and writes it",
    )
    parser.add_argument("results", type=Path, metavar="RESULTS", help="the folder of all results")
    text = "what snakemake --config was given: the page shows the command"
    parser.add_argument("--settings", nargs="*", default=[], metavar="key=value", help=text)
    parser.add_argument("--output", type=Path, required=True, metavar="HTML")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    return write_files({options.output: render(options.results, options.settings).encode()})


if __name__ == "__main__":
    sys.exit(main())
