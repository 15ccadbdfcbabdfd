"""TUM files."""

from .poses import Trajectory
from .tables import read_table
from .text import FilePath

__all__ = ["read_tum"]


def read_tum(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a text table of poses, such as TUM's ``timestamp tx ty tz qx qy qz qw``.

    Parameters
    ----------
    path : path
        The file. Fields are separated by commas or semicolons, otherwise by blanks or tabs. Blank
        lines, and what stands behind #, are left out.
    columns : str, optional
        What the columns hold: ``t`` (``t_s``, ``t_ms``, ``t_us``, ``t_ns``; seconds and nanoseconds
        are added), ``n`` (number of the frame), ``x y z``, ``qx qy qz qw``, ``r11`` to ``r33``, and
        ``-`` for others. By default a header names them, or their number shows it: 3 are ``x y z``,
        4 ``t x y z``, 7 ``x y z qx qy qz qw``, 8 or more ``t x y z qx qy qz qw``, 12 and 16 a
        matrix (13 and 17: with a number).

    Returns
    -------
    Trajectory
        Time stamps in seconds, or numbers of frames or rows, and camera-to-world poses, in the
        order of the file. Rotations that the file lacks, or that are the same throughout, are nan.

    Raises
    ------
    FileError
        Where the file cannot be read, a line is malformed or holds no rotation, or nothing tells
        what its columns hold.

    Warns
    -----
    TrajectoryWarning
        Where quaternions are far from unit length, and are normalised; where stamps are not in
        seconds; and where columns are not read.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_tum
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "estimate.txt")
    ...     _ = path.write_text("# a comment\n0.5 1 2 3 0 0 0 1\n")
    ...     stamps, poses = read_tum(path)
    >>> stamps, poses[0, :3, 3]
    (array([0.5]), array([1., 2., 3.]))
    """
    return read_table(path, columns)
