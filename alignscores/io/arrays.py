"""Arrays of NumPy: ``.npy`` and ``.npz``.

Only the headers are read of arrays that are no poses or stamps, such as depth maps; and an array
is read only if it is as large as its header says, and not too large.
"""

import math
import warnings
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
    BLOCK,
    MIN_IN_ORDER,
    Trajectory,
    check_stamps,
    checked,
    image_names,
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
        numbers in order, their time stamps in seconds, whatever the names, or else the names of
        the images as the only array of n different texts. Further axes of length 1 are left out.
        Else as in `read_tum`.

    Returns
    -------
    Trajectory
        Time stamps in seconds, names or row numbers, and poses; as of `read_kitti`.

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
    shapes_of = {name: array.shape for name, array in arrays.items() if array.dtype.kind in "fiu"}
    candidates = [name for name, shape in shapes_of.items() if shape[1:] in ((4, 4), (3, 4))]
    if len(candidates) != 1:
        shapes = first_few([f"{name[:40]} {shape}" for name, shape in shapes_of.items()])
        raise FileError(
            path, f"must have one array of numbers, {SHAPES}; it has {shapes or 'none'}"
        )
    n = arrays[candidates[0]].shape[0]
    source = Source(path, lambda row: f"{candidates[0]}[{row}]")
    if n == 0:
        raise FileError(path, "has no poses")
    _check_first_rows(arrays[candidates[0]], source)
    keys = _keys(path, arrays, n)
    matrices = arrays[candidates[0]].load().astype(np.float64, copy=False)
    poses = poses_from_matrices(matrices, source)
    if keys is None:
        return checked(np.arange(n), poses, source)
    if keys.dtype.kind == "U":
        return checked(image_names(keys.tolist(), source), poses, source)
    stamps = keys.astype(np.float64)
    source.refuse(~np.isfinite(stamps), "the time stamp is not finite")
    seconds = in_seconds(stamps, path)
    check_stamps(seconds, source)
    return checked(seconds, poses, source)


def _keys(path: FilePath, arrays: dict[str, "Stored"], n: int) -> NDArray[Any] | None:
    """Return the stamps of n poses, otherwise their names; None if there are none."""
    columns = {name: array.load() for name, array in arrays.items() if array.shape == (n,)}
    stamps = [values for values in columns.values() if _are_in_order(values)]
    names = [values for values in columns.values() if _are_names(values)]
    for keys, what in ((stamps, "numbers; leave the stamps"), (names, "texts; leave the names")):
        if len(keys) > 1:
            raise FileError(path, f"has {len(keys)} arrays of {n} {what}")
        if keys:
            return keys[0]
    for name, array in arrays.items():
        if array.shape in ((n - 1,), (n + 1,)) and _are_in_order(array.load()):
            reason = f"has {n} poses, but {array.shape[0]} numbers in order in {name[:40]!r}"
            raise FileError(path, f"{reason}; write a time stamp for each pose, or none")
    if numbers := [name for name, values in columns.items() if values.dtype.kind != "U"]:
        warn(path, f"{first_few(numbers)}: not in order, and not read as time stamps")
    return None


def _check_first_rows(matrices: "Stored", source: Source) -> None:
    """Raise an error where the first rows are no poses, before all of them are unpacked."""
    matrices.check_size()
    if matrices.by_columns or matrices.shape[0] <= BLOCK:
        return
    first = matrices.first(BLOCK).astype(np.float64, copy=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # said where all of them are read
        poses_from_matrices(first, source)


def _are_in_order(values: NDArray[Any]) -> bool:
    """Return whether numbers rise, as time stamps do; confidences and focal lengths do not."""
    if values.dtype.kind == "U":
        return False
    finite = values[np.isfinite(values)]
    if len(finite) < 2 or finite[0] >= finite[-1]:
        return False
    return bool(np.mean(finite[1:] >= finite[:-1]) >= MIN_IN_ORDER)


def _are_names(values: NDArray[Any]) -> bool:
    """Return whether most values are different texts."""
    return values.dtype.kind == "U" and len(np.unique(values)) > len(values) / 2


@dataclass(frozen=True)
class Stored:
    """An array in a file whose header has been read."""

    path: FilePath
    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    by_columns: bool  # in Fortran's order
    start: int  # of the numbers, in bytes
    open: Callable[[], IO[bytes]]

    def check_size(self) -> None:
        """Raise an error for an array that is too large."""
        n_bytes = max(8, self.dtype.itemsize) * math.prod(self.shape)
        if n_bytes > MAX_BYTES:
            size = f"{n_bytes / 1e6:.0f} MB, more than the {MAX_BYTES / 1e6:g} MB that are read"
            raise FileError(self.path, f"the array {self.name} takes {size}")

    def first(self, n_rows: int) -> NDArray[Any]:
        """Return the first rows."""
        n = math.prod(self.shape[1:])
        with self.open() as file:
            content = file.read(self.start + n_rows * n * self.dtype.itemsize)
        return np.frombuffer(content, self.dtype, offset=self.start).reshape(-1, *self.shape[1:])

    def load(self) -> NDArray[Any]:
        """Return the array; dates as seconds since 1970."""
        self.check_size()
        try:
            with self.open() as file:
                array = np.lib.format.read_array(file, allow_pickle=False).reshape(self.shape)
            return (
                array.astype("M8[ns]").astype(np.int64) / 1e9 if array.dtype.kind == "M" else array
            )
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
                shape, by_columns, dtype = read_header(file)
                start = file.tell()
                if dtype.hasobject or math.prod(shape) * dtype.itemsize != size - start:
                    raise ValueError
                if len(shape) in (2, 4) and shape[0] == 1:  # a batch of one
                    shape = shape[1:]
                if len(shape) == 2 and shape[1] == 1:
                    shape = shape[:1]
            if dtype.kind in "fiuMU":
                arrays[name] = Stored(path, name, shape, dtype, by_columns, start, opened)
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
