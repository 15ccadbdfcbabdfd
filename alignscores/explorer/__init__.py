"""What the interactive pages are made of: ``scores.js`` computes, ``charts.js`` draws.

``controls.js`` has the sliders and the state in the address, ``tables.js`` sorts; ``style.css`` is
the look. ``own.*`` is the page of people's own files.
"""

from importlib.resources import files

__all__ = ["source"]


def source(name: str) -> str:
    """Return the text of one of these files."""
    return files(__package__).joinpath(name).read_text("utf-8")
