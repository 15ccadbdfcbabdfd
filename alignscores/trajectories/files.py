"""Trajectory files: TUM, KITTI and EuRoC through evo, COLMAP through pycolmap, NeRF.

Every reader returns a `Trajectory`, a pair ``keys, poses`` with camera-to-world poses. An estimate
may hold poses that are not finite, which are cameras that were not estimated; with
``complete=True``, for a reference, they are an error. Text files may be compressed, with a name
that ends in ``.gz``, and ``-`` is stdin. Whatever is wrong with a file is a
`FileError` that names file, line and reason.
"""

import gzip
import json
import mmap
import posixpath
import re
import struct
import sys
import warnings
import zlib
from collections.abc import Callable, Sequence
from functools import cache
from io import StringIO
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arrays import Floats
from ..validation import finite_rows
from .extras import require

__all__ = [
    "FileError",
    "Trajectory",
    "TrajectoryWarning",
    "orthonormalised",
    "read_colmap",
    "read_colmap_parts",
    "read_euroc",
    "read_kitti",
    "read_nerf",
    "read_stamps",
    "read_tum",
    "time_unit",
]

FilePath = str | PathLike[str]
Where = Callable[[int], str]  # row -> its place in the file, for an error

TUM_COLUMNS = "timestamp tx ty tz qx qy qz qw"
KITTI_COLUMNS = "r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz"
EUROC_COLUMNS = "timestamp tx ty tz qw qx qy qz ..."
COLMAP_FILES = "cameras", "images", "points3D"
COLMAP_RECORDS = {  # bytes of a record, whether a name follows, its count of items, bytes of one
    "images.bin": (64, True, "<Q", 24),
    "frames.bin": (64, False, "<I", 16),
    "points3D.bin": (43, False, "<Q", 8),
}
FORMAT_OF_COLUMNS = {8: "tum", 12: "kitti"}

STDIN = "-"
TIME_UNITS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
LATEST = 1e11  # seconds; larger time stamps, as a rule, are in a smaller unit
LONGEST = 1e14  # nanoseconds, a day or so; larger time stamps are not counted from a start
LONGEST_STEP = 5e5  # from one stamp to the next; what counts from a start in larger steps is in ns
ROUNDED = 1e-2  # largest deviation from a unit quaternion or a rotation that is taken for rounding
NO_ROTATION = 0.1  # deviation from a rotation beyond which a matrix is refused
OPENGL_TO_OPENCV = np.array([1.0, -1.0, -1.0])  # the camera's y and z axes point the other way


class FileError(ValueError):
    """A trajectory file that cannot be read, with its name, the line and the reason.

    Parameters
    ----------
    path : path
        The file.
    reason : str
        What is wrong with it.
    place : str
        Where in the file, if anywhere.

    Examples
    --------
    >>> from alignscores.trajectories.files import FileError
    >>> print(FileError("estimate.txt", "has 2 columns", place="line 1"))
    estimate.txt, line 1: has 2 columns
    """

    def __init__(self, path: FilePath, reason: str, *, place: str = "") -> None:
        super().__init__(f"{path}{place and ', '}{place}: {reason}")


class TrajectoryWarning(UserWarning):
    """Something in a trajectory that was corrected, and that the user should know about."""


class Trajectory(NamedTuple):
    """Poses with what identifies each of them.

    Parameters
    ----------
    keys : (n,) ndarray
        Time stamps in seconds (float), image names (str) or row numbers (int).
    poses : (n, 4, 4) ndarray
        Camera-to-world poses.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.files import Trajectory
    >>> keys, poses = Trajectory(np.array([0.5]), np.eye(4)[None])
    >>> keys
    array([0.5])
    """

    keys: NDArray[Any]
    poses: Floats


def read_tum(path: FilePath, *, complete: bool = False) -> Trajectory:
    r"""Read a TUM file: ``timestamp tx ty tz qx qy qz qw`` in each line, camera-to-world.

    Parameters
    ----------
    path : path
        The file. Blank lines and those that begin with # are left out.
    complete : bool
        Refuse poses that are not finite, as in a reference.

    Returns
    -------
    Trajectory
        Time stamps in seconds and poses, in the order of the file.

    Raises
    ------
    FileError
        Where the file cannot be read, a line is malformed or holds no rotation, or stamps are in
        another unit.
    ModuleNotFoundError
        Where evo is not installed.

    Warns
    -----
    TrajectoryWarning
        Where quaternions are far from unit length; they are normalised.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_tum
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "estimate.txt")
    ...     _ = path.write_text("# a comment\n0.5 1 2 3 0 0 0 1\n")
    ...     stamps, poses = read_tum(path)
    >>> stamps, poses[0, :3, 3]
    (array([0.5]), array([1., 2., 3.]))
    """
    stamps, poses = _read_stamped(path, "read_tum_trajectory_file", TUM_COLUMNS, complete)
    if (unit := time_unit(stamps)) != "seconds":
        raise _wrong_unit(path, stamps, unit, "seconds")
    return Trajectory(stamps, poses)


def read_euroc(path: FilePath, *, complete: bool = False) -> Trajectory:
    r"""Read a EuRoC ``data.csv``: ``timestamp, tx, ty, tz, qw, qx, qy, qz, ...``, stamps in ns.

    A file without commas is read as TUM: estimates for EuRoC sequences are commonly stored so, with
    stamps in seconds or, as by ORB-SLAM3, in ns. Which it is shows in the stamps, with commas and
    without.

    Parameters
    ----------
    path, complete : path and bool
        As in `read_tum`, with the same errors and the same warning.

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
    lines = (line for line in _text(path).splitlines() if line.strip() and line.strip()[0] != "#")
    if "," not in next(lines, ","):
        stamps, poses = _read_stamped(path, "read_tum_trajectory_file", TUM_COLUMNS, complete)
        return Trajectory(_in_seconds(path, stamps), poses)
    # evo takes all stamps for nanoseconds.
    stamps, poses = _read_stamped(
        path, "read_euroc_csv_trajectory", EUROC_COLUMNS, complete, delimiter=","
    )
    unit = time_unit(stamps * 1e9)
    return Trajectory(stamps if unit == "nanoseconds" else _in_seconds(path, stamps * 1e9), poses)


def read_kitti(path: FilePath, *, complete: bool = False) -> Trajectory:
    r"""Read a KITTI file: in each line the upper three rows of a camera-to-world matrix.

    Parameters
    ----------
    path, complete : path and bool
        As in `read_tum`, with the same errors.

    Returns
    -------
    Trajectory
        Row numbers and poses. Matrices that are rotations up to rounding are replaced by the
        nearest rotation.

    Warns
    -----
    TrajectoryWarning
        Where matrices are far from rotations; they are replaced, too.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_kitti
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "00.txt")
    ...     _ = path.write_text("1 0 0 4 0 1 0 5 0 0 1 6\n")
    ...     rows, poses = read_kitti(path)
    >>> rows, poses[0, :3, 3]
    (array([0]), array([4., 5., 6.]))
    """
    trajectory, where = _through_evo(path, "read_kitti_poses_file", KITTI_COLUMNS)
    poses = np.array(trajectory.poses_se3)
    _check_poses(poses, path, where, complete)
    return Trajectory(np.arange(len(poses)), poses)


def read_colmap(path: FilePath, *, complete: bool = False) -> Trajectory:
    """Read the registered images of a COLMAP model.

    Parameters
    ----------
    path : path
        The model's folder, with text or binary files.
    complete : bool
        As in `read_tum`.

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
    pycolmap = require("pycolmap", "colmap")
    if not Path(path).is_dir():
        raise FileError(path, "is not a folder; a COLMAP model is a folder with cameras and images")
    for file in COLMAP_RECORDS:
        _check_whole(Path(path) / file)
    try:
        model = pycolmap.Reconstruction(str(path))
    except (IndexError, MemoryError, OSError, RuntimeError, ValueError) as error:
        _locate_in_images_txt(Path(path))
        reason = re.sub(r"^\[[^]]*\] (Check failed: )?", "", str(error).partition("\n")[0])
        raise FileError(path, _why_no_model(Path(path), reason)) from None
    images = sorted(
        (image for image in model.images.values() if image.has_pose), key=lambda image: image.name
    )
    if not images:
        raise FileError(path, "the model has no registered image")
    names = [image.name for image in images]
    world_to_camera = np.tile(np.eye(4), (len(images), 1, 1))
    world_to_camera[:, :3] = [image.cam_from_world().matrix() for image in images]
    _check_poses(world_to_camera, path, lambda row: f"image {names[row]!r}", complete)
    return Trajectory(np.array(names), inverse_poses(world_to_camera))


def read_colmap_parts(path: FilePath) -> dict[str, Trajectory]:
    """Read a COLMAP model, or all of a folder that is none but holds some, as ``sparse/`` does.

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


def read_nerf(path: FilePath, *, complete: bool = False) -> Trajectory:
    """Read a NeRF ``transforms.json``: camera-to-world matrices with OpenGL camera axes.

    The camera's axes are changed to x right, y down, z forward, as in all other formats.

    Parameters
    ----------
    path, complete : path and bool
        As in `read_tum`.

    Returns
    -------
    Trajectory
        The frames' ``file_path`` without a leading ``./``, and poses; ordered by them, as those of
        COLMAP, since the TAS hangs on the order of the cameras.

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
    frames = _nerf_frames(path)
    matrices, names = [], []
    for index, frame in enumerate(frames):
        place = f"frames[{index}]"
        try:
            name, matrix = frame["file_path"], np.array(frame["transform_matrix"], dtype=float)
        except (KeyError, TypeError, ValueError):
            raise FileError(
                path, "needs a file_path and a transform_matrix of numbers", place=place
            ) from None
        if not isinstance(name, str) or matrix.shape not in ((4, 4), (3, 4)):
            raise FileError(
                path, "file_path must be a text and transform_matrix 4 x 4", place=place
            )
        names.append(posixpath.normpath(name))
        matrices.append(matrix[:3])
    poses = np.tile(np.eye(4), (len(frames), 1, 1))
    poses[:, :3] = matrices
    _check_poses(poses, path, lambda row: f"frames[{row}] ({names[row]!r})", complete)
    poses[:, :3, :3] *= OPENGL_TO_OPENCV
    order = np.argsort(names, kind="stable")  # of equal names the first in the file stays first
    return Trajectory(np.array(names)[order], poses[order])


def read_stamps(path: FilePath) -> Floats:
    r"""Read the time stamps in the first column of a text file.

    Parameters
    ----------
    path : path
        The file: TUM's ``rgb.txt``, EuRoC's ``cam0/data.csv``, a trajectory. Columns are separated
        by blanks or commas; a header line, blank lines and those that begin with # are left out.

    Returns
    -------
    (n,) ndarray
        Time stamps in seconds; those of a file in nanoseconds are divided by 1e9.

    Raises
    ------
    FileError
        Where the file cannot be read, a line does not begin with a finite number, or the stamps
        are in milliseconds or microseconds.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.trajectories.files import read_stamps
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "data.csv")
    ...     _ = path.write_text("time,file\n1500000000500000000,a.png\n")
    ...     stamps = read_stamps(path)
    >>> stamps
    array([1.5e+09])
    """
    stamps: list[float] = []
    header = True
    for number, line in enumerate(StringIO(_text(path), newline=None), 1):
        fields = line.replace(",", " ").split()
        if not fields or fields[0][0] == "#":
            continue
        if _is_number(fields[0]) and np.isfinite(float(fields[0])):
            stamps.append(float(fields[0]))
        elif not header:
            reason = f"must begin with a time stamp, not {fields[0][:40]!r}"
            raise FileError(path, reason, place=f"line {number}")
        header = False
    if not stamps:
        raise FileError(path, "has no time stamps")
    return _in_seconds(path, np.array(stamps))


def time_unit(stamps: Floats) -> str:
    """Return the unit of time stamps, as it shows in their size, or else in their steps.

    Parameters
    ----------
    stamps : (n,) array
        Since 1970, or since the start of a recording. Of the latter, milliseconds and microseconds
        cannot be told from seconds.

    Returns
    -------
    str
        A key of ``TIME_UNITS``.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.files import time_unit
    >>> time_unit(np.array([1.7e12, 1.7e12 + 33])), time_unit(np.array([0.0, 5e7, 1e8]))
    ('milliseconds', 'nanoseconds')
    """
    size = float(np.median(np.abs(stamps)))
    steps = np.diff(np.unique(stamps))
    if size < LONGEST and len(steps) > 0 and np.median(steps) >= LONGEST_STEP:
        return "nanoseconds"
    units = (unit for unit, factor in TIME_UNITS.items() if size < LATEST * factor)
    return next(units, "nanoseconds")


def _in_seconds(path: FilePath, stamps: Floats) -> Floats:
    """Return time stamps in seconds, be they in seconds or in nanoseconds."""
    unit = time_unit(stamps)
    if unit not in ("seconds", "nanoseconds"):
        raise _wrong_unit(path, stamps, unit, "seconds or nanoseconds")
    return stamps / TIME_UNITS[unit]


def _wrong_unit(path: FilePath, stamps: Floats, unit: str, right: str) -> FileError:
    return FileError(
        path,
        f"its time stamps seem to be in {unit} (the first is {stamps[0]:.0f}); write them in "
        f"{right}",
    )


def inverse_poses(poses: Floats) -> Floats:
    """Invert poses (n, 4, 4): camera-to-world from world-to-camera, or the other way round."""
    inverse = poses.copy()
    inverse[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    inverse[:, :3, 3] = -np.einsum("nji,nj->ni", poses[:, :3, :3], poses[:, :3, 3])
    return inverse


def orthonormalised(matrices: Floats) -> tuple[Floats, Floats]:
    """Return the rotations nearest to matrices that are rotations up to rounding.

    Parameters
    ----------
    matrices : (n, 3, 3) array
        Rotations with few digits.

    Returns
    -------
    rotations : (n, 3, 3) ndarray
        The nearest rotations, by Newton steps for the polar decomposition; meaningless where the
        deviation is not well below 1.
    deviation : (n,) ndarray
        Largest entry of ``R^T R - I`` before.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.trajectories.files import orthonormalised
    >>> rotations, deviation = orthonormalised(np.array([[[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]]))
    >>> np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-14), deviation
    (True, array([0.01]))
    """
    with np.errstate(all="ignore"):
        excess = matrices.transpose(0, 2, 1) @ matrices - np.eye(3)
        deviation = np.abs(excess).reshape(-1, 9).max(axis=1)
        for _ in range(4):  # each step squares the deviation
            matrices = matrices - matrices @ excess / 2
            excess = matrices.transpose(0, 2, 1) @ matrices - np.eye(3)
    return matrices, deviation


def _read_stamped(
    path: FilePath, reader: str, columns: str, complete: bool, delimiter: str | None = None
) -> Trajectory:
    """Read a file of time stamps, positions and quaternions."""
    trajectory, where = _through_evo(path, reader, columns, delimiter)
    stamps: Floats = trajectory.timestamps
    if not np.isfinite(stamps).all():
        row = int(np.argmin(np.isfinite(stamps)))
        raise FileError(path, "the time stamp is not finite", place=where(row))
    quaternions = trajectory.orientations_quat_wxyz
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(quaternions, axis=1)
    if (lengths == 0).any():
        row = int(np.argmax(lengths == 0))
        raise FileError(path, "the quaternion is zero, which is not a rotation", place=where(row))
    _warn_of(np.abs(lengths - 1), path, where, "has a quaternion that is not of unit length")

    poses = np.tile(np.eye(4), (len(stamps), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = np.nan, trajectory.positions_xyz
    estimated = np.isfinite(lengths)
    poses[estimated, :3, :3] = scipy.spatial.transform.Rotation.from_quat(
        quaternions[estimated], scalar_first=True
    ).as_matrix()
    _check_complete(poses, path, where, complete)
    return Trajectory(stamps, poses)


def _through_evo(
    path: FilePath, reader: str, columns: str, delimiter: str | None = None
) -> tuple[Any, Where]:
    """Read a text file with evo; return evo's trajectory and where its rows are in the file.

    evo refuses blank lines and repeated or trailing separators, and does not say where they are. So
    it is given the records joined by single separators.
    """
    file_interface = require("evo.tools.file_interface", "files")
    records, numbers = _records(path, columns, delimiter)
    separator = delimiter or " "

    def where(row: int) -> str:
        return f"line {numbers[row]}"

    text = StringIO("\n".join(separator.join(record) for record in records))
    try:
        return getattr(file_interface, reader)(text), where
    except Exception as error:  # evo raises its own, csv's and NumPy's errors
        for row, record in enumerate(records):
            for field in record:
                if not _is_number(field):
                    header = "; a header line begins with #" if row == 0 else ""
                    raise FileError(
                        path, f"{field[:40]!r} is not a number{header}", place=where(row)
                    ) from None
        raise FileError(path, f"evo cannot read it: {error}") from None


def _records(
    path: FilePath, columns: str, delimiter: str | None
) -> tuple[list[list[str]], list[int]]:
    """Return the fields of each line of a text file, no further ones, and the line numbers."""
    least, open_ended = len(columns.removesuffix(" ...").split()), columns.endswith("...")
    records, numbers = [], []
    for number, line in enumerate(StringIO(_text(path), newline=None), 1):
        line = line.strip()
        if not line or line[0] == "#":
            continue
        fields = line.split(delimiter)
        if len(fields) < least or (len(fields) > least and not open_ended):
            raise FileError(path, _wrong_columns(fields, columns), place=f"line {number}")
        records.append(fields[:least])
        numbers.append(number)
    if not records:
        raise FileError(path, "has no poses")
    return records, numbers


def _wrong_columns(fields: Sequence[str], columns: str) -> str:
    reason = f"has {len(fields)} column{'s'[: len(fields) != 1]}, not {columns!r}"
    if len(fields) in FORMAT_OF_COLUMNS:
        reason += f"; {len(fields)} columns are the {FORMAT_OF_COLUMNS[len(fields)]} format"
    elif len(fields) == 16:
        reason += "; the last row, 0 0 0 1, is left out"
    elif "," in fields[0]:
        reason += "; files with commas are the euroc format"
    return reason


def _text(path: FilePath) -> str:
    """Return the text of a file, whatever its line ends, also of one compressed or of stdin."""
    data = b""
    try:
        data = _stdin() if str(path) == STDIN else Path(path).read_bytes()
        data = _decompressed(path, data) if str(path).endswith(".gz") else data
        text = data.decode("utf-8-sig")
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise FileError(path, "is not text (UTF-8)", place=f"line {line}") from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise FileError(path, "is not text (a zero byte)", place=f"line {line}")
    return text


@cache
def _stdin() -> bytes:
    """Return what stands on stdin, which can be read but once."""
    return sys.stdin.buffer.read()


def _decompressed(path: FilePath, data: bytes) -> bytes:
    try:
        return gzip.decompress(data)
    except (EOFError, OSError, zlib.error) as error:
        raise FileError(path, f"is not a complete gzip file ({error})") from None


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _nerf_frames(path: FilePath) -> list[Any]:
    try:
        content = json.loads(_text(path))
    except json.JSONDecodeError as error:
        raise FileError(path, f"is not JSON ({error.msg})", place=f"line {error.lineno}") from None
    except RecursionError:
        raise FileError(path, "is not a transforms.json: it is nested too deeply") from None
    frames = content.get("frames") if isinstance(content, dict) else None
    if not isinstance(frames, list):
        raise FileError(path, "is not a transforms.json: it has no list of frames")
    if not frames:
        raise FileError(path, "has no frames")
    return frames


def _check_whole(path: Path) -> None:
    """Refuse a binary file of a model that is cut off, which pycolmap may read without end."""
    if not path.is_file():
        return
    record, named, count, item = COLMAP_RECORDS[path.name]
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
    """Say why a folder cannot be read as a model, of which pycolmap says little."""
    files = {path.name for path in folder.iterdir()}
    for suffix, empty in (".bin", "8 zero bytes"), (".txt", "an empty file"):
        missing = [part + suffix for part in COLMAP_FILES if part + suffix not in files]
        if not missing:
            return f"is not a readable COLMAP model, as if a file were cut off ({reason})"
        if len(missing) < len(COLMAP_FILES):
            remedy = f"; {empty} will do for it" if missing == [f"points3D{suffix}"] else ""
            return f"the COLMAP model lacks {' and '.join(missing)}{remedy}"
    models = sorted(path.parent.name for path in folder.glob("*/images.*"))
    hint = f", but {folder / models[0]} is: give that one" if models else ""
    return f"is not a COLMAP model, with {', '.join(COLMAP_FILES)} as .bin or .txt{hint}"


def _locate_in_images_txt(model: Path) -> None:
    """Raise a FileError with the first malformed line of a text model's images, if there is one.

    pycolmap does not say which line it is. Each image has two lines, the second of which may be
    empty.
    """
    path = model / "images.txt"
    if not path.is_file():
        return
    image_line = True
    for number, line in enumerate(StringIO(_text(path), newline=None), 1):
        if line.startswith("#") or (image_line and not line.strip()):
            continue
        if image_line:
            fields = line.split()
            numbers = [float(field) for field in fields[:9] if _is_number(field)]
            if len(fields) < 10 or len(numbers) < 9 or not np.isfinite(numbers).all():
                raise FileError(
                    path,
                    "must hold 'IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME', all but the last "
                    "of them numbers",
                    place=f"line {number}",
                )
        image_line = not image_line


def _check_poses(poses: Floats, path: FilePath, where: Where, complete: bool) -> None:
    """Refuse matrices that are no rotation; replace the others by the nearest one, in place."""
    matrices = poses[:, :3, :3]
    rotations, deviation = orthonormalised(matrices)
    with np.errstate(all="ignore"):
        reflected = (np.linalg.det(matrices) < 0) & (deviation <= NO_ROTATION)
    wrong = (reflected | ~(deviation <= NO_ROTATION)) & finite_rows(matrices)
    if wrong.any():
        row = int(np.argmax(wrong))
        reason = (
            "its determinant is negative, a reflection"
            if reflected[row]
            else f"R^T R differs from the identity by {deviation[row]:.2g}"
        )
        raise FileError(path, f"the matrix is not a rotation: {reason}", place=where(row))
    _warn_of(deviation, path, where, "has a matrix that is only roughly a rotation")
    poses[:, :3, :3] = rotations
    _check_complete(poses, path, where, complete)


def _check_complete(poses: Floats, path: FilePath, where: Where, complete: bool) -> None:
    if complete and not np.isfinite(poses).all():
        raise FileError(
            path,
            "the pose is not finite; a reference must be complete (is this the estimate? The "
            "reference comes first)",
            place=where(int(np.argmin(finite_rows(poses)))),
        )


def _warn_of(deviation: Floats, path: FilePath, where: Where, what: str) -> None:
    """Warn of rotations that deviate from a rotation by more than rounding explains."""
    rows = np.flatnonzero(np.isfinite(deviation) & (deviation > ROUNDED))
    if len(rows) > 0:
        first, others = int(rows[0]), len(rows) - 1
        more = f" and so have {others} more" if others else ""
        warnings.warn(
            f"{path}, {where(first)}: {what} (off by {deviation[first]:.2g}){more}; normalised",
            TrajectoryWarning,
            stacklevel=4,
        )
