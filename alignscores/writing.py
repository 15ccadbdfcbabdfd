"""Files that are written as a whole or not at all."""

import errno
import os
import secrets
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

__all__ = ["check_target", "write_files", "write_whole"]

EXCLUSIVELY = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)


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
    modes: dict[Path, int | None] = {}
    created: dict[Path, Path] = {}
    try:
        for path in files:
            modes[path] = check_target(path)
        try:
            for path, content in files.items():
                temporary = path.with_name(f".{secrets.token_hex(8)}.tmp")  # nobody foresees it
                with _new_file(temporary, modes[path]) as file:
                    created[path] = temporary
                    file.write(content)
            for path, temporary in created.items():
                temporary.replace(path)
        finally:
            for temporary in created.values():
                temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None


def check_target(path: Path) -> int | None:
    """Return the mode of the file that would be replaced, None where there is none, or a link.

    Raise an `OSError` for a folder, a pipe, a device or a name that is too long.
    """
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
        raise OSError(errno.EINVAL, "it is a pipe or a device, not a file", str(path))
    return stat.S_IMODE(mode) if stat.S_ISREG(mode) else None


def _new_file(path: Path, mode: int | None) -> BinaryIO:
    """Create a file with some mode, by default the usual one; what is there is not opened."""
    file = os.fdopen(os.open(path, EXCLUSIVELY, 0o666 if mode is None else 0o600), "wb")
    if mode is not None:
        path.chmod(mode)
    return file
