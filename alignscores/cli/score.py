"""Scoring the files of the command line: ``alignscores [FORMAT] REF EST [EST ...]``."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..evaluation.notes import collected_warnings, reference_notes
from ..evaluation.reading import format_of, read_reference
from ..evaluation.scoring import score
from ..evaluation.settings import Settings
from ..extras import require
from ..io import FAILURES, FORMATS, read_stamps
from ..show import PLOT_MODES
from ..texts import unique_names
from ..version import __version__
from .evo import add_pose_relation, check_pose_relation
from .output import Results, print_note, print_notes, show_progress, show_table
from .parser import Parser, output_file
from .saving import KINDS, PRINTED, STDOUT, outputs, refuse_to_replace, save

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
    *("show", "output", "plot", "save_plot", "save_page"),
    *("verbose", "version"),
}


def score_parser() -> Parser:
    """Return the parser; its help has all options, or the everyday ones."""
    listed = "\n".join(f"  {name:8}  {form.help}" for name, form in FORMATS.items())
    parser = Parser(
        EVERYDAY,
        prog="alignscores",
        usage=USAGE,
        description=f"{DESCRIPTION}{listed}",
        epilog=EPILOG,
    )
    version = f"alignscores {__version__}"
    parser.add_argument("--version", action="version", version=version, help="show the version")
    parser.add_argument("files", nargs="+", metavar="REF EST", help="the files")
    parser.add_settings()
    add = parser.groups["output"].add_argument
    add("-v", "--verbose", action="store_true", help="explain the columns of the table")
    only_one = parser.groups["output"].add_mutually_exclusive_group().add_argument
    for form, name in PRINTED.items():
        help = f"print {name} instead of the table"
        only_one(f"--{form}", dest="show", action="store_const", const=form, help=help)
    written = ", ".join(kind.default for kind in KINDS.values() if kind.default)
    add("-o", "--output", metavar="FOLDER", type=Path, help=f"write all results: {written}")
    help = "show errors, trajectories, poses and scores"
    add("-p", "--plot", action="store_true", help=help)
    add("--plot_mode", choices=PLOT_MODES, help="axes of trajectories (default: the two longest)")
    for name, kind in KINDS.items():
        if name in PRINTED:
            continue
        help = f"{kind.help} ({', '.join(kind.suffixes)})" if kind.suffixes else kind.help
        help += "; FILE_<name> if several" if kind.each else ""
        path = output_file(*kind.suffixes) if kind.suffixes else Path
        add(f"--{name}", metavar="FILE", type=path, help=help)
    add_pose_relation(add)
    parser.set_defaults(show="text")
    return parser


def run(argv: Sequence[str]) -> int:
    """Score all estimates, save and print; one that cannot be scored does not stop the others."""
    parser = score_parser()
    arguments = parser.parse(argv)
    reference, estimates, settings = _files(parser, arguments)
    check_pose_relation(arguments, parser.error)
    if arguments.save_aligned and not settings.form.ordered:
        parser.error(f"--save_aligned cannot write {settings.format} files")
    if arguments.markdown == STDOUT:
        if arguments.show != "text":
            parser.error(f"--markdown - and --{arguments.show} both print")
        arguments.show = "markdown"
    for package in KINDS[arguments.show].packages if arguments.show in KINDS else ():
        require(package, "tables")
    names = unique_names(estimates)
    written = outputs(arguments, names, settings)
    frames = [] if settings.frames is None else [str(settings.frames)]
    refuse_to_replace([reference, *estimates, *frames], [one[:2] for one in written])
    if arguments.plot and require("matplotlib.pyplot", "plots").get_backend() == "agg":
        raise ValueError("--plot has no display to show anything on; --save_plot FILE.png saves it")

    results = Results(settings, reference)
    _score(results, list(zip(names, estimates, strict=True)), is_open=not arguments.format)
    save(written, results, arguments)
    print_notes(results, verbose=arguments.verbose)
    # Printed last: the reader may close the pipe, which ends the program.
    if arguments.show == "json" or (results.scored and arguments.show != "text"):
        print(results.written(arguments.show), end="")
    elif results.scored:
        show_table(results, verbose=arguments.verbose)
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
    settings = parser.settings(arguments)
    if not arguments.format:
        columns = settings.columns_of_reference
        settings = replace(settings, format=format_of(reference, columns))
        print_note(f"detected format: {settings.format}")
    return reference, estimates, settings


def _score(results: Results, estimates: list[tuple[str, str]], *, is_open: bool) -> None:
    """Score all estimates, by name; each has a format of its own where this is open."""
    settings, file = results.settings, results.reference
    try:
        with collected_warnings() as results.notes:
            reference = read_reference(file, settings)
        if settings.frames is not None:  # once for all estimates
            file = str(settings.frames)
            settings = replace(settings, frames=read_stamps(file))
    except FAILURES as error:
        results.fail(file, error)
        return
    for number, (name, file) in enumerate(estimates, 1):
        show_progress(f"{number}/{len(estimates)} {name} " if len(estimates) > 1 else "")
        try:
            if is_open and results.settings.est_format is None:
                est_format = format_of(file, settings.columns_of_estimates)
                settings = replace(settings, est_format=est_format)
                if est_format != settings.format:
                    print_note(f"{file}: detected format: {est_format}")
            results.scored.append(
                score(reference, file, settings, name=name, ref_file=results.reference)
            )
        except FAILURES as error:
            results.fail(file, error)
    show_progress("")
    if results.scored:  # as JSON names it
        first = results.scored[0].settings
        results.settings = replace(results.settings, est_format=first.est_format)
    results.notes += map(str, reference_notes(results.scored))
