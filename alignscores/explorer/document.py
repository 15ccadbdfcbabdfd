"""A self-contained page: look, scripts and data in one file, which needs no network."""

import json
from collections.abc import Iterable
from html import escape
from typing import Any

__all__ = ["data_element", "document"]

HEAD = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'{more}">
<meta name="color-scheme" content="light dark">
"""


def document(
    title: str,
    body: str,
    *,
    styles: Iterable[str],
    scripts: Iterable[str],
    data: Any = None,
    allowed: str = "",
) -> str:
    """Return a page of a body in HTML, with styles, scripts, and data in the element ``data``.

    What may be shown beside its own text is ``allowed``: ``"frame-src blob:"``, for example.
    """
    head = HEAD.format(more=f"; {allowed}" if allowed else "")
    parts = [head, f"<title>{escape(title)}</title>\n"]
    parts += [f"<style>\n{style}</style>\n" for style in styles]
    parts.append(f"</head>\n<body>\n{body}\n")
    parts += [] if data is None else [data_element("data", data)]
    parts += [f"<script>\n{script}</script>\n" for script in scripts]
    return "".join([*parts, "</body>\n</html>\n"])


def data_element(name: str, data: Any) -> str:
    """Return the element of a page that holds data as JSON; its text has no ``<``."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>\n'
