"""The command ``alignscores compare``: from its arguments to what is printed and saved."""

import argparse
import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from textwrap import fill

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
from ..evaluation.settings import Settings, order_problem
from ..metrics import metric
from ..pages.comparison import page
from ..parallel import available_processors
from ..texts import printable
from ..trajectories.formats import FORMATS
from ..writing import write_whole
from .output import print_error, print_note, show_progress, table_width
from .parser import Parser, output_file
from .saving import refuse_to_replace

__all__ = ["compare_parser", "run"]

USAGE = """\
alignscores compare [FORMAT] REF_PATTERN EST_PATTERN [options]
       alignscores compare FILE.yaml [options]"""
EPILOG = """\
example:
  alignscores compare 'data/{sequence}/gt.txt' 'data/{sequence}/{system}/{run}.txt'

exit codes: 0 all compared, 1 something was left out or failed, 2 wrong usage,
3 a condition of --fail_on holds
"""
EVERYDAY = {
    *("t_max_diff", "t_offset", "alignment", "dry_run", "jobs", "by", "baseline", "fail_on"),
    *("verbose", "metrics", "html", "markdown", "show"),
}
FILES = (
    "patterns of the references and of the estimates, with {sequence}, {system} and {run}; or one "
    "YAML file"
)
FAIL_ON = (
    "exit with 3 if one holds for a system: 'PAS<0.8,half>0.1,lost>5%%,failed>0'; with --baseline "
    "also 'PAS drops 0.05', or 'worse' (significantly, by the --by metric)"
)
MORE_METRICS = "more metrics, such as auc@30:vggt,rpe@1m; `alignscores metrics` lists them"
FAILS = 3  # exit code
SHOWN = 50  # lines of problems
NOTES = 4  # lines of notes without --verbose


def compare_parser(*, everything: bool = True) -> Parser:
    """Return the parser; its help has all options, or the everyday ones."""
    parser = Parser(
        EVERYDAY,
        everything=everything,
        prog="alignscores compare",
        usage=USAGE,
        description="Compare systems over sequences and runs. Lost frames, failed and missing runs "
        "count as failures.",
        epilog=EPILOG,
    )
    parser.add_argument("files", nargs="+", metavar="[FORMAT] REF EST", help=FILES)
    parser.add_settings("format", "metrics")
    add = parser.add_argument_group("runs").add_argument
    add("--dry-run", action="store_true", help="list the files, and score nothing")
    add("--expect_all", action="store_true", help="a system without runs on a sequence fails")
    jobs, help = available_processors(), "processes in parallel (default: %(default)s)"
    add("--jobs", type=int, default=jobs, metavar="X", help=help)
    add("--cache", metavar="FOLDER", type=Path, help="store results there, and reuse them")
    add = parser.add_argument_group("verdicts").add_argument
    add("--by", default="PAS", metavar="NAME", help="metric of verdicts (default: PAS)")
    add("--baseline", metavar="FILE.json", help="compare with an earlier --json output")
    add("--fail_on", metavar="CONDITIONS", help=FAIL_ON)
    add("--paired", action="store_true", help="compare runs of the same name")
    output, page_file = parser.add_argument_group("output"), output_file(".html")
    add = output.add_argument
    add("-v", "--verbose", action="store_true", help="explain the numbers")
    add("--metrics", metavar="NAMES", default=(), help=MORE_METRICS)
    add("--html", metavar="FILE.html", type=page_file, help="save an HTML page")
    add("--markdown", metavar="FILE", help="save a report in Markdown; - prints it")
    add = output.add_mutually_exclusive_group().add_argument
    for name in ("JSON", "CSV", "LaTeX"):
        form, help = name.lower(), f"print {name} instead of the table"
        add(f"--{form}", dest="show", action="store_const", const=form, help=help)
    return parser


def run(argv: Sequence[str]) -> int:
    """Find, score and compare all runs; what is wrong with one does not stop the others."""
    parser = compare_parser(everything="--help-all" in argv)
    arguments = parser.parse(argv)
    if arguments.jobs < 1:
        parser.error("argument --jobs: must be at least 1")
    settings = parser.settings(arguments)
    measured = list(dict.fromkeys((*COLUMNS, *settings.metrics)))
    _check_names(parser, arguments, measured)
    gate = _gate(parser, arguments, measured)
    benchmark = _benchmark(parser, arguments, settings)
    if wrong := order_problem(settings.metrics, FORMATS[benchmark.format]):
        parser.error(wrong)
    if arguments.dry_run:
        _print_problems(benchmark.problems)
        _show_found(benchmark)
        return int(bool(benchmark.problems))
    if outputs := _outputs(arguments):
        refuse_to_replace(_inputs(benchmark, settings, arguments), outputs)
    saved: list[Result] = []
    if arguments.baseline:
        saved = read_baseline(arguments.baseline, replace(settings, format=benchmark.format))
    comparison = compare_runs(
        benchmark,
        settings,
        paired=arguments.paired,
        jobs=arguments.jobs,
        cache=arguments.cache,
        progress=show_progress,
    )
    changed = _changed(comparison, arguments, saved, gate) if arguments.baseline else None
    reasons = reasons_to_fail(gate, comparison.summary, changed) if gate else []
    unsaved = _save(comparison, arguments, changed, reasons)
    print(_shown(comparison, arguments, changed, reasons), flush=True)
    failed = [f"{error}; it counts as a failure" for error in comparison.failed]
    for problems in (comparison.problems, failed, unsaved):
        _print_problems(problems)
    _print_notes(comparison, arguments)
    for reason in reasons:
        print_error(reason)
    return FAILS if reasons else int(bool(comparison.problems or failed or unsaved))


def _changed(
    comparison: Comparison,
    arguments: argparse.Namespace,
    saved: Sequence[Result],
    gate: Sequence[Condition],
) -> Changes:
    """Compare with the saved runs; note if there are too few for the gate."""
    by, paired = arguments.by, arguments.paired
    changed = changes(comparison.summary, arguments.baseline, saved, by, paired)
    if any(one.relation == "worse" for one in gate) and not changed.may_be_worse:
        print_note("too few runs for a significant change: --fail_on worse cannot fail")
    return changed


def _gate(
    parser: Parser, arguments: argparse.Namespace, measured: Sequence[str]
) -> list[Condition]:
    """Return the conditions of --fail_on."""
    if arguments.fail_on is None:
        return []
    try:
        gate = conditions_of(arguments.fail_on, arguments.by, measured)
    except ValueError as error:
        parser.error(f"argument --fail_on: {error}")
    if any(one.needs_baseline for one in gate) and not arguments.baseline:
        parser.error(f"argument --fail_on: {arguments.fail_on}: needs --baseline FILE")
    return gate


def _check_names(parser: Parser, arguments: argparse.Namespace, measured: Sequence[str]) -> None:
    """Set --by to the metric's own name; refuse what is not measured, and to print twice."""
    if arguments.show and arguments.markdown == "-":
        parser.error(f"argument --markdown -: not allowed with argument --{arguments.show}")
    by = arguments.by
    with suppress(ValueError):
        arguments.by = metric(by).name
    if arguments.by not in measured:
        parser.error(f"argument --by: must be one of {', '.join(measured)}, not {by!r}")


def _benchmark(parser: Parser, arguments: argparse.Namespace, settings: Settings) -> Benchmark:
    """Find the files of two patterns, or read a YAML file."""
    expect_all = arguments.expect_all
    match arguments.files:
        case [form, reference, estimate] if form in FORMATS:
            named = replace(settings, format=form)
            return find_benchmark(reference, estimate, named, expect_all)
        case [reference, estimate] if reference not in FORMATS:
            return find_benchmark(reference, estimate, settings, expect_all)
        case [file] if Path(file).suffix in (".yaml", ".yml"):
            return find_benchmark(file, None, settings, expect_all)
    forms = f"a format ({', '.join(FORMATS)}) and two patterns, or one YAML file"
    parser.error(f"give {forms}; `alignscores REF EST EST` scores single files")


def _outputs(arguments: argparse.Namespace) -> list[tuple[str, Path]]:
    """Return the options that save a file, with the file."""
    outputs = ("--html", arguments.html), ("--markdown", arguments.markdown)
    return [(option, Path(file)) for option, file in outputs if file and file != "-"]


def _inputs(
    benchmark: Benchmark, settings: Settings, arguments: argparse.Namespace
) -> Iterator[str]:
    """Yield all files that are read, or would be if they were not left out."""
    if not arguments.files[1:]:
        yield arguments.files[0]
    yield from benchmark.files
    if arguments.baseline:
        yield arguments.baseline
    for run in benchmark.runs:
        if (frames := settings_of_run(benchmark, run, settings).frames) is not None:
            yield str(frames)


def _print_problems(problems: list[str]) -> None:
    for problem in problems[:SHOWN]:
        print_error(problem)
    if len(problems) > SHOWN:
        print_error(f"and {len(problems) - SHOWN} more; --json has all")


def _print_notes(comparison: Comparison, arguments: argparse.Namespace) -> None:
    notes = list(comparison.notes)
    if arguments.verbose:
        notes += comparison.low_scores
    shown = notes if arguments.verbose or len(notes) <= NOTES else notes[: NOTES - 1]
    for note in shown:
        print_note(note)
    if len(shown) < len(notes):
        print_note(f"{len(notes) - len(shown)} more; --verbose shows them")


def _show_found(benchmark: Benchmark) -> None:
    for sequence, reference in benchmark.references.items():
        print(printable(f"{sequence}: {reference}"))
        for run in benchmark.runs:
            if run.sequence == sequence:
                print(printable(f"  {run.system}, run {run.run}: {run.file or 'missing'}"))
    systems = {run.system for run in benchmark.runs}
    missing = sum(run.file is None for run in benchmark.runs)
    print(
        f"{len(benchmark.references)} sequences, {len(systems)} systems, "
        f"{len(benchmark.runs)} runs, {missing} of them missing"
    )


def _save(
    comparison: Comparison,
    arguments: argparse.Namespace,
    changed: Changes | None,
    reasons: Sequence[str],
) -> list[str]:
    """Save page and report; return why any cannot be saved, which stops nothing else."""
    by, unsaved = arguments.by, []
    for option, path in _outputs(arguments):
        if option == "--html":
            content = page(comparison, by, changed)
        else:
            content = f"{_report(comparison, by, changed, reasons)}\n"
        try:
            write_whole(path, content.encode())
        except ValueError as error:
            unsaved.append(f"{path}: {error}")
    return unsaved


def _shown(
    comparison: Comparison,
    arguments: argparse.Namespace,
    changed: Changes | None,
    reasons: Sequence[str],
) -> str:
    """Return the comparison as it was asked for."""
    by, summary = arguments.by, comparison.summary
    if arguments.show == "json":
        baseline = {"baseline": finite(changed.to_dict())} if changed else {}
        return json.dumps(comparison.to_dict() | baseline, indent=2, allow_nan=False)
    if arguments.show == "csv":
        return as_csv(summary).removesuffix("\n")
    if arguments.show == "latex":
        caption = " ".join([*comparison.verdict(by), *legend(summary, comparison.settings)])
        first, *others = tables(summary, by)
        return "\n\n".join([as_latex(first, caption), *(as_latex(one, by) for one in others)])
    if arguments.markdown == "-":
        return _report(comparison, by, changed, reasons)
    return _text(comparison, arguments, changed)


def _text(comparison: Comparison, arguments: argparse.Namespace, changed: Changes | None) -> str:
    """Return verdict, tables and what changed for a terminal."""
    summary, by = comparison.summary, arguments.by
    width = table_width()
    verdict = [fill(line, width) for line in comparison.verdict(by)]
    shown = [as_text(table, width) for table in tables(summary, by)]
    below = legend(summary, comparison.settings)
    if arguments.verbose:
        below += conditions(comparison.settings)
    parts = ["\n".join(verdict), *shown, "\n".join(below)]
    if changed:
        header = f"{by} against {printable(changed.file)}"
        table = as_text(changed.table(summary.system_names), width)
        parts.append("\n".join([header, table, *changed.notes]))
    return "\n\n".join(filter(None, parts))


def _report(
    comparison: Comparison, by: str, changed: Changes | None, reasons: Sequence[str]
) -> str:
    """Return verdict, tables and what changed in Markdown."""
    summary = comparison.summary
    parts = [f"**Fails:** {markdown(reason)}" for reason in reasons]
    parts += map(markdown, comparison.verdict(by))
    if changed:
        parts.append(f"{by} against {markdown(printable(changed.file))}:")
        parts.append(as_markdown(changed.table(summary.system_names)))
        parts += map(markdown, changed.notes)
    parts += [as_markdown(table) for table in tables(summary, by)]
    return "\n\n".join([*parts, *map(markdown, legend(summary, comparison.settings))])
