"""Decide the claims: ``python -m studies.claims REPLICATE.csv ... --verdicts A --decisions B``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import read_trials, to_csv, write_files

from .claims import load_claims
from .verdicts import check_alike, decide, select_trials

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the verdicts and the evidence for the decisions; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.claims",
        description="Give each claim of the paper a verdict, from the replicate studies.",
    )
    parser.add_argument("replicates", nargs="+", type=Path, metavar="REPLICATE.csv")
    parser.add_argument("--verdicts", type=Path, required=True, metavar="FILE.csv")
    parser.add_argument("--decisions", type=Path, required=True, metavar="FILE.csv")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[object]:
    replicates = [read_trials(path) for path in options.replicates]
    check_alike(options.replicates, [trials.record for trials in replicates])
    claims = load_claims()
    table, decisions = decide(claims, [select_trials(claims, trials) for trials in replicates])
    write_files({options.verdicts: to_csv(table), options.decisions: to_csv(decisions)})
    counts = table["verdict"].value_counts()
    written = ", ".join(f"{count} {name}" for name, count in counts.items())
    return [options.verdicts, options.decisions, written]


if __name__ == "__main__":
    sys.exit(main())
