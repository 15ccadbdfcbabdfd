"""Folders with a matrix a file, as of 7-Scenes and ScanNet."""

import re
from pathlib import Path

import numpy as np

from ...arrays import Floats
from .poses import Trajectory, poses_from_matrices
from .rows import open_table
from .text import FileError, FilePath, Source

__all__ = ["files_of_matrices", "read_matrices"]


def read_matrices(path: FilePath) -> Trajectory:
    r"""Read a folder of text files, each with a camera-to-world matrix of 4 (or 3) rows.

    Parameters
    ----------
    path : path
        The folder. Files whose names end in ``.pose.txt`` are read, otherwise all ``.txt``.

    Returns
    -------
    Trajectory
        The last numbers in the names of the files, or the names where these have none, and poses;
        as of `read_kitti`.

    Raises
    ------
    FileError
        Where there is no such file, or one holds another table.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_matrices
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name, x in (("frame-000010.pose.txt", 5), ("frame-000002.pose.txt", 4)):
    ...         text = f"1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    ...         _ = pathlib.Path(folder, name).write_text(text)
    ...     numbers, poses = read_matrices(folder)
    >>> numbers, poses[:, 0, 3]
    (array([ 2, 10]), array([4., 5.]))
    """
    files = files_of_matrices(Path(path))
    if not files:
        raise FileError(path, "is not a folder with matrices in .txt files")
    names = [file.name.partition(".")[0] for file in files]
    numbers = [int(digits[-1]) for name in names if (digits := re.findall(r"\d+", name))]
    keys = np.array(numbers if len({*numbers}) == len(files) else names)
    order = np.argsort(keys)
    files = [files[row] for row in order]
    source = Source(path, lambda row: files[row].name)
    return Trajectory(keys[order], poses_from_matrices(np.array(list(map(_matrix, files))), source))


def files_of_matrices(folder: Path) -> list[Path]:
    """Return the files of a folder that may hold matrices."""
    files = list(folder.glob("*.txt")) if folder.is_dir() else []
    return [file for file in files if file.name.endswith(".pose.txt")] or files


def _matrix(path: Path) -> Floats:
    table = open_table(path)
    values = table.numbers(range(len(table.first)))
    if values.shape not in ((3, 4), (4, 4)):
        raise FileError(path, f"must hold a 4 x 4 matrix, not {len(values)} x {len(values.T)}")
    return np.vstack([values, [0, 0, 0, 1]])[:4]
