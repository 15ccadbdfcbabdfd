"""Which format a file has, by its name and its first lines."""

from pathlib import Path

import numpy as np

from .files import STDIN, FileError, vslamlab
from .files.stamps import time_unit
from .files.text import data_lines, is_number

__all__ = ["recognise"]

SUFFIXES = {".bag": "bag", ".mcap": "bag", ".db3": "bag", ".npy": "arrays", ".npz": "arrays"}
NAME_IT = "name the format: alignscores FORMAT REF EST"


def recognise(path: str) -> str:
    """Return the format of a file or a folder; the error says why none can be told."""
    if path == STDIN:
        raise FileError(path, f"nothing tells the format of what stands on stdin; {NAME_IT}")
    file = Path(path)
    if file.is_dir():
        if (file / "metadata.yaml").is_file():
            return "bag"
        if list(file.glob("images.*")) + list(file.glob("*/images.*")):
            return "colmap"
        raise FileError(path, f"is a folder with neither a COLMAP model nor a bag; {NAME_IT}")
    if file.suffix in SUFFIXES:
        return SUFFIXES[file.suffix]
    return _format_of_text(path)


def _format_of_text(path: str) -> str:
    lines = data_lines(path)
    number, line = next(lines, (0, ""))
    if not line:
        raise FileError(path, f"has no lines that tell its format; {NAME_IT}")
    if line[0] in "{[":
        return "nerf"
    if line.replace('"', "") == vslamlab.HEADER:
        return "vslamlab"
    fields = line.replace(",", " ").split()
    if not all(map(is_number, fields)) or len(fields) not in (8, 12, 16, 17):
        reason = f"has {len(fields)} columns, by which no format can be told; {NAME_IT}"
        raise FileError(path, reason, place=f"line {number}")
    if "," in line:
        return "euroc"
    if len(fields) != 8:
        return "kitti"
    first = (line.split()[0] for line in (line, *(other for _, other in lines)))
    stamps = np.array([float(stamp) for stamp in first if is_number(stamp, finite=True)])
    return "euroc" if len(stamps) and time_unit(stamps) == "nanoseconds" else "tum"
