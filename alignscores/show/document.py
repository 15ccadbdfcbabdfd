"""A page in one file that needs no network: texts, tables and figures of plotly in a template."""

from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
import plotly.graph_objects as go
from jinja2 import Environment
from markupsafe import Markup

from ..arrays import Floats
from ..texts import printable
from ..version import __version__

__all__ = [
    "COLOURS",
    "LAYOUT",
    "RAMP",
    "REFERENCE",
    "inert",
    "log_range",
    "rectangles",
    "render",
    "style",
]

POLICY = (  # nothing that the page shows can make it load anything
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"
)
COLOURS = ["#1f4e79", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#7a5c00", "#e69f00", "#444444"]
# Dark to light, so that the order survives greyscale and colour blindness.
RAMP = ["#000004", "#180c3c", "#440a68", "#6d186e", "#972766", "#c03a51", "#e15635", "#f67e14"]
REFERENCE = "#aaaaaa"  # the colour of its path
DASHES = "solid", "dash", "dashdot", "dot"
LAYOUT: dict[str, Any] = {
    "template": "plotly_white",
    "margin": {"l": 60, "r": 10, "t": 60, "b": 45},
    "legend": {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "x": 0},
    "font": {"size": 13},
    "hoverlabel": {"namelength": -1},
}


def render(title: str, lead: Sequence[str], sections: Sequence[Mapping[str, Any]]) -> str:
    """Return a page with a title, lines below it, and sections.

    A section has a heading and any of: text (lines), table (rows of texts, the header first), notes
    (lines), terms (pairs), figure (of plotly). All texts are escaped.
    """
    template = files(__package__).joinpath("page.html").read_text("utf-8")
    rendered = []
    for number, section in enumerate(sections):
        figure = section.get("figure")
        html = "" if figure is None else _figure_html(figure, f"figure-{number}")
        rendered.append({**section, "id": f"section-{number}", "figure": html})
    if any(section["figure"] for section in rendered):
        from plotly.offline import get_plotlyjs

        first = next(section for section in rendered if section["figure"])
        first["figure"] = (
            Markup("<script>{}</script>").format(Markup(get_plotlyjs())) + first["figure"]
        )
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(template).render(
        title=printable(title),
        lead=list(map(printable, lead)),
        sections=rendered,
        policy=POLICY,
        version=__version__,
    )


def _figure_html(figure: go.Figure, name: str) -> Markup:
    """Return the element of a figure, and the script that draws it."""
    config = {"responsive": True, "displaylogo": False}
    html = figure.to_html(config, include_plotlyjs=False, full_html=False, div_id=name)
    return Markup(html)  # plotly escapes its data, `inert` what plotly would render


def inert(text: str) -> str:
    """Return a text that plotly shows as it is, which would render tags, entities and formulas."""
    return escape(printable(text), quote=False).replace("$", "&#36;")


def style(index: int) -> dict[str, str]:
    """Return the line of an estimate."""
    return {"color": COLOURS[index % len(COLOURS)], "dash": DASHES[index % len(DASHES)]}


def log_range(errors: Sequence[Floats], limit: float) -> tuple[float, float]:
    """Return an axis for all errors but the smallest hundredth, and three decades about a limit."""
    all_errors = np.concatenate(errors)
    finite = all_errors[np.isfinite(all_errors)]
    low, high = np.quantile(finite, [0.01, 1]) if len(finite) else (limit, limit)
    low, high = (float(np.clip(end, limit / 1e3, limit * 1e3)) for end in (low, high))
    return min(low, limit) / 1.5, 1.5 * max(high, limit)


def rectangles(stretches: Floats, low: float, high: float) -> tuple[Floats, Floats]:
    """Return the outlines of stretches, with a NaN after each."""
    begin, end = stretches.T
    gap = np.full(len(stretches), np.nan)
    x = np.column_stack([begin, begin, end, end, begin, gap]).ravel()
    heights = np.array([low, high, high, low, low, np.nan])
    return x, np.tile(heights, len(stretches))
