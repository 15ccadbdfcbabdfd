"""The command ``alignscores``: score trajectory files, ``alignscores FORMAT REF EST [EST ...]``."""

import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return 0 if all was scored, 1 if something could not be.

    Wrong usage ends in ``SystemExit(2)``.
    """
    # Before NumPy is imported, here and in workers; threads do not pay in small products.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from ..extras import require
    from ..io import FAILURES
    from ..streams import discard_output
    from . import score
    from .metrics import listing
    from .output import one_line, print_error

    for name in ("stdout", "stderr"):  # None where the shell has closed them, as for daemons
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 - until the end
    if isinstance(sys.stdout, io.TextIOWrapper):  # names may hold what it cannot encode
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        try:
            match list(sys.argv[1:] if argv is None else argv):
                case ["compare", *others]:
                    for package in ("pandas", "joblib"):
                        require(package, "compare")
                    from . import compare

                    return compare.run(others)
                case ["metrics", *_]:
                    print(listing())
                    return 0
                case arguments:
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
