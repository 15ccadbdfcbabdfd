"""Which format a file has, by its name and its first lines."""

from pathlib import Path

from .files import FileError, FilePath
from .files.columns import name_columns
from .files.matrices import files_of_matrices
from .files.rows import open_table
from .files.text import read_text
from .formats import FORMATS

__all__ = ["recognise"]

NAME_IT = "name the format: alignscores FORMAT REF EST"


def recognise(path: FilePath, columns: str | None = None) -> str:
    """Return the format of a file or a folder; the error says why none is recognised.

    `columns` names the columns of a text table.
    """
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
    of_suffix = (name for name, form in FORMATS.items() if file.suffix in form.suffixes)
    return next(of_suffix, None) or _format_of_text(path, columns)


def _format_of_text(path: FilePath, named: str | None) -> str:
    if read_text(path).lstrip().startswith(("{", "[")):
        return "nerf"
    columns = name_columns(open_table(path), named, w_first=True)
    if "r11" in columns and not any(name[0] in "nt" for name in columns):
        return "kitti"
    w_first = "qw" in columns and columns.index("qw") < columns.index("qx")
    return "euroc" if w_first else "tum"
