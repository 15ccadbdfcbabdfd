"""Write the report or the article: ``python -m report --verdicts FILE.csv ... --output HTML``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import write_files

from . import article
from .page import render

__all__ = ["main"]

FILES = {  # what the page is made of, by the names that the inputs have in the workflow
    "verdicts": (None, "CSV", "the verdicts on the claims"),
    "readings": (None, "CSV", "the verdicts under other readings"),
    "table1": (None, "CSV", "Table 1"),
    "order": (None, "CSV", "which metric orders neighbouring levels best"),
    "order_parts": ("+", "JSON", "records of the trials that it has beside the experiments'"),
    "figures": ("+", "PNG", "all figures, in their order on the page"),
    "experiments": ("+", "JSON", "records of the experiments' trials"),
    "replicates": ("+", "JSON", "records of the replicate studies"),
    "thresholds": ("+", "CSV", "the tables of the threshold study"),
    "threshold_times": (None, "CSV", "its run times"),
    "threshold_parts": ("+", "JSON", "records of its trials"),
    "registrations": (None, "CSV", "the table of the registration study"),
    "registration_times": (None, "CSV", "its run times"),
    "registration_parts": ("+", "JSON", "records of its trials"),
    "findings": (None, "CSV", "what the scenarios show"),
    "scenarios": ("+", "JSON", "records of the scenarios' trials"),
    "maps": (None, "CSV", "the maps of the threshold study"),
    "maps_parts": ("+", "JSON", "records of its trials"),
    "frame_rates": (None, "CSV", "what the frame rate does"),
    "frame_rates_parts": ("+", "JSON", "records of its trials"),
    "today": (None, "CSV", "what today's protocols order"),
    "today_parts": ("+", "JSON", "records of its trials"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; return the exit code."""
    parser = ArgumentParser(
        prog="python -m report",
        description="Write verdicts, figures and evidence on one self-contained page.",
        epilog="snakemake report makes all that the page needs, and the page",
    )
    for name, (number, kind, content) in FILES.items():
        parser.add_argument(
            f"--{name}", type=Path, nargs=number, metavar=kind, help=content, required=True
        )
    parser.add_argument(
        "--benchmarks",
        type=Path,
        nargs="*",
        default=[],
        metavar="TSV",
        help="what Snakemake measured of jobs; those that are missing are passed over",
    )
    parser.add_argument(
        "--settings",
        nargs="*",
        default=[],
        metavar="key=value",
        help="what snakemake --config was given, to repeat it",
    )
    parser.add_argument(
        "--article", action="store_true", help="write the article of docs/article instead"
    )
    parser.add_argument("--output", type=Path, required=True, metavar="HTML")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    page = article.render(options) if options.article else render(options)
    write_files({options.output: page.encode()})
    return [options.output]


if __name__ == "__main__":
    sys.exit(main())
