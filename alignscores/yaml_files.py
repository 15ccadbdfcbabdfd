"""Files of YAML, of at most 1 MB. It needs PyYAML: import it where a file is read."""

from os import PathLike
from typing import Any

import yaml

from .files import FileError, read_bytes

__all__ = ["load_yaml"]

MAX_BYTES = 10**6


def load_yaml(path: str | PathLike[str]) -> Any:
    """Return the content of a file, or raise ValueError with the reason in one line."""
    try:
        return yaml.safe_load(read_bytes(path, MAX_BYTES))
    except FileError as error:
        raise ValueError(error.reason) from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise ValueError(f"cannot be read: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise ValueError("cannot be read: it is nested too deeply") from None
    except (AttributeError, LookupError, TypeError):  # as of `!!bool x`
        raise ValueError("cannot be read: a value does not have the type of its tag") from None
