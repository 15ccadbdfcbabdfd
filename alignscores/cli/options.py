"""Options of the command: those of `Settings` are made from its fields."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..evaluation.settings import Option, Settings, options

__all__ = ["add_settings", "number_type", "output_file", "settings_of"]


def add_settings(
    parser: argparse.ArgumentParser,
    *,
    left_out: Sequence[str] = (),
    helps: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Add an option for each setting, in their groups, but for those that are left out.

    `helps` and `choices` are those of this parser, where they differ.
    """
    groups: dict[str, Any] = {}
    for name, option in options().items():
        if name in left_out:
            continue
        if option.group not in groups:
            groups[option.group] = parser.add_argument_group(option.group)
        default = getattr(Settings, name)
        help = (helps or {}).get(name, option.help)
        if default is not None and default is not False:
            help += " (default: %(default)s)"
        if default is False:
            kind: dict[str, Any] = {"action": "store_true"}
        elif option.choices:
            kind = {"choices": (choices or {}).get(name, option.choices)}
        elif option.number:
            kind = {"type": number_type(option), "metavar": "X"}
        else:
            kind = {"metavar": "TOPIC" if option.topics else "FILE"}
        groups[option.group].add_argument(f"--{name}", default=default, help=help, **kind)


def settings_of(arguments: argparse.Namespace) -> Settings:
    """Return the settings that were given."""
    given = vars(arguments)
    return Settings(**{name: given[name] for name in options() if name in given})


def number_type(option: Option) -> Callable[[str], float | str]:
    """Return a type of argument that refuses numbers which the option may not have."""

    def number(text: str) -> float | str:
        try:
            return option.parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return number


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
