"""Base of the command's parsers: a short and a full help, errors in one line, hints."""

import argparse
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

from ..evaluation.settings import ABOUT, SCORING, Settings
from ..texts import printable
from .evo import ELSEWHERE, add_alignment, alignment_of, metrics_with_scale
from .output import OUTPUTS, PRINTED, STDOUT, print_note

__all__ = ["Parser"]

METAVARS = {
    **{"frames": "FILE", "ref_topic": "TOPIC", "est_topic": "TOPIC", "rig_frames": "REGEX"},
    **dict.fromkeys(["columns", "ref_columns", "est_columns", "metrics"], "NAMES"),
}


class Parser(argparse.ArgumentParser):
    """A parser that shows its everyday options with ``--help`` and all with ``--help-all``."""

    def __init__(
        self, everyday: Collection[str], foreign: Mapping[str, str], **kwargs: Any
    ) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **kwargs)
        self.shown = {"help", "help_all", "files", *everyday}
        self.add_argument("--help-all", action="help", help="show all options and exit")
        self.groups: dict[str, Any] = {}
        self.foreign = foreign  # options of the other command, and its name

    def format_help(self) -> str:
        """Return the help of the options that are shown."""
        for action in self._actions:
            if action.dest not in self.shown:
                action.help = argparse.SUPPRESS
        return super().format_help()

    def add_settings(self) -> None:
        """Add an option for each setting but the format, in its group."""
        for name, about in ABOUT.items():
            if name == "format":
                continue
            default = getattr(Settings, name)
            keywords: dict[str, Any] = {"metavar": METAVARS.get(name, about.get("numbers", "X"))}
            if default is False:
                keywords = {"action": "store_true"}
            elif "choices" in about:  # checked by `Settings`, like all values
                keywords = {"metavar": f"{{{','.join(about['choices'])}}}"}
            help = f"{about['help']} (default: %(default)s)" if default else about["help"]
            if about["group"] not in self.groups:
                self.groups[about["group"]] = self.add_argument_group(about["group"])
            add = self.groups[about["group"]].add_argument
            add(f"--{name}", default=default, help=help, **keywords)
        add_alignment(self.groups[SCORING].add_argument)

    def add_outputs(self, options: Iterable[str], folder: Iterable[str]) -> None:
        """Add what both commands print and write; `folder` are the files that ``-o`` writes."""
        add = self.groups["output"].add_argument
        add("-v", "--verbose", action="store_true", help="explain the numbers")
        add_exclusive = self.groups["output"].add_mutually_exclusive_group().add_argument
        for option, name in PRINTED.items():
            help = f"print {name} instead of the table"
            add_exclusive(f"--{option}", dest="show", action="store_const", const=option, help=help)
        self.set_defaults(show="text")
        help = f"write all of {', '.join(folder)}; existing files are replaced, inputs never"
        add("-o", "--output", metavar="FOLDER", type=Path, help=help)
        for name in options:
            suffixes = OUTPUTS[name].suffixes
            help = OUTPUTS[name].help + (f" ({', '.join(suffixes)})" if suffixes else "")
            help += "; FILE_<name> if several" if OUTPUTS[name].each else ""
            to_path = _output_file(*suffixes) if suffixes else Path
            add(f"--{name}", metavar="FILE", type=to_path, help=help)

    def parse(self, arguments: Sequence[str]) -> argparse.Namespace:
        """Return the arguments; an unknown option ends in the nearest one, or in a hint."""
        if "--help-all" in arguments:
            self.shown = {action.dest for action in self._actions}
        for argument in arguments:
            if hint := ELSEWHERE.get(argument.partition("=")[0]):
                self.error(f"{argument}: {hint}")
        values, unknown = self.parse_known_intermixed_args(_with_negative_values(arguments))
        for argument in unknown:
            option = argument.partition("=")[0]
            if option in self.foreign:
                self.error(f"{option} belongs to `{self.foreign[option]}`")
            all_options = [name for name in self._option_string_actions if name.startswith("--")]
            all_options.remove("--align")  # evo's; --alignment takes a value
            near = get_close_matches(option, [*all_options, *self.foreign], n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            self.error(f"unknown option {option}{hint}")
        if values.markdown == STDOUT and values.show != "text":
            self.error(f"--markdown - and --{values.show} both print")
        if values.markdown == STDOUT:
            values.show = "markdown"
        return values

    def settings(self, arguments: argparse.Namespace) -> Settings:
        """Return the settings that were given."""
        values = vars(arguments)
        values["alignment"] = alignment_of(arguments, Settings.alignment, self.error)
        if arguments.align:
            print_note(f"-a{'s' * arguments.correct_scale}: --alignment {values['alignment']}")
        try:
            settings = Settings(**{name: values[name] for name in ABOUT if name in values})
        except ValueError as error:
            self.error(str(error))
        if note := metrics_with_scale(settings):
            print_note(note)
        return settings

    def with_format(self, settings: Settings, name: str | None) -> Settings:
        """Return settings with the format of the files, to which all of them must apply."""
        try:
            return replace(settings, format=name)
        except ValueError as error:
            self.error(str(error))

    def error(self, message: str) -> NoReturn:
        """End with the message, and where to find the usage."""
        self.exit(2, f"{self.prog}: error: {printable(message)}; see {self.prog} --help\n")


def _with_negative_values(arguments: Sequence[str]) -> list[str]:
    """Join an option with a value such as -50ms, -1,0,2 or -y, which argparse takes for options."""
    joined: list[str] = []
    for argument in arguments:
        option = joined[-1] if joined else ""
        is_choice = argument in ABOUT.get(option.removeprefix("--"), {}).get("choices", ())
        is_value = re.match(r"-\.?\d", argument) or (is_choice and argument.startswith("-"))
        if is_value and re.fullmatch(r"--\w+", option):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def _output_file(*suffixes: str) -> Callable[[str], Path]:
    """Return a type of argument for files to be written, with one of these suffixes."""

    def output(value: str) -> Path:
        path = Path(value)
        if path.suffix not in suffixes:
            raise argparse.ArgumentTypeError(f"{value} does not end in {' or '.join(suffixes)}")
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"{value}: there is no folder {path.parent}")
        return path

    return output
