"""The command ``alignscores compare``: from its arguments to what is printed and saved."""

import argparse
import signal
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import pandas as pd

from ..comparison.baseline import GATE_LEVEL, Changes, changes, read_baseline
from ..comparison.benchmark import Benchmark
from ..comparison.comparison import (
    Comparison,
    compare_runs,
    find_benchmark,
    from_table,
    read_runs,
)
from ..comparison.gate import WORSE, Condition, conditions_of, reasons_to_fail
from ..comparison.patterns import BenchmarkError
from ..comparison.summary import Design, larger_is_better, metric_columns
from ..comparison.tables import as_latex, problems_of
from ..evaluation.settings import Settings
from ..io import FORMATS
from ..metrics import SCORES, metric
from ..show.report import json_report, markdown_report, text_report
from ..show.tables import as_csv
from ..texts import printable
from ..writing import write_whole
from .output import (
    OF_BOTH,
    STDOUT,
    files_of,
    needed_by,
    print_error,
    print_note,
    refuse_to_replace,
    show_progress,
    table_width,
)
from .parser import Parser

__all__ = ["compare_parser", "run"]

USAGE = """\
alignscores compare [FORMAT] REF_PATTERN EST_PATTERN [options]
       alignscores compare FILE.yaml [options]
       alignscores compare RUNS.csv --by METRIC [options]"""
EPILOG = """\
example:
  alignscores compare 'data/{sequence}/gt.txt' 'data/{sequence}/{system}/{run}.txt'

exit codes: 0 all compared, 1 something was left out or failed,
2 wrong usage, also in patterns or a YAML file,
3 a condition of --fail_on holds
"""
EVERYDAY = {
    *("t_max_diff", "t_offset", "alignment", "dry_run", "jobs", "by", "baseline", "fail_on"),
    *("verbose", "metrics", "save_page", "save_csv", "markdown", "output", "show", "runs"),
}
FILES = (
    "patterns of the references and of the estimates, with {sequence}, {system} and {run}; or one "
    "YAML file; or one CSV file with a row for each run: system, sequence, run and any metric"
)
FAIL_ON = (
    "exit with 3 if one holds for a system: 'PAS<0.8,half>0.1,lost>5%%,failed>0'; with --baseline "
    f"also 'PAS drops 0.05', or 'worse' (significantly, by the --by metric; worse:{GATE_LEVEL:g} "
    "sets the level)"
)
FAILS = 3  # exit code
INTERRUPTED = 130  # exit code
IN_FOLDER = {  # of --output
    "save_page": "comparison.html",
    "save_plot": "comparison.png",
    "save_csv": "runs.csv",
    "markdown": "comparison.md",
    "latex": "comparison.tex",
    "save_json": "comparison.json",
}
OF_SCORE = dict.fromkeys(  # options that are not of this command
    [
        *("--save_errors", "--save_aligned", "--save_results", "--save_rrd", "--plot_mode"),
        *("-p", "--plot", "-r", "--pose_relation"),
    ],
    "alignscores REF EST",
)


def compare_parser() -> Parser:
    """Return the parser; its help has all options, or the everyday ones."""
    parser = Parser(
        EVERYDAY,
        OF_SCORE,
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
    help = "processes in parallel; -1: as many as processors (default: %(default)s)"
    add("--jobs", type=int, default=-1, metavar="X", help=help)
    add("--cache", metavar="FOLDER", type=Path, help="store results there, and reuse them")
    add = parser.add_argument_group("verdicts").add_argument
    add("--by", default="PAS", metavar="NAME", help="metric of verdicts (default: PAS)")
    help = "which values of --by are better, if it is a metric of your own in a CSV file"
    add("--better", choices=("larger", "smaller"), help=help)
    help = "compare with an earlier --save_csv or --save_json file"
    add("--baseline", metavar="FILE", help=help)
    add("--fail_on", default="", metavar="CONDITIONS", help=FAIL_ON)
    help = "dependent: runs of the same name share a build or a night, and count as one value"
    add("--runs", choices=("independent", "dependent"), default="independent", help=help)
    add("--paired", action="store_true", help="compare runs of the same name")
    parser.add_outputs(OF_BOTH, IN_FOLDER.values())
    return parser


def run(argv: Sequence[str]) -> int:
    """Find, score and compare all runs; Ctrl-C ends the workers and this process with 130."""
    ends_at_once = signal.getsignal(signal.SIGINT) is signal.SIG_DFL  # leaving the workers
    if ends_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return _run(argv)
    except KeyboardInterrupt:
        if not ends_at_once:
            raise
        show_progress("")
        return INTERRUPTED


def _run(argv: Sequence[str]) -> int:
    """Find, score and compare all runs; what is wrong with one does not stop the others."""
    parser = compare_parser()
    arguments = parser.parse(argv)
    settings = parser.settings(arguments)
    if arguments.paired and arguments.runs == "dependent":
        parser.error("--paired and --runs dependent exclude each other")
    if arguments.jobs == 0:
        parser.error("argument --jobs: must not be 0")
    table = _table(arguments)
    names = [*SCORES, *settings.metrics] if table is None else metric_columns(table, arguments.by)
    gate = _gate(parser, arguments, names)
    benchmark = None if table is not None else _benchmark(parser, arguments, settings)
    if arguments.dry_run and benchmark:
        return _list_files(benchmark)
    if arguments.show != "text":
        needed_by(arguments.show)
    outputs = files_of(arguments, IN_FOLDER)
    refuse_to_replace(_inputs(benchmark, arguments), outputs.items())
    saved = read_baseline(arguments.baseline, arguments.by) if arguments.baseline else None

    design: Design = "paired" if arguments.paired else arguments.runs
    if benchmark is None:
        assert table is not None
        comparison = from_table(table, arguments.by, arguments.better, design)
    else:
        comparison = compare_runs(
            benchmark,
            settings,
            by=arguments.by,
            design=design,
            jobs=arguments.jobs,
            cache=arguments.cache,
            progress=show_progress,
        )
    changed = None
    if saved is not None:
        levels = [condition.limit for condition in gate if condition.relation == WORSE]
        changed = changes(comparison, arguments.baseline, saved, *levels[:1])
    reasons = reasons_to_fail(gate, comparison, changed) if gate else []
    problems = problems_of(comparison)
    if changed and changed.is_void and any(condition.relation == WORSE for condition in gate):
        problems.append(
            f"no system could be shown to be worse at a level of {changed.level:g}: too few runs"
        )
    problems += _save_and_print(arguments, outputs, comparison, changed, reasons)
    for line in [*problems, *reasons]:
        print_error(line)
    if gate and not problems and not reasons:
        print_note(f"passed: {arguments.fail_on}")
    return FAILS if reasons else int(bool(problems))


def _save_and_print(
    arguments: argparse.Namespace,
    outputs: Mapping[str, Path],
    comparison: Comparison,
    changed: Changes | None,
    reasons: Sequence[str],
) -> list[str]:
    """Write all files and print; return which files could not be written."""
    problems = []
    for option, path in outputs.items():
        try:
            write_whole(path, _content(option, comparison, changed, reasons, path))
        except ValueError as error:
            problems.append(f"{path}: {error}")
    if arguments.show == "text":
        columns, verbose = table_width(), arguments.verbose
        text = text_report(comparison, changed, columns=columns, verbose=verbose)
    else:
        text = _content(arguments.show, comparison, changed, reasons).decode()
    print(text, end="", flush=True)
    if arguments.show in ("csv", "latex"):  # the other forms have them below the verdict
        for note in comparison.notes + (changed.notes if changed else []):
            print_note(note)
    return problems


def _table(arguments: argparse.Namespace) -> pd.DataFrame | None:
    """Return the table of runs, if the file is one, and set --by to the metric's own name."""
    table = None
    if len(arguments.files) == 1 and arguments.files[0].endswith(".csv"):
        table = read_runs(arguments.files[0])
    if table is None or arguments.by not in table:
        with suppress(ValueError):
            arguments.by = metric(arguments.by).name
    return table


def _content(
    option: str,
    comparison: Comparison,
    changed: Changes | None,
    reasons: Sequence[str],
    path: Path = STDOUT,
) -> bytes:
    """Return what an option writes or prints."""
    match option.removeprefix("save_"):
        case "csv":
            return as_csv(comparison.runs).encode()
        case "markdown":
            return markdown_report(comparison, changed, reasons).encode()
        case "latex":
            return as_latex(comparison).encode()
        case "plot":
            from ..show.comparison_plot import figure_of_comparison  # needs Matplotlib
            from ..show.plots import picture

            return picture(figure_of_comparison(comparison), path.suffix)
        case "page":
            from ..show.comparison_page import page_of_comparison  # needs plotly

            return page_of_comparison(comparison, changed, reasons).encode()
    return json_report(comparison, changed).encode()


def _gate(parser: Parser, arguments: argparse.Namespace, names: Sequence[str]) -> list[Condition]:
    """Check --by and --better, and return the conditions of --fail_on."""
    if arguments.by not in names:
        expected = f"one of {', '.join(names)}" if names else "the column of a metric"
        parser.error(f"argument --by: must be {expected}, not {arguments.by!r}")
    try:
        larger_is_better(arguments.by, arguments.better)
    except ValueError as error:
        parser.error(f"argument --better: {error}")
    if not arguments.fail_on:
        return []
    try:
        gate = conditions_of(arguments.fail_on, arguments.by, names)
    except ValueError as error:
        parser.error(f"argument --fail_on: {error}")
    if any(condition.needs_baseline for condition in gate) and not arguments.baseline:
        parser.error(f"argument --fail_on: {arguments.fail_on}: needs --baseline FILE")
    return gate


def _benchmark(parser: Parser, arguments: argparse.Namespace, settings: Settings) -> Benchmark:
    """Find the files of two patterns, or read a YAML file."""
    format_name = arguments.files[0] if arguments.files[0] in FORMATS else None
    files = arguments.files[1:] if format_name else arguments.files
    if len(files) not in (1, 2):
        expected = f"a format ({', '.join(FORMATS)}) and two patterns, or one YAML or CSV file"
        parser.error(f"give {expected}; `alignscores REF EST EST` scores single files")
    reference, estimate = files if files[1:] else (files[0], None)
    settings = parser.with_format(settings, format_name)
    try:
        benchmark = find_benchmark(reference, estimate, settings, arguments.expect_all)
    except BenchmarkError as error:
        parser.error(str(error))
    parser.with_format(settings, benchmark.format)
    return benchmark


def _inputs(benchmark: Benchmark | None, arguments: argparse.Namespace) -> list[str]:
    """Return all files that are read, or would be if they were not left out."""
    inputs = [*arguments.files, *([arguments.baseline] if arguments.baseline else [])]
    if benchmark is not None:
        inputs += benchmark.files
        options = benchmark.sequence_options.values()
        inputs += [entry["frames"] for entry in options if "frames" in entry]
        if arguments.frames:
            inputs += [
                arguments.frames.replace("{sequence}", name) for name in benchmark.references
            ]
    return inputs


def _list_files(benchmark: Benchmark) -> int:
    """Print the files of a benchmark and what is left out; return the exit code."""
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
