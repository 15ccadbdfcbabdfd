"""Figures on disk: whole or not at all, and the same bytes for the same data."""

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from experiments.tables import write_files

from . import style


@style.applied()
def write_figure(figure: Figure, path: Path, title: str) -> list[Path]:
    """Write a figure as PDF and PNG without dates, and return both paths."""
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
