"""Score the runs on a sequence: ``python -m studies.real BENCHMARK.yaml --part SEQUENCE``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import to_csv, write_files

from .scores import read_benchmark, score_sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the table of a sequence; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.real",
        description="Score the runs of a benchmark on a sequence, as they are and changed.",
    )
    parser.add_argument("file", type=Path, metavar="BENCHMARK.yaml", help="as of compare")
    parser.add_argument("--part", required=True, metavar="SEQUENCE")
    parser.add_argument("--quick", action="store_true", help="as they are alone")
    parser.add_argument("--more", default="", metavar="NAMES", help="further metrics")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.csv")

    def work(options: Namespace) -> list[Path]:
        benchmark = read_benchmark(options.file)
        table = score_sequence(
            benchmark, options.part, changed=not options.quick, more=options.more
        )
        write_files({options.output: to_csv(table)})
        return [options.output]

    return run_command(parser, work, arguments)


if __name__ == "__main__":
    sys.exit(main())
