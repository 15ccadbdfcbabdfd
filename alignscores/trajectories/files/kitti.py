"""KITTI files."""

import numpy as np

from ...validation import finite_rows
from .poses import Trajectory, poses_from_matrices
from .text import FilePath, data_lines, read_numbers

__all__ = ["read_kitti"]

COLUMNS = "r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz"
LAST_ROW = [0.0, 0.0, 0.0, 1.0]


def read_kitti(path: FilePath) -> Trajectory:
    r"""Read a KITTI file: in each line a camera-to-world matrix, row by row.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors. Lines have 12 numbers, the upper three rows, or 16,
        which end with 0 0 0 1.

    Returns
    -------
    Trajectory
        Row numbers and poses. Matrices that are rotations up to rounding are replaced by the
        nearest rotation.

    Warns
    -----
    TrajectoryWarning
        Where matrices are far from rotations; they are replaced, too.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_kitti
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "00.txt")
    ...     _ = path.write_text("1 0 0 4 0 1 0 5 0 0 1 6\n")
    ...     rows, poses = read_kitti(path)
    >>> rows, poses[0, :3, 3]
    (array([0]), array([4., 5., 6.]))
    """
    values, source = read_numbers(path, data_lines(path), COLUMNS, [12, 16])
    rows = values.reshape(len(values), -1, 4)
    matrices, last_rows = rows[:, :3], rows[:, 3:]
    wrong = (last_rows != LAST_ROW).any(axis=(1, 2)) & finite_rows(matrices)
    source.refuse(wrong, "16 columns must end with 0 0 0 1")
    poses = poses_from_matrices(matrices, source)
    return Trajectory(np.arange(len(poses)), poses)
