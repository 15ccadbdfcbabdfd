"""Run a replicate study: ``python -m studies.claims NUMBER [output=FILE key=value ...]``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.config import load
from experiments.sweep import run_sweeps
from experiments.tables import refuse_to_replace, write_trials

from .claims import load_claims
from .plan import replicates


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the trials that the claims need; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.claims",
        description="Run the trials of one replicate study, those that the claims need.",
    )
    parser.add_argument("number", type=int, metavar="NUMBER", help="from 0")
    settings = "as of experiments.run"
    parser.add_argument("settings", nargs="*", metavar="key=value", help=settings)
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    claims = load_claims(max(2, options.number + 1))
    (sweeps,) = replicates(claims, options.settings, [options.number])
    _, execution = load(options.settings)
    path = Path(execution.output or f"replicate_{options.number}.csv")
    refuse_to_replace(path)
    write_trials(path, run_sweeps(sweeps, execution.n_jobs), sweeps)
    return [path]


if __name__ == "__main__":
    sys.exit(main())
