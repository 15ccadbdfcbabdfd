"""The command: from its arguments to what is printed and saved."""

import argparse
import multiprocessing
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, TypeVar

from .. import __version__
from ..cli.metrics import OWN, Metrics, order_problem
from ..cli.names import printable
from ..cli.notes import collected_warnings
from ..cli.output import print_error, print_note, show_progress
from ..cli.saving import write_whole
from ..cli.scoring import seeds
from ..registration import REGISTRATIONS
from ..trajectories.association import MISSING
from ..trajectories.files import read_stamps
from ..trajectories.formats import FORMATS
from .benchmark import Benchmark, Run, from_patterns, read_yaml
from .page import page
from .patterns import Pattern
from .runs import Due, Outcome, Task, due, evaluate, read_reference
from .summary import SCORES, Summary, summarise
from .tables import as_csv, as_json, as_latex, as_markdown, as_text
from .trajectories import trajectories

__all__ = ["add_parser"]

EPILOG = """\
example:
  alignscores compare tum 'data/{sequence}/gt.txt' 'data/{sequence}/{system}/{run}.txt'

exit codes: 0 all compared, 1 something was left out or failed, 2 wrong usage
"""
Result = TypeVar("Result")


def add_parser(commands: Any) -> None:
    """Add the command to those of the parser."""
    from ..cli.main import add_number, output_file  # it imports this module in turn

    command = commands.add_parser(
        "compare",
        help="systems over sequences and runs, with their uncertainty",
        description="compare: systems over sequences and runs. Lost frames, failed and missing "
        "runs count as failures.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(command=command, run=run)
    command.add_argument(
        "source", metavar="FORMAT", help=f"{', '.join(FORMATS)}; or a YAML file, without patterns"
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

    matching = command.add_argument_group("which poses belong together")
    matching.add_argument(
        "--missing",
        choices=MISSING,
        default="fail",
        help="cameras without an estimate fail, or are left out (default: %(default)s)",
    )
    matching.add_argument(
        "--est_format", choices=list(FORMATS), help="format of the estimates, if it is another one"
    )
    add_number(matching, "--t_max_diff", 0.01, "largest difference of associated stamps, in s")
    add_number(
        matching,
        "--t_offset",
        0.0,
        "added to the estimates' time stamps, in s; auto: that at which positions fit best",
        least=-float("inf"),
        auto=True,
    )
    matching.add_argument(
        "--frames",
        metavar="PATTERN",
        help="files with the time stamps of the frames that were due; may have {sequence}",
    )
    matching.add_argument("--invert", action="store_true", help="the estimates are world-to-camera")
    matching.add_argument(
        "--body_rotation",
        choices=("auto", "none"),
        default="none",
        help="take a constant rotation of the camera's frame out, if one is found",
    )

    scoring = command.add_argument_group("scoring")
    scoring.add_argument(
        "--metrics",
        action=Metrics,
        default=[],
        metavar="NAMES",
        help="more metrics: auc@30:vggt,ate:rmse; --metrics help lists them",
    )
    add_number(scoring, "--unit", None, "d of all sequences (default: of each)", positive=True)
    add_number(scoring, "--max_threshold", 1.0, "largest threshold of the TAS, in d", positive=True)
    add_number(scoring, "--max_threshold_deg", 10.0, "largest threshold of the RAS", positive=True)
    add_number(scoring, "--weight", 0.5, "share of the TAS in the PAS, from 0 to 1", most=1)
    scoring.add_argument(
        "--registration",
        choices=sorted(REGISTRATIONS),
        default="refined",
        help="how the TAS aligns (default: %(default)s)",
    )
    add_number(scoring, "--seed", 0, "first seed of the registration")
    add_number(scoring, "--repeat", 10, "seeds that scores of pcr99 are means over", least=1)

    work = command.add_argument_group("work")
    add_number(work, "--jobs", os.cpu_count() or 1, "processes side by side", least=1)
    work.add_argument(
        "--cache",
        metavar="FOLDER",
        default=None,
        help="where results are kept (default: alignscores in the user's cache)",
    )
    work.add_argument("--no_cache", action="store_true", help="compute everything anew")

    output = command.add_argument_group("output")
    output.add_argument(
        "--by", default="PAS", metavar="NAME", help="metric of the tables (default: %(default)s)"
    )
    output.add_argument(
        "--html", metavar="FILE.html", type=output_file(".html"), help="save one page with drawings"
    )
    shown = output.add_mutually_exclusive_group()
    for name in ("json", "csv", "markdown", "latex"):
        shown.add_argument(
            f"--{name}",
            dest="show",
            action="store_const",
            const=name,
            help=f"print {name.upper() if len(name) < 5 else name.title()} instead of the table",
        )


def run(arguments: argparse.Namespace) -> int:
    """Find, score and compare all runs; what is wrong with one does not stop the others."""
    metrics = _metrics(arguments)
    benchmark = _benchmark(arguments)
    form = FORMATS[benchmark.format]
    if wrong := order_problem(metrics, form):
        arguments.command.error(f"argument --metrics: {wrong}")
    for problem in benchmark.problems:
        print_error(printable(problem))
    if arguments.dry_run:
        _show_found(benchmark)
        return int(bool(benchmark.problems))
    done = list(_scored(benchmark, arguments, metrics))
    failed = [outcome.error for _, outcome in done if outcome.error]
    for error in failed:
        print_error(printable(f"{error}; it counts as a failure"))
    if not done:
        raise ValueError("nothing is left to be compared")
    summary = summarise(
        done,
        metrics,
        weight=arguments.weight,
        ordered=form.ordered,
    )
    _print_notes(done)
    _show(summary, benchmark, arguments)
    return int(bool(benchmark.problems or failed))


def _metrics(arguments: argparse.Namespace) -> tuple[str, ...]:
    """Return the names of the metrics besides the scores, which have their columns anyway."""
    names = tuple(name for name in arguments.metrics if name == "ate" or name not in OWN)
    if arguments.by not in (*SCORES, *names):
        arguments.command.error(
            f"argument --by: must be one of {', '.join((*SCORES, *names))}, not {arguments.by!r}"
        )
    return names


def _benchmark(arguments: argparse.Namespace) -> Benchmark:
    source, patterns = arguments.source, arguments.patterns
    if source in FORMATS and len(patterns) == 2:
        return from_patterns(source, *patterns)
    if Path(source).suffix in (".yaml", ".yml") and not patterns:
        return read_yaml(source)
    usage = f"give one of {', '.join(FORMATS)} and two patterns, or one YAML file"
    arguments.command.error(usage)
    raise AssertionError  # error() exits


def _show_found(benchmark: Benchmark) -> None:
    for sequence, reference in benchmark.references.items():
        print(printable(f"{sequence}: {reference}"))
        for one in benchmark.runs:
            if one.sequence == sequence:
                print(printable(f"  {one.system}, run {one.run}: {one.file or 'missing'}"))
    systems = {one.system for one in benchmark.runs}
    missing = sum(one.file is None for one in benchmark.runs)
    print(
        f"{len(benchmark.references)} sequences, {len(systems)} systems, "
        f"{len(benchmark.runs)} runs, {missing} of them missing"
    )


def _scored(
    benchmark: Benchmark, arguments: argparse.Namespace, metrics: tuple[str, ...]
) -> Iterator[tuple[Run, Outcome]]:
    """Score all runs; sequences whose reference or frames cannot be read are left out."""
    cache = _cache(arguments)
    read_reference.cache_clear()  # of another run in this process: the files may have changed
    tasks: dict[Run, Task] = {}
    for sequence, reference in benchmark.references.items():
        runs = [one for one in benchmark.runs if one.sequence == sequence]
        options = {one: _options(benchmark, one, arguments) for one in runs}
        try:
            with collected_warnings() as notes:
                read_reference(reference, options[runs[0]].format)
                if frames := options[runs[0]].frames:
                    read_stamps(frames)
        except ValueError as error:
            benchmark.problems.append(f"sequence {sequence}: left out: {error}")
            print_error(printable(benchmark.problems[-1]))
            continue
        for note in notes:
            print_note(f"{sequence}: {note}")
        checked = set()  # what is mixed up is so in all runs of a system: the first one tells
        for one in runs:
            first = one.file is not None and one.system not in checked
            if first:
                checked.add(one.system)
            tasks[one] = Task(reference, one.file or "", options[one], metrics, cache, first)
    there = {one: task for one, task in tasks.items() if one.file}
    with _Pool(arguments.jobs) as pool:
        unknown = {one: task for one, task in there.items() if task.options.unit is None}
        found = dict(pool.work(due, unknown, "looking at"))
        units = _units(found)
        for one, task in unknown.items():
            task.options.unit = units.get(one.sequence)
        outcomes = dict(pool.work(evaluate, there, "scoring"))
    for one in tasks:
        missing = f"{one.system}: has no run {one.run} on {one.sequence}"
        yield one, outcomes[one] if one.file else Outcome({}, error=missing)


def _units(found: dict[Run, Due | str]) -> dict[str, float]:
    """Return d of each sequence: that of the frames that were due, by the estimate with the most.

    Where the estimates tell different numbers of them, d is rounded to two digits, so that one more
    run, as a rule, does not change it.
    """
    units = {}
    for sequence in dict.fromkeys(one.sequence for one in found):
        known = [
            (one.n, one.unit)
            for run, one in found.items()
            if run.sequence == sequence and isinstance(one, Due) and one.unit is not None
        ]
        if known:
            _, unit = max(known)
            units[sequence] = unit if len(set(known)) == 1 else float(f"{unit:.1e}")
    return units


def _options(benchmark: Benchmark, one: Run, arguments: argparse.Namespace) -> argparse.Namespace:
    """Return the options of a run: those of the command line, of its sequence and its system."""
    of_sequence = benchmark.sequence_options.get(one.sequence, {})
    of_system = benchmark.system_options.get(one.system, {})
    form = of_sequence.get("format", benchmark.format)
    keys = (
        "t_max_diff t_offset unit max_threshold max_threshold_deg weight registration seed repeat"
    )
    options = {key: of_sequence.get(key, getattr(arguments, key)) for key in keys.split()}
    frames = of_sequence.get("frames")
    if frames is None and arguments.frames:
        frames = Pattern(arguments.frames, ["sequence"]).fill({"sequence": one.sequence})
    return argparse.Namespace(
        **options,
        format=form,
        est_format=of_system.get("est_format", arguments.est_format),
        missing="fail" if frames else arguments.missing if FORMATS[form].missing else None,
        frames=frames,
        invert=of_system.get("invert", arguments.invert),
        body_rotation=arguments.body_rotation,
    )


def _cache(arguments: argparse.Namespace) -> str | None:
    """Return the folder of the cache, made if need be; None without one."""
    if arguments.no_cache:
        return None
    if arguments.cache is None:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(home) / "alignscores"
    else:
        folder = Path(arguments.cache)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--cache {folder}: cannot be made ({error.strerror})") from None
    return str(folder)


class _Pool:
    """Processes side by side; with one job, this process alone."""

    def __init__(self, jobs: int) -> None:
        self._executor = None if jobs == 1 else ProcessPoolExecutor(jobs, initializer=_in_worker)

    def __enter__(self) -> "_Pool":
        return self

    def __exit__(self, *_: object) -> None:
        if self._executor:
            self._executor.shutdown(cancel_futures=True)

    def work(
        self, function: Callable[[Task], Result], tasks: dict[Run, Task], doing: str
    ) -> Iterator[tuple[Run, Result]]:
        """Yield the result of each task, and show how far it is."""
        for number, (one, result) in enumerate(self._results(function, tasks), 1):
            show_progress(f"{doing} {number}/{len(tasks)}")
            yield one, result
        show_progress("")

    def _results(
        self, function: Callable[[Task], Result], tasks: dict[Run, Task]
    ) -> Iterator[tuple[Run, Result]]:
        if self._executor is None:
            yield from ((one, function(task)) for one, task in tasks.items())
            return
        futures = {self._executor.submit(function, task): one for one, task in tasks.items()}
        for future in as_completed(futures):
            try:
                yield futures[future], future.result()
            except BrokenProcessPool:
                raise ValueError(
                    "a process was ended before its work was done, as when memory is short; what "
                    "is done is in the cache: start again, with fewer --jobs"
                ) from None


def _in_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the work
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process where the parent was ended by a signal; it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _print_notes(done: Sequence[tuple[Run, Outcome]]) -> None:
    """Print each note once, with the first run that it is about and the number of the others."""
    alike: dict[tuple[str, str], list[str]] = {}
    for one, outcome in done:
        for note in outcome.notes:
            text = f"{one.sequence}, {one.system}, run {one.run}: {note}"
            alike.setdefault((one.system, re.sub(r"[\d.]+", "", note)), []).append(text)
    for (system, _), (first, *others) in alike.items():
        more = f" (and alike for {len(others)} more of {system})" if others else ""
        print_note(printable(f"{first}{more}"))


def _show(summary: Summary, benchmark: Benchmark, arguments: argparse.Namespace) -> None:
    """Print the comparison as it was asked for."""
    named = {**benchmark.sequence_options, **benchmark.system_options}
    names = {
        key: printable(str(named.get(key, {}).get("name", key)))
        for key in (*summary.sequences, *summary.systems)
    }
    if arguments.html:
        setting = {
            "threshold": arguments.max_threshold,
            "degrees": arguments.max_threshold_deg,
            "weight": arguments.weight,
        }
        references = {
            run.sequence: (benchmark.references[run.sequence], _options(benchmark, run, arguments))
            for run in benchmark.runs
        }
        content = page(
            summary,
            arguments.by,
            names,
            _footnotes(summary, arguments),
            setting,
            trajectories(summary, arguments.by, names, references),
        )
        # names of files that are not UTF-8 are in it as data, too
        write_whole(arguments.html, content.encode(errors="backslashreplace"))
    match arguments.show:
        case "json":
            print(as_json(summary, _settings(benchmark, arguments)))
        case "csv":
            print(as_csv(summary), end="")
        case "markdown":
            print(as_markdown(summary, arguments.by, names))
        case "latex":
            print(as_latex(summary, arguments.by, names))
        case _:
            print(as_text(summary, arguments.by, names))
            print("\n" + "\n".join(_footnotes(summary, arguments)))
    sys.stdout.flush()


def _settings(benchmark: Benchmark, arguments: argparse.Namespace) -> dict[str, Any]:
    keys = "missing t_max_diff unit max_threshold max_threshold_deg weight registration seed"
    return {
        "version": __version__,
        "format": benchmark.format,
        **{key: getattr(arguments, key) for key in keys.split()},
        "repeat": len(seeds(arguments)),
        "problems": [printable(problem) for problem in benchmark.problems],
    }


def _footnotes(summary: Summary, arguments: argparse.Namespace) -> list[str]:
    """Return what is said below the tables."""
    lines = [
        f"means over runs, overall over sequences; registration {arguments.registration}",
        f"missing cameras: {arguments.missing}; failed and missing runs count as failures",
    ]
    if len(summary.systems) > 1:
        lines.append(
            "(1-2): ranks, shared where they cannot be told apart (95 % for all pairs of a column)"
        )
    if any(entry["failed_runs"] for entry in summary.entries.values()):
        lines.append("†1: so many runs failed or are missing")
    return lines
