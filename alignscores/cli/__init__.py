"""The command ``alignscores``: score trajectory files, ``alignscores FORMAT REF EST [EST ...]``."""

import os
import sys
from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return 0 if all was scored, 1 if something could not be.

    Wrong usage ends in ``SystemExit(2)``.
    """
    # Before NumPy is imported, here and in workers; threads do not pay in small products.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from .command import run_command  # imports NumPy

    return run_command(sys.argv[1:] if argv is None else argv)
