"""Answer a study's question from its trials: ``python -m studies NAME TABLE.csv ...``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import pandas as pd
from joblib import parallel_config

from experiments.command import CommandError, run_command
from experiments.tables import read_trials, to_csv, write_files

STUDIES = ("claims", "table1", "head_to_head", "thresholds", "beyond")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the answers of one study; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies",
        description="Answer a study's question from its trials.",
        epilog=f"studies: {' | '.join(STUDIES)}",
    )
    parser.add_argument("name", choices=STUDIES, metavar="NAME")
    parser.add_argument("tables", nargs="+", type=Path, metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    parser.add_argument("--n_jobs", type=int, default=1, help="processes")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    # Imported by name, so that an edit of one study runs none of the others again.
    study = import_module(f"studies.{options.name}")
    trials = [read_trials(path) for path in options.tables]
    try:
        with parallel_config(n_jobs=options.n_jobs):
            answers = study.answer(trials)
    except KeyError as error:
        problem = f"these tables, which lack {error}, are not from {options.name}"
        raise CommandError(f"{problem}; see the rules of the Snakefile") from None
    return write_answers(options.name, answers, options.output)


def write_answers(
    name: str, answers: Sequence[pd.DataFrame | str], paths: Sequence[Path]
) -> list[Path]:
    """Write the tables and texts that a study returns."""
    if len(answers) != len(paths):
        raise CommandError(f"{name} writes {len(answers)} files, not {len(paths)}")
    contents = [
        answer.encode() if isinstance(answer, str) else to_csv(answer) for answer in answers
    ]
    return write_files(dict(zip(paths, contents, strict=True)))


if __name__ == "__main__":
    sys.exit(main())
