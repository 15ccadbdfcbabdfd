"""COLMAP models, through pycolmap."""

import mmap
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from ..extras import require
from .poses import Trajectory, inverse_poses, poses_from_matrices
from .text import FileError, FilePath, Source, is_number, numbered_lines

__all__ = ["is_model", "read_colmap", "read_colmap_parts"]

PARTS = "cameras", "images", "points3D"  # files of a model, as .bin or .txt
RECORDS = {  # bytes of a record, whether a name follows, its count of items, bytes of an item
    "images.bin": (64, True, "<Q", 24),
    "frames.bin": (64, False, "<I", 16),
    "points3D.bin": (43, False, "<Q", 8),
}


def read_colmap(path: Any) -> Trajectory:
    """Read the registered images of a COLMAP model.

    Parameters
    ----------
    path : path or pycolmap.Reconstruction
        The model's folder, with text or binary files, or the model in memory.

    Returns
    -------
    Trajectory
        Image names and camera-to-world poses, ordered by name.

    Raises
    ------
    FileError
        Where the model cannot be read, or holds no registered image.
    ModuleNotFoundError
        Where pycolmap is not installed.

    Examples
    --------
    >>> from alignscores.trajectories.files import read_colmap
    >>> trajectory = read_colmap("sparse/0")  # doctest: +SKIP
    >>> trajectory.keys[:2]  # doctest: +SKIP
    array(['0000.png', '0001.png'], dtype='<U8')
    """
    if is_model(path):
        return _registered(path, "the Reconstruction", {})
    return _read(Path(path))


def read_colmap_parts(path: FilePath) -> dict[str, Trajectory]:
    """Read a COLMAP model, or all models in a folder that is none itself, as ``sparse/`` is.

    Parameters
    ----------
    path : path
        The folder of a model, or of models.

    Returns
    -------
    dict
        Name of each sub-folder with a model, by its number -> its trajectory, as of `read_colmap`.
        Each has its own coordinate frame. The name of ``path`` itself where it is a model.

    Raises
    ------
    FileError, ModuleNotFoundError
        As in `read_colmap`.

    Examples
    --------
    >>> from alignscores.trajectories.files import read_colmap_parts
    >>> list(read_colmap_parts("sparse"))  # doctest: +SKIP
    ['0', '1']
    """
    folder = Path(path)
    folders = {file.parent for file in folder.glob("*/images.*")}
    if not folders or list(folder.glob("images.*")):
        folders = {folder}
    in_order = sorted(folders, key=lambda each: (len(each.name), each.name))
    return {each.name: _read(each) for each in in_order}


def _registered(model: Any, path: FilePath, names: dict[int, str]) -> Trajectory:
    """Return the registered images of a model; `names` are those that it has not whole."""
    images = {
        names.get(number, image.name): image
        for number, image in model.images.items()
        if image.has_pose
    }
    if not images:
        raise FileError(path, "the model has no registered image")
    ordered = sorted(images)
    matrices = np.array([images[name].cam_from_world().matrix() for name in ordered])
    source = Source(path, lambda row: f"image {ordered[row]!r}")
    world_to_camera = poses_from_matrices(matrices, source)
    return Trajectory(np.array(ordered), inverse_poses(world_to_camera))


def _names_in_text(folder: Path) -> dict[int, str]:
    """Return the names in a text model; pycolmap reads them up to a blank only.

    A malformed line is refused, since pycolmap does not say which it is.
    """
    file = folder / "images.txt"
    names: dict[int, str] = {}
    if (folder / "images.bin").is_file() or not file.is_file():
        return names
    image_line = True  # each is followed by one of points
    for number, line in numbered_lines(file):
        if line.startswith("#") or (image_line and not line.strip()):
            continue
        if image_line:
            fields = line.strip().split(maxsplit=9)
            if len(fields) < 10 or not all(is_number(field, finite=True) for field in fields[:9]):
                reason = "must hold 'IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME', all but the "
                raise FileError(file, f"{reason}last of them numbers", place=f"line {number}")
            names[int(float(fields[0]))] = fields[9]
        image_line = not image_line
    return names


def is_model(model: object) -> bool:
    """Return whether something is a COLMAP model in memory, without importing pycolmap."""
    return type(model).__module__.partition(".")[0] == "pycolmap"


def _read(folder: Path) -> Trajectory:
    """Read a model from its folder."""
    pycolmap = require("pycolmap", "colmap")
    if missing := [part for part in PARTS if not list(folder.glob(f"{part}.*"))]:
        lacks = f"it lacks {' and '.join(missing)}, as .bin or .txt"
        raise FileError(folder, f"is not a folder with a COLMAP model, as sparse/0 is: {lacks}")
    for file in RECORDS:
        if (folder / file).is_file():
            _check_whole(folder / file)
    names = _names_in_text(folder)
    try:
        model = pycolmap.Reconstruction(str(folder))
    except (IndexError, MemoryError, OSError, RuntimeError, ValueError) as error:
        reason = re.sub(r"^\[[^]]*\] (Check failed: )?", "", str(error).partition("\n")[0])
        whole = "is not a readable COLMAP model, as if a file were cut off"
        raise FileError(folder, f"{whole} ({reason})") from None
    return _registered(model, folder, names)


def _check_whole(path: Path) -> None:
    """Check that a binary file of a model is not cut off, which pycolmap may read without end."""
    record, named, count, item = RECORDS[path.name]
    size, end, whole = path.stat().st_size, 8, 0
    if size < end:
        raise FileError(path, "is cut off: it has not even the number of its records")
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        (n,) = struct.unpack_from("<Q", data)
        while whole < n:
            end += record
            if named:
                end = data.find(b"\0", end) + 1 or size
            if end + struct.calcsize(count) > size:
                break
            end += struct.calcsize(count) + item * struct.unpack_from(count, data, end)[0]
            if end > size:
                break
            whole += 1
    if whole < n:
        raise FileError(path, f"is cut off: it holds {whole} of its {n} records")
