"""Shows the verdict on every statement of the paper, from the published table of claims."""

from pathlib import Path

import pandas as pd
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from studies import claims

ROOT = Path(__file__).parents[2]
PUBLISHED = ROOT / "experiments" / "published"
TEMPLATE = ROOT / "studies" / "claims.html.j2"


class Statements(SphinxDirective):
    """``{statements}`` is the page that ``snakemake claims`` writes, without its frame."""

    def run(self) -> list[nodes.Node]:
        """Return the page as raw HTML."""
        files = PUBLISHED / "claims.csv", PUBLISHED / "tables" / "readings.csv"
        for path in (*files, TEMPLATE, Path(claims.__file__)):
            self.env.note_dependency(str(path))
        html = claims.draw(*map(pd.read_csv, files), whole=False)
        return [nodes.raw("", html, format="html")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.add_directive("statements", Statements)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
