"""Readers of text tables, a pose a line, and of folders with a matrix a file."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..files import FileError, FilePath, Source
from ..texts import brief, first_few
from .columns import (
    FOUR_ROWS,
    NAME_THEM,
    POSITION,
    QUATERNION,
    TUM,
    UNITS,
    VECTOR,
    name_columns,
)
from .tables import Table, open_table
from .trajectory import (
    MAX_DEVIATION,
    MAX_DUPLICATES,
    MIN_IN_ORDER,
    TIME_UNITS,
    Trajectory,
    check_stamps,
    checked,
    image_names,
    in_seconds,
    inverse_poses,
    poses_from_matrices,
    poses_from_positions,
    poses_from_quaternions,
    poses_from_vectors,
    refuse_counters,
    time_unit,
    warn,
)

__all__ = [
    "format_of_table",
    "has_matrices",
    "read_euroc",
    "read_hloc",
    "read_kitti",
    "read_matrices",
    "read_names",
    "read_stamps",
    "read_tum",
]

MAX_NUMBER = 1e15  # of a frame; all digits of larger ones may not be kept
MAX_INTEGER = np.iinfo(np.int64).max
MAX_POSITION = 1e8  # metres from the origin; the centre of the earth is 6.4e6 away


def read_tum(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a text table of poses, such as TUM's ``timestamp tx ty tz qx qy qz qw``.

    Parameters
    ----------
    path : path
        The file. Fields are separated by commas or semicolons, otherwise by blanks or tabs. Blank
        lines, and what stands behind #, are left out.
    columns : str, optional
        What the columns hold: ``t`` (``t_s``, ``t_ms``, ``t_us``, ``t_ns``, ``t_ticks`` of 100 ns;
        seconds and their fraction are added), ``n`` (number of the frame), ``x y z``,
        ``qx qy qz qw``, ``rx ry rz`` (rotation vector in radians), ``r11`` to ``r33``, and ``-``
        for others. By default a header names them, or their number shows it: 3 are ``x y z``, 4
        ``t x y z``, 7 ``x y z qx qy qz qw``, 8 or more ``t x y z qx qy qz qw``, 12 and 16 a matrix
        (13 and 17: with a number).

    Returns
    -------
    Trajectory
        Time stamps in seconds, or numbers of frames or rows, and camera-to-world poses, in the
        order of the file. Rotations that the file lacks are nan.

    Raises
    ------
    FileError
        Where the file cannot be read, a line is malformed, has another number of columns than the
        first or holds no rotation, a tenth of the stamps or numbers are duplicates, or nothing
        tells what the columns hold.

    Warns
    -----
    TrajectoryWarning
        Where quaternions are not quite of unit length, and are normalised; where stamps are not in
        seconds; and where columns are not read.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_tum
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "estimate.txt")
    ...     _ = path.write_text("# a comment\n0.5 1 2 3 0 0 0 1\n")
    ...     stamps, poses = read_tum(path)
    >>> stamps, poses[0, :3, 3]
    (array([0.5]), array([1., 2., 3.]))
    """
    return _read_table(path, columns)


def read_euroc(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a EuRoC ``data.csv``: ``timestamp, tx, ty, tz, qw, qx, qy, qz, ...``, stamps in ns.

    It is read as by `read_tum`, but that nothing is said of nanoseconds and further columns, which
    are usual here. Without a header, qw comes first where the stamps are whole nanoseconds.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors.
    columns : str, optional
        As in `read_tum`.

    Returns
    -------
    Trajectory
        Time stamps in seconds and poses, in the order of the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_euroc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "data.csv")
    ...     _ = path.write_text("1500000000500000000,1,2,3,1,0,0,0\n")
    ...     stamps, poses = read_euroc(path)
    >>> float(stamps[0]), poses[0, :3, 3]
    (1500000000.5, array([1., 2., 3.]))
    """
    return _read_table(path, columns, usual="ns")


def read_kitti(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a KITTI file: in each line a camera-to-world matrix, row by row.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors. Lines have 12 numbers, the upper three rows, or 16,
        which end with 0 0 0 1; or the number of the frame before them.
    columns : str, optional
        As in `read_tum`.

    Returns
    -------
    Trajectory
        Numbers of rows, or of frames, and poses. Matrices that are rotations up to rounding are
        replaced by the nearest rotation.

    Warns
    -----
    TrajectoryWarning
        Where matrices are far from rotations; they are replaced, too.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_kitti
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "00.txt")
    ...     _ = path.write_text("1 0 0 4 0 1 0 5 0 0 1 6\n")
    ...     rows, poses = read_kitti(path)
    >>> rows, poses[0, :3, 3]
    (array([0]), array([4., 5., 6.]))
    """
    trajectory = _read_table(path, columns)
    if trajectory.keys.dtype.kind == "f":
        raise FileError(path, "has time stamps, unlike the kitti format; give tum instead")
    return trajectory


def read_names(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a text table of image names with camera-to-world poses.

    Parameters
    ----------
    path : path
        As in `read_tum`, with the same errors. A name in the first column may hold blanks.
    columns : str, optional
        As in `read_tum`, with ``name``. By default a header names them, or the table has a name
        and ``x y z qx qy qz qw``, 12 or 16 numbers of a matrix.

    Returns
    -------
    Trajectory
        Image names and poses, ordered by name.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_names
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "poses.csv")
    ...     _ = path.write_text("image,x,y,z,qx,qy,qz,qw\na.jpg,1,2,3,0,0,0,1\n")
    ...     names, poses = read_names(path)
    >>> str(names[0]), poses[0, :3, 3]
    ('a.jpg', array([1., 2., 3.]))
    """
    table = open_table(path)
    names = name_columns(table, columns)
    if "name" not in names:
        raise FileError(path, "has no column of image names; --columns names it, 'name ...'")
    used = [name for name in names if name not in ("-", "name")]
    texts, values = table.names_and_numbers(names.index("name"), list(map(names.index, used)))
    values = _converted(values, used, names, table)
    _warn_of_ignored(["name", *used], names, table)
    order = sorted(range(len(texts)), key=texts.__getitem__)
    keys, source = image_names(texts, table.source), table.source
    trajectory = checked(keys, _poses(values, used, source, "name "), source)
    return Trajectory(trajectory.keys[order], trajectory.poses[order])


def read_hloc(path: FilePath, *, columns: str | None = None) -> Trajectory:
    r"""Read a text table ``name qw qx qy qz tx ty tz`` of world-to-camera poses, as hloc writes it.

    Parameters
    ----------
    path : path
        As in `read_names`, with the same errors.
    columns : str, optional
        As in `read_names`.

    Returns
    -------
    Trajectory
        Image names and camera-to-world poses, ordered by name.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_hloc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "results.txt")
    ...     _ = path.write_text("query/a.jpg 1 0 0 0 1 2 3\n")
    ...     names, poses = read_hloc(path)
    >>> str(names[0]), poses[0, :3, 3]
    ('query/a.jpg', array([-1., -2., -3.]))
    """
    names, poses = read_names(path, columns=columns)
    return Trajectory(names, inverse_poses(poses))


def read_matrices(path: FilePath) -> Trajectory:
    r"""Read a folder of text files, each with a camera-to-world matrix of 4 (or 3) rows.

    Parameters
    ----------
    path : path
        The folder. Files whose names end in ``.pose.txt`` are read, otherwise all ``.txt``.

    Returns
    -------
    Trajectory
        The last numbers in the names of the files, or the names where one has none or a decimal
        point, and poses; as of `read_kitti`.

    Raises
    ------
    FileError
        Where there is no such file, or one holds another table.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_matrices
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name, x in (("frame-000010.pose.txt", 5), ("frame-000002.pose.txt", 4)):
    ...         text = f"1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    ...         _ = pathlib.Path(folder, name).write_text(text)
    ...     numbers, poses = read_matrices(folder)
    >>> numbers, poses[:, 0, 3]
    (array([ 2, 10]), array([4., 5.]))
    """
    files = _files_of_matrices(Path(path))
    if not files:
        raise FileError(path, "is not a folder with matrices in .txt files")
    names = [re.sub(r"(\.pose)?\.txt$", "", file.name) for file in files]
    keys = _keys_of_files(names, path)
    order = np.argsort(keys)
    files = [files[row] for row in order]
    source = Source(path, lambda row: files[row].name)
    poses = poses_from_matrices(np.array(list(map(_matrix, files))), source)
    return checked(keys[order], poses, source)


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
        Time stamps in seconds, whatever their unit is in the file.

    Raises
    ------
    FileError
        Where the file cannot be read, or a line does not begin with a finite number.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from alignscores.io import read_stamps
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "data.csv")
    ...     _ = path.write_text("time,file\n1500000000500000000,a.png\n")
    ...     stamps = read_stamps(path)
    >>> stamps
    array([1.5e+09])
    """
    table = open_table(path)
    stamps = table.stamps()
    table.source.refuse(~np.isfinite(stamps), "the time stamp is not finite")
    seconds = stamps / TIME_UNITS[time_unit(stamps)]
    check_stamps(seconds, table.source)
    return seconds


def format_of_table(path: FilePath, columns: str | None = None) -> str:
    """Return which of the readers above a text table takes, by its header and its first row."""
    table = open_table(path)
    names = name_columns(table, columns)
    if "name" in names and not any(name[0] == "t" or name == "n" for name in names):
        is_hloc = names[:2] == ["name", "qw"] and not columns and not table.header
        return "hloc" if is_hloc else "names"
    if "r11" in names and not any(name[0] in "nt" for name in names):
        return "kitti"
    w_first = "qw" in names and names.index("qw") < names.index("qx")
    return "euroc" if w_first else "tum"


def has_matrices(folder: Path) -> bool:
    """Return whether a folder has files that may hold matrices."""
    return bool(_files_of_matrices(folder))


def _files_of_matrices(folder: Path) -> list[Path]:
    files = list(folder.glob("*.txt")) if folder.is_dir() else []
    return [file for file in files if file.name.endswith(".pose.txt")] or files


def _keys_of_files(names: list[str], path: FilePath) -> NDArray[Any]:
    """Return the last numbers in the names of files, or the names where many have none."""
    digits = [re.findall(r"\d+", name) if "." not in name else [] for name in names]  # no 17.25
    numbers = [int(of_name[-1]) if of_name else MAX_INTEGER for of_name in digits]
    count = Counter(numbers)
    wrong = [
        row for row, number in enumerate(numbers) if number >= MAX_INTEGER or count[number] > 1
    ]
    if not wrong:
        return np.array(numbers)
    if len(wrong) < MAX_DUPLICATES * len(names):
        odd = first_few([brief(names[row]) for row in wrong])
        reason = "of its files, only these have no number in the name that no other file has: "
        raise FileError(path, f"{reason}{odd}; rename or remove them")
    return np.array(names)


def _matrix(path: Path) -> Floats:
    table = open_table(path)
    values = table.numbers(range(len(table.first)))
    if values.shape not in ((3, 4), (4, 4), (1, 12), (1, 16)):
        raise FileError(path, f"must hold a 4 x 4 matrix, not {len(values)} x {len(values.T)}")
    return np.vstack([values.reshape(-1, 4), [0, 0, 0, 1]])[:4]


def _read_table(path: FilePath, columns: str | None, usual: str = "s") -> Trajectory:
    """Read a table; no warning about columns that are left out where stamps are usually in ns."""
    table = open_table(path)
    names = name_columns(table, columns)
    used = [name for name in names if name not in ("-", "name")]
    values = table.numbers([names.index(name) for name in used])
    values = _converted(values, used, names, table)
    column = dict(zip(used, values.T, strict=True))
    if usual == "s":
        _warn_of_ignored(used, names, table)
    if "rx" in column and not columns:
        warn(path, "read rx ry rz as a rotation vector in radians; Euler angles are not read")
    if not columns:
        _refuse_others(values, column, table)
    keys = _keys(column, table.source, usual)
    key = next((f"{name} " for name in used if name[0] in "tn"), "")
    return checked(keys, _poses(values, used, table.source, key), table.source)


def _warn_of_ignored(used: list[str], names: list[str], table: Table) -> None:
    """Warn of columns that are not read, and name those that are."""
    if len(used) == len(names):
        return
    headers = [table.header[names.index(name)] for name in used] if table.header else []
    in_header = shorten(" ".join(headers), 300, placeholder=" ...")
    by_header = f" (in the header: {in_header})" if headers else ""
    ignored = f"{len(names) - len(used)} of {len(names)} columns ignored"
    warn(table.path, f"read {' '.join(used)}{by_header}, {ignored}")


def _converted(values: Floats, used: list[str], names: list[str], table: Table) -> Floats:
    """Return numbers in metres and seconds, where the names of the columns have other units."""
    units = [table.units[names.index(name)] for name in used] if table.units else []
    if not any(units):
        return values
    warn(table.path, f"converted from {', '.join(sorted({*units} - {''}))}, as its columns say")
    return values * [UNITS.get(unit, 1.0) for unit in units]


@np.errstate(over="ignore")
def _refuse_others(values: Floats, column: dict[str, Floats], table: Table) -> None:
    """Raise an error where columns that nothing names seem to hold no positions.

    Of more than eight columns, the first must be in order, as times are. Three lines of four
    numbers that have a rotation are a matrix. A heading jumps by a full turn in its range. In
    degrees or radians of latitude and longitude, a path of some kilometres is small against its
    distance from the origin, and the height has another scale; less than 5 degrees from the origin
    there is only sea. Positions that hardly change could be radians, but for a height that does.
    """
    block, n_columns = values[:3, :3], len(table.first)
    is_guess = n_columns > len(TUM.split()) and not table.header and "t" in column
    if is_guess and len(values) > 1 and np.mean(np.diff(column["t"]) > 0) < MIN_IN_ORDER:
        reason = f"has {n_columns} columns, and the first is no time: it is not in order"
        raise FileError(table.path, f"{reason}; {NAME_THEM}")
    is_small = n_columns == 4 and block.shape == (3, 3) and (np.abs(block) < 2).all()
    if is_small and np.abs(block @ block.T - np.eye(3)).max() < MAX_DEVIATION:
        reason = "seems to have a matrix in several lines; write each in one, of 12 or 16 numbers"
        raise FileError(table.path, f"{reason}, or give a folder of files with one each")
    z = column["z"][np.isfinite(column["z"])]
    jump = np.abs(np.diff(z)).max(initial=0)
    for turn in (2 * np.pi, 360) if n_columns <= 4 else ():
        in_range = any((np.abs(z - middle) < 0.501 * turn).all() for middle in (0, turn / 2))
        if in_range and jump > 0.95 * turn:
            reason = f"z jumps by {jump:.4g} within {z.min():.4g} to {z.max():.4g}, as a heading"
            remedy = "write a heading as a quaternion; if it is a height, --columns names it"
            raise FileError(table.path, f"{reason} does; {remedy}")
    rows = slice(None, None, max(1, len(column["x"]) // 1000))
    positions = np.column_stack([column[name][rows] for name in POSITION])
    positions = positions[np.isfinite(positions).all(axis=1)]
    if len(positions) < 4:
        return
    middle = np.abs(np.median(positions, axis=0))
    if middle.max() > MAX_POSITION:
        reason = (
            f"{'xyz'[middle.argmax()]} is near {middle.max():.4g}, which is no position in metres"
        )
        raise FileError(table.path, f"{reason}; --columns names the columns, such as 't x y z'")
    extent = np.ptp(positions, axis=0)
    wide, height = extent[:2].max(), extent[2]
    in_degrees = middle[:2].min() <= 90 and 5 < middle[:2].max() <= 180
    in_radians = middle[:2].min() <= np.pi / 2 and np.radians(5) < middle[:2].max() <= np.pi
    is_other = height >= wide * 10 or (in_degrees and height <= wide / 10)
    if (in_degrees or in_radians) and 0 < wide < middle[:2].max() / 200 and is_other:
        x, y = np.median(positions[:, :2], axis=0)
        raise FileError(
            table.path,
            f"seems to have latitudes and longitudes (near {x:.4f}, {y:.4f}, within {wide:.2g}); "
            "convert them to east, north, up in metres first; if they are positions in one unit, "
            "--columns names them",
        )


def _keys(column: dict[str, Floats], source: Source, usual: str) -> NDArray[Any]:
    """Return time stamps in seconds, otherwise the numbers of frames or rows."""
    stamps = {name: values for name, values in column.items() if name[0] == "t"}
    for values in stamps.values():
        source.refuse(~np.isfinite(values), "the time stamp is not finite")
    if len(stamps) == 1:
        refuse_counters(values, source)
    if stamps and "t" not in stamps:
        seconds = sum(values / TIME_UNITS[name[2:]] for name, values in stamps.items())
        for name, values in stamps.items() if len(stamps) > 1 else ():
            beyond = (values < 0) | (values >= TIME_UNITS[name[2:]])
            if name != "t_s":
                source.refuse(
                    beyond, f"{name} is not a fraction of t_s; --columns chooses one clock"
                )
        check_stamps(np.asarray(seconds), source, min(TIME_UNITS[name[2:]] for name in stamps))
        return np.asarray(seconds)
    keys = stamps.get("t", column.get("n", np.arange(0.0, len(column["x"]))))
    if not stamps:
        source.refuse(~(np.abs(keys) <= MAX_NUMBER), f"the number is not within {MAX_NUMBER:.0e}")
    if not stamps and time_unit(keys) == "s" and (keys == np.round(keys)).all():
        return keys.astype(np.int64)
    seconds = in_seconds(keys, source.path, usual)
    check_stamps(seconds, source)
    return seconds


def _poses(values: Floats, names: list[str], source: Source, key: str) -> Floats:
    """Return poses (n, 4, 4); the remedy for wrong quaternions names the key of the table."""
    positions = _part(values, names, POSITION)
    if "qw" in names:
        quaternions = _part(values, names, QUATERNION)
        other = f"'{key}qx qy qz qw x y z' for another order"
        if not key:  # stamps, read as x
            other = "'t rx ry rz x y z' for rotation vectors"
        remedy = f"; --columns names the columns, such as '{key}x y z' for only positions or "
        remedy += f"{other}; Euler angles are not read"
        return poses_from_quaternions(positions, quaternions, source, remedy)
    if "rx" in names:
        return poses_from_vectors(positions, _part(values, names, VECTOR), source)
    if "r11" not in names:
        return poses_from_positions(positions)
    matrices = _part(values, names, [name for name in FOUR_ROWS.split() if name in names])
    return poses_from_matrices(matrices.reshape(len(matrices), -1, 4), source)


def _part(values: Floats, names: list[str], part: Sequence[str]) -> Floats:
    """Return some of the columns with these names, without a copy where they follow each other."""
    indices = [names.index(name) for name in part]
    if indices == list(range(indices[0], indices[0] + len(indices))):
        return values[:, indices[0] : indices[-1] + 1]
    return values[:, indices]
