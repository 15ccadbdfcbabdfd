"""EuRoC's ``data.csv``, and the estimates for it."""

from itertools import chain, islice

from . import tum
from .poses import Trajectory, stamped_poses
from .stamps import in_seconds
from .text import FilePath, data_lines, read_numbers

__all__ = ["read_euroc"]

COLUMNS = "timestamp tx ty tz qw qx qy qz ..."


def read_euroc(path: FilePath) -> Trajectory:
    r"""Read a EuRoC ``data.csv``: ``timestamp, tx, ty, tz, qw, qx, qy, qz, ...``, stamps in ns.

    A file without commas is read as TUM: estimates for EuRoC sequences are commonly stored so, with
    stamps in seconds or, as by ORB-SLAM3, in ns. Which it is shows in the stamps, with commas and
    without.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors and the same warning.

    Returns
    -------
    Trajectory
        Time stamps in seconds and poses, in the order of the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_euroc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "data.csv")
    ...     _ = path.write_text("#time, position, w first\n1500000000500000000,1,2,3,1,0,0,0\n")
    ...     stamps, poses = read_euroc(path)
    >>> float(stamps[0]), poses[0, :3, 3]
    (1500000000.5, array([1., 2., 3.]))
    """
    lines = data_lines(path)
    first = list(islice(lines, 1))
    lines = chain(first, lines)
    if first and "," not in first[0][1]:
        values, source = read_numbers(path, lines, tum.COLUMNS, [8])
    else:
        lines = ((number, ",".join(line.split(",")[:8])) for number, line in lines)
        values, source = read_numbers(path, lines, COLUMNS, [8], ",")
        values = values[:, [0, 1, 2, 3, 5, 6, 7, 4]]  # qw last, as in TUM files
    stamps, poses = stamped_poses(values, source)
    return Trajectory(in_seconds(path, stamps, "seconds", "nanoseconds"), poses)
