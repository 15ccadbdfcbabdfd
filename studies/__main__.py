"""Put the question of a study to its trials: ``python -m studies NAME TABLE.csv ...``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from experiments.command import CommandError, run_command
from experiments.config import split_override
from experiments.tables import read_record, read_table, read_trials, to_csv, write_files

from .axes import axes_of, is_seeded
from .study import Question, Study, found
from .times import measure


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the answers of one study; return the exit code."""
    studies = {study.name: study for study in found()}
    parser = ArgumentParser(
        prog="python -m studies",
        description="Put the question of a study to its trials.",
        epilog=f"studies: {' | '.join(studies)}",
    )
    parser.add_argument("name", choices=studies, metavar="NAME")
    parser.add_argument("tables", nargs="*", type=Path, metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    parser.add_argument("--times", type=Path, metavar="FILE.csv", help="table of run times")
    parser.add_argument(
        "--own",
        nargs="*",
        default=[],
        type=Path,
        metavar="FILE.csv",
        help="tables of one's own files",
    )
    parser.add_argument("--measure", action="store_true", help="write this table instead")
    parser.add_argument("--part", help="of one's own files, whose table to write instead")
    parser.add_argument("--settings", nargs="*", default=[], metavar="key=value", help="its own")
    parser.add_argument("--n_jobs", type=int, default=1, help="processes that decide the claims")

    def work(options: Namespace) -> list[Path]:
        study = studies[options.name]
        if options.measure or options.part:
            table = _score(study, options) if options.part else _measure(study, options.tables)
            write_files({options.output[0]: to_csv(table)})
            return list(options.output)
        if study.axes and not options.times:
            raise CommandError("this study reports run times, too: --times FILE.csv")
        if len(study.answers) != len(options.output):
            raise CommandError(
                f"{study.name} writes {len(study.answers)} files, not {len(options.output)}"
            )
        if not (options.tables or options.own):
            raise CommandError(f"no tables are given; run: snakemake {study.name}")
        times = read_table(options.times, dtype={"value": str}) if options.times else pd.DataFrame()
        trials = [read_trials(path) for path in options.tables]
        own = [read_table(path, dtype={"run": str}) for path in options.own]
        together = pd.concat(own, ignore_index=True) if own else pd.DataFrame()
        try:
            answers = study.ask(Question(trials, times, options.n_jobs, together))
        except KeyError as error:
            problem = f"these tables, which lack {error}, are not those of {study.name}"
            raise CommandError(f"{problem}; run: snakemake {study.name}") from None
        contents = [one.encode() if isinstance(one, str) else to_csv(one) for one in answers]
        write_files(dict(zip(options.output, contents, strict=True)))
        return list(options.output)

    return run_command(parser, work, arguments)


def _score(study: Study, options: Namespace) -> pd.DataFrame:
    """Score a part of people's own files."""
    if study.score is None:
        raise CommandError(f"{study.name} scores no files of one's own")
    return study.score(dict(map(split_override, options.settings)), options.part)


def _measure(study: Study, tables: Sequence[Path]) -> pd.DataFrame:
    """Time the values of the axes of a study on the scenes that have several seeds."""
    if study.axes is None:
        raise CommandError(f"{study.name} has no axes whose values could be timed")
    records = {path.stem: read_record(path) for path in tables}
    metrics = {name: record.metrics for name, record in records.items()}
    seeded = [record.sweep for record in records.values() if is_seeded(record.metrics)]
    return measure(axes_of(study.axes, metrics), seeded)


if __name__ == "__main__":
    sys.exit(main())
