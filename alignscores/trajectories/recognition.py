"""Which format a file has, by its name and its first lines."""

from pathlib import Path

from .files import STDIN, FileError, FilePath
from .files.matrices import files_of_matrices
from .files.tables import open_table
from .files.text import numbered_lines
from .formats import FORMATS

__all__ = ["recognise", "recognise_pair"]

SUFFIXES = {".bag": "bag", ".mcap": "bag", ".db3": "bag", ".npy": "arrays", ".npz": "arrays"}
NAME_IT = "name the format: alignscores FORMAT REF EST"


def recognise_pair(reference: FilePath, estimate: FilePath) -> tuple[str, str]:
    """Return the formats of a reference and of an estimate, which must be matched alike."""
    names = recognise(reference), recognise(estimate)
    kinds = {(FORMATS[name].timed, FORMATS[name].missing) for name in names}
    if len(kinds) > 1:
        raise ValueError(
            f"{reference} is in the format {names[0]}, {estimate} in {names[1]}: no match"
        )
    return names


def recognise(path: FilePath) -> str:
    """Return the format of a file or a folder; the error says why none can be told."""
    if path == STDIN:
        raise FileError(path, f"nothing tells the format of what stands on stdin; {NAME_IT}")
    file = Path(path)
    if file.is_dir():
        if (file / "metadata.yaml").is_file():
            return "bag"
        if list(file.glob("images.*")) + list(file.glob("*/images.*")):
            return "colmap"
        if files_of_matrices(file):
            return "matrices"
        reason = f"is a folder with no COLMAP model, bag or matrices in .txt files; {NAME_IT}"
        raise FileError(path, reason)
    if file.suffix in SUFFIXES:
        return SUFFIXES[file.suffix]
    return _format_of_text(path)


def _format_of_text(path: FilePath) -> str:
    first = next((line.lstrip() for _, line in numbered_lines(path) if line.strip()), "")
    if first[:1] in ("{", "["):
        return "nerf"
    columns = open_table(path).columns(w_first=True)
    if "r11" in columns and "n" not in columns:
        return "kitti"
    w_first = "qw" in columns and columns.index("qw") < columns.index("qx")
    return "euroc" if w_first else "tum"
