"""A page in one file, with its styles, scripts and data, which needs no network."""

import json
from base64 import b64encode
from collections.abc import Iterable
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["data_element", "document", "packed", "source"]

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


def data_element(data: Any) -> str:
    """Return data as JSON in an element for scripts; its text has no ``<``."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    return f'<script type="application/json">{text}</script>'


def packed(values: NDArray[Any], kind: str) -> str:
    """Return numbers as base64 of their bytes, of a type such as ``<f4``."""
    with np.errstate(over="ignore"):  # beyond single precision: infinite
        return b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
