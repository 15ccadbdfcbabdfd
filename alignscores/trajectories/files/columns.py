"""What the columns of a text table hold: by a header, by ``--columns``, or by their number."""

import re
from collections.abc import Container, Sequence
from contextlib import suppress

from .poses import MAX_DEVIATION
from .stamps import unit_of_word

__all__ = [
    "NAME_THEM",
    "QUATERNION",
    "columns_by_width",
    "columns_of_header",
    "matrix_columns",
    "parse_columns",
]

QUATERNION = ("qx", "qy", "qz", "qw")
ROTATION = tuple(f"r{row}{column}" for row in "123" for column in "123")
LAST_ROW = ("r41", "r42", "r43", "r44")
TUM, MATRIX = "t x y z qx qy qz qw", "r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
FOUR_ROWS = f"{MATRIX} {' '.join(LAST_ROW)}"
KNOWN = [TUM, "x y z", "t x y z", TUM[2:], MATRIX, f"n {MATRIX}", FOUR_ROWS, f"n {FOUR_ROWS}"]
BY_WIDTH = {len(names.split()): names for names in KNOWN}  # of tables that do not name them
NAME_THEM = "name them, as in --columns 't x y z qx qy qz qw' (- skips one)"
COLUMNS = "t (t_s, t_ms, t_us, t_ns), n, x, y, z, qx, qy, qz, qw, r11 to r33 or - (skip)"

# Words in headers.
TIMES = {"t", "ts", "time", "times", "stamp", "timestamp", "timestamps"}
NUMBERS = {"n", "num", "number", "id", "idx", "index", "frame", "seq"}
POSITIONS = {"t", "p", "pos", "pose", "position", "trans", "translation", "gt", "est"}
ORIENTATIONS = {"q", "quat", "quaternion", "orientation", "rot", "rotation"}
METRES = {"m", "meter", "meters", "metres"}


def parse_columns(text: str) -> list[str]:
    """Return the columns that ``--columns`` names; the error says which of them is wrong."""
    words = text.replace(",", " ").split()
    names = [_column(word) for word in words]
    for word, name in zip(words, names, strict=True):
        if name == "-" != word:
            raise ValueError(f"{word[:40]!r} is no column: give {COLUMNS}")
    if "x" not in names or _without_parts(names) != names:
        raise ValueError("columns must be x, y and z, and all of a rotation or none, each once")
    return names


def columns_of_header(header: str) -> list[str]:
    """Return what the columns hold that a header names; - for columns that are not used."""
    text = re.sub(r"\s+(?=[\[(])", "", header.replace('"', "").lstrip("#%/ \t"))  # units: x [m]
    words = re.split(r"[,;]" if re.search("[,;]", text) else r"\s+", text)
    if "stamp" in text.lower():  # a message's own stamp, not the time at which it was recorded
        words = [
            "-" if _column(word) == "t" and "stamp" not in word.lower() else word for word in words
        ]
    return _without_parts([_column(word) for word in words])


def matrix_columns(names: Container[str]) -> list[str]:
    """Return the columns of matrices, of 3 or 4 rows, in the order of their entries."""
    return (FOUR_ROWS if "r44" in names else MATRIX).split()


def columns_by_width(first: Sequence[str], *, w_first: bool) -> list[str]:
    """Return the columns that a table usually has, if its first row agrees; none if unknown."""
    width = len(first)
    candidates = ["t x y z qw qx qy qz" if w_first else TUM] if width >= 8 else []
    if width != 8 and width in BY_WIDTH:
        candidates.insert(0, BY_WIDTH[width])
    for names in map(str.split, candidates):
        if width in (3, 4, 8) or _is_plausible(dict(zip(names, first, strict=False))):
            return names
    return []


def _column(text: str) -> str:
    """Return what a column with this name holds."""
    words = re.findall(r"[a-z]+\d*", text.lower())
    if len(words) > 1 and words[-1] in METRES:
        words.pop()
    if not words:
        return "-"
    last, unit = words[-1], unit_of_word(words[-1])
    if axis := re.fullmatch(r"([a-z]*)([wxyz])", last):
        kinds = {*words[:-1], axis[1]} - {""}
        if kinds & ORIENTATIONS:
            return f"q{axis[2]}"
        if axis[2] != "w" and (kinds & POSITIONS or not kinds):
            return axis[2]
    if TIMES & {*words} or (unit and len(last) > 2):  # sec, nsec
        return f"t_{unit}" if unit else "t"
    if last in NUMBERS:
        return "n"
    return last if last in (*ROTATION, *LAST_ROW) else "-"


def _without_parts(names: Sequence[str]) -> list[str]:
    """Return the columns, each once, without those of an incomplete position or rotation."""
    columns = [name if name not in names[:index] else "-" for index, name in enumerate(names)]
    for group in (("x", "y", "z"), QUATERNION, ROTATION, LAST_ROW):
        if not {*group} <= {*columns}:
            columns = ["-" if name in group else name for name in columns]
    return columns


def _is_plausible(row: dict[str, str]) -> bool:
    """Return whether a row has a rotation, or nan, where there should be one."""
    rotation, size = (QUATERNION, 1) if "qw" in row else (ROTATION, 3)
    with suppress(ValueError):
        return not abs(sum(float(row[name]) ** 2 for name in rotation) - size) > MAX_DEVIATION
    return False
