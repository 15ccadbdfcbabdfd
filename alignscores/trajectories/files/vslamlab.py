"""VSLAM-LAB's CSV files."""

from .poses import Trajectory, stamped_poses
from .text import FileError, FilePath, data_lines, read_numbers

__all__ = ["HEADER", "read_vslamlab"]

HEADER = "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"


def read_vslamlab(path: FilePath) -> Trajectory:
    r"""Read a CSV file of VSLAM-LAB, ``ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw``.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors and the same warning. The header is needed, since the
        files of EuRoC, which have qw first, look alike without.

    Returns
    -------
    Trajectory
        Time stamps in seconds and camera-to-world poses, in the order of the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_vslamlab
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "00000_KeyFrameTrajectory.csv")
    ...     header = "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"
    ...     _ = path.write_text(f"{header}\n500000000,1,2,3,0,0,0,1\n")
    ...     stamps, poses = read_vslamlab(path)
    >>> stamps, poses[0, :3, 3]
    (array([0.5]), array([1., 2., 3.]))
    """
    lines = data_lines(path)
    header = next((line for _, line in lines), "")
    if header.replace('"', "") != HEADER:
        raise FileError(path, f"must begin with {HEADER!r}, as files of VSLAM-LAB do")
    values, source = read_numbers(path, lines, HEADER, [8], ",")
    stamps, poses = stamped_poses(values, source)
    return Trajectory(stamps / 1e9, poses)
