"""The command ``alignscores compare``: from its arguments to what is printed and saved."""

import argparse
import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

from ..comparison.baseline import Changes, changes, read_baseline
from ..comparison.benchmark import Benchmark
from ..comparison.comparison import (
    Comparison,
    compare_runs,
    find_benchmark,
    finite,
    settings_of_run,
)
from ..comparison.gate import Condition, conditions_of, reasons_to_fail
from ..comparison.runs import COLUMNS
from ..comparison.summary import Result
from ..comparison.tables import (
    as_csv,
    as_latex,
    as_markdown,
    as_text,
    conditions,
    legend,
    markdown,
    tables,
)
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
3 a condition of --fail_on holds
"""
FAILS = 3  # exit code
SHOWN = 50  # lines of problems
JOBS = Option(
    help="processes in parallel (default: %(default)s)", group="work", number=int, least=1
)


def add_parser(commands: Any) -> None:
    """Add the command to those of the parser."""
    command = commands.add_parser(
        "compare",
        help="systems over sequences and runs, and which of them are ahead",
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

    _add_verdicts(command)
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


def _add_verdicts(command: argparse.ArgumentParser) -> None:
    """Add how systems are compared with each other, and with what was saved."""
    verdicts = command.add_argument_group("verdicts")
    verdicts.add_argument(
        "--by",
        default="PAS",
        metavar="NAME",
        help="metric of verdicts and tables (default: %(default)s)",
    )
    verdicts.add_argument(
        "--baseline",
        metavar="FILE.json",
        help="show what changed against a comparison that was saved with --json, by --by",
    )
    verdicts.add_argument(
        "--fail_on",
        metavar="CONDITIONS",
        help="exit with 3 if one holds for a system: 'PAS<0.8,half>0.1,lost>5%%,failed>0'; "
        "with --baseline also 'PAS drops 0.05', or 'worse', significantly by --by",
    )
    verdicts.add_argument(
        "--paired",
        action="store_true",
        help="compare runs of the same name, such as those of one seed",
    )


def _add_output(command: argparse.ArgumentParser) -> None:
    """Add what is printed and saved."""
    output = command.add_argument_group("output")
    add_metrics(output, "more metrics")
    output.add_argument(
        "--html", metavar="FILE.html", type=output_file(".html"), help="save one page with drawings"
    )
    output.add_argument(
        "--markdown",
        metavar="FILE",
        help="write a report in Markdown, such as $GITHUB_STEP_SUMMARY; - prints it",
    )
    output.add_argument("--verbose", action="store_true", help="say more about the numbers")
    shown = output.add_mutually_exclusive_group()
    for name in ("JSON", "CSV", "LaTeX"):
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
    gate = _gate(arguments)
    if wrong := order_problem(settings.metrics, FORMATS[benchmark.format]):
        arguments.command.error(f"argument --metrics: {wrong}")
    if arguments.dry_run:
        _print_problems(benchmark.problems)
        _show_found(benchmark)
        return int(bool(benchmark.problems))
    outputs = [("--html", arguments.html)] if arguments.html else []
    if arguments.markdown and arguments.markdown != "-":
        outputs.append(("--markdown", Path(arguments.markdown)))
    if outputs:
        refuse_to_replace(_inputs(benchmark, settings, arguments), outputs)
    saved = (
        read_baseline(arguments.baseline, replace(settings, format=benchmark.format))
        if arguments.baseline
        else []
    )
    comparison = compare_runs(
        benchmark,
        settings,
        paired=arguments.paired,
        jobs=arguments.jobs,
        cache=arguments.cache,
        progress=show_progress,
    )
    _print_problems(comparison.problems)
    _print_problems([f"{error}; it counts as a failure" for error in comparison.failed])
    for note in [*alias_notes(arguments.metrics_as_given), *comparison.notes]:
        print_note(note)
    changed = _changed(comparison, arguments, saved, gate) if arguments.baseline else None
    reasons = reasons_to_fail(gate, comparison.summary, changed) if gate else []
    _show(comparison, arguments, changed, reasons)
    for reason in reasons:
        print_error(reason)
    return FAILS if reasons else int(bool(comparison.problems or comparison.failed))


def _changed(
    comparison: Comparison,
    arguments: argparse.Namespace,
    saved: Sequence[Result],
    gate: Sequence[Condition],
) -> Changes:
    """Compare with the saved runs; tell if there are too few for the gate."""
    by, paired = arguments.by, arguments.paired
    changed = changes(comparison.summary, arguments.baseline, saved, by, paired)
    if any(one.relation == "worse" for one in gate) and not changed.may_be_worse:
        print_note("too few runs for a significant change: --fail_on worse cannot fail")
    return changed


def _gate(arguments: argparse.Namespace) -> list[Condition]:
    """Return the conditions of --fail_on."""
    if arguments.fail_on is None:
        return []
    try:
        gate = conditions_of(arguments.fail_on, arguments.by, _metrics(arguments))
    except ValueError as error:
        arguments.command.error(f"argument --fail_on: {error}")
    if any(one.needs_baseline for one in gate) and not arguments.baseline:
        arguments.command.error(f"argument --fail_on: {arguments.fail_on}: needs --baseline FILE")
    return gate


def _metrics(arguments: argparse.Namespace) -> list[str]:
    """Return all that is measured."""
    return list(dict.fromkeys((*COLUMNS, *arguments.metrics)))


def _settings(arguments: argparse.Namespace) -> Settings:
    """Return the settings but for the format, which is the benchmark's; check --by."""
    arguments.format, by = None, arguments.by
    shown = _metrics(arguments)
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


def _show(
    comparison: Comparison,
    arguments: argparse.Namespace,
    changed: Changes | None,
    reasons: Sequence[str],
) -> None:
    """Print the comparison as it was asked for, and save its page and its report."""
    by, summary = arguments.by, comparison.summary
    report = _report(comparison, by, changed, reasons)
    if arguments.html:
        write_whole(arguments.html, page(comparison, by, changed).encode())
    if arguments.markdown == "-":
        print(report)
    elif arguments.markdown:
        write_whole(Path(arguments.markdown), f"{report}\n".encode())
    if arguments.show == "json":
        baseline = {"baseline": finite(changed.to_dict())} if changed else {}
        print(json.dumps(comparison.to_dict() | baseline, indent=2, allow_nan=False))
    elif arguments.show == "csv":
        print(as_csv(summary).removesuffix("\n"))
    elif arguments.show == "latex":
        caption = " ".join([*comparison.verdict(by), *legend(summary, comparison.settings)])
        first, *others = tables(summary, by, comparison.names)
        print("\n\n".join([as_latex(first, caption), *(as_latex(one, by) for one in others)]))
    elif arguments.markdown != "-":
        print(_text(comparison, arguments, changed))


def _text(comparison: Comparison, arguments: argparse.Namespace, changed: Changes | None) -> str:
    """Return verdict, tables and what changed for a terminal."""
    summary, names, by = comparison.summary, comparison.names, arguments.by
    width = table_width()
    verdict = [fill(line, width) for line in comparison.verdict(by)]
    shown = [as_text(table, width) for table in tables(summary, by, names)]
    below = legend(summary, comparison.settings)
    if arguments.verbose:
        below += conditions(summary, names, comparison.settings)
    parts = ["\n".join(verdict), *shown, "\n".join(below)]
    if changed:
        header = f"{by} against {printable(changed.file)}"
        table = as_text(changed.table(names.systems), width)
        parts.append("\n".join([header, table, *changed.notes]))
    return "\n\n".join(filter(None, parts))


def _report(
    comparison: Comparison, by: str, changed: Changes | None, reasons: Sequence[str]
) -> str:
    """Return verdict, tables and what changed in Markdown."""
    summary, names = comparison.summary, comparison.names
    parts = [f"**Fails:** {markdown(reason)}" for reason in reasons]
    parts += map(markdown, comparison.verdict(by))
    if changed:
        parts.append(f"{by} against {markdown(printable(changed.file))}:")
        parts.append(as_markdown(changed.table(names.systems)))
        parts += map(markdown, changed.notes)
    parts += [as_markdown(table) for table in tables(summary, by, names)]
    return "\n\n".join([*parts, *map(markdown, legend(summary, comparison.settings))])
