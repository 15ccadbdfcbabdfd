"""Scoring the files of the command line: ``alignscores [FORMAT] REF EST [EST ...]``."""

import argparse
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from textwrap import fill

from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import collected_warnings, reference_notes
from ..evaluation.reading import format_of, read_reference
from ..evaluation.rigs import of_model
from ..evaluation.scoring import score
from ..evaluation.settings import Settings
from ..extras import require
from ..io import FAILURES, FORMATS, read_stamps
from ..show import PLOT_MODES, files, tables
from ..show.evo import evo_result
from ..texts import WIDTH, aligned, alike, numbered, printable, unique_names
from ..version import __version__
from ..writing import write_whole
from .evo import add_pose_relation, check_pose_relation
from .output import (
    OF_BOTH,
    OUTPUTS,
    STDOUT,
    files_of,
    needed_by,
    one_line,
    print_error,
    print_note,
    refuse_to_replace,
    show_progress,
    table_width,
)
from .parser import Parser

__all__ = ["run", "score_parser"]

USAGE = """\
alignscores [FORMAT] REF EST [EST ...] [options]
       alignscores compare [FORMAT] REF_PATTERN EST_PATTERN [options]
       alignscores metrics"""
DESCRIPTION = """\
Score estimated camera trajectories against a reference (ground truth): TAS for
positions, RAS for rotations, PAS for both, from 0 to 1 (Lee and Civera).

formats (recognised from the files if none is named):
"""
EPILOG = """\
examples:
  alignscores groundtruth.txt orb_slam.txt dso.txt
  alignscores kitti 00_gt.txt 00_est.txt --alignment rigid -o results
  alignscores colmap reference/sparse/0 mine/sparse/0 --save_page page.html

exit codes: 0 scored, 1 something could not be scored, 2 wrong usage
"""
EVERYDAY = {
    *("t_max_diff", "t_offset", "t_start", "t_end", "sync", "rate", "max_gap", "invert", "align"),
    *("alignment", "missing", "metrics"),
    *("show", "output", "plot", "save_plot", "save_page"),
    *("verbose", "version"),
}
WRITTEN = *OF_BOTH, "save_errors", "save_aligned", "save_results", "save_rrd"
IN_FOLDER = {  # of --output
    "save_plot": "plot.png",
    "save_page": "page.html",
    "save_errors": "errors.csv",
    "save_csv": "scores.csv",
    "markdown": "scores.md",
    "latex": "scores.tex",
    "save_aligned": "aligned.txt",
    "save_json": "scores.json",
}
SHOWN_MODELS = 5  # of an estimate, without --verbose
OF_COMPARE = dict.fromkeys(  # options that are not of this command
    [
        *("--dry-run", "--expect_all", "--jobs", "--cache", "--by", "--better", "--baseline"),
        *("--fail_on", "--runs", "--paired"),
    ],
    "alignscores compare",
)


def score_parser() -> Parser:
    """Return the parser; its help has all options, or the everyday ones."""
    formats = "\n".join(f"  {name:8}  {file_format.help}" for name, file_format in FORMATS.items())
    parser = Parser(
        EVERYDAY,
        OF_COMPARE,
        prog="alignscores",
        usage=USAGE,
        description=f"{DESCRIPTION}{formats}",
        epilog=EPILOG,
    )
    version = f"alignscores {__version__}"
    parser.add_argument("--version", action="version", version=version, help="show the version")
    parser.add_argument("files", nargs="+", metavar="REF EST", help="the files")
    parser.add_settings()
    parser.add_outputs(WRITTEN, IN_FOLDER.values())
    add = parser.groups["output"].add_argument
    help = "show errors, trajectories, poses and scores"
    add("-p", "--plot", action="store_true", help=help)
    add("--plot_mode", choices=PLOT_MODES, help="axes of trajectories (default: the two longest)")
    add_pose_relation(add)
    return parser


@dataclass
class Results:
    """Results of all files: evaluations, failures, and notes on the reference."""

    settings: Settings
    reference: str
    scored: list[Evaluation] = field(default_factory=list)
    failed: list[dict[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def fail(self, file: str, error: Exception) -> None:
        """Add and print that a file cannot be read, scored or written."""
        message = one_line(error, file)
        self.failed.append({"file": printable(file), "error": message})
        print_error(message)

    def all_notes(self) -> list[str]:
        """Return the notes on the reference, and why files failed."""
        return [*self.notes, *(f"error: {failure['error']}" for failure in self.failed)]

    def json(self) -> str:
        """Return settings, results and failures as JSON."""
        content = {
            "version": __version__,
            "reference": printable(self.reference),
            **self.settings.to_dict(),
            "notes": self.notes,
            "results": [evaluation.to_dict() for evaluation in self.scored],
            "failed": self.failed,
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"


def run(argv: Sequence[str]) -> int:
    """Score all estimates, save and print; one that cannot be scored does not stop the others."""
    parser = score_parser()
    arguments = parser.parse(argv)
    reference, estimates, settings = _files(parser, arguments)
    check_pose_relation(arguments, parser.error)
    if arguments.save_aligned and not settings.file_format.ordered:
        parser.error(f"--save_aligned cannot write {settings.format} files")
    if arguments.show != "text":
        needed_by(arguments.show)
    names = unique_names(estimates)
    written = _outputs(arguments, names, settings)
    frames = [] if settings.frames is None else [str(settings.frames)]
    refuse_to_replace([reference, *estimates, *frames], [target[:2] for target in written])
    if arguments.plot and require("matplotlib.pyplot", "plots").get_backend() == "agg":
        raise ValueError("--plot has no display to show anything on; --save_plot FILE.png saves it")

    results = Results(settings, reference)
    _score(results, list(zip(names, estimates, strict=True)), detect=not arguments.format)
    for option, path, name in written:
        scored = [target for target in results.scored if name in (None, target.name)]
        if not scored and option != "save_json":  # the estimate could not be scored
            continue
        try:
            write_whole(path, _content(option, path, results, scored, arguments))
        except ValueError as error:
            results.fail(str(path), error)
    _print_notes(results, verbose=arguments.verbose)
    # Printed last: the reader may close the pipe, which ends the program.
    if arguments.show == "text" and results.scored:
        _print_table(results, verbose=arguments.verbose)
    elif arguments.show == "json" or results.scored:
        content = _content(arguments.show, STDOUT, results, results.scored, arguments)
        print(content.decode(), end="")
    if results.scored and arguments.plot:
        from ..show.plots import figure_of  # needs Matplotlib

        figure_of(results.scored, plot_mode=arguments.plot_mode, interactive=True)
        require("matplotlib.pyplot", "plots").show()
    return int(bool(results.failed))


def _files(parser: Parser, arguments: argparse.Namespace) -> tuple[str, list[str], Settings]:
    """Return reference, estimates, and the settings with the formats of these files."""
    arguments.format = arguments.files[0] if arguments.files[0] in FORMATS else None
    files = arguments.files[1:] if arguments.format else arguments.files
    if len(files) < 2:
        parser.error("give a reference and at least one estimate")
    reference, *estimates = files
    if not (arguments.format or Path(reference).suffix or Path(reference).exists()):
        parser.error(f"{reference!r} is neither a file nor a format ({', '.join(FORMATS)})")
    if (
        arguments.format == "bag"
        and estimates[0].startswith("/")
        and not Path(estimates[0]).exists()
    ):
        hint = (
            f"alignscores bag {reference} {reference} --ref_topic {estimates[0]} --est_topic NAME"
        )
        parser.error(f"{estimates[0]} is not a file; topics are options here: {hint}")
    settings = parser.settings(arguments)
    if not arguments.format:
        settings = parser.with_format(settings, format_of(reference, settings, "ref"))
        print_note(f"detected format: {settings.format}")
    return reference, estimates, settings


def _score(results: Results, estimates: list[tuple[str, str]], *, detect: bool) -> None:
    """Score all estimates, by name; with `detect` each has its own format where none is set."""
    settings, file = results.settings, results.reference
    try:
        with collected_warnings() as results.notes:
            reference = read_reference(file, settings)
            rig_frames = of_model(file, settings)
        if settings.frames is not None:  # once for all estimates
            file = str(settings.frames)
            settings = replace(settings, frames=read_stamps(file))
    except FAILURES as error:
        results.fail(file, error)
        return
    for number, (name, file) in enumerate(estimates, 1):
        show_progress(f"{number}/{len(estimates)} {name} " if len(estimates) > 1 else "")
        try:
            if detect and results.settings.est_format is None:
                est_format = format_of(file, settings, "est")
                settings = replace(settings, est_format=est_format)
                if est_format != settings.format:
                    print_note(f"{file}: detected format: {est_format}")
            results.scored.append(
                score(
                    reference,
                    file,
                    settings,
                    name=name,
                    ref_file=results.reference,
                    rig_frames=rig_frames,
                )
            )
        except FAILURES as error:
            results.fail(file, error)
    show_progress("")
    if results.scored:  # as JSON names it
        first = results.scored[0].settings
        results.settings = replace(results.settings, est_format=first.est_format)
    results.notes += map(str, reference_notes(results.scored))


def _outputs(
    arguments: argparse.Namespace, names: Sequence[str], settings: Settings
) -> list[tuple[str, Path, str | None]]:
    """Return all files that will be written: option, path, and the estimate that it is of."""
    in_folder = dict(IN_FOLDER)
    if not settings.file_format.ordered:
        del in_folder["save_aligned"]
    written: list[tuple[str, Path, str | None]] = []
    suffix = r"\.[a-z]+(?=$| \()"  # not of v1.2, and before the number of equal names
    short = numbered([re.sub(suffix, "", name.replace("/", "_")) for name in names])
    for option, path in files_of(arguments, in_folder).items():
        if not OUTPUTS[option].each:
            written.append((option, path, None))
        elif len(names) == 1:
            written.append((option, path, names[0]))
        else:  # each has its name, without slashes, appended
            files = [path.with_name(f"{path.stem}_{name}{path.suffix}") for name in short]
            written += [(option, file, name) for file, name in zip(files, names, strict=True)]
    return written


def _content(
    option: str,
    path: Path,
    results: Results,
    scored: Sequence[Evaluation],
    arguments: argparse.Namespace,
) -> bytes:
    """Return what an option writes or prints of some estimates."""
    match option.removeprefix("save_"):
        case "csv":
            return tables.csv(scored).encode()
        case "markdown":
            return tables.markdown(scored, results.all_notes()).encode()
        case "latex":
            return tables.latex(scored).encode()
        case "errors":
            return files.errors_csv(scored).encode()
        case "aligned":
            return files.aligned(scored[0])
        case "results":
            reference = printable(results.reference)
            return evo_result(scored[0], reference, arguments.pose_relation)
        case "plot":
            from ..show.plots import figure_of, picture  # needs Matplotlib

            return picture(figure_of(scored, plot_mode=arguments.plot_mode), path.suffix)
        case "rrd":
            from ..show.rerun import recording  # needs Rerun

            return recording(scored)
        case "page":
            from ..show.page import page_of  # needs plotly

            return page_of(scored, printable(results.reference), results.all_notes()).encode()
    return results.json().encode()


def _print_table(results: Results, *, verbose: bool) -> None:
    """Print the table with its conditions; `verbose` adds where the scores are lost, and terms."""
    scored = results.scored
    print(tables.text(scored, table_width()))
    print("\n".join(tables.conditions(scored)))
    if models := tables.models_of(scored, max_models=None if verbose else SHOWN_MODELS):
        print("", *aligned(models), sep="\n")
    if verbose and not results.settings.metrics:
        print("", *aligned(tables.deficits_of(scored)), "", sep="\n")
        for term, meaning in tables.terms(scored):
            print(fill(f"{term:15}{meaning}", WIDTH, subsequent_indent=" " * 15))


def _print_notes(results: Results, *, verbose: bool) -> None:
    """Print the notes; without `verbose` a line for those on estimates that are alike."""
    notes = [
        ("" if note.kind == "file" else evaluation.name, str(note))  # which names the file itself
        for evaluation in results.scored
        for note in evaluation.notes
    ]
    lines = [f"{name}: {note}" if name else note for name, note in notes]
    for line in [*results.notes, *(lines if verbose else alike(notes))]:
        print_note(line)
