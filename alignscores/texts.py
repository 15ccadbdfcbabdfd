"""Texts as they are printed: names of files, short, unique and printable, in columns."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import takewhile
from pathlib import Path
from reprlib import Repr
from typing import Any

__all__ = [
    "WIDTH",
    "aligned",
    "alike",
    "brief",
    "distinct",
    "first_few",
    "groups_alike",
    "in_latex",
    "in_markdown",
    "numbered",
    "padded",
]
__all__ += ["printable", "shortened", "text_table", "text_width", "unique_names"]
__all__ += ["with_footnotes"]

WIDTH = 100  # columns of a table
N_SHOWN = 5  # entries of a list that a message shows
LONGEST = 60  # characters of a text in a message


def first_few(texts: Sequence[str], n: int = N_SHOWN) -> str:
    """Return the first n texts, separated by commas, and how many more there are if not one."""
    if len(texts) <= n + 1:
        return ", ".join(texts)
    return f"{', '.join(texts[:n])} and {len(texts) - n} more"


def alike(notes: Iterable[tuple[str, str]]) -> list[str]:
    """Return each note after its name; notes that differ only in numbers share a line."""
    lines = []
    for first, *others in groups_alike(notes):
        more = f"{len(others)} more like it"
        if len(others) == 1 and others[0][0]:
            more = f"one like it for {others[0][0]}"
        lines.append(": ".join(filter(None, first)) + (f" (and {more})" if others else ""))
    return lines


def groups_alike(notes: Iterable[tuple[str, str]]) -> list[list[tuple[str, str]]]:
    """Return groups of names and notes that differ only in numbers."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for name, note in notes:
        groups.setdefault(re.sub(r"[\d.]+", "", note), []).append((name, note))
    return list(groups.values())


def brief(value: Any) -> str:
    """Return a value as Python writes it; of long texts and lists, no more than the beginning."""
    short = Repr()
    short.maxlevel = 2
    short.maxstring = short.maxother = LONGEST
    return short.repr(value)


def shortened(text: str, width: int) -> str:
    """Cut the middle out of a long text."""
    half = (width - 1) // 2
    return text if len(text) <= width else f"{text[:half]}…{text[-half:]}"


def distinct(names: Sequence[str], width: int) -> list[str]:
    """Shorten names to a width, but keep what tells them apart; names that are short stay whole.

    What all have in common is cut first, then the middle of each. Names that this makes equal are
    shortened among themselves.
    """
    if all(len(name) <= width for name in names):
        return list(names)
    begin = _common_start(names) if names[1:] else ""
    rest = [name[len(begin) :] for name in names]
    end = _common_start([name[::-1] for name in rest])[::-1] if names[1:] else ""
    cores = [name.removesuffix(end) for name in rest]
    spare = max(width - max(map(len, cores)), 8)  # for what is next to the difference
    end = end if len(end) <= spare // 2 else f"{end[: spare // 2 - 1]}…"
    n_begin = spare - len(end)
    begin = begin if len(begin) <= n_begin else f"…{begin[len(begin) - n_begin + 1 :]}"
    short = [f"{begin}{shortened(core, width - len(begin) - len(end))}{end}" for core in cores]
    for repeated in {name for name in short if short.count(name) > 1}:
        equal = [index for index, name in enumerate(short) if name == repeated]
        if len(equal) < len(names):
            longer = distinct([names[index] for index in equal], width)
            short = [longer[equal.index(k)] if k in equal else s for k, s in enumerate(short)]
    return short


def _common_start(texts: Sequence[str]) -> str:
    first, last = min(texts), max(texts)
    pairs = zip(first, last, strict=False)
    return "".join(letter for letter, _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def printable(text: str) -> str:
    """Return a text with escapes for control characters and bytes that are not UTF-8."""
    return "".join(letter if letter.isprintable() else _escape(letter) for letter in text)


def _escape(letter: str) -> str:
    byte = ord(letter) - 0xDC00  # of a byte that is not UTF-8, in os.fsdecode
    return f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else letter.encode("unicode_escape").decode()


def in_markdown(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return re.sub(r"([\\`*\[\]<>|~&$#]|\b_|_\b)", r"\\\1", printable(text))


LATEX = str.maketrans(
    {
        **{letter: rf"\{letter}" for letter in "&%$#_{}"},
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "\\": r"\textbackslash{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': r"\textquotedbl{}",
    }
)


def in_latex(text: str) -> str:
    """Return a text that LaTeX shows as it is."""
    return printable(text).translate(LATEX)


def with_footnotes(table: str, n_columns: int, lines: Iterable[str]) -> str:
    """Return a table in LaTeX with further lines at its end."""
    cells = (rf"\multicolumn{{{n_columns}}}{{l}}{{\footnotesize {line}}} \\" for line in lines)
    end = r"\end{tabular}"
    return table.replace(end, "\n".join([*cells, end]))


def text_width(text: str) -> int:
    """Return the width of a text on a terminal, where Chinese and its like take two columns."""
    marks = sum(unicodedata.combining(letter) > 0 for letter in text)
    return len(text) - marks + sum(unicodedata.east_asian_width(letter) in "WF" for letter in text)


def padded(text: str, width: int) -> str:
    """Fill a text with blanks at its end; of a negative width, at its start."""
    blanks = " " * (abs(width) - text_width(text))
    return text + blanks if width > 0 else blanks + text


def text_table(rows: Sequence[Sequence[str]], columns: int) -> str:
    """Return rows for a terminal, in parts, each with the first column, if they are too wide."""
    parts, start, n = [], 1, len(rows[0])
    while start < n:
        end = n
        while end > start + 1 and text_width(aligned(_part(rows, start, end))[0]) > columns:
            end -= 1
        parts.append("\n".join(aligned(_part(rows, start, end))))
        start = end
    return "\n\n".join(parts)


def _part(rows: Sequence[Sequence[str]], start: int, end: int) -> list[list[str]]:
    return [[row[0], *row[start:end]] for row in rows]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table; names begin below each other, numbers end there."""
    first, *others = [max(map(text_width, column)) for column in zip(*rows, strict=True)]
    widths = [first, *(-width for width in others)]
    return ["  ".join(map(padded, row, widths)).rstrip() for row in rows]


def unique_names(files: Sequence[str]) -> list[str]:
    """Return short names of files: as many last parts of each path as make them unique."""
    parts = [Path(file).parts for file in files]
    length = 1
    while len({path[-length:] for path in parts}) < len(set(parts)):
        length += 1
    names = [printable(str(Path(*path[-length:]))) for path in parts]
    return numbered(names)  # in case the same file is given twice


def numbered(names: Sequence[str]) -> list[str]:
    """Append a number to the second and further of equal names."""
    return [
        f"{name} ({names[:index].count(name) + 1})" if name in names[:index] else name
        for index, name in enumerate(names)
    ]
