"""Errors of the study's commands: one line without a traceback."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from pydantic import ValidationError

from alignscores.streams import discard_output
from alignscores.texts import brief, printable

__all__ = ["INTERRUPTED", "CommandError", "ConfigError", "problems", "run_command"]
__all__ += ["run_in_one_line"]

INTERRUPTED = 130  # exit code by custom: 128 + SIGINT


class CommandError(ValueError):
    """Ends a command with one line and this exit code, and no traceback."""

    exit_code = 1


class ConfigError(CommandError):
    """A setting that is missing, mistyped or impossible."""

    exit_code = 2


def problems(error: ValidationError) -> list[tuple[str, str]]:
    """Return the keys that a validation failed at, and what is wrong with their values."""
    errors: list[Any] = error.errors(include_url=False)
    return [_problem(details) for details in errors]


def _problem(details: Mapping[str, Any]) -> tuple[str, str]:
    location, wrong = list(details["loc"]), _wrong(details)
    if location[-1:] == ["[key]"]:  # so pydantic marks a key that is at fault itself
        *location, key, _ = location
        wrong = f"has the key {brief(key)}, which {wrong}"
    return ".".join(map(str, location)), wrong


def _wrong(details: Mapping[str, Any]) -> str:
    match details["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden" | "unexpected_keyword_argument":
            return "is unknown"
        case "dict_type" | "model_type" | "dataclass_type":
            return f"needs key: value, not {brief(details['input'])}"
        case "too_short":
            minimum = details["ctx"]["min_length"]
            return f"needs {minimum} or more entries, not {brief(details['input'])}"
        case "value_error":  # raised by our own checks, which name the value
            return str(details["ctx"]["error"])
    return f"{details['msg'].removeprefix('Input ')}, not {brief(details['input'])}"


def run_command(
    parser: ArgumentParser,
    work: Callable[[Namespace], Iterable[object]],
    arguments: Sequence[str] | None,
) -> int:
    """Do the work of a command line, print a line for each result, and return the exit code."""
    options = parser.parse_intermixed_args(arguments)
    return run_in_one_line(parser.prog.removeprefix("python -m "), lambda: work(options))


def run_in_one_line(program: str, work: Callable[[], Iterable[object]]) -> int:
    """Do some work, print a line for each result, and return the exit code.

    An error is one line on standard error: a `CommandError` ends with its exit code, an `OSError`,
    too little memory and a process that ended with 1, an interruption with 130.
    """
    try:
        results = list(work())
        try:
            print(*(printable(str(result)) for result in results), sep="\n", flush=True)
        except BrokenPipeError:  # the reader has closed the pipe, as `| head` does
            discard_output()
            return 1
        except OSError:
            discard_output()
            raise
        return 0
    except CommandError as error:
        code, problem = error.exit_code, str(error)
    except BlockingIOError as error:  # of the limit of processes
        code, problem = 1, f"no further process can be started ({error.strerror}); set n_jobs=1"
    except OSError as error:
        code, problem = 1, str(error)
        if error.filename:
            problem = f"cannot write {error.filename}: {error.strerror}"
    except BrokenProcessPool:  # by the system where memory is short, or by hand
        code, problem = 1, "a process ended before its work was done; set n_jobs=1, or free memory"
    except MemoryError:
        code, problem = 1, "not enough memory; set n_jobs=1, or fewer cameras"
    except KeyboardInterrupt:
        code, problem = INTERRUPTED, "interrupted"
    print(f"{program}: {printable(problem)}", file=sys.stderr)
    return code
