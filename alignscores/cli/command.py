"""The command ``alignscores``: from arguments to what is printed and saved."""

import argparse
import io
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import NoReturn

from ..evaluation.evaluation import Evaluation
from ..evaluation.matching import read_reference
from ..evaluation.notes import collected_warnings, why
from ..evaluation.ranking import in_rank_order, ranking_notes
from ..evaluation.scoring import notes_of_all, score
from ..evaluation.settings import options
from ..similarity import UP
from ..streams import discard_output, replace_closed_errors
from ..texts import printable, unique_names
from ..trajectories.extras import require
from ..trajectories.files import FAILURES, STDIN, FileError, read_stamps
from ..trajectories.formats import FORMATS, Format
from ..trajectories.recognition import recognise
from ..version import __version__
from . import compare
from .inputs import check_stdin_read_once, refuse_to_replace
from .metrics import add_metrics, alias_notes, metre_notes
from .options import add_settings, output_file, settings_of
from .output import print_error, print_note, show_json, show_progress, show_table
from .saving import save, show_plot, targets

__all__ = ["run_command"]

EPILOG = f"""\
examples:
{chr(10).join(f"  alignscores {name} {form.example}" for name, form in FORMATS.items())}

`alignscores REF EST` recognises the format and says which it took.
Every score is from 0 to 1, the larger the better. `alignscores FORMAT --help` tells the options.
exit codes: 0 scored, 1 something could not be scored, 2 wrong usage
"""
GONE = {  # options of 1.x, and what to do instead
    "--clear_cache": "delete the folder of --cache",
    "--no_cache": "nothing is stored without --cache FOLDER",
}
PICTURES = ".png", ".pdf", ".svg"
SAVED = ("save_errors", "save_metrics", "profile", "save_plot", "save_page")  # one file each
SAVED_EACH = ("save_aligned", "save_results")  # one file an estimate


def run_command(argv: Sequence[str] | None) -> int:
    """Run the command line; see `alignscores.cli.main`."""
    replace_closed_errors()
    if sys.stdout is None:
        print_error("standard output is closed, and nothing could be printed; give > /dev/null")
        return 1
    parser = build_parser()
    if isinstance(sys.stdout, io.TextIOWrapper):  # names may hold what it cannot encode
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        try:
            return _run(parser, argv)
        finally:  # of help, too, which ends in the parser
            sys.stdout.flush()
    except BrokenPipeError:  # the reader has closed the pipe, as `| head` does
        discard_output()
        return 1
    except (ModuleNotFoundError, *FAILURES) as error:
        print_error(one_line(error))
        try:
            sys.stdout.flush()
        except OSError:  # as on a full disk
            discard_output()
        return 1


def _run(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    arguments, unknown = parser.parse_known_args(with_format(with_signed_axes(argv)))
    if unknown:  # by the format's parser, not that of the whole
        hints = [GONE[name] for name in unknown if name in GONE]
        arguments.command.error("; ".join([f"unrecognized arguments: {' '.join(unknown)}", *hints]))
    return int(arguments.run(arguments))


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        """End with the message, and where to find the usage."""
        self.exit(2, f"{self.prog}: error: {printable(message)}; see {self.prog} --help\n")


def with_signed_axes(argv: Sequence[str] | None) -> list[str]:
    """Return the arguments with ``--up -y`` as one, since -y alone would be taken for an option."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    for index in range(len(arguments) - 2, -1, -1):
        if arguments[index] == "--up" and arguments[index + 1] in UP:
            arguments[index : index + 2] = [f"--up={arguments[index + 1]}"]
    return arguments


def with_format(arguments: list[str]) -> list[str]:
    """Return the arguments with the format of the files before them, where it is not named."""
    files = list(takewhile(lambda argument: argument == STDIN or argument[:1] != "-", arguments))
    if (
        len(files) < 2
        or files[0] in (*FORMATS, "compare")
        or not (Path(files[0]).exists() or Path(files[0]).suffix)
    ):
        return arguments
    found, *others = dict.fromkeys(map(recognise, files[:2]))
    for file in files[2:]:
        if recognise(file) != (form := recognise(files[1])):
            raise FileError(file, f"is not in the format of {files[1]}, {form}; score it apart")
    kinds = [(FORMATS[name].timed, FORMATS[name].missing) for name in (found, *others)]
    if len(set(kinds)) > 1:
        raise ValueError(
            f"{files[0]} is in the format {found}, {files[1]} in {others[0]}: no match"
        )
    print_note(f"taken for the format {found}{f'; {files[1]} for {others[0]}' if others else ''}")
    return [found, *arguments, *(f"--est_format={other}" for other in others)]


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line: one subcommand a format, and ``compare``."""
    parser = Parser(
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
        command.set_defaults(command=command, run=run)
        command.add_argument("reference", metavar="REF", help="the reference (ground truth)")
        command.add_argument("estimates", metavar="EST", nargs="+", help="an estimate; - is stdin")
        _add_settings(command, form)
        _add_output(command, form)
    compare.add_parser(formats)
    return parser


def _add_settings(command: argparse.ArgumentParser, form: Format) -> None:
    """Add the settings that the format has."""
    alike = [
        name
        for name, other in FORMATS.items()
        if (other.timed, other.missing) == (form.timed, form.missing)
    ]
    left_out = ["format", "metrics"]
    left_out += [] if len(alike) > 1 else ["est_format"]
    left_out += [] if form.missing else ["missing"]
    left_out += [
        name
        for name, option in options().items()
        if (option.timed and not form.timed) or (option.topics and not form.topics)
    ]
    add_settings(command, left_out=left_out, choices={"est_format": alike})


def _add_output(command: argparse.ArgumentParser, form: Format) -> None:
    """Add what is printed, shown and saved."""
    command.set_defaults(save_aligned=None, metrics_as_given=())
    output = command.add_argument_group("output")

    def add_file(name: str, *suffixes: str, help: str) -> None:
        metavar = f"FILE{suffixes[0]}" if len(suffixes) == 1 else "FILE"
        output.add_argument(f"--{name}", metavar=metavar, type=output_file(*suffixes), help=help)

    add_metrics(output, "show these instead", form)
    output.add_argument("--json", action="store_true", help="print JSON instead of a table")
    add_file("save_errors", ".csv", help="save the errors of each scored camera")
    output.add_argument(
        "--all_cameras",
        action="store_true",
        help="save there those without an error, too: left out, or without a reference pose",
    )
    add_file(
        "save_metrics",
        ".csv",
        help="save the --metrics, a line an estimate; without --metrics, those of this package",
    )
    add_file(
        "profile",
        ".csv",
        help="save TAS and RAS of all estimates over all units of their thresholds; as for the "
        "half-score distance, the TAS is of the refined registration",
    )
    if form.aligned:
        add_file(
            "save_aligned",
            ".txt",
            help=f"save the estimate in the reference's world, in {form.aligned} format, aligned "
            "as in the TAS; of several estimates each gets FILE_<name>.txt",
        )
    add_file(
        "save_results",
        ".zip",
        help="save for evo_res; of several estimates each gets FILE_<name>.zip",
    )
    output.add_argument(
        "--plot", action="store_true", help="show histograms, trajectories and score profiles"
    )
    add_file(
        "save_plot",
        *PICTURES,
        help="save them as FILE (.png, .pdf or .svg); more than 4 estimates share axes",
    )
    add_file(
        "save_page",
        ".html",
        help="save one page, which needs no network: trajectories to turn, errors, and sliders for "
        "thresholds, weight and missing cameras",
    )


def run(arguments: argparse.Namespace) -> int:
    """Score all estimates, save and print; one that cannot be scored does not stop the others."""
    settings, names = settings_of(arguments), unique_names(arguments.estimates)
    inputs = [arguments.reference, *arguments.estimates]
    inputs += [str(settings.frames)] if settings.frames is not None else []
    check_stdin_read_once(inputs)
    refuse_to_replace(inputs, _outputs(arguments, names))
    check_outputs_possible(arguments)
    scored: list[Evaluation] = []
    failed: list[dict[str, str]] = []
    notes: list[str] = []

    def fail(file: str, error: Exception) -> None:
        failed.append({"file": printable(file), "error": one_line(error, file)})
        print_error(failed[-1]["error"])

    file, with_stamps = arguments.reference, settings
    try:
        with collected_warnings() as notes:
            reference = read_reference(file, settings)
        if settings.frames is not None:  # once for all estimates
            file = arguments.frames
            with_stamps = replace(settings, frames=read_stamps(file))
    except FAILURES as error:
        fail(file, error)
        if arguments.json:
            show_json(settings, arguments.reference, [], failed, notes)
        return 1
    for number, (name, file) in enumerate(zip(names, arguments.estimates, strict=True), 1):
        show_progress(f"{number}/{len(names)} {name} " if len(names) > 1 else "")
        try:
            scored.append(score(reference, file, with_stamps, name=name))
        except FAILURES as error:
            fail(file, error)
    show_progress("")
    scored = in_rank_order(scored)
    notes += [
        *notes_of_all(scored),
        *ranking_notes(scored),
        *metre_notes(settings),
        *alias_notes(arguments.metrics_as_given),
    ]
    for path, unsaved in save(scored, arguments) if scored else ():
        fail(str(path), unsaved)
    if arguments.json:  # printed last: whoever reads it may close the pipe, which ends the program
        show_json(settings, arguments.reference, scored, failed, notes)
    elif scored:
        show_table(scored, notes)
    if scored and arguments.plot:
        show_plot(scored)
    return int(bool(failed))


def _outputs(arguments: argparse.Namespace, names: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """Yield all files that will be written, with their options."""
    for option in SAVED:
        if path := getattr(arguments, option):
            yield f"--{option}", path
    for option in SAVED_EACH:
        if path := getattr(arguments, option):
            yield from ((f"--{option}", target) for target, _ in targets(path, names).values())


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
    message = why(error)
    return printable(f"{file}: {message}" if file and not isinstance(error, FileError) else message)
