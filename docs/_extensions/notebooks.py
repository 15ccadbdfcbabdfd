"""Shows notebooks as they were saved: text, code, what it printed and drew. Nothing is run."""

import json
from typing import Any

from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx


class NotebookParser(MystParser):
    """Reads a notebook as the Markdown page that it would be."""

    supported = ("notebook",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Fill the page with the cells of a notebook."""
        cells = json.loads(inputstring)["cells"]
        super().parse("\n\n".join(part for cell in cells for part in markdown(cell)), document)


def markdown(cell: dict[str, Any]) -> list[str]:
    """Return a cell, and what came out of it, as parts of a page."""
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        return [source]
    parts = [f"```python\n{source}\n```"]
    for output in cell["outputs"]:
        if output["output_type"] == "stream":
            parts.append(f"```text\n{''.join(output['text'])}```")
        elif output["output_type"] == "execute_result":
            parts.append(f"```text\n{''.join(output['data']['text/plain'])}\n```")
        else:
            picture = "".join(output["data"]["image/png"].split())
            parts.append(f"![What the code draws](data:image/png;base64,{picture})")
    return parts


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.add_source_suffix(".ipynb", "notebook")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
