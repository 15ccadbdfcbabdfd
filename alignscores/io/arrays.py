"""Arrays of NumPy: ``.npy`` and ``.npz``.

Only the headers are read of arrays that are no poses or stamps, such as depth maps; and an array
is read only if it is as large as its header says, and not too large.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from typing import IO, Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from ..files import MAX_BYTES, FileError, FilePath, Source, read_bytes
from ..texts import first_few
from .trajectory import (
    MIN_IN_ORDER,
    Trajectory,
    check_stamps,
    checked,
    in_seconds,
    poses_from_matrices,
    warn,
)

__all__ = ["read_arrays"]

SHAPES = "(n, 4, 4) or (n, 3, 4)"
HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
NO_ARRAYS = "is not a file of arrays, .npy or .npz, without objects"


def read_arrays(path: FilePath) -> Trajectory:
    """Read camera-to-world matrices, (n, 4, 4) or (n, 3, 4), with or without time stamps.

    Parameters
    ----------
    path : path
        A file ``.npy`` with the matrices; or one ``.npz`` with them and, as the only array of n
        numbers in order, their time stamps in seconds, whatever the names. A first axis of length
        1 more is left out. Else as in `read_tum`.

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
    >>> from alignscores.io import read_arrays
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "poses.npz")
    ...     np.savez(path, c2w=np.tile(np.eye(4), (3, 1, 1)), times=[0.0, 0.1, 0.2])
    ...     stamps, poses = read_arrays(path)
    >>> stamps, poses.shape
    (array([0. , 0.1, 0.2]), (3, 4, 4))
    """
    arrays = _arrays(path, read_bytes(path))
    candidates = [name for name, array in arrays.items() if array.shape[1:] in ((4, 4), (3, 4))]
    if len(candidates) != 1:
        shapes = first_few([f"{name[:40]} {array.shape}" for name, array in arrays.items()])
        raise FileError(
            path, f"must have one array of numbers, {SHAPES}; it has {shapes or 'none'}"
        )
    n = arrays[candidates[0]].shape[0]
    source = Source(path, lambda row: f"{candidates[0]}[{row}]")
    if n == 0:
        raise FileError(path, "has no poses")
    numbers = {name: array.load() for name, array in arrays.items() if array.shape == (n,)}
    times = [values for values in numbers.values() if _are_in_order(values)]
    if len(times) > 1:
        raise FileError(path, f"has {len(times)} arrays of {n} numbers; leave the stamps")
    if numbers and not times:
        warn(path, f"{first_few(list(numbers))}: not in order, and not read as time stamps")
    matrices = arrays[candidates[0]].load().astype(np.float64, copy=False)
    poses = poses_from_matrices(matrices, source)
    if not times:
        return checked(np.arange(n), poses, source)
    stamps = times[0].astype(np.float64)
    source.refuse(~np.isfinite(stamps), "the time stamp is not finite")
    seconds = in_seconds(stamps, path)
    check_stamps(seconds, source)
    return checked(seconds, poses, source)


def _are_in_order(numbers: NDArray[Any]) -> bool:
    """Return whether numbers rise, as time stamps do; confidences and focal lengths do not."""
    finite = numbers[np.isfinite(numbers)]
    if len(finite) < 2 or finite[0] >= finite[-1]:
        return False
    return bool(np.mean(finite[1:] >= finite[:-1]) >= MIN_IN_ORDER)


@dataclass(frozen=True)
class Stored:
    """An array in a file whose header has been read."""

    path: FilePath
    name: str
    shape: tuple[int, ...]
    open: Callable[[], IO[bytes]]

    def load(self) -> NDArray[Any]:
        """Return the array, unless it is too large."""
        n_bytes = 8 * math.prod(self.shape)
        if n_bytes > MAX_BYTES:
            size = f"{n_bytes / 1e6:.0f} MB, more than the {MAX_BYTES / 1e6:g} MB that are read"
            raise FileError(self.path, f"the array {self.name} takes {size}")
        try:
            with self.open() as file:
                return np.lib.format.read_array(file, allow_pickle=False).reshape(self.shape)
        except MemoryError:
            raise
        except Exception:  # as below
            raise FileError(self.path, NO_ARRAYS) from None


def _arrays(path: FilePath, content: bytes) -> dict[str, Stored]:
    """Return the arrays of numbers of a file with this content, by name."""
    arrays = {}
    try:
        for name, size, opened in _members(content):
            with opened() as file:
                version = np.lib.format.read_magic(file)
                read_header = HEADERS[version]
                shape, _, dtype = read_header(file)
                if dtype.hasobject or math.prod(shape) * dtype.itemsize != size - file.tell():
                    raise ValueError
                if len(shape) in (2, 4) and shape[0] == 1:  # a batch of one
                    shape = shape[1:]
            if dtype.kind in "fiu":
                arrays[name] = Stored(path, name, shape, opened)
    except MemoryError:
        raise
    except Exception:  # a broken archive or header leads to errors of many kinds
        raise FileError(path, NO_ARRAYS) from None
    return arrays


def _members(content: bytes) -> Iterator[tuple[str, int, Callable[[], IO[bytes]]]]:
    """Yield name and size of the arrays in a file, and a function that opens each."""
    if not content.startswith(b"PK"):
        yield "the array", len(content), partial(BytesIO, content)
        return
    archive = ZipFile(BytesIO(content))
    for member in archive.infolist():
        if member.filename.endswith(".npy"):
            name = member.filename.removesuffix(".npy")
            yield name, member.file_size, partial(archive.open, member)
