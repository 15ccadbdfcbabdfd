"""Files of YAML, of at most 1 MB. It needs PyYAML: import it where a file is read."""

from os import PathLike
from pathlib import Path
from typing import Any

import yaml

__all__ = ["load_yaml"]

MAX_BYTES = 10**6


def load_yaml(path: str | PathLike[str]) -> Any:
    """Return the content of a file, or raise ValueError with the reason in one line."""
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise ValueError(f"it has more than {MAX_BYTES // 10**6} MB")
        return yaml.safe_load(data)
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise ValueError(f"cannot be read: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise ValueError("cannot be read: it is nested too deeply") from None
