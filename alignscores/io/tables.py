"""Text tables: the rows of a file, and the numbers in them.

NumPy's `loadtxt` reads plain tables. What it refuses is read line by line: comments, quotes, empty
fields, decimal commas, columns of text, and NaN as Microsoft's compilers write it. There the error
names the line.
"""

import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..files import FileError, FilePath, Source, is_number, numbered_lines, read_head, to_number

__all__ = ["COMMENTS", "MISSING", "Table", "open_table"]

COMMENTS = ("#", "%", "//")
COMMENT = re.compile(r"(?<![^\s,;])#")  # no part of a name
UNPACKED = (".gz", ".bz2", ".xz", ".lzma")  # by loadtxt, whatever such a file holds
MISSING = {"", "na", "n/a", "none", "null"}
N_SAMPLE = 100  # rows that show what the columns of a table hold
MICROSOFT = re.compile(r"[+-]?(1\.#(IND|QNAN|SNAN|INF)\d*|nan\((ind|snan)\))", re.IGNORECASE)


@dataclass
class Table:
    """A text file with a row of fields a line."""

    path: FilePath
    above: list[str]  # lines above the rows, without blank ones
    start: int  # line of the first row
    first: list[str]  # fields of the first row, without what is behind a separator at its end
    separator: str | None  # ",", ";" with decimal commas, tab, or None for blanks
    n_after_name: int = 0  # numbers in a row that begins with a name, which may hold blanks
    header: list[str] = field(default_factory=list)  # names of the columns, if a line names them
    units: list[str] = field(default_factory=list)  # of the columns; empty if usual
    sample: list[list[str]] = field(default_factory=list)  # of rows in the first megabyte
    has_keys: bool = False  # whether a column has stamps, names or numbers of frames
    lines: Sequence[int] | None = None  # of the rows, once they have been read line by line

    @property
    def source(self) -> Source:
        """The file, and the line of each row."""
        return Source(self.path, self._line_of)

    def _line_of(self, row: int) -> str:
        if self.lines is None:
            self.lines = array("q", (number for number, _ in self._rows()))
        return f"line {self.lines[row]}"

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Yield the rows with the numbers of their lines.

        A row of separators only is left out if it needs a key; otherwise it is a pose that is lost.
        """
        blank = " \t,;" if self.has_keys else None
        for number, line in numbered_lines(self.path):
            if number >= self.start and (row := _row(line)).strip(blank):
                yield number, row

    def numbers(self, columns: Sequence[int]) -> Floats:
        """Return the numbers in some columns; every row has as many columns as the first."""
        values = self._plain_numbers()
        if values is None:
            return self._parsed(columns)[1]
        return values if list(columns) == list(range(len(self.first))) else values[:, columns]

    def stamps(self) -> Floats:
        """Return the numbers in the first column; rows may have any number of others."""
        self.has_keys = True
        return self._parsed([0], any_width=True)[1][:, 0]

    def names_and_numbers(self, name: int, columns: Sequence[int]) -> tuple[list[str], Floats]:
        """Return the texts in a column, and the numbers in others."""
        return self._parsed(columns, name)

    def _plain_numbers(self) -> Floats | None:
        """Return all numbers as `loadtxt` reads them, or None if it refuses the file."""
        path = Path(self.path)
        is_plain = self.separator != ";" and all(map(is_number, self.first))
        is_plain &= path.suffix not in UNPACKED
        if not (is_plain and path.is_file()):
            return None
        try:
            return np.loadtxt(
                path.absolute(),
                delimiter=self.separator,
                comments=None,
                skiprows=self.start - 1,
                ndmin=2,
                encoding="utf-8-sig",
            )
        except ValueError:
            return None

    def _parsed(
        self, columns: Sequence[int], name: int | None = None, *, any_width: bool = False
    ) -> tuple[list[str], Floats]:
        """Return names and numbers, read line by line."""
        width, names = len(self.first), []
        lines, values, marks = array("q"), array("d"), set[str]()
        for number, row in self._rows():
            fields = self.fields(row)
            n = len(fields)
            if not (any_width or n == width or (n == width + 1 and not fields[-1])):
                has = f"has {n} column{'s' * (n != 1)}, the first row {width}"
                reason = f"{has}; write as many in each row"
                raise FileError(self.path, reason, place=f"line {number}")
            used = [fields[column] for column in columns]
            if self.separator == ";":
                marks |= {*",."} & {*"".join(row.split(";")[column] for column in columns)}
            if len(marks) > 1:
                reason = "has , and . in the numbers of one table: write one decimal mark, and"
                place = f"line {number}"
                raise FileError(self.path, f"{reason} no mark between thousands", place=place)
            used = ["nan" if text.lower() in MISSING else text for text in used]
            try:
                values.extend(map(to_number, used))
            except ValueError:
                wrong = next(text for text in used if not is_number(text))
                reason = f"{wrong[:40]!r} is not a number; --columns names the columns"
                raise FileError(self.path, reason, place=f"line {number}") from None
            lines.append(number)
            if name is not None:
                names.append(fields[name])
        self.lines = lines
        return names, np.frombuffer(values).reshape(-1, len(columns))

    def fields(self, row: str) -> list[str]:
        """Return the fields of a row; there may be an empty one behind the last separator."""
        if not self.n_after_name:
            return _split(row, self.separator)
        fields = row.rsplit(maxsplit=self.n_after_name)
        # Numbers in a name are those of another row, which a lost line break has joined.
        return row.split() if sum(map(is_number, fields[0].split())) > 2 else fields


def open_table(path: FilePath) -> Table:
    """Return the table of a text file.

    Its rows begin with the first line that has a number, or nothing but missing ones.
    """
    above: list[str] = []
    lines = re.split("\r\n|\r|\n", read_head(path))
    for number, line in enumerate(lines, 1):
        row = _row(line)
        fields = [field for field in re.split(r'[\s,;"]+', row) if field]
        is_lost = fields and all(field.lower() in MISSING for field in fields)
        if is_lost or any(map(is_number, fields)):
            table = _table(path, above, number, row)
            below = lines[number - 1 : -1] or [line]  # the last one may be cut off
            rows = filter(None, map(_row, below[:: -(-len(below) // N_SAMPLE)]))
            table.sample = [table.fields(row) for row in rows]
            return table
        if line := line.strip():
            above.append(line)
    if "\0" in lines[0]:
        raise FileError(path, "is not text (UTF-8), but binary or UTF-16; save it as UTF-8")
    begins = f"; it begins with {above[0][:40]!r}" if above else ""
    raise FileError(path, f"has no line of numbers{begins}")


def _table(path: FilePath, above: list[str], number: int, row: str) -> Table:
    separator = next((mark for mark in ";," if mark in row), None)
    names = above[-1].split() if above else []
    if len(names) > 1 and len(names) == above[-1].count("\t") + 1 == row.count("\t") + 1:
        separator = "\t"  # a text in a row may have blanks
    first = _split(row, separator)
    if separator is None and not is_number(first[0]):
        after = first[::-1]
        n_after_name = next(n for n, text in enumerate(after) if not is_number(text))
        if n_after_name > 2:
            first = row.rsplit(maxsplit=n_after_name)
            return Table(path, above, number, first, None, n_after_name)
    return Table(path, above, number, first if first[-1] else first[:-1], separator)


def _split(row: str, separator: str | None) -> list[str]:
    """Return the fields of a row without the quotes around them."""
    fields = [text.strip() for text in row.split(separator)]
    if separator == ";":
        dotted = [text.replace(",", ".") for text in fields]  # decimal commas
        fields = [
            point if is_number(point) else text for text, point in zip(fields, dotted, strict=True)
        ]
    if '"' not in row:
        return fields
    return [text[1:-1] if re.fullmatch('".*"', text) else text for text in fields]


def _row(line: str) -> str:
    """Return a line without its comment and with plain NaN; empty if nothing is left."""
    if ".#" in line or "nan(" in line.lower():
        line = MICROSOFT.sub("nan", line)
    text = COMMENT.split(line, maxsplit=1)[0].strip() if "#" in line else line.strip()
    return "" if text.startswith(COMMENTS) else text
