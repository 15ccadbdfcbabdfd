"""KITTI files."""

from .poses import Trajectory
from .tables import read_table
from .text import FileError, FilePath

__all__ = ["read_kitti"]


def read_kitti(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a KITTI file: in each line a camera-to-world matrix, row by row.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors. Lines have 12 numbers, the upper three rows, or 16,
        which end with 0 0 0 1; or the number of the frame before them.
    columns : str, optional
        As in `read_tum`.

    Returns
    -------
    Trajectory
        Numbers of rows, or of frames, and poses. Matrices that are rotations up to rounding are
        replaced by the nearest rotation.

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
    trajectory = read_table(path, columns)
    if trajectory.keys.dtype.kind == "f":
        raise FileError(path, "has time stamps, which the kitti format has not; give tum instead")
    return trajectory
