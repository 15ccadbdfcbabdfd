"""COLMAP models, through pycolmap."""

import mmap
import re
import struct
from collections.abc import Iterator
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
    model, path = (path, "the Reconstruction") if is_model(path) else (_model(path), path)
    in_text = _names_in_text(Path(path))
    images = {
        in_text.get(number, image.name): image
        for number, image in model.images.items()
        if image.has_pose
    }
    if not images:
        raise FileError(path, "the model has no registered image")
    names = sorted(images)
    matrices = np.array([images[name].cam_from_world().matrix() for name in names])
    source = Source(path, lambda row: f"image {names[row]!r}")
    world_to_camera = poses_from_matrices(matrices, source)
    return Trajectory(np.array(names), inverse_poses(world_to_camera))


def _names_in_text(folder: Path) -> dict[int, str]:
    """Return the names in a text model, of which pycolmap reads no more than up to a blank."""
    file = folder / "images.txt"
    if (folder / "images.bin").is_file() or not file.is_file():
        return {}
    return {int(fields[0]): fields[9] for _, fields in _images_in_text(file)}


def is_model(model: object) -> bool:
    """Tell whether something is a COLMAP model in memory, without pycolmap for what is none."""
    return type(model).__module__.partition(".")[0] == "pycolmap"


def _model(path: FilePath) -> Any:
    """Read a model from its folder."""
    pycolmap = require("pycolmap", "colmap")
    folder = Path(path)
    if not folder.is_dir():
        raise FileError(path, "is not a folder; a COLMAP model is a folder with cameras and images")
    for file in RECORDS:
        if (folder / file).is_file():
            _check_whole(folder / file)
    try:
        return pycolmap.Reconstruction(str(path))
    except (IndexError, MemoryError, OSError, RuntimeError, ValueError) as error:
        _check_images_txt(folder / "images.txt")
        reason = re.sub(r"^\[[^]]*\] (Check failed: )?", "", str(error).partition("\n")[0])
        raise FileError(path, _why_no_model(folder, reason)) from None


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
        Each has a world of its own. The name of ``path`` itself where it is a model.

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
    models = {file.parent for file in folder.glob("*/images.*")}
    if not models or list(folder.glob("images.*")):
        return {folder.name: read_colmap(path)}
    models_in_order = sorted(models, key=lambda model: (len(model.name), model.name))
    return {model.name: read_colmap(model) for model in models_in_order}


def _check_whole(path: Path) -> None:
    """Refuse a binary file of a model that is cut off, which pycolmap may read without end."""
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


def _why_no_model(folder: Path, reason: str) -> str:
    """Say why a folder cannot be read as a model, where pycolmap gives no more than a reason."""
    files = {path.name for path in folder.iterdir()}
    for suffix, empty in (".bin", "8 zero bytes"), (".txt", "an empty file"):
        missing = [part + suffix for part in PARTS if part + suffix not in files]
        if not missing:
            return f"is not a readable COLMAP model, as if a file were cut off ({reason})"
        if len(missing) < len(PARTS):
            remedy = f"; {empty} will do for it" if missing == [f"points3D{suffix}"] else ""
            return f"the COLMAP model lacks {' and '.join(missing)}{remedy}"
    models = sorted(path.parent.name for path in folder.glob("*/images.*"))
    hint = f", but {folder / models[0]} is: give that one" if models else ""
    return f"is not a COLMAP model, with {', '.join(PARTS)} as .bin or .txt{hint}"


def _check_images_txt(path: Path) -> None:
    """Refuse a malformed line of a text model's images, since pycolmap does not say which it is."""
    if not path.is_file():
        return
    for line_number, fields in _images_in_text(path):
        finite = [is_number(field, finite=True) for field in fields[:9]]
        if len(fields) < 10 or not all(finite):
            raise FileError(
                path,
                "must hold 'IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME', all but the last "
                "of them numbers",
                place=f"line {line_number}",
            )


def _images_in_text(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines of images, with their numbers: each is followed by one of points."""
    image_line = True
    for line_number, line in numbered_lines(path):
        if line.startswith("#") or (image_line and not line.strip()):
            continue
        if image_line:
            yield line_number, line.strip().split(maxsplit=9)
        image_line = not image_line
