"""What the interactive pages are made of, in JavaScript and CSS: arithmetic, drawing, look.

The arithmetic of ``scores.js`` is that of `alignscores.histogram` and `alignscores.profile`, and
tested against them in a browser. ``charts.js`` draws, ``controls.js`` has the sliders and the state
in the address; ``style.css`` is the look. ``own.*`` is the page of people's own files.
"""

from importlib.resources import files

__all__ = ["source"]


def source(name: str) -> str:
    """Return one of the files, to be put into a page.

    Parameters
    ----------
    name : str
        Its name.

    Examples
    --------
    >>> from alignscores.explorer import source
    >>> "const AlignmentScores" in source("scores.js")
    True
    """
    return files(__package__).joinpath(name).read_text("utf-8")
