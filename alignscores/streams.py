"""Standard output that is full, or a pipe that nobody reads from."""

import os
import sys

__all__ = ["discard_output"]


def discard_output() -> None:
    """Discard all output, also what is buffered: at its end Python would try to write it again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
