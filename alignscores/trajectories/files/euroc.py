"""EuRoC's ``data.csv``, and the estimates for it."""

from .poses import Trajectory
from .tables import read_table
from .text import FilePath

__all__ = ["read_euroc"]


def read_euroc(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a EuRoC ``data.csv``: ``timestamp, tx, ty, tz, qw, qx, qy, qz, ...``, stamps in ns.

    It is read as by `read_tum`, but for two things: without a header, qw comes first where there
    are commas; and nothing is said of nanoseconds and further columns, which are usual here.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors.
    columns : str, optional
        As in `read_tum`.

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
    return read_table(path, columns, euroc=True)
