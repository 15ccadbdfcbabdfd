"""TUM files."""

from .poses import Trajectory, stamped_poses
from .stamps import in_seconds
from .text import FilePath, data_lines, read_numbers

__all__ = ["read_tum"]

COLUMNS = "timestamp tx ty tz qx qy qz qw"


def read_tum(path: FilePath) -> Trajectory:
    r"""Read a TUM file: ``timestamp tx ty tz qx qy qz qw`` in each line, camera-to-world.

    Parameters
    ----------
    path : path
        The file. Blank lines and those that begin with # are left out.

    Returns
    -------
    Trajectory
        Time stamps in seconds and poses, in the order of the file.

    Raises
    ------
    FileError
        Where the file cannot be read, a line is malformed or holds no rotation, or stamps are in
        another unit.

    Warns
    -----
    TrajectoryWarning
        Where quaternions are far from unit length; they are normalised.

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
    values, source = read_numbers(path, data_lines(path), COLUMNS, [8])
    stamps, poses = stamped_poses(values, source)
    return Trajectory(in_seconds(path, stamps, "seconds"), poses)
