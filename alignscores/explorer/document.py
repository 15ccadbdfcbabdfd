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
    data: Any,
    frames: bool = False,
) -> str:
    r"""Return a page; the same input gives the same bytes.

    Parameters
    ----------
    title : str
        Its title, which may hold any characters.
    body : str
        HTML.
    styles, scripts : iterable of str
        CSS and JavaScript, in their order.
    data : object
        What the scripts read from the element ``data``; anything that JSON can hold.
    frames : bool
        Whether the scripts may show pages of their own making in it.

    Returns
    -------
    str
        HTML.

    Examples
    --------
    >>> from alignscores.explorer.document import document
    >>> html = document("a < b", "<p>c</p>", styles=(), scripts=(), data="</script>")
    >>> "<title>a &lt; b</title>" in html, r'"\u003c/script>"' in html
    (True, True)
    """
    head = HEAD.format(more="; frame-src blob:" if frames else "")
    parts = [head, f"<title>{escape(title)}</title>\n"]
    parts += [f"<style>\n{style}</style>\n" for style in styles]
    parts.append(f"</head>\n<body>\n{body}\n")
    parts.append(data_element("data", data))
    parts += [f"<script>\n{script}</script>\n" for script in scripts]
    return "".join([*parts, "</body>\n</html>\n"])


def data_element(name: str, data: Any) -> str:
    r"""Return the element of a page that holds data as JSON, for its scripts.

    Parameters
    ----------
    name : str
        Its id.
    data : object
        Anything that JSON can hold; its text has no ``<``.

    Examples
    --------
    >>> from alignscores.explorer.document import data_element
    >>> print(data_element("a", ["<b>", 1]), end="")
    <script type="application/json" id="a">["\u003cb>",1]</script>
    """
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>\n'
