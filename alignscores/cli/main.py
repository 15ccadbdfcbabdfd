"""The parser of the command line, and the run from arguments to output."""

import argparse
import io
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .. import __version__
from ..registration import REGISTRATIONS
from ..trajectories.association import MISSING, in_order
from ..trajectories.extras import require
from ..trajectories.files import STDIN, FileError, read_stamps
from ..trajectories.formats import FORMATS, Format
from .metrics import Metrics, metre_notes
from .names import printable, unique_names
from .notes import collected_warnings, units_notes
from .output import (
    print_error,
    show_json,
    show_progress,
    show_table,
)
from .ranking import in_rank_order
from .saving import save, show_plot
from .scoring import Scored, score

__all__ = ["main"]

EPILOG = f"""\
examples:
{chr(10).join(f"  alignscores {name} {form.example}" for name, form in FORMATS.items())}

Every score is from 0 to 1, the larger the better. `alignscores FORMAT --help` tells the options.
exit codes: 0 scored, 1 something could not be scored, 2 wrong usage
shell completion: eval "$(register-python-argcomplete alignscores)"
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        0 if all was scored, 1 if something could not be. Wrong usage ends in ``SystemExit(2)``.
    """
    parser = build_parser()
    if isinstance(sys.stdout, io.TextIOWrapper):  # names may hold what it cannot encode
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        if "_ARGCOMPLETE" in os.environ:
            require("argcomplete", "completion").autocomplete(parser)
        arguments, unknown = parser.parse_known_args(argv)
        if unknown:  # with the usage of the format, not that of the whole
            arguments.command.error(f"unrecognized arguments: {' '.join(unknown)}")
        return int(arguments.run(arguments))
    except BrokenPipeError:  # the reader has closed the pipe, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ModuleNotFoundError, OSError, ValueError) as error:
        print_error(one_line(error))
        return 1
    except KeyboardInterrupt:
        return 130


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line: one subcommand a format."""
    parser = argparse.ArgumentParser(
        prog="alignscores",
        description="Score estimated camera trajectories against a reference: TAS (positions), RAS "
        "(rotations) and PAS (their mean), after Lee and Civera.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    formats = parser.add_subparsers(dest="format", metavar="FORMAT", required=True)
    for name, form in FORMATS.items():
        command = formats.add_parser(
            name,
            help=form.help,
            description=f"{name}: {form.help}.",
            epilog=f"example: alignscores {name} {form.example}",
        )
        _add_arguments(command, form)
    from ..compare.command import add_parser  # it imports this module in turn

    add_parser(formats)
    return parser


def _add_arguments(command: argparse.ArgumentParser, form: Format) -> None:
    command.set_defaults(command=command, run=run, missing=None, save_aligned=None, est_format=None)
    command.add_argument("reference", metavar="REF", help="the reference (ground truth)")
    command.add_argument("estimates", metavar="EST", nargs="+", help="an estimate; - is stdin")

    alike = [
        name
        for name, other in FORMATS.items()
        if (other.timed, other.missing) == (form.timed, form.missing)
    ]
    if len(alike) > 1:
        command.add_argument(
            "--est_format", choices=alike, help="format of the estimates, if it is another one"
        )

    matching = command.add_argument_group("which poses belong together")
    if form.missing:
        matching.add_argument(
            "--missing",
            choices=MISSING,
            default=form.missing,
            help="cameras without an estimate count as failures, or are left out "
            "(default: %(default)s)",
        )
    if form.timed:
        add_number(matching, "--t_max_diff", 0.01, "largest difference of associated stamps, in s")
        add_number(
            matching,
            "--t_offset",
            0.0,
            "added to the estimate's time stamps, in s; auto: that at which positions fit best",
            least=-math.inf,
            auto=True,
        )
        matching.add_argument(
            "--frames",
            metavar="FILE",
            help="time stamps of the frames that were to be estimated, in the first column of a "
            "text file, in s or ns, as the estimate has them: those without a pose fail, and "
            "nothing else (implies --missing fail)",
        )

    scoring = command.add_argument_group("scoring")
    add_number(
        scoring,
        "--unit",
        None,
        "d in the reference's unit (default: from the reference)",
        positive=True,
    )
    add_number(
        scoring, "--max_threshold", 1.0, "largest threshold of the TAS in units of d", positive=True
    )
    add_number(
        scoring,
        "--max_threshold_deg",
        10.0,
        "largest threshold of the RAS in degrees",
        positive=True,
    )
    add_number(scoring, "--weight", 0.5, "share of the TAS in the PAS, from 0 to 1", most=1)
    scoring.add_argument(
        "--registration",
        choices=sorted(REGISTRATIONS),
        default="pcr99",
        help="how the TAS aligns; pcr99 is the paper's (default: %(default)s)",
    )
    add_number(
        scoring,
        "--seed",
        0,
        "first seed of the registration; errors, plots and saved files are of this one",
    )
    add_number(
        scoring,
        "--repeat",
        10,
        "seeds, from --seed on, that TAS, PAS and their sd are over; the refined registration, "
        "which hardly depends on it, takes one",
        least=1,
    )
    scoring.add_argument(
        "--invert", action="store_true", help="the estimates are world-to-camera: invert them"
    )
    scoring.add_argument(
        "--body_rotation",
        choices=("auto", "none"),
        default="none",
        help="take a constant rotation of the camera's frame out, if one is found "
        "(default: %(default)s)",
    )

    output = command.add_argument_group("output")
    output.add_argument(
        "--metrics",
        metavar="NAMES",
        action=Metrics,
        form=form,
        default=[],
        help="show these instead: tas, ras, pas, half, half:rotation, ate, and other projects' "
        "metrics, such as auc@30:vggt,maa:imc,recall@5cm,5deg,rpe@1m; help lists all",
    )
    output.add_argument("--json", action="store_true", help="print JSON instead of a table")
    output.add_argument(
        "--save_errors",
        metavar="FILE.csv",
        type=output_file(".csv"),
        help="save the errors of each camera, and why it has none",
    )
    output.add_argument(
        "--save_metrics",
        metavar="FILE.csv",
        type=output_file(".csv"),
        help="save the --metrics, a line an estimate; without --metrics, those of this package",
    )
    output.add_argument(
        "--profile",
        metavar="FILE.csv",
        type=output_file(".csv"),
        help="save TAS and RAS of all estimates over all units of their thresholds; as for the "
        "half-score distance, the TAS is of the refined registration",
    )
    if form.aligned:
        output.add_argument(
            "--save_aligned",
            metavar="FILE.txt",
            type=output_file(".txt"),
            help=f"save the estimate in the reference's world, in {form.aligned} format, aligned "
            "as in the TAS; of several estimates each gets FILE_<name>.txt",
        )
    output.add_argument(
        "--save_results",
        metavar="FILE.zip",
        type=output_file(".zip"),
        help="save for evo_res; of several estimates each gets FILE_<name>.zip",
    )
    output.add_argument(
        "--plot", action="store_true", help="show histograms, trajectories and score profiles"
    )
    output.add_argument(
        "--save_plot",
        metavar="FILE",
        type=output_file(".png", ".pdf", ".svg"),
        help="save them as FILE (.png, .pdf or .svg); more than 4 estimates share axes",
    )
    output.add_argument(
        "--save_page",
        metavar="FILE.html",
        type=output_file(".html"),
        help="save one page, which needs no network: trajectories to turn, errors, and sliders for "
        "thresholds, weight and missing cameras",
    )


def add_number(
    group: Any,
    option: str,
    default: float | None,
    text: str,
    *,
    least: float = 0,
    most: float = math.inf,
    positive: bool = False,
    auto: bool = False,
) -> None:
    """Add an option that takes a number: a whole one if the default is, else a finite one."""
    convert = int if isinstance(default, int) else float
    bound = " above 0" if positive else "" if least == -math.inf else f" of at least {least}"
    if most < math.inf:
        bound = f" from {least} to {most}"

    def number(value: str) -> float | str:
        if auto and value == "auto":
            return value
        try:
            result = convert(value)
            possible = math.isfinite(result) and least <= result <= most
            if possible and not (positive and result == 0):
                return result
        except (OverflowError, ValueError):
            pass
        kind = "whole" if convert is int else "finite"
        raise argparse.ArgumentTypeError(f"must be a {kind} number{bound}, not {value!r}")

    suffix = "" if default is None else " (default: %(default)s)"
    group.add_argument(option, type=number, default=default, metavar="X", help=text + suffix)


def output_file(*suffixes: str) -> Callable[[str], Path]:
    """Return a type of argument that refuses at once what could not be written at the end."""

    def output(value: str) -> Path:
        path = Path(value)
        if path.suffix not in suffixes:
            raise argparse.ArgumentTypeError(f"{value} does not end in {' or '.join(suffixes)}")
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"{value}: there is no folder {path.parent}")
        return path

    return output


def run(arguments: argparse.Namespace) -> int:
    """Score all estimates, save and print; one that cannot be scored does not stop the others."""
    check_stdin_read_once(arguments)
    check_outputs_possible(arguments)
    form = FORMATS[arguments.format]
    scored: list[Scored] = []
    failed: list[dict[str, str]] = []

    def fail(file: str, error: ValueError) -> None:
        failed.append({"file": printable(file), "error": one_line(error, file)})
        print_error(failed[-1]["error"])

    file = arguments.reference
    try:
        with collected_warnings() as notes:
            reference = in_order(form.read(file, complete=True))
        if file := getattr(arguments, "frames", None):
            arguments.missing, frames = "fail", read_stamps(file)
        else:
            frames = None
    except ValueError as error:
        fail(file, error)
        if arguments.json:
            show_json(scored, failed, [], arguments)
        return 1
    names = unique_names(arguments.estimates)
    for number, (name, file) in enumerate(zip(names, arguments.estimates, strict=True), 1):
        show_progress(f"{number}/{len(names)} {name}" if len(names) > 1 else "")
        try:
            scored.append(score(reference, name, file, arguments, frames))
        except ValueError as error:
            fail(file, error)
    show_progress("")
    scored = in_rank_order(scored)
    notes += units_notes(scored, reference, form)
    notes += metre_notes(arguments.metrics, form)
    for path, unsaved in save(scored, reference, arguments) if scored else ():
        fail(str(path), unsaved)
    if arguments.json:  # printed last: whoever reads it may close the pipe, which ends the program
        show_json(scored, failed, notes, arguments)
    elif scored:
        show_table(scored, notes, arguments)
    if scored and arguments.plot:
        show_plot(scored, arguments)
    return int(bool(failed))


def check_stdin_read_once(arguments: argparse.Namespace) -> None:
    """Refuse to take what stands on stdin for two files."""
    files = [arguments.reference, *arguments.estimates, getattr(arguments, "frames", None)]
    if files.count(STDIN) > 1:
        raise ValueError("stdin (-) can be one file only")


def check_outputs_possible(arguments: argparse.Namespace) -> None:
    """Refuse outputs for which something is missing on this machine."""
    if arguments.save_results:
        require("evo", "evo")
    if arguments.save_plot:
        require("matplotlib", "plots")
    if arguments.plot:
        backend = require("matplotlib.pyplot", "plots").get_backend()
        registry = require("matplotlib.backends.registry", "plots")
        if backend in registry.backend_registry.list_builtin(
            registry.BackendFilter.NON_INTERACTIVE
        ):
            raise ValueError(f"--plot has no display to show anything on ({backend}); --save_plot")


def one_line(error: Exception, file: str = "") -> str:
    """Return the message of an error in one line, with the file unless it names the file itself."""
    message = f"{file}: {error}" if file and not isinstance(error, FileError) else str(error)
    return printable(" ".join(message.split()))
