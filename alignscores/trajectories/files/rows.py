"""The rows of a text table, and the numbers in them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from .text import FileError, FilePath, Source, is_number, numbered_lines

__all__ = ["COMMENTS", "Table", "open_table"]

COMMENTS = ("#", "%", "//")
MISSING = {"", "na", "none", "null"}  # instead of a number


@dataclass(frozen=True)
class Table:
    """A text file with a row of fields a line."""

    source: Source
    above: list[str]  # lines above the rows
    rows: list[str]  # their fields are separated by commas, otherwise by blanks
    first: list[str]  # fields of the first row, without what is behind a separator at its end

    def numbers(self, columns: Sequence[int]) -> Floats:
        """Return the numbers in some columns."""
        values, width = [], len(self.first)
        for row, text in enumerate(self.rows):
            fields = _fields(text)
            n, all_used = len(fields), len(columns) == width
            if n <= max(columns) or (all_used and any(fields[width:])):
                reason = f"has {n} column{'s' * (n != 1)}, the first row {width}"
                raise self.source.error(row, reason)
            used = [fields[column] for column in columns]
            used = ["nan" if field.lower() in MISSING else field for field in used]
            try:
                values.append(list(map(float, used)))
            except ValueError:
                wrong = next(field for field in used if not is_number(field))
                reason = f"{wrong[:40]!r} is not a number; --columns names the columns"
                raise self.source.error(row, reason) from None
        return np.array(values)


def open_table(path: FilePath) -> Table:
    """Return the table of a text file; its rows begin with the first line that has a number."""
    above: list[str] = []
    rows: dict[int, str] = {}
    for number, line in numbered_lines(path):
        row = _row(line)
        if row and (rows or any(map(is_number, re.split(r'[\s,;"]+', line)))):
            rows[number] = row
        elif not rows:
            above.append(line.strip())
    if not rows:
        raise FileError(path, "has no line of numbers")
    lines, texts = list(rows), list(rows.values())
    source = Source(path, lambda row: f"line {lines[row]}")
    first = _fields(texts[0])
    return Table(source, above, texts, first if first[-1] else first[:-1])


def _row(line: str) -> str:
    """Return a line with commas for semicolons; a blank line or a comment is empty."""
    text = line.partition("#")[0].replace('"', "").strip()
    if ";" in text:
        text = text.replace(",", ".").replace(";", ",")  # decimal commas
    return "" if text.startswith(COMMENTS) else text


def _fields(row: str) -> list[str]:
    return [field.strip() for field in row.split("," if "," in row else None)]
