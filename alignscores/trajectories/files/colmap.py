"""COLMAP models: folders with text or binary files, and models of pycolmap in memory."""

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from ...averaging import rotations_from_quaternions
from .poses import Trajectory, inverse_poses, poses_from_matrices
from .text import FileError, FilePath, Source, is_number, numbered_lines

__all__ = ["is_model", "read_colmap"]

Images = list[tuple[str, tuple[float, ...]]]  # names, and qw qx qy qz tx ty tz

# In images.bin: number, pose and camera of an image; its name; the number of its points.
BINARY_IMAGE = re.compile(rb"(.{64})([^\0]*)\0(.{8})", re.DOTALL)
POSE = struct.Struct("<4x7d4x")
POINT = 24  # bytes


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

    Examples
    --------
    >>> from alignscores.trajectories.files import read_colmap
    >>> trajectory = read_colmap("tests/data/colmap/reference")
    >>> trajectory.keys[:2]
    array(['0000.png', '0001.png'], dtype='<U8')
    """
    if not is_model(path):
        return _read(Path(path))
    images = []
    for image in path.images.values():
        if image.has_pose:
            pose = image.cam_from_world()
            x, y, z, w = pose.rotation.quat
            images.append((image.name, (w, x, y, z, *pose.translation)))
    return _trajectory("the Reconstruction", images)


def is_model(model: object) -> bool:
    """Return whether something is a COLMAP model in memory, without importing pycolmap."""
    return type(model).__module__.partition(".")[0] == "pycolmap"


def _read(folder: Path) -> Trajectory:
    """Read a model from its folder, in which images.bin or images.txt has the poses."""
    if (folder / "images.bin").is_file():
        return _trajectory(folder, _images_of_binary(folder / "images.bin"))
    if (folder / "images.txt").is_file():
        return _trajectory(folder, _images_of_text(folder / "images.txt"))
    if models := sorted({file.parent.name for file in folder.glob("*/images.*")}):
        example = folder / models[0]
        raise FileError(folder, f"holds {len(models)} models; name one, such as {example}")
    reason = "is not a folder with a COLMAP model, as sparse/0 is"
    raise FileError(folder, f"{reason}: it has no images.bin or images.txt")


def _images_of_binary(path: Path) -> Images:
    """Return the registered images of a binary model."""
    images: Images = []
    data, position = path.read_bytes(), 8
    n = int.from_bytes(data[:position], "little")
    while len(images) < n and (image := BINARY_IMAGE.match(data, position)):
        pose, name, n_points = image.groups()
        images.append((name.decode(errors="replace"), POSE.unpack(pose)))
        position = image.end() + POINT * int.from_bytes(n_points, "little")
    if len(images) < n or position > len(data):
        whole = max(len(images) - (position > len(data)), 0)
        raise FileError(path, f"is cut off: it holds {whole} of its {n} images")
    return images


def _images_of_text(path: Path) -> Images:
    """Return the registered images of a text model."""
    images: Images = []
    lines = (line for line in numbered_lines(path) if not line[1].startswith("#"))
    for number, line in lines:
        fields = line.strip().split(maxsplit=9)
        if not fields:
            continue
        if len(fields) < 10 or not all(is_number(field, finite=True) for field in fields[:9]):
            reason = "must hold 'IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME', all but the last "
            raise FileError(path, f"{reason}of them numbers", place=f"line {number}")
        images.append((fields[9], tuple(map(float, fields[1:8]))))
        if len(next(lines, (0, ""))[1].split()) % 3:
            raise FileError(path, "must hold the points of each image", place=f"line {number + 1}")
    return images


def _trajectory(path: FilePath, images: Images) -> Trajectory:
    """Return the trajectory of registered images, whose poses are world-to-camera."""
    if not images:
        raise FileError(path, "the model has no registered image")
    names, poses = zip(*sorted(images), strict=True)
    quaternions, translations = np.split(np.array(poses), [4], axis=1)
    with np.errstate(invalid="ignore"):  # of zeros, which is refused below
        unit = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    matrices = np.dstack([rotations_from_quaternions(unit[:, [1, 2, 3, 0]]), translations])
    source = Source(path, lambda row: f"image {names[row]!r}")
    return Trajectory(np.array(names), inverse_poses(poses_from_matrices(matrices, source)))
