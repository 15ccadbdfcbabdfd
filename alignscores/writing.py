"""Files that are written as a whole or not at all."""

import secrets
import shutil
from pathlib import Path

__all__ = ["write_whole"]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it: nobody ever sees half of one.

    Its folder is created. It keeps its mode; a link is replaced by a file, and what it points to
    stays as it is. A ValueError says why it cannot be written.
    """
    temporary = path.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        if path.exists() and not path.is_file():
            raise ValueError("cannot be written (it is a folder, a pipe or a device, not a file)")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            temporary.write_bytes(content)
            if path.exists():
                shutil.copymode(path, temporary)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise ValueError(f"cannot be written ({error.strerror})") from None
