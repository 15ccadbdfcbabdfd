"""Pose graphs of g2o: the vertices are poses, the edges are not."""

import re

import numpy as np

from ..files import FileError, FilePath, Source, numbered_lines, to_number
from .trajectory import Trajectory, checked, poses_from_quaternions

__all__ = ["is_g2o", "read_g2o"]

VERTEX = "VERTEX_SE3:QUAT"
MAX_ID = np.iinfo(np.int64).max


def read_g2o(path: FilePath) -> Trajectory:
    r"""Read the vertices ``VERTEX_SE3:QUAT id x y z qx qy qz qw`` of a pose graph.

    Parameters
    ----------
    path : path
        As in `read_tum`.

    Returns
    -------
    Trajectory
        Numbers of the vertices, and camera-to-world poses.

    Raises
    ------
    FileError
        Where the file cannot be read, it has no such vertex, or one is malformed.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_g2o
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "graph.g2o")
    ...     _ = path.write_text("VERTEX_SE3:QUAT 7 1 2 3 0 0 0 1\n")
    ...     numbers, poses = read_g2o(path)
    >>> numbers, poses[0, :3, 3]
    (array([7]), array([1., 2., 3.]))
    """
    lines, numbers, values = [], [], []
    for number, line in numbered_lines(path):
        tag, *fields = line.split() or ["#"]
        if tag.startswith("#") or _is_other(tag):
            continue
        try:
            _, *pose = map(to_number, fields)
            vertex = int(fields[0])
            if tag != VERTEX or len(pose) != 7 or abs(vertex) > MAX_ID:
                raise ValueError
            numbers.append(vertex)
        except (IndexError, ValueError):
            reason = f"must hold '{VERTEX} id x y z qx qy qz qw'"
            raise FileError(path, reason, place=f"line {number}") from None
        lines.append(number)
        values.append(pose)
    if not values:
        raise FileError(path, f"is a pose graph of g2o without {VERTEX}; only these are read")
    source = Source(path, lambda row: f"line {lines[row]}")
    positions, quaternions = np.split(np.array(values), [3], axis=1)
    poses = poses_from_quaternions(positions, quaternions, source)
    return checked(np.array(numbers), poses, source)


def _is_other(tag: str) -> bool:
    """Return whether a line with this tag is of another type, and not a damaged vertex."""
    return tag[0].isalpha() and VERTEX not in tag and not VERTEX.startswith(tag.upper())


def is_g2o(text: str) -> bool:
    """Return whether a file that begins with this text is a pose graph."""
    # Possessive: backtracking into a million blanks would take 150 MB.
    return bool(re.match(r"(?:\s|#.*\n)*+(VERTEX_|EDGE_|FIX |PARAMS_)", text))
