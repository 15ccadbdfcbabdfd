"""Put the question of a study to its trials: ``python -m studies NAME TABLE.csv ...``."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from experiments.command import CommandError, run_command
from experiments.tables import Trials, read_table, read_trials, to_csv, write_files

from .claims.claims import load_claims
from .claims.verdicts import check_alike, decide, select_trials
from .frame_rate import rates
from .order import compare_orders, side_by_side
from .order import to_markdown as orders_to_markdown
from .parameters import KINDS, maps, registrations, thresholds
from .parameters.axes import Axis, axes_of, check_parts, is_seeded
from .parameters.effects import effects
from .parameters.times import measure
from .scenarios.findings import findings
from .table1 import compare, to_markdown
from .today import findings as today
from .today import orders

__all__ = ["main"]

Question = Callable[[Sequence[Trials], Namespace], list[bytes]]

HELP = """\
table1         Table 1 of the paper, from the experiments: CSV, Markdown
order          which metric orders neighbouring levels best, from the experiments and those of
               trials/halves: CSV, Markdown
claims         verdicts and the evidence for the decisions, from the replicates: CSV, CSV
threshold      effects of the thresholds, from the parts of the study: CSV for TAS, RAS, PAS and the
               registration, Markdown
threshold_maps    how the best threshold depends on the noise: CSV, Markdown
registration   the two registrations, likewise: CSV, Markdown
threshold_time, registration_time    run times of the values of a study's axes: CSV
frame_rate     how much each metric depends on the frame rate: CSV, Markdown
scenarios      what each metric orders in each scenario: CSV
today          today's protocols beside the new scores: CSV, Markdown
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the files of one study; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies",
        description="Put the question of a study to its trials.",
        epilog=HELP,
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", choices=QUESTIONS, metavar="NAME")
    parser.add_argument("tables", nargs="+", type=Path, metavar="TABLE.csv")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    parser.add_argument("--times", type=Path, metavar="FILE.csv", help="table of run times")
    parser.add_argument("--n_jobs", type=int, default=1, help="processes that decide the claims")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    contents = QUESTIONS[options.name]([read_trials(path) for path in options.tables], options)
    if len(contents) != len(options.output):
        raise CommandError(
            f"{options.name} writes {len(contents)} files, not {len(options.output)}"
        )
    write_files(dict(zip(options.output, contents, strict=True)))
    return list(options.output)


def _table1(experiments: Sequence[Trials], _: Namespace) -> list[bytes]:
    table = compare({trials.sweep.name: trials for trials in experiments})
    return [to_csv(table), to_markdown(table).encode()]


def _order(experiments: Sequence[Trials], _: Namespace) -> list[bytes]:
    table = compare_orders(side_by_side(experiments))
    return [to_csv(table), orders_to_markdown(table).encode()]


def _claims(replicates: Sequence[Trials], options: Namespace) -> list[bytes]:
    claims = load_claims(max(len(replicates), 2))
    check_alike(claims, [one.path for one in replicates], [one.record for one in replicates])
    tables = [select_trials(claims, one) for one in replicates]
    table, decisions = decide(claims, tables, n_jobs=options.n_jobs)
    return [to_csv(table), to_csv(decisions)]


def _threshold(trials: Sequence[Trials], options: Namespace) -> list[bytes]:
    axes, parts = _axes("threshold", trials)
    milliseconds = _read_times(options.times)
    table = effects(axes, {name: part.table for name, part in parts.items()})
    kind_of = table["axis"].str.partition("_")[0]
    text = thresholds.to_markdown(axes, table, milliseconds, parts["outliers"].sweep.trials)
    return [*(to_csv(table[kind_of == kind]) for kind in KINDS), text.encode()]


def _registration(trials: Sequence[Trials], options: Namespace) -> list[bytes]:
    (axis,), parts = _axes("registration", trials)
    table = registrations.compare(axis, parts)
    return [
        to_csv(table),
        registrations.to_markdown(axis, table, _read_times(options.times)).encode(),
    ]


def _time(name: str) -> Question:
    def study(trials: Sequence[Trials], _: Namespace) -> list[bytes]:
        axes, parts = _axes(name, trials)
        seeded = [part.sweep for part in parts.values() if is_seeded(part.record.metrics)]
        return [to_csv(measure(axes, seeded))]

    return study


def _scenarios(trials: Sequence[Trials], _: Namespace) -> list[bytes]:
    return [to_csv(findings(_by_name(trials)))]


def _compared(
    comparison: Callable[[Mapping[str, Trials]], pd.DataFrame], words: Callable[[pd.DataFrame], str]
) -> Question:
    def study(trials: Sequence[Trials], _: Namespace) -> list[bytes]:
        table = comparison(_by_name(trials))
        return [to_csv(table), words(table).encode()]

    return study


QUESTIONS: Mapping[str, Question] = {
    "table1": _table1,
    "order": _order,
    "claims": _claims,
    "threshold": _threshold,
    "threshold_time": _time("threshold"),
    "threshold_maps": _compared(maps.compare, maps.to_markdown),
    "registration": _registration,
    "registration_time": _time("registration"),
    "frame_rate": _compared(rates.compare, rates.to_markdown),
    "scenarios": _scenarios,
    "today": _compared(orders.compare, today.to_markdown),
}
"""What makes the contents of a study's files, of its trials and the options."""


def _axes(name: str, trials: Sequence[Trials]) -> tuple[list[Axis], dict[str, Trials]]:
    """Return the axes of a parameter study, and its parts by their names."""
    parts = _by_name(trials)
    metrics = [part.record.metrics for part in trials]
    axes = axes_of(name, next((one for one in metrics if not is_seeded(one)), []))
    check_parts(name, axes, parts)
    return axes, parts


def _by_name(trials: Sequence[Trials]) -> dict[str, Trials]:
    return {one.path.stem: one for one in trials}


def _read_times(path: Path | None) -> pd.DataFrame:
    if path is None:
        raise CommandError("this study reports run times, too: --times FILE.csv")
    return read_table(path, dtype={"value": str})


if __name__ == "__main__":
    sys.exit(main())
