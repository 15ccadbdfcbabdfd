"""Write the report: ``python -m report RESULTS --output HTML``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import write_files

from . import page
from .results import Results


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; return the exit code."""
    parser = ArgumentParser(
        prog="python -m report",
        description="Write verdicts, figures and evidence on one self-contained page.",
        epilog="snakemake report makes all that the page needs, and the page",
    )
    parser.add_argument("results", type=Path, metavar="RESULTS", help="the folder of all results")
    given = "what snakemake --config was given, but for how it was run"
    parser.add_argument("--settings", nargs="*", default=[], metavar="key=value", help=given)
    parser.add_argument("--output", type=Path, required=True, metavar="HTML")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    text = page.render(Results(options.results, options.settings))
    return write_files({options.output: text.encode()})


if __name__ == "__main__":
    sys.exit(main())
