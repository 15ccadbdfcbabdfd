"""Scenes in JSON: NeRF's ``transforms.json``, nerfstudio's cameras, OpenSfM's reconstructions."""

import json
import posixpath
import re
from collections import Counter
from typing import Any

import numpy as np

from ..arrays import Floats
from ..files import FileError, FilePath, Source, read_text
from ..texts import brief
from .trajectory import (
    Trajectory,
    checked,
    image_names,
    inverse_poses,
    poses_from_matrices,
    poses_from_vectors,
    warn,
)

__all__ = ["read_nerf", "read_opensfm", "read_opensfm_models"]

MAX_BYTES = 100_000_000  # of a file of JSON, whose content takes many times as much memory
OPENGL_TO_OPENCV = np.array([1.0, -1.0, -1.0])  # the camera's y and z axes point the other way


def read_nerf(path: FilePath) -> Trajectory:
    """Read a NeRF ``transforms.json``: camera-to-world matrices with OpenGL camera axes.

    The list of frames with ``transform`` that nerfstudio's ``ns-export cameras`` writes is read,
    too. The camera's axes are changed to x right, y down, z forward, as in all other formats.

    Parameters
    ----------
    path : path
        As in `read_tum`.

    Returns
    -------
    Trajectory
        The frames' ``file_path`` without a leading ``./``, and poses; in the order of the names, as
        for COLMAP, since the TAS depends on the order of the cameras.

    Raises
    ------
    FileError
        Where the file cannot be read, a frame is malformed or holds no rotation, or a tenth of the
        names are duplicates.

    Warns
    -----
    TrajectoryWarning
        As in `read_kitti`.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> import numpy as np
    >>> from alignscores.io import read_nerf
    >>> frame = {"file_path": "./a.png", "transform_matrix": np.eye(4).tolist()}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "transforms.json")
    ...     _ = path.write_text(json.dumps({"frames": [frame]}))
    ...     names, poses = read_nerf(path)
    >>> str(names[0]), poses[0, :3, :3].diagonal()
    ('a.png', array([ 1., -1., -1.]))
    """
    matrices, names = [], []
    for index, frame in enumerate(_frames(path)):
        try:
            matrix = frame["transform" if "transform" in frame else "transform_matrix"]
            matrix = _numbers(matrix)
            names.append(posixpath.normpath(frame["file_path"]))
        except (KeyError, OverflowError, TypeError, ValueError):
            matrix = np.empty(0)
        if matrix.shape not in ((4, 4), (3, 4)):
            reason = "needs a file_path and a transform_matrix of 4 x 4 numbers"
            raise FileError(path, reason, place=f"frames[{index}]")
        matrices.append(np.vstack([matrix, [0, 0, 0, 1]])[:4])
    source = Source(path, lambda row: f"frames[{row}] ({brief(names[row])})")
    poses = poses_from_matrices(np.array(matrices), source)
    poses[:, :3, :3] *= OPENGL_TO_OPENCV
    return _by_name(names, poses, source)


def read_opensfm(path: FilePath) -> Trajectory:
    """Read OpenSfM's ``reconstruction.json``: world-to-camera rotation vectors and translations.

    Parameters
    ----------
    path : path
        As in `read_tum`.

    Returns
    -------
    Trajectory
        Image names and camera-to-world poses of the largest reconstruction, ordered by name.

    Raises
    ------
    FileError
        Where the file cannot be read, it has no image, or one is malformed.

    Warns
    -----
    TrajectoryWarning
        Where there are several reconstructions.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> from alignscores.io import read_opensfm
    >>> shots = {"a.jpg": {"rotation": [0, 0, 0], "translation": [1, 2, 3]}}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "reconstruction.json")
    ...     _ = path.write_text(json.dumps([{"cameras": {}, "shots": shots}]))
    ...     names, poses = read_opensfm(path)
    >>> str(names[0]), poses[0, :3, 3]
    ('a.jpg', array([-1., -2., -3.]))
    """
    shots = _shots(path)
    if len(shots) > 1:
        sizes = ", ".join(str(len(images)) for images in shots)
        warn(path, f"has {len(shots)} reconstructions, of {sizes} images; the largest one is read")
    return _of_shots(path, max(shots, key=len))


def read_opensfm_models(path: FilePath) -> dict[str, Trajectory]:
    """Read all reconstructions in a file of OpenSfM.

    Parameters
    ----------
    path : path
        As in `read_opensfm`.

    Returns
    -------
    dict of str to Trajectory
        The reconstructions by their numbers, "0", "1", ..., as of `read_opensfm`.

    Raises
    ------
    FileError
        As in `read_opensfm`.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> from alignscores.io import read_opensfm_models
    >>> shots = {"a.jpg": {"rotation": [0, 0, 0], "translation": [1, 2, 3]}}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "reconstruction.json")
    ...     _ = path.write_text(json.dumps([{"shots": shots}, {"shots": shots}]))
    ...     print(read_opensfm_models(path))
    {'0': Trajectory(1 poses, a.jpg to a.jpg), '1': Trajectory(1 poses, a.jpg to a.jpg)}
    """
    return {str(number): _of_shots(path, shots) for number, shots in enumerate(_shots(path))}


def _shots(path: FilePath) -> list[dict[str, Any]]:
    """Return the images of each reconstruction that has any, with their poses."""
    content = _content(path)
    models = content if isinstance(content, list) else [content]
    in_models = (model.get("shots") for model in models if isinstance(model, dict))
    shots = [images for images in in_models if isinstance(images, dict) and images]
    if not shots:
        raise FileError(path, "is not a reconstruction of OpenSfM: it has no shots")
    return shots


def _of_shots(path: FilePath, shots: dict[str, Any]) -> Trajectory:
    """Return the poses of the images of a reconstruction, which are world-to-camera."""
    names, numbers = list(shots), []
    for name, shot in shots.items():
        try:
            numbers.append(_numbers([shot["rotation"], shot["translation"]]))
            if numbers[-1].shape != (2, 3):
                raise ValueError
        except (KeyError, OverflowError, TypeError, ValueError):
            reason = "needs a rotation and a translation of 3 numbers"
            raise FileError(path, reason, place=f"shot {brief(name)}") from None
    source = Source(path, lambda row: f"shot {brief(names[row])}")
    vectors, translations = np.array(numbers).swapaxes(0, 1)
    return _by_name(names, inverse_poses(poses_from_vectors(translations, vectors, source)), source)


def is_opensfm(text: str) -> bool:
    """Return whether a file that begins with this text is a reconstruction of OpenSfM."""
    return text.lstrip().startswith(("{", "[")) and any(
        f'"{key}"' in text for key in ("shots", "reference_lla")
    )


def is_json(text: str) -> bool:
    """Return whether a file that begins with this text has JSON."""
    return bool(re.match(r"\s*+(\{|\[\s*+[\[{])", text))


def _by_name(names: list[str], poses: np.ndarray[Any, Any], source: Source) -> Trajectory:
    trajectory = checked(image_names(names, source), poses, source)
    order = np.argsort(names, kind="stable")  # of equal names the first in the file stays first
    return Trajectory(trajectory.keys[order], trajectory.poses[order])


def _numbers(rows: Any) -> Floats:
    """Return lists of numbers, or null, as an array; raise TypeError or ValueError for others."""
    if not all(type(value) in (int, float, type(None)) for row in rows for value in row):
        raise TypeError
    return np.array(rows, dtype=np.float64)


def _frames(path: FilePath) -> list[Any]:
    content = _content(path)
    frames = content.get("frames") if isinstance(content, dict) else content
    if not isinstance(frames, list) or not frames:
        raise FileError(path, "is not a transforms.json: it has no list of frames")
    return frames


def _content(path: FilePath) -> Any:
    try:
        return json.loads(read_text(path, MAX_BYTES), object_pairs_hook=_unique)
    except FileError:
        raise
    except (RecursionError, ValueError) as error:  # also of numbers with thousands of digits
        raise FileError(path, f"is not JSON that can be read ({error})") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of JSON; raise a ValueError if it has a name twice."""
    content = dict(pairs)
    if len(content) < len(pairs):
        name = next(name for name, n in Counter(name for name, _ in pairs).items() if n > 1)
        raise ValueError(f"an object has the name {name[:60]!r} twice")
    return content
