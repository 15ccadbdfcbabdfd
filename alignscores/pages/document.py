"""A page in one file, with its styles, which needs no network."""

from collections.abc import Iterable
from html import escape
from importlib.resources import files

__all__ = ["document"]

HEAD = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'">
<meta name="color-scheme" content="light dark">
"""


def document(title: str, body: str, styles: Iterable[str]) -> str:
    """Return a page with a body in HTML, and the named styles of this folder."""
    parts = [HEAD, f"<title>{escape(title)}</title>\n"]
    for style in styles:
        parts.append(f"<style>\n{files(__package__).joinpath(style).read_text('utf-8')}</style>\n")
    return "".join([*parts, f"</head>\n<body>\n{body}\n</body>\n</html>\n"])
