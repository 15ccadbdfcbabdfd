"""The command ``alignscores``: its subcommands, and what holds for all of them."""

import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from ..extras import require
from ..io import FAILURES
from ..streams import discard_output
from . import score
from .metrics import listing
from .output import one_line, print_error

__all__ = ["run_command"]


def run_command(arguments: Sequence[str]) -> int:
    """Run the command line; see `alignscores.cli.main`."""
    for name in ("stdout", "stderr"):  # None where the shell has closed them, as for daemons
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 - until the end
    if isinstance(sys.stdout, io.TextIOWrapper):  # names may hold what it cannot encode
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        try:
            match list(arguments):
                case ["compare", *others]:
                    for package in ("pandas", "joblib"):
                        require(package, "compare")
                    from . import compare

                    return compare.run(others)
                case ["metrics", *_]:
                    print(listing())
                    return 0
                case _:
                    return score.run(arguments)
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
