"""Links names of NumPy, SciPy and Python to their documentation, without asking the network."""

from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

NUMPY = "https://numpy.org/doc/stable"
SCIPY = "https://docs.scipy.org/doc/scipy"
PYTHON = "https://docs.python.org/3/library"

BUILT_IN = "bool bytes dict float int list set str tuple".split()
ERRORS = "DeprecationWarning OSError TypeError UserWarning ValueError".split()
PAGES = {
    "array_like": f"{NUMPY}/glossary.html#term-array_like",
    "numpy.ndarray": f"{NUMPY}/reference/generated/numpy.ndarray.html",
    "numpy.random.Generator": f"{NUMPY}/reference/random/generator.html",
    "numpy.random.SeedSequence": (
        f"{NUMPY}/reference/random/bit_generators/generated/numpy.random.SeedSequence.html"
    ),
    "pathlib.Path": f"{PYTHON}/pathlib.html#pathlib.Path",
    "scipy.spatial.transform.Rotation": (
        f"{SCIPY}/reference/generated/scipy.spatial.transform.Rotation.html"
    ),
    **{name: f"{PYTHON}/stdtypes.html#{name}" for name in BUILT_IN},
    **{name: f"{PYTHON}/exceptions.html#{name}" for name in ERRORS},
}
"""What the docstrings name; the build fails for a name that is neither here nor in the project."""


def link(app: Sphinx, env: object, node: pending_xref, text: nodes.Element) -> Any:
    """Return the link to what is documented elsewhere."""
    page = PAGES.get(node["reftarget"])
    return page and nodes.reference("", "", text, internal=False, refuri=page)


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.connect("missing-reference", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
