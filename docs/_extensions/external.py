"""Links names of NumPy, SciPy and Python to their documentation, without asking the network."""

from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

NUMPY = "https://numpy.org/doc/stable"
SCIPY = "https://docs.scipy.org/doc/scipy"
PYTHON = "https://docs.python.org/3/library"

PAGES = {
    "numpy.array_like": f"{NUMPY}/glossary.html#term-array_like",
    "numpy.ndarray": f"{NUMPY}/reference/generated/numpy.ndarray.html",
    "numpy.random.Generator": f"{NUMPY}/reference/random/generator.html",
    "numpy.random.SeedSequence": (
        f"{NUMPY}/reference/random/bit_generators/generated/numpy.random.SeedSequence.html"
    ),
    "scipy.spatial.transform.Rotation": (
        f"{SCIPY}/reference/generated/scipy.spatial.transform.Rotation.html"
    ),
    "builtins.None": f"{PYTHON}/constants.html#None",
    "builtins.callable": f"{PYTHON}/functions.html#callable",
    "builtins.sequence": f"{PYTHON}/stdtypes.html#sequence-types-list-tuple-range",
    **{
        f"builtins.{name}": f"{PYTHON}/functions.html#{name}"
        for name in ("bool", "float", "int", "object")
    },
    **{
        f"builtins.{name}": f"{PYTHON}/stdtypes.html#{name}"
        for name in ("bytes", "dict", "list", "set", "str", "tuple")
    },
    **{
        f"builtins.{name}": f"{PYTHON}/exceptions.html#{name}"
        for name in ("ModuleNotFoundError", "TypeError", "UserWarning", "ValueError")
    },
}
"""What the docstrings name."""

ALIASES = {name.rpartition(".")[2]: name for name in PAGES}
"""The names as they stand there."""


def link(app: Sphinx, env: object, node: pending_xref, text: nodes.Element) -> Any:
    """Return the link to what is documented elsewhere."""
    target = node["reftarget"]
    page = PAGES.get(target) or PAGES.get(f"builtins.{target}")
    return page and nodes.reference("", "", text, internal=False, refuri=page)


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.connect("missing-reference", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
