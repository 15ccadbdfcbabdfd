"""Files that are written as a whole or not at all."""

import os
from pathlib import Path

__all__ = ["write_whole"]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it: nobody ever sees half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:  # named after the file, not after the temporary one
        raise ValueError(f"cannot be written ({error.strerror})") from None
    finally:
        temporary.unlink(missing_ok=True)
