"""Standard streams that are closed, full, or a pipe that nobody reads from."""

import os
import sys
from pathlib import Path

__all__ = ["discard_output", "replace_closed_errors"]


def replace_closed_errors() -> None:
    """Let what goes to a closed standard error go nowhere, and no file take its place."""
    if sys.stderr is None:
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 - as long as the process


def discard_output() -> None:
    """Let nobody have what is printed, nor what waits to be: at the end Python would try again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
