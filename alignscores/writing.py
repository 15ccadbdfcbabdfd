"""Files that are written as a whole or not at all."""

import errno
import os
import secrets
import shutil
import stat
from collections.abc import Mapping
from pathlib import Path

__all__ = ["write_files", "write_whole"]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file as `write_files` does; a ValueError says why it cannot be written."""
    try:
        write_files({path: content})
    except OSError as error:
        raise ValueError(f"cannot be written ({error.strerror})") from None


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write files under temporary names, then rename them: nobody ever sees half of one.

    A file keeps its mode. A link is replaced by a file, and what it points to stays as it is. An
    `OSError` has the name of the file that cannot be written, not of the temporary one.
    """
    temporary = {path: path.with_name(f".{secrets.token_hex(8)}.tmp") for path in files}
    try:
        for path in files:
            _check_target(path)
        try:
            for path, content in files.items():
                with temporary[path].open("xb") as file:
                    if path.is_file() and not path.is_symlink():
                        shutil.copymode(path, temporary[path])
                    file.write(content)
            for path in files:
                temporary[path].replace(path)
        finally:
            for one in temporary.values():
                one.unlink(missing_ok=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def _check_target(path: Path) -> None:
    """Raise an `OSError` for a folder, a pipe or a device; a link is replaced."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
        raise OSError(errno.EINVAL, "it is a pipe or a device, not a file", str(path))
