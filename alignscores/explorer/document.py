"""A self-contained page: look, scripts and data in one file, which needs no network."""

import json
from collections.abc import Iterable
from html import escape
from typing import Any

__all__ = ["document"]

HEAD = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<meta name="color-scheme" content="light dark">
"""


def document(
    title: str, body: str, *, styles: Iterable[str], scripts: Iterable[str], data: Any = None
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
    data : object, optional
        What the scripts read from the element ``data``; anything that JSON can hold.

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
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    parts = [HEAD, f"<title>{escape(title)}</title>\n"]
    parts += [f"<style>\n{style}</style>\n" for style in styles]
    parts.append(f"</head>\n<body>\n{body}\n")
    if data is not None:
        parts.append(f'<script type="application/json" id="data">{text}</script>\n')
    parts += [f"<script>\n{script}</script>\n" for script in scripts]
    return "".join([*parts, "</body>\n</html>\n"])
