"""Figures on disk: whole or not at all, and the same bytes for the same data."""

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from experiments.tables import write_files

from . import style

__all__ = ["write_figure"]


@style.applied()
def write_figure(figure: Figure, path: Path, title: str) -> list[Path]:
    """Write a figure as PDF and PNG.

    Both are drawn before the first is written, and there are no dates in them.

    Parameters
    ----------
    figure : Figure
        The figure.
    path : Path
        The files' path without extension; missing directories are made.
    title : str
        Title in the files' metadata.

    Returns
    -------
    list of Path
        The two files.
    """
    formats = {
        ".pdf": {"Title": title, "CreationDate": None},
        ".png": {"Title": title, "Software": None},
    }
    files: dict[Path, bytes] = {}
    for extension, metadata in formats.items():
        buffer = BytesIO()
        figure.savefig(buffer, format=extension.removeprefix("."), metadata=metadata)
        files[path.with_name(path.name + extension)] = buffer.getvalue()

    write_files(files)
    return list(files)
