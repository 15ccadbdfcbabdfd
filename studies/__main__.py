"""Answer a study's question from its trials: ``python -m studies NAME TABLE.csv ...``.

With ``--trials TABLE`` it runs the trials of one of the study's tables instead.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from experiments.command import CommandError, run_command
from experiments.config import split_override
from experiments.sweep import run_sweeps
from experiments.tables import read_table, read_trials, to_csv, write_files, write_trials

from .study import Question, found, plans


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the answers of one study; return the exit code."""
    studies = {study.name: study for study in found()}
    parser = ArgumentParser(
        prog="python -m studies",
        description="Answer a study's question from its trials, or run these.",
        epilog=f"studies: {' | '.join(studies)}",
    )
    parser.add_argument("name", choices=studies, metavar="NAME")
    parser.add_argument("tables", nargs="*", type=Path, metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    parser.add_argument(
        "--own",
        nargs="*",
        default=[],
        type=Path,
        metavar="FILE.csv",
        help="tables of user-supplied files",
    )
    parser.add_argument("--trials", metavar="TABLE", help="run the trials of this table instead")
    parser.add_argument("--part", help="score this part of user-supplied files instead")
    parser.add_argument("--settings", nargs="*", default=[], metavar="key=value", help="of trials")
    parser.add_argument("--n_jobs", type=int, default=1, help="processes")

    def work(options: Namespace) -> list[Path]:
        study = studies[options.name]
        if options.trials:
            sweeps = plans(options.settings)[study.name].tables[options.trials].sweeps
            write_trials(options.output[0], run_sweeps(sweeps, options.n_jobs), sweeps)
            return list(options.output)
        if options.part:
            if study.score is None:
                raise CommandError(f"{study.name} does not score files")
            table = study.score(dict(map(split_override, options.settings)), options.part)
            write_files({options.output[0]: to_csv(table)})
            return list(options.output)
        if not (options.tables or options.own):
            raise CommandError(f"no tables are given; run: snakemake {study.name}")
        trials = [read_trials(path) for path in options.tables]
        own = [read_table(path, dtype={"run": str}) for path in options.own]
        together = pd.concat(own, ignore_index=True) if own else pd.DataFrame()
        try:
            answers = study.ask(Question(trials, options.n_jobs, together))
        except KeyError as error:
            problem = f"these tables, which lack {error}, are not those of {study.name}"
            raise CommandError(f"{problem}; run: snakemake {study.name}") from None
        if len(answers) != len(options.output):
            problem = f"writes {len(answers)} files, not {len(options.output)}"
            raise CommandError(f"{study.name} {problem}")
        contents = [one.encode() if isinstance(one, str) else to_csv(one) for one in answers]
        write_files(dict(zip(options.output, contents, strict=True)))
        return list(options.output)

    return run_command(parser, work, arguments)


if __name__ == "__main__":
    sys.exit(main())
