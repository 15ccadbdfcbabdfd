"""A page in one file, with its styles, which needs no network."""

from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

__all__ = ["document", "html_table"]

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


def html_table(header: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return a table of HTML, whose cells stand below each other where the screen is too narrow.

    The tables of pandas do not carry the names of columns to the cells, for narrow screens.
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
