"""Shows what a function returns, from its docstring: the columns of the file that it makes."""

from importlib import import_module
from inspect import cleandoc

from docutils import nodes
from numpydoc.docscrape import FunctionDoc
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Columns(SphinxDirective):
    """``{columns} package.module.function``."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the descriptions of all that is returned."""
        module, _, name = self.arguments[0].rpartition(".")
        function = getattr(import_module(module), name)
        self.env.note_dependency(function.__code__.co_filename)
        returned = FunctionDoc(function)["Returns"]
        texts = [cleandoc("\n".join(value.desc)) for value in returned]
        # The page is Markdown, docstrings are reStructuredText.
        return self.parse_text_to_nodes(
            "".join(f"```{{eval-rst}}\n{text}\n```\n" for text in texts)
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.add_directive("columns", Columns)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
