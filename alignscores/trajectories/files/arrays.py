"""Arrays of NumPy: ``.npy`` and ``.npz``."""

from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...texts import first_few
from .poses import Trajectory, poses_from_matrices
from .stamps import in_seconds
from .text import FileError, FilePath, Source, read_bytes

__all__ = ["read_arrays"]

SHAPES = "(n, 4, 4) or (n, 3, 4)"


def read_arrays(path: FilePath) -> Trajectory:
    """Read camera-to-world matrices, (n, 4, 4) or (n, 3, 4), with or without time stamps.

    Parameters
    ----------
    path : path
        A file ``.npy`` with the matrices; or one ``.npz`` with them and, as the only array of n
        numbers, their time stamps in seconds, whatever the names. Else as in `read_tum`.

    Returns
    -------
    Trajectory
        Time stamps in seconds, or row numbers, and poses; as of `read_kitti`.

    Raises
    ------
    FileError
        Where the file cannot be read, or it has no such array, or several.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from alignscores.trajectories.files import read_arrays
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "poses.npz")
    ...     np.savez(path, c2w=np.tile(np.eye(4), (3, 1, 1)), times=[0.0, 0.1, 0.2])
    ...     stamps, poses = read_arrays(path)
    >>> stamps, poses.shape
    (array([0. , 0.1, 0.2]), (3, 4, 4))
    """
    arrays = _arrays(path, read_bytes(path))
    candidates = [
        name
        for name, array in arrays.items()
        if array.ndim == 3 and array.shape[1:] in ((4, 4), (3, 4))
    ]
    if len(candidates) != 1:
        shapes = first_few([f"{name[:40]} {array.shape}" for name, array in arrays.items()])
        raise FileError(
            path, f"must have one array of numbers, {SHAPES}; it has {shapes or 'none'}"
        )
    matrices = arrays[candidates[0]].astype(np.float64)
    source = Source(path, lambda row: f"{candidates[0]}[{row}]")
    if len(matrices) == 0:
        raise FileError(path, "has no poses")
    times = [array for array in arrays.values() if array.shape == (len(matrices),)]
    if len(times) > 1:
        raise FileError(
            path, f"has {len(times)} arrays of {len(matrices)} numbers; leave the stamps"
        )
    poses = poses_from_matrices(matrices, source)
    if not times:
        return Trajectory(np.arange(len(poses)), poses)
    stamps = times[0].astype(np.float64)
    source.refuse(~np.isfinite(stamps), "the time stamp is not finite")
    return Trajectory(in_seconds(stamps, path), poses)


def _arrays(path: FilePath, content: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays of numbers of a file with this content, if they are not too large."""
    try:
        stored = np.load(BytesIO(content), allow_pickle=False)
        members = {"the array": stored} if isinstance(stored, np.ndarray) else dict(stored)
        arrays = {name: one for name, one in members.items() if isinstance(one, np.ndarray)}
        return {name: array for name, array in arrays.items() if array.dtype.kind in "fiu"}
    except MemoryError:
        raise
    except Exception:  # a broken archive or header leads to errors of many kinds
        raise FileError(path, "is not a file of arrays, .npy or .npz, without objects") from None
