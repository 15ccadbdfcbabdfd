"""What the parsers of the command share: a short and a full help, errors in one line, hints."""

import argparse
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any, NoReturn

from ..evaluation.settings import ABOUT, Settings
from ..texts import printable

__all__ = ["Parser", "output_file"]

ELSEWHERE = {  # options of evo, and what to use here
    **dict.fromkeys(["-a", "--align"], "it is --alignment rigid here"),
    **dict.fromkeys(["-s", "--correct_scale", "-as"], "it is --alignment similarity, the default"),
    "-va": "it is -v --alignment rigid here",
    "-vas": "it is -v here, since --alignment similarity is the default",
    "-p": "it is --plot here",
    **dict.fromkeys(
        ["-r", "--pose_relation"],
        "positions and rotations are always scored; evo's errors are --metrics ate:rmse,rpe@1m,are",
    ),
    **dict.fromkeys(
        ["-d", "--delta", "-u", "--delta_unit"],
        "evo's RPE is a metric here, such as --metrics rpe@1m or rpe@10f",
    ),
    **dict.fromkeys(
        ["--align_origin", "--n_to_align"],
        "all poses are aligned; --alignment none compares them as they are",
    ),
    "--project_to_plane": "all three dimensions count; --alignment yaw keeps the vertical axis",
    "--ref": "the reference is the first file here",
    "--save_table": "evo_res writes tables of --save_results; --save_csv FILE.csv is ours",
}
METAVARS = {
    **{"frames": "FILE", "ref_topic": "TOPIC", "est_topic": "TOPIC", "rig_frames": "REGEX"},
    **dict.fromkeys(["columns", "ref_columns", "est_columns", "metrics"], "NAMES"),
}


class Parser(argparse.ArgumentParser):
    """A parser that shows its everyday options with ``--help`` and all with ``--help-all``."""

    def __init__(self, everyday: Collection[str], **kwargs: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **kwargs)
        self.shown = {"help", "help_all", "files", *everyday}
        self.add_argument("--help-all", action="help", help="show all options and exit")
        self.groups: dict[str, Any] = {}

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
            kind: dict[str, Any] = {
                "metavar": about.get("numbers", "X" if "number" in about else "TEXT")
            }
            if default is False:
                kind = {"action": "store_true"}
            elif "choices" in about:  # checked by `Settings`, like all values
                kind = {"metavar": f"{{{','.join(about['choices'])}}}"}
            elif name in METAVARS:
                kind = {"metavar": METAVARS[name]}
            help = f"{about['help']} (default: %(default)s)" if default else about["help"]
            if about["group"] not in self.groups:
                self.groups[about["group"]] = self.add_argument_group(about["group"])
            add = self.groups[about["group"]].add_argument
            add(f"--{name}", default=default, help=help, **kind)

    def parse(self, arguments: Sequence[str]) -> argparse.Namespace:
        """Return the arguments; options of other programs end in a hint."""
        if "--help-all" in arguments:
            self.shown = {action.dest for action in self._actions}
        for argument in arguments:
            if hint := ELSEWHERE.get(argument.partition("=")[0]):
                self.error(f"{argument}: {hint}")
        return self.parse_intermixed_args(arguments)

    def settings(self, arguments: argparse.Namespace) -> Settings:
        """Return the settings that were given."""
        values = vars(arguments)
        try:
            return Settings(**{name: values[name] for name in ABOUT if name in values})
        except ValueError as error:
            self.error(str(error))

    def error(self, message: str) -> NoReturn:
        """End with the message, and where to find the usage."""
        self.exit(2, f"{self.prog}: error: {printable(message)}; see {self.prog} --help\n")


def output_file(*suffixes: str) -> Callable[[str], Path]:
    """Return a type of argument for files to be written, with one of these suffixes."""

    def output(value: str) -> Path:
        path = Path(value)
        if path.suffix not in suffixes:
            raise argparse.ArgumentTypeError(f"{value} does not end in {' or '.join(suffixes)}")
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"{value}: there is no folder {path.parent}")
        return path

    return output
