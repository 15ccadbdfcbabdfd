"""Results of runs in a folder: one JSON each, named by what it was computed from."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..evaluation.reading import files_below
from ..io.files import FileError, open_file
from ..version import __version__

__all__ = ["file_of"]

MAX_BYTES = 10**13  # of a bag


def file_of(folder: Path, settings: Mapping[str, Any], paths: Iterable[str]) -> Path:
    """Return the file of a result: the hash of settings, version and content names it."""
    described = __version__, sorted(settings.items()), [_content_hash(path) for path in paths]
    return folder / f"{hashlib.sha256(json.dumps(described).encode()).hexdigest()}.json"


def _content_hash(path: str) -> str:
    """Return the hash of a file, or of the files in a folder."""
    digest = hashlib.sha256()
    for file in files_below(path):
        name = file.suffix if file == Path(path) else file.relative_to(path).as_posix()
        digest.update(f"{name}\0".encode())
        try:
            with open_file(file, MAX_BYTES) as opened:
                digest.update(hashlib.file_digest(opened, "sha256").digest())
        except (FileError, OSError):  # whoever reads it says why
            pass
    return digest.hexdigest()
