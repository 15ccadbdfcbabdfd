"""Standard streams that are closed, full, or a pipe that nobody reads from."""

import os
import sys
from pathlib import Path

__all__ = ["discard_output", "replace_closed_errors"]


def replace_closed_errors() -> None:
    """Discard what is written to a closed standard error; no other file may take its number."""
    if sys.stderr is None:
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 - as long as the process


def discard_output() -> None:
    """Discard all output, also what is buffered: at its end Python would try to write it again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
