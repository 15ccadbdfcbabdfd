"""The command ``alignscores compare``: from its arguments to what is printed and saved."""

import argparse
import signal
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ..comparison.baseline import Changes, changes, read_baseline
from ..comparison.benchmark import Benchmark
from ..comparison.comparison import Comparison, compare_runs, find_benchmark
from ..comparison.gate import Condition, conditions_of, reasons_to_fail
from ..comparison.runs import COLUMNS
from ..comparison.summary import Result
from ..evaluation.settings import Settings
from ..io import FORMATS
from ..metrics import metric
from ..texts import printable
from ..writing import write_whole
from .output import print_error, print_note, show_progress
from .parser import Parser, output_file
from .report import Report
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
FAILS = 3  # exit code
INTERRUPTED = 130  # by custom: 128 + SIGINT
STDOUT = Path("-")


def compare_parser() -> Parser:
    """Return the parser; its help has all options, or the everyday ones."""
    parser = Parser(
        EVERYDAY,
        prog="alignscores compare",
        usage=USAGE,
        description="Compare systems over sequences and runs. Lost frames, failed and missing runs "
        "count as failures.",
        epilog=EPILOG,
    )
    parser.add_argument("files", nargs="+", metavar="[FORMAT] REF EST", help=FILES)
    parser.add_settings()
    add = parser.add_argument_group("runs").add_argument
    add("--dry-run", action="store_true", help="list the files, and score nothing")
    add("--expect_all", action="store_true", help="a system without runs on a sequence fails")
    help = "processes in parallel; -1: one for each core (default)"
    add("--jobs", type=int, default=-1, metavar="X", help=help)
    add("--cache", metavar="FOLDER", type=Path, help="store results there, and reuse them")
    add = parser.add_argument_group("verdicts").add_argument
    add("--by", default="PAS", metavar="NAME", help="metric of verdicts (default: PAS)")
    add("--baseline", metavar="FILE.json", help="compare with an earlier --json output")
    add("--fail_on", default="", metavar="CONDITIONS", help=FAIL_ON)
    add("--paired", action="store_true", help="compare runs of the same name")
    output = parser.groups["output"]
    add = output.add_argument
    add("-v", "--verbose", action="store_true", help="explain the numbers")
    add("--html", metavar="FILE.html", type=output_file(".html"), help="save an HTML page")
    add("--markdown", metavar="FILE", type=Path, help="save a report in Markdown; - prints it")
    add = output.add_mutually_exclusive_group().add_argument
    for form in ("json", "csv"):
        help = f"print {form.upper()} instead of the table"
        add(f"--{form}", dest="show", action="store_const", const=form, help=help)
    parser.set_defaults(show="text")
    return parser


def run(argv: Sequence[str]) -> int:
    """Find, score and compare all runs; what is wrong with one does not stop the others."""
    parser = compare_parser()
    arguments = parser.parse(argv)
    settings = parser.settings(arguments)
    if arguments.markdown == STDOUT and arguments.show != "text":
        parser.error(f"--markdown - and --{arguments.show} both print")
    gate = _gate(parser, arguments, [*COLUMNS, *settings.metrics])
    benchmark = _benchmark(parser, arguments, settings)
    if arguments.dry_run:
        return _show_found(benchmark)
    settings = replace(settings, format=benchmark.format)
    outputs = {form: getattr(arguments, form) for form in ("html", "markdown")}
    outputs = {form: path for form, path in outputs.items() if path not in (None, STDOUT)}
    refuse_to_replace(_inputs(benchmark, arguments), outputs.items())
    saved = read_baseline(arguments.baseline, settings) if arguments.baseline else []

    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # joblib then ends its processes
    try:
        comparison = compare_runs(
            benchmark,
            settings,
            paired=arguments.paired,
            jobs=arguments.jobs,
            cache=arguments.cache,
            progress=show_progress,
        )
    except KeyboardInterrupt:
        return INTERRUPTED
    changed = _changed(comparison, arguments, saved, gate) if arguments.baseline else None
    reasons = reasons_to_fail(gate, comparison.summary, changed) if gate else []
    problems = comparison.problems + [f"{e}; it counts as a failure" for e in comparison.failed]

    report = Report(comparison, arguments.by, changed, reasons)
    for form, path in outputs.items():
        try:
            write_whole(path, report.written(form).encode())
        except ValueError as error:
            problems.append(f"{path}: {error}")
    form = "markdown" if arguments.markdown == STDOUT else arguments.show
    print(report.written(form, verbose=arguments.verbose), end="", flush=True)
    for note in comparison.notes + (comparison.low_scores if arguments.verbose else []):
        print_note(note)
    for problem in [*problems, *reasons]:
        print_error(problem)
    return FAILS if reasons else int(bool(problems))


def _gate(
    parser: Parser, arguments: argparse.Namespace, measured: Sequence[str]
) -> list[Condition]:
    """Return the conditions of --fail_on, and set --by to the metric's own name."""
    by = arguments.by
    with suppress(ValueError):
        arguments.by = metric(by).name
    if arguments.by not in measured:
        parser.error(f"argument --by: must be one of {', '.join(measured)}, not {by!r}")
    try:
        gate = conditions_of(arguments.fail_on, arguments.by, measured)
    except ValueError as error:
        parser.error(f"argument --fail_on: {error}")
    if any(one.needs_baseline for one in gate) and not arguments.baseline:
        parser.error(f"argument --fail_on: {arguments.fail_on}: needs --baseline FILE")
    return gate


def _benchmark(parser: Parser, arguments: argparse.Namespace, settings: Settings) -> Benchmark:
    """Find the files of two patterns, or read a YAML file."""
    form = arguments.files[0] if arguments.files[0] in FORMATS else None
    files = arguments.files[1:] if form else arguments.files
    if len(files) not in (1, 2):
        forms = f"a format ({', '.join(FORMATS)}) and two patterns, or one YAML file"
        parser.error(f"give {forms}; `alignscores REF EST EST` scores single files")
    reference, estimate = files if files[1:] else (files[0], None)
    settings = replace(settings, format=form)
    return find_benchmark(reference, estimate, settings, arguments.expect_all)


def _inputs(benchmark: Benchmark, arguments: argparse.Namespace) -> list[str]:
    """Return all files that are read, or would be if they were not left out."""
    frames = [one["frames"] for one in benchmark.sequence_options.values() if "frames" in one]
    if arguments.frames:
        frames += [arguments.frames.replace("{sequence}", name) for name in benchmark.references]
    baseline = [arguments.baseline] if arguments.baseline else []
    return [*benchmark.files, *arguments.files, *frames, *baseline]


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


def _show_found(benchmark: Benchmark) -> int:
    """Print what is found and what is left out; return the exit code."""
    for problem in benchmark.problems:
        print_error(problem)
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
    return int(bool(benchmark.problems))
