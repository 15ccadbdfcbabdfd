"""Shows the columns of files, from the docstrings of the functions that compute them."""

from importlib import import_module
from inspect import cleandoc

from docutils import nodes
from numpydoc.docscrape import FunctionDoc
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Columns(SphinxDirective):
    """``{columns}`` with a line for each file: its name, a colon and the function."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Return the descriptions of all that the functions return."""
        lines = []
        for entry in self.content:
            file, _, path = entry.partition(": ")
            module, _, name = path.rpartition(".")
            function = getattr(import_module(module), name)
            self.env.note_dependency(function.__code__.co_filename)
            lines.append(f"**{file}**\n")
            for value in FunctionDoc(function)["Returns"]:
                # The page is Markdown, docstrings are reStructuredText.
                text = cleandoc("\n".join(value.desc))
                lines.append(f"```{{eval-rst}}\n{text}\n```\n")
        return self.parse_text_to_nodes("\n".join(lines))


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.add_directive("columns", Columns)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
