"""What the columns of a text table hold: by a header, by ``--columns``, or by their number."""

import re
from collections.abc import Sequence
from contextlib import suppress

from .poses import MAX_DEVIATION
from .rows import COMMENTS, Table
from .text import FileError

__all__ = ["FOUR_ROWS", "QUATERNION", "name_columns", "parse_columns"]

QUATERNION = ("qx", "qy", "qz", "qw")
ROTATION = tuple(f"r{row}{column}" for row in "123" for column in "123")
LAST_ROW = ("r41", "r42", "r43", "r44")
TUM, W_FIRST = "t x y z qx qy qz qw", "t x y z qw qx qy qz"
MATRIX = "r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
FOUR_ROWS = f"{MATRIX} {' '.join(LAST_ROW)}"
KNOWN = ["x y z", "t x y z", TUM[2:], MATRIX, f"n {MATRIX}", FOUR_ROWS, f"n {FOUR_ROWS}"]
BY_WIDTH = {len(names.split()): names for names in KNOWN}  # of tables that do not name them
NAME_THEM = "name them, as in --columns 't x y z qx qy qz qw' (- skips one)"
COLUMNS = "t (t_s, t_ms, t_us, t_ns), n, x, y, z, qx, qy, qz, qw, r11 to r33 or - (skip)"

# Words in headers.
TIMES = {"t", "ts", "time", "times", "stamp", "timestamp", "timestamps"}
NUMBERS = {"n", "num", "number", "id", "idx", "index", "frame", "seq"}
POSITIONS = {"t", "p", "pos", "pose", "position", "trans", "translation", "gt", "est"}
ORIENTATIONS = {"q", "quat", "quaternion", "orientation", "rot", "rotation"}


def name_columns(table: Table, named: str | None = None, *, w_first: bool = False) -> list[str]:
    """Return what each column of a table holds; - for columns that are not used.

    `named` names them. With `w_first`, tables with commas have w first if nothing names them.
    """
    width = len(table.first)
    names = parse_columns(named) if named else _of_header(table) or _by_width(table, w_first)
    if not 0 < len(names) <= width:
        unknown = f"whose meaning is unknown; {NAME_THEM}"
        reason = f"not the {len(names)} of {named!r}" if named else unknown
        raise table.source.error(0, f"has {width} column{'s' * (width != 1)}, {reason}")
    return names + ["-"] * (width - len(names))


def parse_columns(text: str) -> list[str]:
    """Return the columns that ``--columns`` names; the error says which of them is wrong."""
    words = text.replace(",", " ").split()
    if wrong := [word for word in words if _column(word) == "-" != word]:
        raise ValueError(f"{wrong[0][:40]!r} is no column: give {COLUMNS}")
    names = list(map(_column, words))
    if "x" not in names or _without_parts(names) != names:
        raise ValueError("columns must be x, y and z, and all of a rotation or none, each once")
    return names


def _of_header(table: Table) -> list[str]:
    """Return the columns that a line above the rows names; none if no line does."""
    path, width = table.source.path, len(table.first)
    for line in reversed(table.above):
        names = _of_words(line)
        if "x" in names and len(names) <= width:
            return names
        if re.search("latitude|(?<![a-z])lat(?![a-z])", line.lower()):
            raise FileError(path, "has latitudes; it takes positions x, y, z in one unit")
        if len(names) == width and not line.startswith(COMMENTS):
            raise FileError(path, f"its header names no x, y, z ({line[:60]!r}); {NAME_THEM}")
    return []


def _of_words(header: str) -> list[str]:
    """Return what the columns hold that a header names; - for columns that are not used."""
    text = re.sub(r"\s+(?=[\[(])", "", header.replace('"', "").lower().lstrip("#%/ \t"))  # x [m]
    words = text.replace(";", ",").split("," if "," in text or ";" in text else None)
    names = [_column(word) for word in words]
    if "stamp" in text:  # a message's own stamp, not the time at which it was recorded
        pairs = zip(words, names, strict=True)
        names = ["-" if name == "t" and "stamp" not in word else name for word, name in pairs]
    return _without_parts(names)


def _by_width(table: Table, w_first: bool) -> list[str]:
    """Return the columns that a table usually has, if its first row agrees; none if unknown."""
    width = len(table.first)
    tum = W_FIRST if w_first and "," in table.rows[0] else TUM
    for names in map(str.split, (BY_WIDTH.get(width, tum), tum)):
        if len(names) <= width and (width in (3, 4, 8) or _is_plausible(names, table.first)):
            return names
    return []


def _column(text: str) -> str:
    """Return what a column with this name holds."""
    words = re.findall(r"[a-z]+\d*", text.lower())
    if len(words) > 1 and words[-1] in ("m", "meters", "metres"):
        words.pop()
    if not words:
        return "-"
    last = words[-1]
    if axis := re.fullmatch(r"([a-z]*)([wxyz])", last):
        kinds = {*words[:-1], axis[1]} - {""}
        if kinds & ORIENTATIONS:
            return f"q{axis[2]}"
        if axis[2] != "w" and (kinds & POSITIONS or not kinds):
            return axis[2]
    unit = re.fullmatch("(|m|milli|u|micro|n|nano)s(ec(ond)?s?)?", last)
    if TIMES & {*words} or (unit and len(last) > 2):  # sec, nsec
        return f"t_{unit[1].replace('micro', 'u')[:1]}s" if unit else "t"
    if last in NUMBERS:
        return "n"
    return last if last in ROTATION + LAST_ROW else "-"


def _without_parts(names: Sequence[str]) -> list[str]:
    """Return the columns, each once, without those of an incomplete position or rotation."""
    columns = [name if name not in names[:index] else "-" for index, name in enumerate(names)]
    for group in (("x", "y", "z"), QUATERNION, ROTATION, LAST_ROW):
        if not {*group} <= {*columns}:
            columns = ["-" if name in group else name for name in columns]
    return columns


def _is_plausible(names: Sequence[str], fields: Sequence[str]) -> bool:
    """Return whether a row has a rotation, or nan, where there should be one."""
    row = dict(zip(names, fields, strict=False))
    rotation, size = (QUATERNION, 1) if "qw" in row else (ROTATION, 3)
    with suppress(ValueError):
        return not abs(sum(float(row[name]) ** 2 for name in rotation) - size) > MAX_DEVIATION
    return False
