"""COLMAP models: folders with text or binary files, and models of pycolmap in memory."""

import math
import re
import struct
from collections import Counter
from contextlib import suppress
from operator import itemgetter
from os import SEEK_END
from pathlib import Path
from typing import Any

import numpy as np

from ..files import (
    FileError,
    FilePath,
    Source,
    is_number,
    numbered_lines,
    open_file,
    read_bytes,
    read_head,
)
from ..texts import brief
from .text import format_of_table, read_hloc
from .trajectory import (
    MAX_NAME,
    MAX_ROUNDING,
    Trajectory,
    checked,
    image_names,
    inverse_poses,
    poses_from_quaternions,
)

__all__ = [
    "has_model",
    "is_images",
    "is_model",
    "read_colmap",
    "read_colmap_models",
    "read_rig_frames",
]

Image = tuple[str, tuple[float, ...], int]  # name, qw qx qy qz tx ty tz, and IMAGE_ID
Images = list[Image]

MAX_BYTES = 10**11  # of images.bin and images.txt; most are points, which are not read
# In images.bin: number, pose and camera of an image; its name; the number of its points.
POSE = struct.Struct("<I7d4x")
POINT = 24  # bytes
# In frames.bin: the number of a frame, and how many data it has; the type of each, and its number.
FRAME = struct.Struct("<I60xI")
DATUM = struct.Struct("<i4xQ")
CAMERA = 0  # a type of sensor


def read_colmap(path: Any) -> Trajectory:
    """Read the registered images of a COLMAP model.

    Parameters
    ----------
    path : path or pycolmap.Reconstruction
        The model's folder, with text or binary files, or the folder of a single model's folder; or
        the model in memory; also hloc's table ``name qw qx qy qz tx ty tz``, which has COLMAP's
        convention.

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
    >>> from alignscores.io import read_colmap
    >>> trajectory = read_colmap("tests/data/colmap/reference")
    >>> trajectory.keys[:2]
    array(['0000.png', '0001.png'], dtype='<U8')
    """
    if not is_model(path):
        return _read(Path(path))
    images = []
    for image in _registered(path):
        pose = image.cam_from_world()
        x, y, z, w = pose.rotation.quat
        images.append((image.name, (w, x, y, z, *pose.translation), image.image_id))
    return _trajectory("the Reconstruction", images)


def read_colmap_models(path: FilePath) -> dict[str, Trajectory]:
    """Read all models in a folder such as COLMAP's ``sparse``, each in its own folder.

    Parameters
    ----------
    path : path
        The folder.

    Returns
    -------
    dict of str to Trajectory
        The models by the names of their folders, as of `read_colmap`; without models that have no
        registered image, and empty for anything but such a folder.

    Raises
    ------
    FileError
        Where a model cannot be read.

    Examples
    --------
    >>> from alignscores.io import read_colmap_models
    >>> {name: len(model.keys) for name, model in read_colmap_models("tests/data/colmap").items()}
    {'estimate': 37, 'reference': 40}
    """
    folder = Path(path)
    if not folder.is_dir() or any(folder.glob("images.*")):
        return {}
    images = {model.name: _images(model) for model in _folders_of_models(folder)}
    return {
        name: _trajectory(folder / name, images_of_model)
        for name, images_of_model in images.items()
        if images_of_model
    }


def read_rig_frames(path: Any) -> dict[str, int]:
    """Read which images of a COLMAP model were taken by a rig of cameras at once.

    Parameters
    ----------
    path : path or pycolmap.Reconstruction
        The model's folder or its file of images, or the model in memory.

    Returns
    -------
    dict
        The rig frame of each image, by its name. It is empty if no frame has several images, or
        the model has no ``frames`` and ``rigs`` (before COLMAP 3.12).

    Raises
    ------
    FileError
        Where ``frames`` cannot be read.

    Examples
    --------
    >>> from alignscores.io import read_rig_frames
    >>> read_rig_frames("tests/data/colmap/reference")
    {}
    """
    if is_model(path):
        registered = _registered(path)
        frames = {image.name: getattr(image, "frame_id", image.image_id) for image in registered}
        return frames if len(set(frames.values())) < len(frames) else {}
    folder = Path(path)
    if folder.is_file():
        folder = folder.parent if folder.stem == "images" else folder
    elif not _file_of_images(folder).exists() and len(models := _folders_of_models(folder)) == 1:
        folder = models[0]
    file = _file_of_images(folder)
    frames_file, rigs = (file.with_name(f"{stem}{file.suffix}") for stem in ("frames", "rigs"))
    if not (file.exists() and frames_file.exists() and rigs.exists()):
        return {}
    read = _frames_of_binary if file.suffix == ".bin" else _frames_of_text
    frame_of = read(frames_file)
    if max(Counter(frame_of.values()).values(), default=0) < 2:
        return {}
    return {name: frame_of[number] for name, _, number in _images(folder) if number in frame_of}


def is_model(model: object) -> bool:
    """Return whether something is a COLMAP model in memory, without importing pycolmap."""
    return type(model).__module__.partition(".")[0] == "pycolmap"


def _registered(model: Any) -> list[Any]:
    """Return the registered images of a model of pycolmap."""
    return [image for image in model.images.values() if image.has_pose]


def has_model(folder: Path) -> bool:
    """Return whether a folder has a COLMAP model, or one of its folders has."""
    return any(folder.glob("images.*")) or any(folder.glob("*/images.*"))


def _read(path: Path) -> Trajectory:
    """Read a model from its folder or its images.bin or images.txt, or a table of hloc."""
    if path.is_file():
        return _read_file(path)
    if _file_of_images(path).exists():
        return _trajectory(path, _images(path))
    if models := _folders_of_models(path):
        if len(models) == 1:
            return _read(models[0])
        raise FileError(path, f"holds {len(models)} models; name one, such as {models[0]}")
    reason = "is not a folder with a COLMAP model, as sparse/0 is"
    raise FileError(path, f"{reason}: it has no images.bin or images.txt")


def _folders_of_models(folder: Path) -> list[Path]:
    """Return the folders of the models in a folder: 0, 1, ..., 10, ..."""
    models = {file.parent for file in folder.glob("*/images.*") if file.suffix in (".bin", ".txt")}
    return sorted(models, key=lambda model: (len(model.name), model.name))


def _file_of_images(folder: Path) -> Path:
    """Return the file with the images of a model: the binary one, if there is one."""
    binary = folder / "images.bin"
    return binary if binary.exists() else folder / "images.txt"


def _images(model: Path) -> Images:
    """Return the registered images of the model in a folder."""
    file = _file_of_images(model)
    return _images_of_binary(file) if file.suffix == ".bin" else _images_of_text(file)


def is_images(text: str) -> bool:
    """Return whether a file that begins with this text has the images of a model.

    Without the comments a table could be mistaken for it: every other line must have the quaternion
    of an image and a name, the others points or nothing.
    """
    if re.search("^# *IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ,", text, re.MULTILINE):
        return True
    lines = [line for line in text.strip().splitlines() if not line.startswith("#")]
    if not text.endswith("\n"):
        lines = lines[:-1]  # which may be cut off
    return bool(lines) and all(map(_is_image, lines[::2])) and all(map(_are_points, lines[1::2]))


def _is_image(line: str) -> bool:
    """Return whether a line can only be that of an image."""
    image = _image(line)
    if image is None or image[0].startswith("#") or is_number(image[0]):
        return False
    return abs(math.hypot(*image[1][:4]) - 1) <= MAX_ROUNDING


def _image(line: str) -> Image | None:
    """Return the image of a line of images.txt, if it has one."""
    fields = line.split(maxsplit=9)
    if len(fields) < 10 or not all(is_number(field, finite=True) for field in fields[1:8]):
        return None
    if not all(re.fullmatch("[0-9]{1,10}", fields[number]) for number in (0, 8)):
        return None
    return fields[9].strip(), tuple(map(float, fields[1:8])), int(fields[0])


def _read_file(path: Path) -> Trajectory:
    if path.name == "images.bin":
        return _trajectory(path, _images_of_binary(path))
    if path.name == "images.txt" or (path.suffix != ".bin" and is_images(read_head(path))):
        return _trajectory(path, _images_of_text(path))
    with suppress(FileError):
        if format_of_table(path) == "hloc":
            return read_hloc(path)
    reason = "is a file, not a COLMAP model; "
    if _file_of_images(path.parent).exists():
        reason += f"name its folder, {path.parent}"
    else:
        reason += "leave out the format to have it detected"
    raise FileError(path, reason)


def _images_of_binary(path: Path) -> Images:
    """Return the registered images of a binary model."""
    images: Images = []
    with open_file(path, MAX_BYTES) as file:
        size = file.seek(0, SEEK_END)
        file.seek(0)
        n = int.from_bytes(file.read(8), "little")
        while len(images) < n:
            head, name = file.read(POSE.size), bytearray()
            while (letter := file.read(1)) not in (b"", b"\0"):
                name += letter
                if len(name) > 4 * MAX_NAME:  # bytes of UTF-8
                    reason = f"is damaged: the name of image {len(images)} does not end"
                    raise FileError(path, reason)
            n_points = file.read(8)
            end = file.tell() + POINT * int.from_bytes(n_points, "little")
            if len(n_points) < 8 or end > size:
                break
            number, *pose = POSE.unpack(head)
            images.append((name.decode(errors="replace"), tuple(pose), number))
            file.seek(end)
        if len(images) < n or size < 8:
            raise FileError(path, f"is cut off: it holds {len(images)} of its {n} images")
        if rest := size - file.tell():
            raise FileError(path, f"is damaged: {rest} bytes follow the last of its {n} images")
    return images


def _images_of_text(path: Path) -> Images:
    """Return the registered images of a text model."""
    images: Images = []
    lines = (line for line in numbered_lines(path, MAX_BYTES) if not line[1].startswith("#"))
    for number, line in lines:
        if not line.strip():
            continue
        image = _image(line)
        if image is None:
            reason = "must hold 'IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME', with whole IDs, "
            raise FileError(path, f"{reason}seven numbers and a name", place=f"line {number}")
        images.append(image)
        number, line = next(lines, (number, ""))
        if not _are_points(line):
            reason = "expected the line of 2D points, 'X Y POINT3D_ID ...', after each image"
            raise FileError(path, reason, place=f"line {number}")
    return images


def _frames_of_binary(path: Path) -> dict[int, int]:
    """Return the frame of each image, by their numbers, of a binary model."""
    content, frame_of = read_bytes(path), {}
    try:
        (n,), at = struct.unpack_from("<Q", content), 8
        for _ in range(n):
            frame, n_data = FRAME.unpack_from(content, at)
            at += FRAME.size
            for _ in range(n_data):
                sensor_type, number = DATUM.unpack_from(content, at)
                at += DATUM.size
                if sensor_type == CAMERA:
                    frame_of[number] = frame
        if at < len(content):
            raise struct.error
    except struct.error:
        raise FileError(path, "is cut off or damaged; --rig_frames none does without it") from None
    return frame_of


def _frames_of_text(path: Path) -> dict[int, int]:
    """Return the frame of each image, by their numbers, of a text model."""
    frame_of = {}
    for at, line in numbered_lines(path):
        fields = line.split()
        if not fields or line.startswith("#"):
            continue
        try:
            frame, n_data, data = int(fields[0]), int(fields[9]), fields[10:]
            if len(data) != 3 * n_data:
                raise ValueError
            images = [
                int(datum)
                for sensor_type, datum in zip(data[::3], data[2::3], strict=True)
                if sensor_type == "CAMERA"
            ]
        except (IndexError, ValueError):
            reason = "must hold 'FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS' and as many "
            remedy = "'SENSOR_TYPE SENSOR_ID DATA_ID'; --rig_frames none does without it"
            raise FileError(path, f"{reason}{remedy}", place=f"line {at}") from None
        frame_of.update(dict.fromkeys(images, frame))
    return frame_of


def _are_points(line: str) -> bool:
    """Return whether a line of images.txt has points: two numbers and a whole one each."""
    fields = line.split()
    whole = all(field.removeprefix("-").isdecimal() for field in fields[2::3])
    return len(fields) % 3 == 0 and whole and all(map(is_number, fields))


def _trajectory(path: FilePath, images: Images) -> Trajectory:
    """Return the trajectory of registered images, whose poses are world-to-camera."""
    if not images:
        raise FileError(path, "the model has no registered image")
    names, poses, _ = zip(*sorted(images, key=itemgetter(0)), strict=True)
    quaternions, translations = np.split(np.array(poses), [4], axis=1)
    source = Source(path, lambda row: f"image {brief(names[row])}")
    world_to_camera = poses_from_quaternions(translations, quaternions[:, [1, 2, 3, 0]], source)
    return checked(image_names(names, source), inverse_poses(world_to_camera), source)
