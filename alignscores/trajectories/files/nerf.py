"""NeRF's ``transforms.json``, and the cameras that nerfstudio exports."""

import json
import posixpath
from typing import Any

import numpy as np

from .poses import Trajectory, poses_from_matrices
from .text import FileError, FilePath, Source, read_text

__all__ = ["read_nerf"]

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
        Where the file cannot be read, or a frame is malformed or holds no rotation.

    Warns
    -----
    TrajectoryWarning
        As in `read_kitti`.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> import numpy as np
    >>> from alignscores.trajectories.files import read_nerf
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
            matrix = np.array(matrix, dtype=float)
            names.append(posixpath.normpath(frame["file_path"]))
        except (KeyError, OverflowError, TypeError, ValueError):
            matrix = np.empty(0)
        if matrix.shape not in ((4, 4), (3, 4)):
            reason = "needs a file_path and a transform_matrix of 4 x 4 numbers"
            raise FileError(path, reason, place=f"frames[{index}]")
        matrices.append(matrix[:3])
    source = Source(path, lambda row: f"frames[{row}] ({names[row]!r})")
    poses = poses_from_matrices(np.array(matrices), source)
    poses[:, :3, :3] *= OPENGL_TO_OPENCV
    order = np.argsort(names, kind="stable")  # of equal names the first in the file stays first
    return Trajectory(np.array(names)[order], poses[order])


def _frames(path: FilePath) -> list[Any]:
    text = read_text(path)
    try:
        content = json.loads(text)
    except (RecursionError, ValueError) as error:  # also of numbers with thousands of digits
        raise FileError(path, f"is not JSON that can be read ({error})") from None
    frames = content.get("frames") if isinstance(content, dict) else content
    if not isinstance(frames, list) or not frames:
        raise FileError(path, "is not a transforms.json: it has no list of frames")
    return frames
