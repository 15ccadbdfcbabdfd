"""Turns a page's links to files of the repository into links to pages that show these files.

In the repository the links lead to the files themselves; what is written is the same.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from pygments.lexers import get_lexer_for_filename
from pygments.util import ClassNotFound
from sphinx.addnodes import download_reference, pending_xref
from sphinx.application import Sphinx
from sphinx.builders.html import StandaloneHTMLBuilder
from sphinx.transforms import SphinxTransform

ROOT = Path(__file__).resolve().parents[2]
LINKED: set[Path] = set()


class SourceLinks(SphinxTransform):
    """Links of one page."""

    default_priority = 870  # all links are there, and no file has been copied yet

    def apply(self, **options: Any) -> None:
        """Replace the links to files that are not part of the site."""
        documents = Path(self.env.srcdir)
        for link in list(self.document.findall(nodes.Element)):
            if isinstance(link, download_reference):
                path = Path(self.env.relfn2path(link["reftarget"], self.env.docname)[1])
            elif isinstance(link, pending_xref) and link["refdomain"] == "doc":
                path = Path(documents, link["reftarget"] + ".md")
            else:
                continue
            if path.resolve().is_relative_to(documents):
                continue  # a page, or a picture
            file = path.resolve().relative_to(ROOT)
            LINKED.add(file)
            page = self.app.builder.get_relative_uri(self.env.docname, page_of(file))
            link.replace_self(nodes.reference("", "", *link.children, refuri=page))


def page_of(file: Path) -> str:
    """Return the name of the page that shows a file."""
    return f"files/{file.as_posix()}"


def pages(app: Sphinx) -> Iterator[tuple[str, dict[str, str], str]]:
    """Yield the pages that show files."""
    assert isinstance(app.builder, StandaloneHTMLBuilder)
    for file in sorted(LINKED):
        try:
            language = get_lexer_for_filename(file.name).aliases[0]
        except ClassNotFound:
            language = "text"
        shown = app.builder.highlighter.highlight_block((ROOT / file).read_text(), language)
        yield page_of(file), {"title": str(file), "body": f"<h1>{file}</h1>{shown}"}, "page.html"


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.add_transform(SourceLinks)
    app.connect("html-collect-pages", pages)
    return {"parallel_read_safe": False}
