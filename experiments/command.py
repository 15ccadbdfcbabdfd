"""What all command lines of the study share: overrides, and one line for what goes wrong."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Sequence

__all__ = ["CommandError", "run_command"]

INTERRUPTED = 130  # exit code by custom: 128 + SIGINT


class CommandError(ValueError):
    """What ends a command with one line and this exit code, and no traceback."""

    exit_code = 1


def run_command(
    parser: ArgumentParser,
    work: Callable[[Namespace], Iterable[object]],
    arguments: Sequence[str] | None,
) -> int:
    """Do the work of a command line and print what it returns, a line each.

    Parameters
    ----------
    parser : ArgumentParser
        Of a program ``python -m MODULE``. Settings, as `overrides`, may follow its own arguments.
    work : callable
        Takes the parsed options and returns what to print, the files that it has written.
    arguments : sequence of str, optional
        By default those of the process.

    Returns
    -------
    int
        The exit code, 0. Where the work ends in a `CommandError`, that of the error; in an
        `OSError`, 1; where it is interrupted, 130. Each is told in one line on standard error.
    """
    parser.add_argument("overrides", nargs="*", default=[], metavar="key=value")
    options = parser.parse_intermixed_args(arguments)
    try:
        print(*work(options), sep="\n")
        return 0
    except CommandError as error:
        code, problem = error.exit_code, str(error)
    except OSError as error:
        code, problem = 1, f"cannot write {error.filename}: {error.strerror}"
    except KeyboardInterrupt:
        code, problem = INTERRUPTED, "interrupted"
    print(f"{parser.prog.removeprefix('python -m ')}: {problem}", file=sys.stderr)
    return code
