"""Files of YAML, of at most 1 MB. It needs PyYAML: import it where a file is read."""

from os import PathLike
from pathlib import Path
from typing import Any

import yaml

__all__ = ["load_yaml", "parse_yaml"]

MAX_BYTES = 10**6


def load_yaml(path: str | PathLike[str]) -> Any:
    """Return the content of a file.

    Raises
    ------
    ValueError
        Why it cannot be read, in one line, without the name of the file.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ValueError(error.strerror) from None
    if len(data) > MAX_BYTES:
        raise ValueError(f"it has more than {MAX_BYTES // 10**6} MB")
    return parse_yaml(data)


def parse_yaml(text: str | bytes) -> Any:
    """Return the content of a text; ValueError as of `load_yaml`."""
    try:
        return yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}: " if mark else ""
        raise ValueError(f"{place}{error.problem or error.context}") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise ValueError(" ".join(str(error).split())) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
