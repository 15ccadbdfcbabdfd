"""A page in one file, with its styles, scripts and data, which needs no network."""

import json
from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["data_element", "document", "html_table", "packed", "source"]

HEAD = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'{scripts}">
<meta name="color-scheme" content="light dark">
"""


def source(name: str) -> str:
    """Return the text of a style, a script or a template of this folder."""
    return files(__package__).joinpath(name).read_text("utf-8")


def document(title: str, body: str, styles: Iterable[str], scripts: Iterable[str] = ()) -> str:
    """Return a page with a body in HTML, and the named styles and scripts."""
    head = HEAD.format(scripts="; script-src 'unsafe-inline'" if scripts else "")
    parts = [head, f"<title>{escape(title)}</title>\n"]
    parts += [f"<style>\n{source(style)}</style>\n" for style in styles]
    parts.append(f"</head>\n<body>\n{body}\n")
    parts += [f"<script>\n{source(script)}</script>\n" for script in scripts]
    return "".join([*parts, "</body>\n</html>\n"])


def html_table(header: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return a table of HTML, whose cells stand below each other where the screen is too narrow.

    A page of estimates has no pandas, whose tables do not carry the names of columns to the cells.
    """
    head = "".join(f'<th scope="col">{name}</th>' for name in header)
    lines = "".join(
        f'<tr><th scope="row">{first}</th>'
        + "".join(
            f'<td data-label="{name}"><span>{cell}</span></td>'
            for name, cell in zip(header[1:], cells, strict=True)
        )
        + "</tr>"
        for first, *cells in rows
    )
    title = f"<caption>{caption}</caption>" if caption else ""
    body = f"<thead><tr>{head}</tr></thead><tbody>{lines}</tbody>"
    return f'<table class="stacked">{title}{body}</table>'


def data_element(data: Any) -> str:
    """Return data as JSON in an element for scripts; its text has no ``<``."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    return f'<script type="application/json">{text}</script>'


def packed(values: NDArray[Any], kind: str) -> str:
    """Return numbers as base64 of their bytes, of a type such as ``<f4``."""
    with np.errstate(over="ignore"):  # beyond single precision: infinite
        return b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
