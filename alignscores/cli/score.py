"""Scoring the files of the command line: ``alignscores [FORMAT] REF EST [EST ...]``."""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from ..evaluation.evaluation import Evaluation
from ..evaluation.notes import collected_warnings, reference_notes
from ..evaluation.reading import read_reference, with_format
from ..evaluation.scoring import score
from ..evaluation.settings import Settings
from ..texts import printable, unique_names
from ..trajectories.extras import require
from ..trajectories.files import FAILURES, STDIN, read_stamps
from ..trajectories.formats import FORMATS
from ..version import __version__
from .metrics import metre_notes
from .output import (
    json_text,
    one_line,
    print_error,
    print_note,
    print_notes,
    show_progress,
    show_table,
)
from .parser import Parser, output_file
from .saving import refuse_to_replace, save, show_plot, targets

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
    *("t_max_diff", "t_offset", "rate", "max_gap", "invert", "alignment", "missing", "metrics"),
    *("json", "output", "plot", "save_plot", "save_page", "save_results", "verbose", "version"),
}
METRICS = (
    "show these metrics instead of the scores, such as auc@30:vggt,rpe@1m; `alignscores metrics` "
    "lists them"
)
MODES = ("xy", "xz", "yz", "xyz")
WRITTEN = {  # options with the suffixes of their files
    "save_plot": ((".png", ".pdf", ".svg"), "save the plot as .png, .pdf or .svg"),
    "save_page": ((".html",), "save a page with trajectories, errors and scores"),
    "save_rrd": ((".rrd",), "save a recording for the Rerun viewer"),
    "save_errors": ((".csv",), "save the errors of each expected frame"),
    "save_metrics": ((".csv",), "save --metrics or, without it, the scores"),
    "save_aligned": (
        (".txt",),
        "save the aligned estimate, as TUM or KITTI; FILE_<name> if several",
    ),
    "save_results": ((".zip",), "save results for evo_res; FILE_<name> if several"),
}
SAVED_EACH = ("save_aligned", "save_results")  # one file an estimate
FOLDER = {  # what `--output FOLDER` writes
    "save_json": "scores.json",
    "save_errors": "errors.csv",
    "save_metrics": "metrics.csv",
    "save_aligned": "aligned.txt",
    "save_plot": "plot.png",
    "save_page": "page.html",
}


def score_parser(*, everything: bool = True) -> Parser:
    """Return the parser; its help has all options, or the everyday ones."""
    width = max(map(len, FORMATS))
    listed = "\n".join(f"  {name:{width}}  {form.help}" for name, form in FORMATS.items())
    parser = Parser(
        EVERYDAY,
        everything=everything,
        prog="alignscores",
        usage=USAGE,
        description=f"{DESCRIPTION}{listed}",
        epilog=EPILOG,
    )
    version = f"alignscores {__version__}"
    parser.add_argument("--version", action="version", version=version, help="show the version")
    parser.add_argument("files", nargs="+", metavar="REF EST", help="the files; - is stdin")
    parser.add_settings("format", "metrics")
    add = parser.add_argument_group("output").add_argument
    add("-v", "--verbose", action="store_true", help="explain the columns of the table")
    add("--json", action="store_true", help="print JSON instead of a table")
    add("--metrics", metavar="NAMES", default=(), help=METRICS)
    written = f"write all results: {', '.join(FOLDER.values())}"
    add("-o", "--output", metavar="FOLDER", type=Path, help=written)
    add("--plot", action="store_true", help="show errors, trajectories, poses and scores")
    add("--plot_mode", choices=MODES, help="axes of trajectories (default: the two longest)")
    for name, (suffixes, help) in WRITTEN.items():
        form = output_file(*suffixes)
        add(f"--{name}", metavar=f"FILE{suffixes[0]}", type=form, help=help)
    parser.set_defaults(save_json=None)
    return parser


def run(argv: Sequence[str]) -> int:
    """Score all estimates, save and print; one that cannot be scored does not stop the others."""
    parser = score_parser(everything="--help-all" in argv)
    arguments = parser.parse(argv)
    settings = _settings(parser, arguments)
    if arguments.save_aligned and not settings.form.ordered:
        parser.error(f"--save_aligned cannot write {settings.format} files")
    if arguments.output:
        _set_outputs(arguments, settings)
    inputs = [arguments.reference, *arguments.estimates]
    inputs += [str(settings.frames)] if settings.frames is not None else []
    if inputs.count(STDIN) > 1:
        raise ValueError("stdin (-) can be one file only")
    refuse_to_replace(inputs, _outputs(arguments))
    _require_extras(arguments)

    scored, failed, notes = _score_all(arguments, settings)
    if scored:
        notes += metre_notes(settings)
        failed += save(scored, failed, notes, arguments)
    if arguments.json:  # printed last: the reader may close the pipe, which ends the program
        print_notes(scored, notes)
        print(json_text(settings, arguments.reference, scored, failed, notes))
    elif scored:
        show_table(scored, notes, verbose=arguments.verbose)
    if scored and arguments.plot:
        show_plot(scored, arguments.plot_mode)
    return int(bool(failed))


def _settings(parser: Parser, arguments: argparse.Namespace) -> Settings:
    """Set reference and estimates, and return the settings with the formats of the files."""
    first, *others = arguments.files
    named = first in FORMATS
    if len(arguments.files) < (3 if named else 2):
        parser.error("give a reference and at least one estimate")
    if named:
        arguments.format, first, *others = arguments.files
    elif not Path(first).suffix and not Path(first).exists():
        parser.error(f"{first!r} is neither a file nor a format ({', '.join(FORMATS)})")
    arguments.reference, arguments.estimates = first, others
    settings = with_format(parser.settings(arguments), first, *others)
    if not named:
        other = f"; of the estimates: {settings.est_format}" if settings.est_format else ""
        print_note(f"detected format: {settings.format}{other}")
    return settings


def _set_outputs(arguments: argparse.Namespace, settings: Settings) -> None:
    """Set the files in the folder of ``--output``, and create the folder."""
    arguments.output.mkdir(exist_ok=True)
    for option, name in FOLDER.items():
        if option == "save_aligned" and not settings.form.ordered:
            continue
        if option == "save_plot" and find_spec("matplotlib") is None:
            print_note(f"{name} is not written: Matplotlib is not installed")
            continue
        if getattr(arguments, option) is None:
            setattr(arguments, option, arguments.output / name)


def _outputs(arguments: argparse.Namespace) -> Iterator[tuple[str, Path]]:
    """Yield all files that will be written, with their options."""
    names = unique_names(arguments.estimates)
    for option in ("save_json", *WRITTEN):
        path = getattr(arguments, option)
        if path and option in SAVED_EACH:
            yield from ((f"--{option}", target) for target in targets(path, names).values())
        elif path:
            yield f"--{option}", path


def _require_extras(arguments: argparse.Namespace) -> None:
    """Check that the packages and the display for the outputs are there."""
    if arguments.save_results:
        require("evo", "evo")
    if arguments.save_plot:
        require("matplotlib", "plots")
    if arguments.save_rrd:
        require("rerun", "rerun")
    if arguments.plot:
        backend = require("matplotlib.pyplot", "plots").get_backend()
        registry = require("matplotlib.backends.registry", "plots")
        if backend in registry.backend_registry.list_builtin(
            registry.BackendFilter.NON_INTERACTIVE
        ):
            reason = f"--plot has no display to show anything on ({backend})"
            raise ValueError(f"{reason}; --save_plot FILE.png saves the figure")


def _score_all(
    arguments: argparse.Namespace, settings: Settings
) -> tuple[list[Evaluation], list[dict[str, str]], list[str]]:
    """Return the evaluations, the files that could not be scored, and notes on the reference."""
    scored: list[Evaluation] = []
    failed: list[dict[str, str]] = []
    notes: list[str] = []

    def fail(file: str, error: Exception) -> None:
        failed.append({"file": printable(file), "error": one_line(error, file)})
        print_error(failed[-1]["error"])

    file = arguments.reference
    try:
        with collected_warnings() as notes:
            reference = read_reference(file, settings)
        if settings.frames is not None:  # once for all estimates
            file = str(settings.frames)
            settings = replace(settings, frames=read_stamps(file))
    except FAILURES as error:
        fail(file, error)
        return scored, failed, notes
    names = unique_names(arguments.estimates)
    for number, (name, file) in enumerate(zip(names, arguments.estimates, strict=True), 1):
        show_progress(f"{number}/{len(names)} {name} " if len(names) > 1 else "")
        try:
            scored.append(score(reference, file, settings, name=name))
        except FAILURES as error:
            fail(file, error)
    show_progress("")
    return scored, failed, [*notes, *map(str, reference_notes(scored))]
