"""The command ``alignscores compare``: from its arguments to what is printed and saved."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..comparison.baseline import Changes, changes, read_baseline
from ..comparison.benchmark import Benchmark
from ..comparison.comparison import Comparison, compare_runs, find_benchmark, settings_of_run
from ..comparison.runs import COLUMNS
from ..comparison.tables import as_csv, as_latex, as_markdown, as_text, footnotes
from ..evaluation.settings import Option, Settings, order_problem
from ..metrics import metric
from ..pages.comparison import page
from ..parallel import available_processors
from ..texts import printable
from ..trajectories.formats import FORMATS
from ..writing import write_whole
from .inputs import refuse_to_replace
from .metrics import add_metrics, alias_notes
from .options import add_settings, number_type, output_file, settings_of
from .output import print_error, print_note, show_progress, table_width

__all__ = ["add_parser"]

EPILOG = """\
example:
  alignscores compare tum 'data/{sequence}/gt.txt' 'data/{sequence}/{system}/{run}.txt'

exit codes: 0 all compared, 1 something was left out or failed, 2 wrong usage,
3 certainly worse than the baseline (--fail_on worse)
"""
WORSE = 3  # exit code
SHOWN = 50  # lines of problems
JOBS = Option(
    help="processes in parallel (default: %(default)s)", group="work", number=int, least=1
)


def add_parser(commands: Any) -> None:
    """Add the command to those of the parser."""
    command = commands.add_parser(
        "compare",
        help="systems over sequences and runs, with their uncertainty",
        description="compare: systems over sequences and runs. Lost frames, failed and missing "
        "runs count as failures.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(command=command, run=run, metrics_as_given=())
    command.add_argument(
        "source",
        nargs="?",
        metavar="FORMAT",
        help=f"{', '.join(FORMATS)}; or a YAML file, without patterns",
    )
    command.add_argument(
        "patterns",
        nargs="*",
        metavar="PATTERN",
        help="of the references and of the estimates, with {sequence}, {system} and {run}",
    )
    command.add_argument(
        "--dry-run", "--dry_run", action="store_true", help="show what is found, and score nothing"
    )
    command.add_argument(
        "--baseline",
        metavar="FILE.json",
        help="show what changed against a comparison that was saved with --json, by --by",
    )
    command.add_argument(
        "--fail_on",
        choices=("worse",),
        help="with --baseline: exit with 3 where a system is certainly worse",
    )
    command.add_argument(
        "--expect_all",
        action="store_true",
        help="a system without a run on a sequence failed there (default: it was not tried)",
    )
    add_settings(
        command,
        left_out=["format", "metrics"],
        helps={
            "frames": "file with the time stamps of the frames that were to be estimated, or a "
            "pattern of such files with {sequence}"
        },
    )

    work = command.add_argument_group("work")
    work.add_argument(
        "--jobs",
        type=number_type(JOBS),
        default=available_processors(),
        metavar="X",
        help=JOBS.help,
    )
    work.add_argument(
        "--cache",
        metavar="FOLDER",
        type=Path,
        help="store results there, and take those of the same files and options from there",
    )
    _add_output(command)


def _add_output(command: argparse.ArgumentParser) -> None:
    """Add what is printed and saved."""
    output = command.add_argument_group("output")
    add_metrics(output, "more metrics")
    output.add_argument(
        "--by", default="PAS", metavar="NAME", help="metric of the tables (default: %(default)s)"
    )
    output.add_argument(
        "--html", metavar="FILE.html", type=output_file(".html"), help="save one page with drawings"
    )
    shown = output.add_mutually_exclusive_group()
    for name in ("JSON", "CSV", "Markdown", "LaTeX"):
        shown.add_argument(
            f"--{name.lower()}",
            dest="show",
            action="store_const",
            const=name.lower(),
            help=f"print {name} instead of the table",
        )


def run(arguments: argparse.Namespace) -> int:
    """Find, score and compare all runs; what is wrong with one does not stop the others."""
    settings = _settings(arguments)
    benchmark = _benchmark(arguments)
    if arguments.fail_on and not arguments.baseline:
        arguments.command.error("argument --fail_on: needs --baseline FILE")
    if wrong := order_problem(settings.metrics, FORMATS[benchmark.format]):
        arguments.command.error(f"argument --metrics: {wrong}")
    if arguments.dry_run:
        _print_problems(benchmark.problems)
        _show_found(benchmark)
        return int(bool(benchmark.problems))
    if arguments.html:
        refuse_to_replace(_inputs(benchmark, settings, arguments), [("--html", arguments.html)])
    saved = (
        read_baseline(arguments.baseline, replace(settings, format=benchmark.format))
        if arguments.baseline
        else []
    )
    comparison = compare_runs(
        benchmark,
        settings,
        jobs=arguments.jobs,
        cache=arguments.cache,
        progress=show_progress,
    )
    _print_problems(comparison.problems)
    _print_problems([f"{error}; it counts as a failure" for error in comparison.failed])
    for note in [*alias_notes(arguments.metrics_as_given), *comparison.notes]:
        print_note(note)
    changed = (
        changes(comparison, arguments.baseline, saved, arguments.by) if arguments.baseline else None
    )
    _show(comparison, arguments, changed)
    if changed and changed.worse and arguments.fail_on == "worse":
        return WORSE
    return int(bool(comparison.problems or comparison.failed))


def _settings(arguments: argparse.Namespace) -> Settings:
    """Return the settings but for the format, which is the benchmark's; check --by."""
    arguments.format, by = None, arguments.by
    shown = dict.fromkeys((*COLUMNS, *arguments.metrics))
    with suppress(ValueError):
        arguments.by = metric(by).name
    if arguments.by not in shown:
        arguments.command.error(f"argument --by: must be one of {', '.join(shown)}, not {by!r}")
    return settings_of(arguments)


def _benchmark(arguments: argparse.Namespace) -> Benchmark:
    source, patterns = arguments.source, arguments.patterns
    expect_all = arguments.expect_all
    if source in FORMATS and len(patterns) == 2:
        reference, estimate = patterns
        return find_benchmark(reference, estimate, source, expect_all)
    if source and Path(source).suffix in (".yaml", ".yml") and not patterns:
        return find_benchmark(source, None, None, expect_all)
    usage = f"give one of {', '.join(FORMATS)} and two patterns, or one YAML file"
    arguments.command.error(usage)
    raise AssertionError  # error() exits


def _inputs(
    benchmark: Benchmark, settings: Settings, arguments: argparse.Namespace
) -> Iterator[str]:
    """Yield all files that are read, or would be if they were not left out."""
    if not arguments.patterns:
        yield arguments.source
    yield from benchmark.files
    if arguments.baseline:
        yield arguments.baseline
    for found in benchmark.runs:
        if (frames := settings_of_run(benchmark, found, settings).frames) is not None:
            yield str(frames)


def _print_problems(problems: list[str]) -> None:
    for problem in problems[:SHOWN]:
        print_error(problem)
    if len(problems) > SHOWN:
        print_error(f"and {len(problems) - SHOWN} more of these; --json has all")


def _show_found(benchmark: Benchmark) -> None:
    for sequence, reference in benchmark.references.items():
        print(printable(f"{sequence}: {reference}"))
        for found in benchmark.runs:
            if found.sequence == sequence:
                print(printable(f"  {found.system}, run {found.run}: {found.file or 'missing'}"))
    systems = {found.system for found in benchmark.runs}
    missing = sum(found.file is None for found in benchmark.runs)
    print(
        f"{len(benchmark.references)} sequences, {len(systems)} systems, "
        f"{len(benchmark.runs)} runs, {missing} of them missing"
    )


def _show(comparison: Comparison, arguments: argparse.Namespace, changed: Changes | None) -> None:
    """Print the comparison as it was asked for, and save its page."""
    by = arguments.by
    if arguments.html:
        write_whole(arguments.html, page(comparison, by, changed).encode())
    found = comparison.to_dict() | ({"baseline": changed.to_dict()} if changed else {})
    tables: dict[str, Callable[[], str]] = {
        "json": lambda: json.dumps(found, indent=2, allow_nan=False),
        "csv": lambda: as_csv(comparison.summary).removesuffix("\n"),
        "markdown": lambda: as_markdown(comparison.summary, by, comparison.names),
        "latex": lambda: as_latex(comparison.summary, by, comparison.names),
    }
    if arguments.show:
        print(tables[arguments.show]())
    else:
        print(as_text(comparison.summary, by, comparison.names, table_width()))
        notes = footnotes(comparison.summary, by, comparison.names, comparison.settings)
        print("\n" + "\n".join(notes))
    if changed:
        print(
            f"\n{changed.as_text()}" if not arguments.show else changed.as_text(),
            file=sys.stderr if arguments.show else sys.stdout,
        )
