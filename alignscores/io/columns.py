"""The meaning of a text table's columns: by ``--columns``, by a header, or by their number.

The rule for headers: a name is cut into words at everything but letters. A word that is an axis,
x, y, z or w, or ends in one, makes it a coordinate.

- Position: only the axis, or with one of `POSITIONS`, as in ``tx``, ``p_RS_R_x [m]``,
  ``pose.position.x``, ``tx_world_device``, ``x_gt``.
- Quaternion: with one of `ORIENTATIONS`, as in ``qx``, ``ow``, ``q_RS_w []``, ``rotW``; all
  four. q0 to q3 are not read, since the first may be w or x.
- Rotation vector in radians: ``rx``, ``ry``, ``rz`` without ``rw``, or with one of `VECTORS`.
  Matrix: ``r11`` to ``r33``.
- Another quantity: with one of `OTHERS`, as in ``v_x`` or ``pos_std_x``.
- Time: one of `TIMES` or a unit, as in ``time_ms``, ``sec``, ``ticks`` (of 100 ns). If a column is
  called a stamp, no other is a time; nor is a mere unit, if one is called a time. Seconds and a
  fraction are added.
- Number of the frame: one of `NUMBERS`. Name of the image: one of `NAMES`.

One of `OWNERS` tells several positions apart, as in ``gt_x`` and ``est_x``; they are not mixed. A
header with two positions, rotations or clocks is refused with the choices. If there are several
positions, their owners may have any name, as in ``vicon_x`` and ``slam_x``, ``x`` and ``x_hat``.
One that repeats only some of the coordinates, as in ``x y tx ty tz``, is refused, too.

A unit among the words, as in ``x [mm]``, or in a line below the names, is one of `UNITS`.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import islice, product

import numpy as np

from ..arrays import Floats
from ..files import FileError, is_number, to_number
from .tables import COMMENTS, MISSING, Table
from .trajectory import MAX_DEVIATION

__all__ = [
    "FOUR_ROWS",
    "NAME_THEM",
    "POSITION",
    "QUATERNION",
    "TUM",
    "UNITS",
    "VECTOR",
    "name_columns",
    "parse_columns",
]

POSITION = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
VECTOR = ("rx", "ry", "rz")
ROTATION = tuple(f"r{row}{column}" for row in "123" for column in "123")
LAST_ROW = ("r41", "r42", "r43", "r44")
TUM, W_FIRST = "t x y z qx qy qz qw", "t x y z qw qx qy qz"
MATRIX = "r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
FOUR_ROWS = f"{MATRIX} {' '.join(LAST_ROW)}"
USUAL_COLUMNS = ["x y z", "t x y z", TUM[2:], MATRIX, f"n {MATRIX}", FOUR_ROWS, f"n {FOUR_ROWS}"]
BY_WIDTH = {len(names.split()): names for names in USUAL_COLUMNS}  # of tables that do not name them
OF_NAMES = [
    "name qw qx qy qz x y z",
    "name x y z qx qy qz qw",
    f"name {MATRIX}",
    f"name {FOUR_ROWS}",
]
MAX_HEADER = 10_000  # characters; a longer line names no columns
MAX_PRINTED = 1e-3  # deviation from a unit quaternion of one with four decimals
MAX_COSINE = 0.995  # of half of 11 degrees: small velocities next to a constant 1 turn less
EUROC_STAMP = 1e16  # of w first without a header: whole nanoseconds since 1970

NAME_THEM = (
    "name them, as in --columns 't x y z qx qy qz qw' or, for rotation vectors, "
    "'t rx ry rz x y z' (- skips one)"
)
COLUMNS = (
    "t (t_s, t_ms, t_us, t_ticks, t_ns), n, name, x, y, z, qx, qy, qz, qw, rx, ry, rz, r11 to r33 "
    "or -"
)

Groups = dict[tuple[str, ...], list[tuple[str, list[int]]]]  # owner and columns, by part

# Words in headers.
TIMES = {"t", "ts", "time", "times", "stamp", "timestamp", "timestamps"}
TIMES |= {"elapsed", "epoch", "utime", "gpstime", "rostime"}
NUMBERS = {"n", "num", "number", "id", "idx", "index", "frame", "seq"}
NAMES = {"name", "image", "img", "filename", "imagename", "file", "path", "label", "photo"}
NAMES |= {"photoid"}
OWNERS = {"gt", "groundtruth", "ground", "truth", "true", "ref", "reference"}
OWNERS |= {"est", "estimate", "estimated", "pred", "predicted"}
POSITIONS = {"t", "p", "pos", "pose", "position", "trans", "translation", "tvec", "loc", "location"}
ORIENTATIONS = {"q", "o", "quat", "quaternion", "orientation", "rot", "rotation"}
VECTORS = {"rvec", "rotvec", "rodrigues"}
OTHERS = {"v", "vel", "velocity", "speed", "acc", "accel", "acceleration", "gyro", "angular", "w"}
OTHERS |= {"a", "b", "linear", "twist", "omega", "bias", "force", "gravity", "euler"}
OTHERS |= {"gyr", "mag", "magnetic", "magnetometer", "rate", "dot", "torque"}
OTHERS |= {"cov", "covariance", "std", "stddev", "sd", "sigma", "var", "variance", "uncertainty"}
OTHERS |= {"err", "error", "errors", "delta", "scale", "size", "normal", "direction", "dir"}
OTHERS |= {"rpy", "angle", "axis", "deg", "degrees"}
# A word that ends in an axis; and, where an owner may be anyone, one that has it before its name.
PREFIXES = {"", "r", *POSITIONS, *ORIENTATIONS, *VECTORS, *OWNERS}
AXIS = re.compile("([a-z]*)([wxyz])()")
OWNED_AXIS = re.compile(r"([a-z]*?)([wxyz])((?:(?<!w)(?![wxyz])[a-z]+)?)\d*")

# Units of positions in metres, of times in seconds, and those without a factor.
LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "ft": 0.3048, "feet": 0.3048}
LENGTHS |= {"um": 1e-6, "dm": 0.1, "inch": 0.0254, "inches": 0.0254, "yd": 0.9144}
LENGTHS |= {"mile": 1609.344, "miles": 1609.344}
MINUTES = {"min": 60.0, "minutes": 60.0, "h": 3600.0, "hours": 3600.0, "days": 86400.0}
UNITS = LENGTHS | MINUTES | dict.fromkeys(["s", "ms", "us", "ns", "rad", "deg"], 1.0)
LETTERS = str.maketrans({'"': None, ";": ",", "µ": "u", "μ": "u", "°": "_deg"})


def name_columns(table: Table, columns: str | None = None) -> list[str]:
    """Return what each column of a table holds; - for columns that are not used."""
    width = len(table.first)
    names = parse_columns(columns) if columns else _of_header(table) or _by_width(table)
    if not 0 < len(names) <= width:
        unknown = f"whose meaning is unknown; {NAME_THEM}"
        reason = f"not the {len(names)} of {columns!r}" if columns else unknown
        raise table.source.error(0, f"has {width} column{'s' * (width != 1)}, {reason}")
    if not columns:
        _refuse_two_poses(names, table)
    words = columns.lower().replace(",", " ").split() if columns else table.header
    for word, name in zip(words, names, strict=False):
        units = {*re.findall("[a-z]+", "".join(re.findall(r"\[[^\]]*", word)))}
        if name in POSITION and not units <= LENGTHS.keys():
            reason = f"its header names a unit that is unknown, {word[:40]!r}"
            raise FileError(table.path, f"{reason}; convert positions to metres, or {NAME_THEM}")
    table.units = list(map(_unit, words, names))
    table.has_keys = any(name[0] in "tn" for name in names)
    return names + ["-"] * (width - len(names))


def parse_columns(text: str) -> list[str]:
    """Return the columns that ``--columns`` names; the error says which of them is wrong."""
    words = text.replace(",", " ").split()
    names = _meanings(words)
    if wrong := [word for word, name in zip(words, names, strict=True) if name == "-" != word]:
        raise ValueError(f"unknown column {wrong[0][:40]!r}; use {COLUMNS}")
    used = [name for name in names if name != "-"]
    if "x" not in names or _complete(names) != names or len({*used}) < len(used):
        raise ValueError("columns must be x, y and z, and all of a rotation or none, each once")
    return names


def _of_header(table: Table) -> list[str]:
    """Return the columns that a line above the rows names; none if no line does."""
    width = len(table.first)
    for line, words, units in _headers(table):
        is_comment = line.startswith(COMMENTS)
        before, last = words[:-width], words[-width:]
        if {*map(_what, before)} <= {"-"} and "-" not in map(_what, last):
            words = last if is_comment else words  # behind a word such as "Format:"
        words = _with_units(words, units, table)
        parts = _meanings(words)
        _refuse_images(words, table)
        names = _complete(parts)
        _check_owners(words, table)
        if "x" in names:
            _check_counts(list(map(_owner, words)), parts, table)
        # A comment may leave out the last columns.
        if "x" in names and (len(names) == width or (is_comment and len(names) < width)):
            table.header = words
            return _unambiguous(words, names, table)
        n_coordinates = sum(part in (*POSITION, *QUATERNION) for part in parts)
        contradicts = "-" not in names and names[:width] != _by_width(table)
        if "x" in names and (not is_comment or contradicts):
            counts = f"its header names {len(names)} columns, its first row has {width}"
            reason = f"{counts}; {NAME_THEM}"
        elif re.search("latitude|(?<![a-z])lat(?![a-z])", line.lower()):
            reason = "has latitudes; convert them to east, north, up in metres first"
        elif "rotation_matrix" in words and "translation_vector" in words:
            reason = (
                "is a submission to the Image Matching Challenge, which has several scenes: write "
                "a file 'name qw qx qy qz tx ty tz' for each scene"
            )
        elif len(names) == width and (n_coordinates > 1 or not is_comment):
            planar = "; write z, too, and a heading as a quaternion" * ({"x", "y"} <= {*parts})
            reason = f"its header names no x, y, z ({line[:60]!r}); {NAME_THEM}{planar}"
        else:
            continue
        raise FileError(table.path, reason)
    return []


def _headers(table: Table) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield the lines above the rows that may be headers, their names, and the units below them."""
    width, units = len(table.first), list[str]()
    for line in reversed([line for line in table.above if len(line) <= MAX_HEADER]):
        words = _words(line)
        if row_of_units := _row_of_units(line):
            units = row_of_units
        elif re.search("[a-z]", " ".join(words)):
            if len(words) == width + 1 and not words[-1]:
                words.pop()  # of a separator at the end
            yield line, words, units
        elif len(words) == width and not line.startswith(COMMENTS):
            reason = f"the line above its first row, {line[:60]!r}, has neither names nor numbers"
            raise FileError(table.path, f"{reason}; delete it, or write nan for a lost pose")


def _with_units(words: list[str], units: list[str], table: Table) -> list[str]:
    """Return the names of a header with the units in a line below it."""
    if len(units) == len(words) + 1 and not units[-1]:
        units = units[:-1]
    if len(units) == len(words):
        return [f"{word} {unit}".strip() for word, unit in zip(words, units, strict=True)]
    changes = any(UNITS.get(unit) != 1 for unit in re.findall("[a-z]+", " ".join(units)))
    if changes and "x" in _meanings(words):
        reason = f"its header names {len(words)} columns, the line of their units {len(units)}"
        raise FileError(table.path, f"{reason}; write - where a column has none")
    return words


def _refuse_images(words: Sequence[str], table: Table) -> None:
    """Refuse a header of COLMAP's images, whose poses are world-to-camera, and matched by name."""
    if {"image_id", "camera_id"} <= {*words} and len(words) <= len(table.first):
        reason = "has the columns of COLMAP's images.txt, whose poses are world-to-camera: give the"
        remedy = "model's folder, or name them and invert the poses, as in --invert"
        columns = "--columns '- qw qx qy qz x y z - name'"
        raise FileError(table.path, f"{reason} {remedy} {columns}")


def _check_owners(words: Sequence[str], table: Table) -> None:
    """Refuse a header with several positions whose owners may be anyone, as of two systems."""
    anyone = _complete(_meanings(words, anyone=True))
    if anyone.count("x") > 1 and len(anyone) <= len(table.first):
        _unambiguous(words, anyone, table, anyone=True)


def _owner(word: str, anyone: bool = False) -> str:
    """Return the words of a name that say whose column it is."""
    words = re.findall("[a-z]+", word)
    if not anyone:
        return " ".join(sorted(OWNERS & {*words}))
    prefix, _, others = _axis(words, anyone) or ("", "", {*words})
    known = {"", "r", *"wxyz", *POSITIONS, *ORIENTATIONS, *VECTORS, *UNITS}
    return " ".join(sorted({prefix, *others} - known))


def _words(header: str) -> list[str]:
    """Return the names in a header; timestampNs has two words."""
    last_word = "(?<=[a-z]{2})(?=[A-Z][a-z]*(?![a-zA-Z]))"
    text = _plain(re.sub(last_word, "_", header))
    return _split(re.sub(r"(?<=\w) +(?=[\[(])", "", text))  # x [m]


def _row_of_units(line: str) -> list[str]:
    """Return the units in a line that has nothing else; none if it has."""
    fields = _split(_plain(line))
    units = {*re.findall("[a-z]+", " ".join(fields))}
    in_brackets = all(re.fullmatch(r"[\[(].*[\])]", field) for field in fields if field)
    return fields if units and (in_brackets or units <= UNITS.keys()) else []


def _plain(header: str) -> str:
    """Return a header in small letters, with short units, without what marks a comment."""
    text = header.translate(LETTERS).lower().lstrip("\ufeff#%/ \t")
    text = re.sub("(?:(m)illi|(c)enti|(k)ilo)?met(?:er|re)s?", r"\1\2\3m", text)
    text = re.sub(r"100\s*ns", "ticks", text)
    return re.sub(r"[\[(][^\])]*", lambda unit: unit[0].replace(" ", "_"), text)  # [m s^-1]


def _split(names: str) -> list[str]:
    """Return the names in a line."""
    return [name.strip() for name in names.split("," if "," in names else None)]


def _unit(word: str, name: str) -> str:
    """Return the unit of a position or a time if the header has another than metres or seconds."""
    units = LENGTHS if name in POSITION else MINUTES if name[0] == "t" else {}
    return next((unit for unit in re.findall("[a-z]+", word) if units.get(unit, 1) != 1), "")


def _unambiguous(
    words: Sequence[str], names: Sequence[str], table: Table, anyone: bool = False
) -> list[str]:
    """Return the columns of one position, rotation and clock; refuse several with the choices."""
    owners = [_owner(word, anyone) for word in words]
    _check_counts(owners, names, table)
    poses, clocks = _poses(owners, names), _clocks(words, names)
    if not poses:
        reason = "its header names x, y and z, but not of the same position"
        raise FileError(table.path, f"{reason}; {NAME_THEM}")
    names = _with_keys(names, table)
    keys = [names.index(key) for key in ("n", "name") if key in names]
    choices = [
        [name if index in {*pose, *clock, *keys} else "-" for index, name in enumerate(names)]
        for pose, clock in islice(product(poses, clocks), 4)
    ]
    if len(choices) == 1:
        return choices[0]
    n, what = (len(poses), "poses") if len(poses) > 1 else (len(clocks), "clocks")
    alternatives = " or ".join(f"'{' '.join(choice).rstrip(' -')}'" for choice in choices)
    reason = f"its header names {n} {what}; choose one by --columns {alternatives[:1000]}"
    raise FileError(table.path, reason)


def _with_keys(names: Sequence[str], table: Table) -> list[str]:
    """Return the columns with at most one of numbers and one of names, which differ by row.

    Names of frames, and numbers of images, are names; a word that is the same in all rows is none.
    """
    columns = ["-" if name in ("n", "name") else name for name in names]
    for index, name in enumerate(names):
        values = [row[index] for row in table.sample if len(row) > index]
        key = "n" if name == "n" and is_number(table.first[index]) else "name"
        differ = key == "n" or len({*values}) > len(values) / 2
        if name in ("n", "name") and key not in columns and differ:
            columns[index] = key
    return columns


def _check_counts(owners: Sequence[str], names: Sequence[str], table: Table) -> None:
    """Raise an error where only some coordinates of a position or rotation are repeated.

    Nothing tells which of x, y, tx, ty, tz belong together.
    """
    n_columns = Counter(zip(names, owners, strict=True))
    for part, owner in product((POSITION, QUATERNION, VECTOR, ROTATION), {*owners}):
        ordered = sorted((n_columns[name, owner], name) for name in part)
        (n_min, rare), (n_max, frequent) = ordered[0], ordered[-1]
        if n_min < n_max > 1:
            reason = f"its header names {n_max} columns {frequent}, but {n_min} {rare}"
            raise FileError(table.path, f"{reason}; {NAME_THEM}")


def _poses(owners: Sequence[str], names: Sequence[str]) -> list[list[int]]:
    """Return the columns of each position with its rotation, if there is one.

    Both have the same owner; a rotation without an owner belongs to the only position.
    """
    parts = POSITION, QUATERNION, VECTOR, ROTATION, LAST_ROW
    columns = defaultdict(list)
    for index, key in enumerate(zip(names, owners, strict=True)):
        columns[key].append(index)
    # The columns of a part with one owner, the first, the second ...
    groups: Groups = defaultdict(list)
    for part in parts:
        for owner in dict.fromkeys(owners):
            of_owner = [columns[name, owner] for name in part]
            groups[part] += [(owner, list(group)) for group in zip(*of_owner, strict=False)]
    poses = []
    positions = [name for name, _ in groups[POSITION]]
    for number, (owner, position) in enumerate(groups[POSITION]):
        entries = [entry for part in parts[1:4] for entry in groups[part]]
        rotations = [columns for name, columns in entries if name == owner]
        if 1 < len(rotations) == positions.count(owner):  # as x, y, z, qx, ... twice
            rotations = [rotations[positions[:number].count(owner)]]
        if not rotations and len(groups[POSITION]) == 1:
            rotations = [columns for name, columns in entries if not name]
        last_row = [column for _, columns in groups[LAST_ROW] for column in columns]
        poses += [[*position, *rotation, *last_row] for rotation in rotations or [[]]]
    return poses


def _clocks(words: Sequence[str], names: Sequence[str]) -> list[list[int]]:
    """Return the column of each clock; a clock may have seconds and their fraction."""
    times = [index for index, name in enumerate(names) if name[0] == "t"]
    stamps = [index for index in times if "stamp" in words[index]]
    named = [index for index in times if TIMES & {*re.findall("[a-z]+", words[index])}]
    times = stamps or named or times
    if (
        len(times) == 2
        and "t_s" in (units := [names[index] for index in times])
        and ({*units} & {"t_ms", "t_us", "t_ns"})
    ):
        return [times]
    return [[index] for index in times] or [[]]


def _by_width(table: Table) -> list[str]:
    """Return the columns that a table usually has, if its first row agrees; none if unknown.

    A matrix that is not next to its translation, row by row, may be stored by columns: it is
    refused.
    """
    width, first = len(table.first), table.first
    if not is_number(first[0]):
        _refuse_damaged_number(table)
        layouts = [names.split() for names in OF_NAMES if len(names.split()) == width]
        layouts.sort(key=lambda names: np.nan_to_num(_usual_deviation(names, table), nan=np.inf))
    else:
        stamp = to_number(first[0])
        is_euroc = table.separator == "," and stamp >= EUROC_STAMP and stamp.is_integer()
        tum = W_FIRST if is_euroc else TUM
        layouts = [BY_WIDTH.get(width, tum).split(), tum.split()]
    for names in layouts:
        is_usual = width in (3, 4, 8) and names[0] != "name"
        if names[0] == "t":
            _refuse_block(table)
        if len(names) <= width and (is_usual or _have_rotations(names, table)):
            return names
    return []


def _refuse_damaged_number(table: Table) -> None:
    """Raise an error where the rows below the first begin with numbers, not with names."""
    below = [row[0] for row in table.sample[1:]]
    if sum("." in field and is_number(field) for field in below) > len(below) / 2:
        reason = f"{table.first[0][:40]!r} is not a number, as the rows below have"
        raise table.source.error(0, f"{reason} in the first column")


def _have_rotations(names: Sequence[str], table: Table) -> bool:
    """Return whether the first rows have rotations in these columns, or lost poses only."""
    off = _usual_deviation(names, table)
    if np.isnan(off):
        rows = [row for row in table.sample if len(row) >= len(names)]
        return not any(is_number(row[names.index("x")], finite=True) for row in rows)
    return off <= MAX_DEVIATION


def _usual_deviation(names: Sequence[str], table: Table) -> float:
    """Return how far the first rows are from rotations in the median; nan if all are lost."""
    # One row may be lost, or agree by chance.
    off = [_deviation(names, row) for row in table.sample if len(row) >= len(names)]
    return float("nan") if np.isnan(off).all() else float(np.nanmedian(off))


def _refuse_block(table: Table) -> None:
    """Raise an error where a rotation matrix stands before or behind a position."""
    for start in range(5):
        key = ["", "t", "n t"][start % 3].split()
        pose = [*ROTATION, *POSITION] if start < 3 else [*POSITION, *ROTATION]
        fields = table.first[start : start + 9]
        is_wide = len(table.first) >= len(key + pose)
        if is_wide and _deviation(ROTATION, fields) <= MAX_DEVIATION:
            reason = f"columns {start + 1} to {start + 9} seem to be a rotation matrix"
            remedy = f"name them, as in --columns '{' '.join([*key, *pose])}' if it is row by row"
            raise FileError(table.path, f"{reason}; {remedy}")


@np.errstate(over="ignore", invalid="ignore")
def _refuse_two_poses(names: Sequence[str], table: Table) -> None:
    """Raise an error where unnamed columns have another rotation, or almost the same position."""
    n, width = len(names), len(table.first)
    if n == width or [name[0] for name in names[:4]] not in (["t", *POSITION], ["n", *POSITION]):
        return
    rows = [row[:width] for row in table.sample if len(row) >= width]
    fields = [to_number(field) if is_number(field) else np.nan for row in rows for field in row]
    values = np.reshape(fields, (-1, width))
    values[:, np.isnan(values).all(axis=0)] = 0  # columns of text
    values = values[np.isfinite(values).all(axis=1)]
    position = values[:, 1:4]
    for start in range(n - 3, width - 2) if len(values) > 1 else ():
        has_rotation = "qw" in names and _turns(values[:, start + 3 : start + 7])
        has_position = start >= n and _is_near(values[:, start : start + 3], position)
        if not (has_rotation or has_position):
            continue
        rotation, skipped = names[4:] if has_rotation else [], ["-"] * (start - 1)
        if start < n:
            other = [*names[:4], *["-"] * (start - 1), *rotation]
        elif start > n and _is_near(values[:, start - 1 : start], values[:, :1]):
            other = [*skipped, names[0], *POSITION, *rotation]
        else:
            other = [names[0], *skipped, *POSITION, *rotation]
        choices = f"'{' '.join(names)}' or '{' '.join(other)}'"
        reason = f"seems to have two poses a line; choose one by --columns {choices}"
        raise FileError(table.path, reason)


def _turns(quaternions: Floats) -> bool:
    """Return whether all rows are unit quaternions, and not all of the same rotation."""
    lengths = np.linalg.norm(quaternions, axis=1)
    is_unit = quaternions.shape[1] == 4 and bool((np.abs(lengths - 1) < MAX_PRINTED).all())
    return is_unit and bool((np.abs(quaternions @ quaternions[0]) < MAX_COSINE).any())


def _is_near(others: Floats, values: Floats) -> bool:
    """Return whether values differ by less than a tenth of their range in most rows."""
    largest = np.ptp(values, axis=0).max() / 10
    return bool(np.median(np.linalg.norm(others - values, axis=1)) < largest)


def _meanings(words: Sequence[str], anyone: bool = False) -> list[str]:
    """Return what each column holds; rx, ry, rz with rw are a quaternion."""
    names = [_what(word, anyone) for word in words]
    vector = [] if "rw" not in names else [*VECTOR, "rw"]
    return [f"q{name[1]}" if name in vector else name for name in names]


def _what(text: str, anyone: bool = False) -> str:
    """Return what a column with this name holds, whose owner may be anyone."""
    words = re.findall(r"[a-z]+\d*", text.lower())
    if len(words) > 1 and words[-1] in LENGTHS:
        words.pop()
    if not words:
        return "-"
    if coordinate := _axis(words, anyone):
        prefix, axis, others = coordinate
        if words[0] in POSITIONS | ORIENTATIONS:  # p_WS_W_x is a position in W, no rate
            others -= {*"abvw"}
        return _coordinate(axis, {prefix} - {""}, others, anyone)
    last = words[-1]
    unit = re.fullmatch("(|m|milli|u|micro|n|nano)s(ec(ond)?s?)?", last)
    if last == "ticks":
        return "t_ticks"
    if TIMES & {*words} or (unit and last != "s"):  # sec, nsec
        return f"t_{unit[1].replace('micro', 'u')[:1]}s" if unit else "t"
    if last in NUMBERS:
        return "n"
    if NAMES & {*words}:
        return "name"
    return last if last in ROTATION + LAST_ROW else "-"


def _axis(words: Sequence[str], anyone: bool) -> tuple[str, str, set[str]] | None:
    """Return the letters before the axis in a name, the axis, and the other words."""
    for pattern, word in product([AXIS, OWNED_AXIS][: 1 + anyone], reversed(words)):
        match = pattern.fullmatch(word)
        if match and match[1] in PREFIXES:
            return match[1], match[2], ({*words} - {word}) | ({match[3]} - {""})
    return None


def _coordinate(axis: str, prefix: set[str], others: set[str], anyone: bool) -> str:
    """Return what a coordinate belongs to, by the letters before its axis or the other words."""
    qualifiers = prefix or others
    if OTHERS & (prefix | others):
        return "-"
    if qualifiers & ORIENTATIONS:
        return f"q{axis}"
    if prefix == {"r"} or (qualifiers & VECTORS and axis != "w"):
        return f"r{axis}"
    if axis == "w":
        return "-"
    is_owned = anyone and "r" not in qualifiers  # R_x is of a rotation
    return axis if is_owned or qualifiers & {*POSITIONS, *OWNERS} or not qualifiers else "-"


def _complete(names: Sequence[str]) -> list[str]:
    """Return the columns without those of an incomplete position or rotation."""
    columns = list(names)
    for part in (POSITION, QUATERNION, VECTOR, ROTATION, LAST_ROW):
        if not {*part} <= {*columns}:
            columns = ["-" if name in part else name for name in columns]
    return columns


def _deviation(names: Sequence[str], fields: Sequence[str]) -> float:
    """Return how far a row is from a rotation where there should be one; nan if it is lost."""
    row = dict(zip(names, fields, strict=False))
    columns, shape = (QUATERNION, (1, 4)) if "qw" in row else (ROTATION, (3, 3))
    with suppress(ValueError), np.errstate(all="ignore"):
        texts = ["nan" if row[name].lower() in MISSING else row[name] for name in columns]
        part = np.reshape(list(map(to_number, texts)), shape)
        is_lost = not np.isfinite(part).all()
        return np.nan if is_lost else float(np.abs(part @ part.T - np.eye(len(part))).max())
    return np.inf
