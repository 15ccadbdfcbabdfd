"""Score your own runs: ``python -m studies.real BENCHMARK.yaml SEQUENCE``, and compare metrics.

With tables of runs, ``python -m studies.real TABLE.csv ...``, it writes three tables: of the
metrics, of the pairs of systems, and of how metrics agree.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from experiments.command import run_command
from experiments.tables import read_table

from ..__main__ import write_answers
from .answers import agreement, pairs, summarise
from .scores import read_benchmark, score_sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Score the runs on a sequence, or compare metrics; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.real",
        description="Compare metrics by tables of your own runs, or write such a table.",
    )
    parser.add_argument("tables", nargs="*", type=Path, metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    parser.add_argument("--benchmark", type=Path, metavar="YAML", help="score its runs instead")
    parser.add_argument("--sequence", help="of the benchmark")
    parser.add_argument("--more", default="", metavar="NAMES", help="further metrics of files")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    if options.benchmark:
        benchmark = read_benchmark(options.benchmark)
        scores = score_sequence(benchmark, options.sequence, more=options.more)
        return write_answers("real", [scores], options.output)
    tables = [read_table(path, dtype={"run": str}) for path in options.tables]
    runs = pd.concat(tables, ignore_index=True)
    of_pairs = pairs(runs)
    return write_answers("real", [summarise(runs), of_pairs, agreement(of_pairs)], options.output)


if __name__ == "__main__":
    sys.exit(main())
